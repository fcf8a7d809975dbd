"""Load a VAL3 application for a linter: every file on its own, so that one bad file does not hide the others."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from sicp_cam.errors import FormatError, printable
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_formats.robot.program import Statement
from sicp_formats.source import read_bytes
from sicp_formats.val3.check_bytes import check_bytes, early_end
from sicp_formats.val3.check_report import Report
from sicp_formats.val3.data import Variable, declarations
from sicp_formats.val3.project import lies_inside, program_of
from sicp_formats.val3.xml import Element, parse_xml

__all__ = ["Application", "Code", "Own", "load"]

_NAMESPACES = {
    "Project": "http://www.staubli.com/robotics/VAL3/Project/3",
    "Database": "http://www.staubli.com/robotics/VAL3/Data/2",
    "Programs": "http://www.staubli.com/robotics/VAL3/Program/2",
    "project": "ProjectNameSpace",
    "dataList": "DataNameSpace",
    "programList": "ProgramNameSpace",
}
_ROOTS = {".pjx": ("Project", "project"), ".dtx": ("Database", "dataList"), ".pgx": ("Programs", "programList")}
_MOST_FILES = 10_000


@dataclass(frozen=True, slots=True)
class Own:
    """A parameter or local of a program: its type, its size (None if not known) and where it is declared."""

    name: str
    type: str
    size: int | None
    line: int
    local: bool


@dataclass(frozen=True, slots=True)
class Code:
    """A program as it is written: the name in the file, its own variables, the statements between begin and end."""

    name: str
    file: Path
    line: int
    public: bool
    own: Mapping[str, Own]
    statements: tuple[Statement, ...]


@dataclass(slots=True)
class Application:
    """What the files of an application hold, as far as they can be read."""

    project: Path
    old: bool = False
    version: str = ""
    programs: list[Code] = field(default_factory=list)
    variables: dict[str, Variable] = field(default_factory=dict)
    doubled: list[tuple[Variable, Variable]] = field(default_factory=list)
    elements: list[tuple[Variable, Element]] = field(default_factory=list)
    libraries: frozenset[str] = frozenset()
    types: frozenset[str] = frozenset()


def load(project: Path, limits: Limits, report: Report) -> Application:
    """Read the project and every file that it lists; what is wrong with them goes into the report.

    Raises
    ------
    FormatError
        If the project file itself cannot be read.
    """
    application = Application(project)
    root = _root(project, limits, report)
    if root is None:
        return application
    application.old = root.name == "project"
    _parameters(application, root, report)
    named = {each: [(e.attributes.get(key, ""), e.line) for e in root.all(each)] for each, key in _NAMED.items()}
    application.libraries = frozenset(name for each in ("library", "alias") for name, _ in named[each])
    application.types = frozenset(name for name, _ in named["type"])
    for file in _listed(project, root, "data", report):
        _read_data(application, file, limits, report)
    listed = list(_listed(project, root, "program", report))
    for file in listed:
        _read_program(application, file, limits, report)
    _not_listed(application, root, report)
    _start_and_stop(application, listed, report)
    return application


_NAMED = {"library": "alias", "alias": "name", "type": "name"}


def _root(file: Path, limits: Limits, report: Report) -> Element | None:
    """Return the root of a file, None if it is no XML of VAL3; a file that is not there raises FormatError."""
    content = read_bytes(file, limits)
    check_bytes(file, content, report)
    try:
        root = parse_xml(file, content)
    except FormatError as error:
        early = early_end(content)
        if early:
            what = "]]> in the code ends its section there, and the rest is no code; write ]] > instead"
            report.add(850, Level.FAIL, what, file, early)
        else:
            report.error(850, error, file)
        return None
    wanted = _ROOTS.get(file.suffix.lower(), ())
    if root.name not in wanted:
        what = f"the root is <{printable(root.name, 40)}> and not <{'> or <'.join(wanted)}>; is it the right file?"
        report.add(850, Level.FAIL, what, file, root.line)
        return None
    if root.attributes.get("xmlns") != _NAMESPACES[root.name]:
        what = f"the namespace of <{root.name}> is not {_NAMESPACES[root.name]}; a controller may refuse the file"
        report.add(850, Level.WARN, what, file, root.line)
    return root


def _part(file: Path, limits: Limits, report: Report) -> Element | None:
    try:
        return _root(file, limits, report)
    except FormatError as error:
        report.error(850, error, file)
        return None


def _parameters(application: Application, root: Element, report: Report) -> None:
    file = application.project
    for parameters in root.all("parameters"):
        application.version = parameters.attributes.get("version", "")
        stated = parameters.attributes.get("millimeterUnit", "true").strip()
        if stated == "false":
            what = "millimeterUnit is false: the controller reads every length of the application in inches"
            report.add(854, Level.WARN, what, file, parameters.line)
        elif stated != "true":
            what = f"millimeterUnit = {printable(stated, 20)!r} is neither true nor false; write true"
            report.add(854, Level.FAIL, what, file, parameters.line)


def _listed(project: Path, root: Element, kind: str, report: Report) -> Iterator[Path]:
    """Yield the files of a kind that the project lists and that are there."""
    met: set[str] = set()
    for element in root.all(kind):
        name = element.attributes.get("file", "").replace("\\", "/")
        told = printable(name, 60)
        wrong = (
            f"a {kind} without a file; name it"
            if not name
            else f"the {kind} file {told!r} lies outside of the folder of the application; copy it there"
            if not lies_inside(project, name)
            else f"the {kind} file {told!r} is listed twice; take one out"
            if name.lower() in met
            else f"the {kind} file {told!r} is listed, but not there; add it"
            if not (project.parent / name).is_file()
            else ""
        )
        met.add(name.lower())
        if wrong:
            report.add(852, Level.FAIL, wrong, project, element.line)
        else:
            yield project.parent / name


def _not_listed(application: Application, root: Element, report: Report) -> None:
    """Tell of programs and data in the folder that the project does not name; folders of other applications apart."""
    folder = application.project.parent
    known = {
        (folder / e.attributes.get("file", "").replace("\\", "/")).as_posix().lower()
        for kind in ("program", "data")
        for e in root.all(kind)
    }
    seen = 0
    for place, folders, files in os.walk(folder):
        if Path(place) != folder and any(name.lower().endswith(".pjx") for name in files):
            folders.clear()
            continue
        folders.sort()
        seen += len(files)
        if seen > _MOST_FILES:
            return
        for name in sorted(files):
            file = Path(place, name)
            if file.suffix.lower() in (".pgx", ".dtx") and file.as_posix().lower() not in known:
                report.add(852, Level.WARN, "the project does not list this file, so it is not loaded", file)


def _start_and_stop(application: Application, listed: list[Path], report: Report) -> None:
    names = {file.stem.lower() for file in listed}
    missing = [name for name in ("start", "stop") if name not in names]
    if missing and names:
        told = " and ".join(missing)
        what = f"the project lists no program {told}, which every application has; add it"
        # Neither of them: an application that others load as a library.
        report.add(852, Level.FAIL if len(missing) == 1 else Level.WARN, what, application.project)


def _read_data(application: Application, file: Path, limits: Limits, report: Report) -> None:
    root = _part(file, limits, report)
    if root is None:
        return
    elements = _declaring(root)
    for declare, element in zip(declarations(file, root), elements, strict=True):
        try:
            variable = declare()
        except FormatError as error:
            report.error(855, error, file)
            continue
        if variable.name in application.variables:
            application.doubled.append((application.variables[variable.name], variable))
        application.variables[variable.name] = variable
        application.elements.append((variable, element))


def _declaring(root: Element) -> list[Element]:
    if root.name == "Database":
        return list(root.all("data"))
    return [data for section in root.children for data in section.children]


def _read_program(application: Application, file: Path, limits: Limits, report: Report) -> None:
    root = _part(file, limits, report)
    if root is None:
        return
    try:
        program = program_of(file, root)
    except FormatError as error:
        report.error(861, error, file)
        return
    element = next(root.all("program"))
    if program.name != file.stem:
        what = f"the program {printable(program.name, 40)!r} stands in {printable(file.name, 60)}; name both alike"
        report.add(852, Level.FAIL, what, file, element.line)
    public = "true" in (element.attributes.get("public"), str(element.attributes.get("access") == "public").lower())
    own = {each.name: each for each in _own(element)}
    application.programs.append(Code(program.name, file, element.line, public, own, program.statements))


def _own(program: Element) -> Iterator[Own]:
    for place in program.children:
        kind = place.name.lower()
        if kind in ("parameters", "locals", "paramsection", "localsection"):
            local = kind.startswith("local")
            for each in place.children:
                size = each.attributes.get("size", "1")
                known = local and size.isdecimal() and each.attributes.get("xsi:type") != "collection"
                yield Own(
                    each.attributes.get("name", ""),
                    each.attributes.get("type", ""),
                    int(size) if known else None,
                    each.line,
                    local,
                )
