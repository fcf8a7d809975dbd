"""`sicp-cam check`: reads written programs back and lints them."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from sicp_cam.cli.reader_settings import Unit
from sicp_cam.cli.session import Talk, logging_to, reported, say, say_json
from sicp_cam.errors import JobError, printable

__all__ = ["check"]

_log = logging.getLogger("sicp_cam.cli")


def check(
    *programs: Path,
    units: Annotated[Unit | None, Parameter(alias=["--path-units"])] = None,
    against: Path | None = None,
    tolerance_mm: float = 0.002,
    tolerance_deg: float = 0.002,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    strict: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    as_json: Annotated[bool, Parameter(name="--json", negative="", show_default=False)] = False,
    talk: Talk = Talk(),  # noqa: B008  # frozen
) -> int:
    """Read programs back and tell what is wrong with them: their words, their path, and how far it is from another.

    Exit code 0: it may run; warnings are told. 5: it must not run. 3: it cannot be read, so nobody knows. 7: warnings
    under --strict. This is no safety function: what a controller makes of a program, only the controller knows.

    Parameters
    ----------
    programs
        Programs; a VAL3 application folder; or a folder that correct has written, for every program in it.
    units
        Unit of programs that state none: mm, cm, m, inch.
    against
        Another program of the same path in the same frame, such as the CSV of the same run: tips, tool axes, feeds and
        rapid moves are compared.
    tolerance_mm
        How far a tip may be off from that of --against.
    tolerance_deg
        How far a tool axis may be off from that of --against.
    set_
        KEY=VALUE: what the reader takes, such as path.rotary=AC; what the checker takes, such as check.line_length=80,
        or check.axis_jump_deg=45; what the reader of --against takes, such as against.decimal=,; or a cap, such as
        limits.path_points=5000000. May be repeated.
    strict
        Let warnings end the check with exit code 7.
    as_json
        Print one JSON document.
    talk
        How much is said.
    """
    with logging_to(talk):
        return reported(
            lambda: _run(programs, units, against, (tolerance_mm, tolerance_deg), set_ or [], strict, as_json),
            as_json=as_json,
        )


def _run(
    programs: tuple[Path, ...],
    units: str | None,
    against: Path | None,
    tolerances: tuple[float, float],
    pairs: list[str],
    strict: bool,
    as_json: bool,
) -> int:
    from sicp_cam.cli.check_lines import check_lines
    from sicp_cam.cli.reader_settings import reader_settings

    if not programs:
        raise JobError("name at least one program to check")
    if not all(0.0 <= tolerance < float("inf") for tolerance in tolerances):
        raise JobError("--tolerance-mm and --tolerance-deg must be numbers of at least 0")
    limits, tables = reader_settings(pairs, ("path", "check", "against"))

    from sicp_cam.checking.check import Check
    from sicp_cam.checking.check import check as judged

    document = judged(
        Check(
            programs,
            units,
            against,
            *tolerances,
            tables["path"],
            tables["check"],
            tables["against"],
            limits,
            strict,
        )
    )
    if as_json:
        say_json(document)
    else:
        for line in check_lines(document):
            say(line)
    _tell(document)
    return int(document["exit_code"])


def _tell(document: dict[str, Any]) -> None:
    """Say in one line each on stderr which programs may not be run, where the exit code says so."""
    from sicp_cam.cli.check_lines import counted

    for program in document["programs"]:
        name = printable(program["path"])
        levels = [finding["level"] for finding in program["findings"]]
        if program["facts"] is None and not program["unread"]:
            _log.error("%s", next(each["message"] for each in program["findings"] if each["code"] == 903))
        elif "fail" in levels:
            _log.error("%s: must not run: %s of level fail", name, counted(levels.count("fail"), "finding"))
        elif document["exit_code"] == 7 and "warn" in levels:
            _log.error("%s: %s under --strict", name, counted(levels.count("warn"), "warning"))
