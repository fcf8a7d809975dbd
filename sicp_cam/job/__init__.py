"""What one run is to do, as one tree of frozen dataclasses.

A job file holds the keys of `Job` and its tables::

    cad = "part.step"
    scan = "scan.ply"
    path = "trim.apt"
    post = ["val3", "csv"]
    out = "out"

    [registration]
    segments = 14

    [options.scan]          # what the reader of the scan takes
    decimal = ","

    [options.post.val3]     # what the post takes
    spin_deg = 90.0

It holds values only: nothing in it is run. File names are relative to its folder, also those of data files (.toml) that
options of a post name.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, get_type_hints

from sicp_cam.errors import JobError, printable
from sicp_cam.job.input_files import absent, wrong_places
from sicp_cam.job.keys import misplaced
from sicp_cam.job.layers import Layer
from sicp_cam.job.tables import GATES, RANGES, TABLES
from sicp_cam.limits import Limits
from sicp_cam.options.values import Word, closest, converted, nearest, table
from sicp_cam.output.names import name_problem
from sicp_cam.plugins.registry import POSTPROCESSORS, owners
from sicp_cam.registration.settings import METHODS, RegistrationSettings
from sicp_cam.toolpath.settings import GateLimits, ToolPathSettings

__all__ = ["Job", "build"]

Unit = Literal["mm", "cm", "m", "inch"]
Options = Mapping[str, object]


def _none() -> Mapping[str, Any]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Job:
    """Everything about one run; the defaults fit an ordinary job.

    Parameters
    ----------
    cad
        The nominal part.
    scan
        Its measured surface.
    path
        The path to be corrected, in the frame of the part.
    out
        Folder of the results; made if it does not exist.
    post
        Names of the postprocessors that write the program.
    name
        Stem of the output files, and name of the program.
    method
        How the deformation is found: sicp, rigid, projection or paper.
    contour
        Numbers of the contours to be registered, or auto: those that the path follows.
    align
        auto, given (the scan lies roughly in the part frame), or a file with the rough pose or datum pairs.
    frame
        Frame of the program's coordinates: that of the scan, or that of the part.
    cad_units, scan_units, path_units
        Unit of the file, where it does not state its own; mm where neither does.
    report
        Kinds of report pages; none for no report.
    force
        Replace existing results.
    recover
        Repair damaged inputs where that can be done; each repair is a warning.
    strict
        Let warnings end the run.
    dry_run
        Write nothing.
    override
        Gates that may be broken, by name.
    registration, toolpath, gates, limits
        Settings of the steps.
    scan_options, part_options, path_options, post_options
        What readers and posts take by name; `post_options` by name of the post.
    """

    cad: Path
    scan: Path
    path: Path
    out: Path
    post: tuple[str, ...] = ("csv",)
    name: str = "corrected"
    method: str = "sicp"
    contour: Literal["auto"] | tuple[int, ...] = "auto"
    align: Literal["auto", "given"] | Path = "auto"
    frame: Literal["scan", "part"] = "scan"
    cad_units: Unit | None = None
    scan_units: Unit | None = None
    path_units: Unit | None = None
    report: tuple[Literal["pdf", "png"], ...] = ("pdf", "png")
    force: bool = False
    recover: bool = False
    strict: bool = False
    dry_run: bool = False
    override: tuple[str, ...] = ()
    registration: RegistrationSettings = field(default_factory=RegistrationSettings)
    toolpath: ToolPathSettings = field(default_factory=ToolPathSettings)
    gates: GateLimits = field(default_factory=GateLimits)
    limits: Limits = field(default_factory=Limits)
    scan_options: Options = field(default_factory=_none)
    part_options: Options = field(default_factory=_none)
    path_options: Options = field(default_factory=_none)
    post_options: Mapping[str, Options] = field(default_factory=_none)


_HINTS = get_type_hints(Job)
_KEYS = tuple(f.name for f in fields(Job) if f.name not in TABLES and not f.name.endswith("_options"))
_REQUIRED = tuple(f.name for f in fields(Job) if f.default is MISSING and f.default_factory is MISSING)
_LISTS = ("post", "report", "override", "contour")
_NAME_LENGTH = 120
_DATA_FILE = ".toml"
_ROLES = {"part": "cad", "scan": "scan", "path": "path"}
_NO_REPORT = "; or none for no report"
_CONTOUR = "must be auto or numbers of contours from 1, such as 1,2; see sicp-cam inspect"


@dataclass(frozen=True, slots=True)
class _Stated:
    value: object
    layer: Layer
    rank: int


def build(*layers: Layer) -> Job:
    """Build a job from layers of values, each of which has precedence over those before it.

    Raises
    ------
    JobError
        With every problem found: unknown keys, wrong types, numbers out of range, missing files, and so on. Each
        problem names where it was stated, its key, what is wrong and what to do.
    """
    stated = {
        key: _Stated(value, layer, rank) for rank, layer in enumerate(layers) for key, value in layer.values.items()
    }
    values: dict[str, Any] = {}
    problems: dict[str, str] = {}
    for key in stated:
        if key in _KEYS:
            try:
                values[key] = _plain_value(key, stated[key])
            except ValueError as error:
                problems[key] = str(error)
        elif problem := misplaced(key, stated[key].value, _KEYS):
            problems[key] = problem
    problems |= _wrong_places(values, stated)
    for name, kind in TABLES.items():
        values[name], wrong = table(kind, _below(stated, name), RANGES[name])
        problems |= {f"{name}.{key}": problem for key, problem in wrong.items()}
    for role in ("scan", "part", "path"):
        values[f"{role}_options"] = MappingProxyType(_below(stated, f"options.{role}"))
    values["post_options"], wrong = _post_options(stated, None if "post" in problems else values.get("post", ("csv",)))
    lines = [f"{stated[key].layer.source}: {printable(key)}: {text}" for key, text in (problems | wrong).items()]
    lines += [f"{key}: missing; {_REMEDIES[key]}" for key in _REQUIRED if key not in stated]
    if lines:
        raise JobError(*lines)
    return Job(**values)


_REMEDIES = {
    "cad": "give the nominal part with --cad FILE, or as cad in the job file",
    "scan": "give the scan of the part with --scan FILE, or as scan in the job file",
    "path": "give the tool path with --path FILE, or as path in the job file",
    "out": "give the folder for the results with --out FOLDER, or as out in the job file",
}


def _below(stated: Mapping[str, _Stated], name: str) -> dict[str, object]:
    prefix = f"{name}."
    return {key.removeprefix(prefix): entry.value for key, entry in stated.items() if key.startswith(prefix)}


def _plain_value(key: str, stated: _Stated) -> object:
    try:
        value = converted(_listed(stated.value) if key in _LISTS else stated.value, _HINTS[key])
    except ValueError as error:
        told = f"{error}{_NO_REPORT}" if key == "report" else str(error)
        raise ValueError(_CONTOUR if key == "contour" else told) from error
    if isinstance(value, Path):
        return _checked_path(key, stated.layer.folder / value)
    if isinstance(value, tuple) and len(set(value)) < len(value):
        raise ValueError("names something twice; leave one out")
    if key == "contour" and value != "auto" and (not value or min(value) < 1):
        raise ValueError(_CONTOUR)
    if key in _CHOICES:
        _check_choices(key, (value,) if isinstance(value, str) else value)
    if key == "name" and (problem := name_problem(value)):
        raise ValueError(f"'{printable(value, 60)}' {problem}")
    if key == "name" and len(value.encode()) > _NAME_LENGTH:
        raise ValueError(f"is longer than {_NAME_LENGTH} bytes")
    return value


def _check_choices(key: str, chosen: tuple[str, ...]) -> None:
    if key == "post" and not chosen:
        raise ValueError("names no postprocessor; see sicp-cam plugins")
    what, choices = _CHOICES[key]
    known = choices()
    for word in chosen:
        if word not in known:
            raise ValueError(f"no {what} '{printable(word, 60)}'; {nearest(word, known)}")


_CHOICES: Mapping[str, tuple[str, Callable[[], Collection[str]]]] = {
    "post": ("postprocessor", lambda: owners(POSTPROCESSORS)),
    "method": ("method", lambda: METHODS),
    "override": ("gate", lambda: GATES),
}


def _listed(value: object) -> object:
    """Take "a,b" for a list in a job file too, one number for a list of one, and none for an empty list."""
    if isinstance(value, str):
        return Word("" if value == "none" else value)
    if isinstance(value, int) and not isinstance(value, bool):
        return [value]
    return [] if value == ["none"] else value


def _checked_path(key: str, path: Path) -> Path:
    name = printable(str(path))
    if key == "out":
        if path.exists() and not path.is_dir():
            raise ValueError(f"{name} is not a folder")
    elif path.is_dir():
        raise ValueError(f"{name} is a folder; give a file")
    elif not path.exists():
        near = closest(path.name, ("auto", "given")) if key == "align" else None
        raise ValueError(f"{name}: no such file (did you mean {near}?)" if near else f"{name}: {absent(path)}")
    return path


def _wrong_places(values: Mapping[str, Any], stated: Mapping[str, _Stated]) -> dict[str, str]:
    files = {
        role: values[key]
        for role, key in _ROLES.items()
        if key in values and f"options.{role}.format" not in stated  # which says what the file is
    }
    return {_ROLES[role]: problem for role, problem in wrong_places(files).items()}


def _beside_the_job(value: object, folder: Path) -> object:
    """Return a data file that an option names (a machine, a robot) as a path from here; any other value as it is."""
    is_file = isinstance(value, str) and value.strip().lower().endswith(_DATA_FILE)
    return str(folder / str(value).strip()) if is_file else value


def _post_options(
    stated: Mapping[str, _Stated], posts: tuple[str, ...] | None
) -> tuple[Mapping[str, Options], dict[str, str]]:
    options: dict[str, dict[str, object]] = {}
    problems = {}
    chosen_at = stated["post"].rank if "post" in stated else -1
    for key, value in _below(stated, "options.post").items():
        post, _, option = key.partition(".")
        whole = f"options.post.{key}"
        if not option and value != {}:
            problems[whole] = "must be a table of the post's options"
        elif posts is None:
            continue  # which posts are meant is not known
        elif post not in posts and stated[whole].rank >= chosen_at:
            # Options of a post that a later layer has left out do no harm.
            problems[whole] = f"{printable(post, 60)} is not among the posts of this job; {nearest(post, posts)}"
        elif option and post in posts:
            options.setdefault(post, {})[option] = _beside_the_job(value, stated[whole].layer.folder)
    return MappingProxyType({post: MappingProxyType(table) for post, table in options.items()}), problems
