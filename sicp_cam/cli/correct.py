"""`sicp-cam correct`: the main job."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from sicp_cam.cli.progress import progress_shown
from sicp_cam.cli.session import Talk, logging_to, reported, say, say_json
from sicp_cam.errors import JobError, printable
from sicp_cam.job import Job
from sicp_cam.job.tables import GATES
from sicp_cam.options.help import written

__all__ = ["correct"]

_DEFAULTS = {field.name: field.default for field in fields(Job)}


def _with_default(key: str, text: str | None = None) -> Parameter:
    """Show in the help what the job takes where the flag is left out; the flag itself is then not stated."""
    return Parameter(negative="", show_default=text or written(_DEFAULTS[key]))


_OVERRIDE = (
    f"A gate that may be broken: {', '.join(GATES)}. It is named in the program and the report. May be repeated."
)
_FILE_UNIT = "as the file states, else mm"


def correct(
    job: Path | None = None,
    /,
    *more: Annotated[str, Parameter(show=False)],
    cad: str | None = None,
    scan: str | None = None,
    path: str | None = None,
    post: Annotated[list[str] | None, _with_default("post")] = None,
    out: str | None = None,
    name: Annotated[str | None, _with_default("name")] = None,
    method: Annotated[str | None, _with_default("method")] = None,
    contour: Annotated[str | None, _with_default("contour")] = None,
    align: Annotated[str | None, _with_default("align")] = None,
    frame: Annotated[str | None, _with_default("frame")] = None,
    cad_units: Annotated[str | None, _with_default("cad_units", _FILE_UNIT)] = None,
    scan_units: Annotated[str | None, _with_default("scan_units", _FILE_UNIT)] = None,
    path_units: Annotated[str | None, _with_default("path_units", _FILE_UNIT)] = None,
    report: Annotated[list[str] | None, _with_default("report")] = None,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    override: Annotated[list[str] | None, _with_default("override"), Parameter(help=_OVERRIDE)] = None,
    dry_run: Annotated[bool | None, _with_default("dry_run")] = None,
    force: Annotated[bool | None, _with_default("force")] = None,
    recover: Annotated[bool | None, _with_default("recover")] = None,
    strict: Annotated[bool | None, _with_default("strict")] = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="", show_default=False)] = False,
    talk: Talk = Talk(),  # noqa: B008  # frozen
) -> int:
    """Correct a tool path to the scanned shape of its part, and write programs, report and result.

    Every option is a key of the job file too. The command line has precedence over SICP_* variables, and those over the
    job file.

    Parameters
    ----------
    job
        Job file (TOML); file names in it are relative to its folder.
    cad
        Nominal part: STEP, or a mesh.
    scan
        Scan of the part: PLY, STL, points as text, and more.
    path
        Tool path: APT or CL data, G-code, CSV, DXF, and more.
    post
        Postprocessors, separated by commas: val3, gcode, csv, same (the path's own program, corrected), ... (see
        sicp-cam plugins).
    out
        Folder for the results; made if it does not exist.
    name
        Stem of the output files and name of the program.
    method
        How the deformation is found: sicp, rigid, projection, paper.
    contour
        Contours to register: auto, or their numbers separated by commas (see sicp-cam inspect).
    align
        Where the part lies in the scan: auto (found from the geometry), given (already there, roughly), or a file with
        the rough 4x4 matrix T_scan_part or with datum pairs.
    frame
        Frame of the program's coordinates: scan or part.
    cad_units
        Unit of the nominal part, where its file does not state one: mm, cm, m, inch.
    scan_units
        Unit of the scan.
    path_units
        Unit of the path.
    report
        Report pages, separated by commas: pdf, png; or none.
    set_
        KEY=VALUE: any other setting, such as registration.segments=14, gates.coverage=0.8, scan.decimal=,
        path.feed_mm_min=1500 or post.val3.spin_deg=90; which there are is told below. May be repeated.
    dry_run
        Do everything but write.
    force
        Replace existing results.
    recover
        Repair damaged inputs where that can be done, and tell each repair as a warning.
    strict
        Let warnings end the run with exit code 7.
    as_json
        Print the result as one JSON document.
    talk
        How much is said.
    """
    flags: dict[str, object] = {
        "cad": cad,
        "scan": scan,
        "path": path,
        "post": _joined(post),
        "out": out,
        "name": name,
        "method": method,
        "contour": contour,
        "align": align,
        "frame": frame,
        "cad_units": cad_units,
        "scan_units": scan_units,
        "path_units": path_units,
        "report": _joined(report),
        "override": _joined(override),
        "dry_run": dry_run,
        "force": force,
        "recover": recover,
        "strict": strict,
    }
    with logging_to(talk):
        return reported(lambda: _run(_only(job, more), flags, set_ or [], as_json, talk.quiet), as_json=as_json)


def _run(job_file: Path | None, flags: dict[str, object], pairs: list[str], as_json: bool, quiet: bool) -> int:
    from sicp_cam.job import build
    from sicp_cam.job.layers import environment, load, settings

    stated = settings(flags, pairs)
    job = build(*([load(job_file)] if job_file else []), environment(), stated)

    from sicp_cam import pipeline  # heavy, so only when the job is sound

    with progress_shown(quiet) as progress:
        outcome = pipeline.correct(job, progress)
    if as_json:
        say_json(outcome.document)
    else:
        for line in outcome.lines:
            say(line)
    return outcome.exit_code


def _only(job: Path | None, more: tuple[str, ...]) -> Path | None:
    """Refuse a second word without a flag, and say which flags were meant."""
    if not more:
        return job
    from sicp_cam.job.input_files import FLAGS
    from sicp_cam.plugins import roles

    words = [str(job), *more]
    left, meant = dict(FLAGS), []
    for word in words:
        role = next((role for role in roles(Path(word)) if role in left), None)
        meant += [f"{left.pop(role)} {printable(word)}"] if role else []
    if len(meant) == len(words):
        raise JobError(
            f"{printable(', '.join(words))}: give the files with --cad, --scan and --path: {' '.join(meant)}"
        )
    raise JobError(
        f"{printable(', '.join(more))}: one job file is taken, and flags; give the files with --cad, --scan and --path,"
        " and several values of one flag with commas"
    )


def _joined(words: list[str] | None) -> str | None:
    return None if words is None else ",".join(words)
