"""Tell whether a file is a scan, a part or a path, where its suffix leaves that open."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from types import MappingProxyType

from sicp_cam import plugins
from sicp_cam.errors import FormatError, InputError, JobError, printable
from sicp_cam.job.input_files import absent, is_pose
from sicp_cam.limits import DEFAULT_LIMITS, Limits

__all__ = ["role_of"]

_AXIS_ASSUMED = 303


def role_of(
    path: Path,
    *,
    among: Collection[str] = ("scan", "part", "path"),
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    options: Mapping[str, object] = MappingProxyType({}),
) -> str:
    """Return the role that a file has by its suffix or else by its content.

    A mesh may be a scan as well as a part, and counts as a scan; a table of points counts as a path only where it
    states tool axes.

    Parameters
    ----------
    path
        The file.
    among
        The roles that make sense.
    units, limits, options
        As for the readers.

    Raises
    ------
    InputError
        If the file does not exist, no reader knows its suffix, or none of those that do can read it.
    JobError
        If no role makes sense, or a table may be a scan with normals as well as a path with tool axes.
    """
    name = printable(str(path))
    if not path.exists():
        raise InputError(f"{name}: {absent(path)}")
    if is_pose(path):
        raise InputError(f"{name}: this is a pose, a 4x4 matrix; give it with --align")
    possible = plugins.roles(path)
    if not possible:
        job = "; if it is a job, give it to sicp-cam correct" if path.suffix.lower() == ".toml" else ""
        raise InputError(f"{name}: nothing reads this suffix; see sicp-cam plugins{job}")
    sensible = [role for role in possible if role in among]
    if not sensible:
        raise JobError(
            f"{name} is read as a {' or a '.join(possible)}, and that cannot become a {' or a '.join(among)}"
        )
    if len(sensible) == 1:
        return sensible[0]
    if "path" not in sensible:
        return sensible[0]
    return _by_content(path, sensible[0], units, limits, options)


def _by_content(path: Path, otherwise: str, units: str | None, limits: Limits, options: Mapping[str, object]) -> str:
    """Tell a path from a table of measured points: by the reader that can read it, or by the axes that it states.

    Where neither can, the one that came further in the file is to say why.
    """
    try:
        moves = plugins.read_path(path, units=units, limits=limits, options=options)
    except (InputError, JobError) as no_path:
        try:
            plugins.read_scan(path, units=units, limits=limits, options=options)
        except (InputError, JobError) as no_scan:
            return "path" if _line(no_path) > _line(no_scan) else otherwise
        return otherwise
    if any(finding.code == _AXIS_ASSUMED for finding in moves.findings):
        return otherwise
    if otherwise == "scan" and _has_normals(path, units, limits, options):
        name = printable(str(path))
        raise JobError(f"{name}: may be a scan with normals or a path with tool axes; say which with --role")
    return "path"


def _has_normals(path: Path, units: str | None, limits: Limits, options: Mapping[str, object]) -> bool:
    try:
        return plugins.read_scan(path, units=units, limits=limits, options=options).normals is not None
    except (InputError, JobError):
        return False


def _line(error: Exception) -> int:
    return (error.line or 0) if isinstance(error, FormatError) else 0
