"""Conversion: a scan or mesh into another format, a path into another program; nothing is corrected.

What was written is read back before it is handed over: the document says how far it is from what was read, and a
finding names what the format has no place for.
"""

from __future__ import annotations

import gzip
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from sicp_cam import output, plugins
from sicp_cam.checking.reading_back import read_back
from sicp_cam.correction import unit_taken
from sicp_cam.errors import JobError, OutputError, SicpError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, IntArray, Part, Program, Scan, Source, Status, ToolPath
from sicp_cam.result_document import SCHEMA, findings_list, input_entry, output_entry, status, versions
from sicp_cam.roles import role_of
from sicp_cam.units import mm_per_unit

__all__ = ["Conversion", "convert"]

Options = Mapping[str, object]


def _none() -> Options:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Conversion:
    """What is to become of a file.

    Parameters
    ----------
    source, target
        The file to read, and the file to write. The name of a program that is a folder has no suffix.
    role
        What the file is; None where its content tells.
    units, out_units
        Unit of the numbers read, where the file states none; and of those written, mm if None.
    post
        Postprocessor of a path; None for the one that writes the suffix of the target: the words of the program that
        was read, where it has the same suffix.
    recover, force
        As for a correction.
    in_options, out_options
        What the reader, and the writer or post, take by name.
    limits
        Caps that the readers keep.
    """

    source: Path
    target: Path
    role: str | None = None
    units: str | None = None
    out_units: str | None = None
    post: str | None = None
    recover: bool = False
    force: bool = False
    in_options: Options = field(default_factory=_none)
    out_options: Options = field(default_factory=_none)
    limits: Limits = DEFAULT_LIMITS


def convert(job: Conversion) -> dict[str, Any]:
    """Convert a file and return the document of the result: input, outputs, units, findings, and the reading back.

    Raises
    ------
    JobError
        If the pair of formats makes no sense, or an option is wrong.
    InputError
        If the file cannot be read.
    PathError
        If the controller would refuse the path.
    OutputError
        If the target exists, cannot be written, or does not read back as what was read.
    """
    out_unit = job.out_units or "mm"
    mm_per_unit(out_unit)
    role = job.role or _role(job)
    output.check_free(job.target.parent, [job.target.name], job.force, [job.source])
    thing = _read(job, role)
    taken = _taken(job, role, thing.source)
    done = _program(job, thing, out_unit) if isinstance(thing, ToolPath) else _encoded(job, role, thing, out_unit)
    files, findings, read_back = done
    output.write(job.target.parent, files, force=job.force, inputs=[job.source])
    count = len(thing) if isinstance(thing, ToolPath) else len(_points(thing))
    noticed = (*taken, *thing.findings, *findings)
    return {
        "schema": SCHEMA,
        "status": status(noticed, ()),
        "findings": findings_list(noticed),
        "inputs": [input_entry(role, thing.source, count)],
        "outputs": [
            {**output_entry(_KINDS[role], name, content), "units": out_unit} for name, content in files.items()
        ],
        "read_back": read_back,
        "versions": dict(versions()),
    }


_KINDS = {"scan": "scan", "part": "mesh", "path": "program"}


def _read(job: Conversion, role: str) -> Scan | Part | ToolPath:
    readers: dict[str, Callable[..., Scan | Part | ToolPath]] = {
        "scan": plugins.read_scan,
        "part": plugins.read_part,
        "path": plugins.read_path,
    }
    return readers[role](job.source, units=job.units, limits=job.limits, options=job.in_options, recover=job.recover)


def _taken(job: Conversion, role: str, source: Source | None) -> tuple[Finding, ...]:
    """Warn of a unit that no one stated; it cannot be changed into another one.

    Raises
    ------
    JobError
        If another unit is asked for.
    """
    if source is None or source.unit_stated or role == "path":
        return ()
    if job.out_units is not None and job.out_units != "mm":
        raise JobError(
            f"out_units: {printable(str(job.source))} states no unit, so there is none to be changed; state it with"
            " --units"
        )
    return (unit_taken(source, "--units"),)


def _role(job: Conversion) -> str:
    """Return the one role in which the source can be read and the target written."""
    writable = [*plugins.writable_roles(job.target)]
    if job.post is not None:
        writable = ["path"]
    elif plugins.posts_writing(job.target) or _same_words(job):
        writable.append("path")
    if not writable:
        known = ", ".join(plugins.writable_suffixes())
        raise JobError(
            f"{printable(str(job.target))}: nothing writes the suffix '{printable(job.target.suffix, 40)}'; writable:"
            f" {known}; or name the postprocessor of a path with --post"
        )
    return role_of(job.source, among=writable, units=job.units, limits=job.limits, options=job.in_options)


def _same_words(job: Conversion) -> bool:
    suffix = plugins.suffix_of(job.target)
    return suffix == plugins.suffix_of(job.source) and "path" in plugins.roles(job.target)


# --- scans and parts ---


def _points(thing: Scan | Part) -> FloatArray:
    return thing.points_mm if isinstance(thing, Scan) else thing.mesh.vertices_mm


def _faces(thing: Scan | Part) -> IntArray | None:
    faces = thing.faces if isinstance(thing, Scan) else thing.mesh.faces
    return faces if faces is not None and len(faces) else None


def _corners(thing: Scan | Part) -> FloatArray:
    """Return (m, 3, 3) corners of the triangles: equal vertices may have been merged on reading back."""
    faces = _faces(thing)
    return np.zeros((0, 3, 3)) if faces is None else _points(thing)[faces]


def _encoded(
    job: Conversion, role: str, thing: Scan | Part, out_unit: str
) -> tuple[dict[str, bytes], tuple[Finding, ...], dict[str, Any]]:
    content = plugins.encoded(role, job.target, thing, unit=out_unit, options=job.out_options)
    if job.target.suffix.lower() == ".gz":
        content = gzip.compress(content, mtime=0)
    back = _read_back(job, role, content, out_unit)
    meshed = _faces(back) is not None
    noun = "triangles" if meshed else "points"
    before, after = (_corners(thing), _corners(back)) if meshed else (_points(thing), _points(back))
    if before.shape != after.shape:
        raise OutputError(
            f"{printable(str(job.target))}: {len(before)} {noun} were to be written, {len(after)} read back; nothing"
            " was written: choose another format"
        )
    far = float(np.abs(before - after).max(initial=0.0))
    findings = []
    if far > 0.0:
        findings.append(Finding(111, Level.INFO, f"coordinates were rounded by up to {far:.3g} mm", str(job.target)))
    if lost := _lost(thing, back):
        message = f"the format has no place for {', '.join(lost)}; not written"
        findings.append(Finding(110, Level.WARN, message, str(job.target)))
    return {job.target.name: content}, tuple(findings), {"count": len(_points(back)), "largest_difference_mm": far}


def _read_back(job: Conversion, role: str, content: bytes, out_unit: str) -> Scan | Part:
    reader = plugins.read_scan if role == "scan" else plugins.read_part
    with tempfile.TemporaryDirectory(prefix="sicp-cam-") as folder:
        copy = Path(folder) / job.target.name
        copy.write_bytes(content)
        try:
            return reader(copy, units=out_unit, limits=job.limits, options=_reading_options(job))
        except SicpError as error:
            told = str(error).replace(str(copy), printable(str(job.target)))
            raise OutputError(f"{told}; nothing was written: change the options of the writer") from error


def _reading_options(job: Conversion) -> Options:
    """Return the options of the writer that its reader must know too."""
    return {key: value for key, value in job.out_options.items() if key in ("delimiter", "decimal", "columns")}


def _lost(thing: Scan | Part, back: Scan | Part) -> list[str]:
    if not isinstance(thing, Scan) or not isinstance(back, Scan):
        return []
    lost = ["normals"] if thing.normals is not None and back.normals is None else []
    lost += ["triangles"] if thing.faces is not None and back.faces is None else []
    return lost + [f"column {printable(name, 40)}" for name in thing.columns if name not in back.columns]


# --- paths ---


def _program(
    job: Conversion, path: ToolPath, out_unit: str
) -> tuple[dict[str, bytes], tuple[Finding, ...], dict[str, Any] | None]:
    name = _post(job, path)
    options = dict(job.out_options)
    if out_unit != "mm" and name != "same":
        options.setdefault("units", out_unit)
    post = plugins.postprocessor(name, options)
    program = Program(
        job.target.name.split(".")[0],
        path,
        (Status.APPROACH,) * len(path),
        notes=tuple(_notes(path)),
        source_moves=np.arange(len(path)),
        corrected=False,
    )
    findings = tuple(post.preflight(program))
    files: dict[str, bytes] = post.write(program, findings)
    if len(files) == 1 and job.target.suffix:
        files = {job.target.name: next(iter(files.values()))}
    told = job.in_options if name == "same" else None
    back = read_back(post, program, files, options=told, limits=job.limits)
    return files, findings + back.findings, back.facts


def _post(job: Conversion, path: ToolPath) -> str:
    if job.post is not None:
        return job.post
    if path.original is not None and _same_words(job) and (job.out_units is None or job.out_units == _unit_of(path)):
        return "same"
    posts = [name for name in plugins.posts_writing(job.target) if name != "same"]
    if not posts:
        raise JobError(f"{printable(str(job.target))}: no postprocessor writes this suffix; name one with --post")
    return posts[0]


def _unit_of(path: ToolPath) -> str:
    return path.source.unit if path.source is not None else "mm"


def _notes(path: ToolPath) -> list[str]:
    made = f"sicp-cam {versions()['sicp-cam']}, converted and not corrected to any scan"
    source = path.source
    return [made] if source is None else [made, f"path {Path(source.path).name} sha256 {source.sha256[:16]}"]
