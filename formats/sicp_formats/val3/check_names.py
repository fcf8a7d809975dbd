"""Names of a VAL3 application: what a controller refuses, and what differs by nothing but capitals."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.findings import Level
from sicp_formats.val3.check_files import Application
from sicp_formats.val3.check_report import Report
from sicp_formats.val3.words import RESERVED

__all__ = ["check_names"]

_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_APPLICATION = re.compile(r"[A-Za-z][A-Za-z0-9]*", re.ASCII)
_LONGEST = 15
_BUILT_IN_S6 = frozenset({"world", "flange"})


def check_names(application: Application, report: Report) -> None:
    """Check the names of the application, its programs, and all variables."""
    _check_application(application.project, report)
    programs = [(code.name, code.file, code.line) for code in application.programs]
    variables = [(v.name, v.file, v.line) for v in application.variables.values()]
    for what, named in (("program", programs), ("variable", variables)):
        for name, file, line in named:
            allowed = _BUILT_IN_S6 if application.old else frozenset()
            _check_name(what, name, file, line, allowed, report)
        _check_twins(what, named, report)
    for first, again in application.doubled:
        what = f"the variable '{printable(again.name, 40)}' is declared before, in {first.file.name}; take one out"
        report.add(853, Level.FAIL, what, again.file, again.line, kind="doubled")
    for code in application.programs:
        own = [(each.name, code.file, each.line) for each in code.own.values()]
        for name, file, line in own:
            _check_name("variable", name, file, line, frozenset(), report)
        _check_twins("variable", own, report)


def _check_application(project: Path, report: Report) -> None:
    name = project.stem
    if not _APPLICATION.fullmatch(name):
        what = f"the application name '{printable(name, 40)}' is not of letters and digits, a letter first; rename it"
        report.add(853, Level.WARN, what, project)
    elif len(name) > _LONGEST:
        what = f"the application name '{printable(name, 40)}' is longer than {_LONGEST} characters; shorten it"
        report.add(853, Level.WARN, what, project)
    folder = project.resolve().parent.name
    if folder != name:
        what = f"the folder is named '{printable(folder, 40)}'; a controller expects that of the application, '{name}'"
        report.add(853, Level.WARN, what, project)


def _check_name(what: str, name: str, file: Path, line: int, allowed: frozenset[str], report: Report) -> None:
    told = f"the {what} '{printable(name, 40)}'"
    if not _NAME.fullmatch(name):
        message = f"{told} has no name of letters, digits and underscores that begins with a letter; rename it"
        report.add(853, Level.FAIL, message, file, line, kind="form")
    elif name.lower() in RESERVED and name not in allowed:
        report.add(853, Level.FAIL, f"{told} has the name of a word of VAL3; rename it", file, line, kind="reserved")
    elif len(name) > _LONGEST:
        message = f"{told} has a name longer than {_LONGEST} characters, which older controllers refuse; shorten it"
        report.add(853, Level.WARN, message, file, line, kind="long")


def _check_twins(what: str, named: Iterable[tuple[str, Path, int]], report: Report) -> None:
    met: dict[str, str] = {}
    for name, file, line in named:
        twin = met.setdefault(name.lower(), name)
        if twin != name:
            message = f"the {what}s '{printable(twin, 40)}' and '{printable(name, 40)}' differ in capitals only; rename"
            report.add(853, Level.WARN, message, file, line, kind="twins")
