"""The files of a VAL3 application: found from any of them, and never outside of their folder."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from sicp_cam.errors import FormatError, printable
from sicp_cam.limits import Limits
from sicp_formats.robot.program import Statement
from sicp_formats.val3.data import Variables
from sicp_formats.val3.xml import Element, read_xml

__all__ = ["Program", "Project", "lies_inside", "open_project", "program_of", "project_file"]

_COMMENT = re.compile(r'((?:[^"/]|"[^"]*"|/(?!/))*)//(.*)', re.DOTALL)
_LONGEST_LINE = 2000


@dataclass(frozen=True, slots=True)
class Program:
    """A program: its file, the statements between begin and end, and the names of its parameters and locals.

    Comments are statements of their own, which begin with `//`.
    """

    name: str
    file: Path
    statements: tuple[Statement, ...]
    own_names: frozenset[str]


@dataclass(slots=True)
class Project:
    """An application: its .pjx file and the bytes of that, its unit, its variables, and its programs once met."""

    file: Path
    content: bytes
    unit: str
    unit_line: int
    variables: Variables
    limits: Limits
    program_files: dict[str, Path]
    _programs: dict[str, Program] = field(default_factory=dict)

    def program(self, name: str) -> Program | None:
        """Return a program by its name, None if the application has none of that name."""
        wanted = name.lower()
        if wanted not in self._programs:
            if wanted not in self.program_files:
                return None
            file = self.program_files[wanted]
            self._programs[wanted] = program_of(file, read_xml(file, self.limits)[0])
        return self._programs[wanted]


def open_project(path: Path, limits: Limits) -> Project:
    """Read the project and data files of an application, from its folder or any of its files.

    Raises
    ------
    FormatError
        If there is not exactly one .pjx file, or a file is missing, lies elsewhere or is not what it should be.
    """
    file = project_file(path)
    root, content = read_xml(file, limits)
    if root.name.lower() != "project":
        what = f"<{printable(root.name, 40)}> is not the root of a .pjx file; give the .pjx of a VAL3 application"
        raise FormatError(file, what, line=root.line)
    unit, unit_line = "mm", 0
    for parameters in root.all("parameters"):
        stated = parameters.attributes.get("millimeterUnit", "true").strip().lower()
        if stated not in ("true", "false"):
            what = f"millimeterUnit = {printable(stated, 20)!r} is neither true nor false; correct it"
            raise FormatError(file, what, line=parameters.line)
        unit, unit_line = "mm" if stated == "true" else "inch", parameters.line
    variables = Variables()
    for data_file in _listed(file, root, "data"):
        variables.read(data_file, read_xml(data_file, limits)[0])
    programs = {each.stem.lower(): each for each in _listed(file, root, "program")}
    return Project(file, content, unit, unit_line, variables, limits, programs)


def project_file(path: Path) -> Path:
    """Return the .pjx of an application, from its folder or any of its files.

    Raises
    ------
    FormatError
        If there is not exactly one beside the file.
    """
    if path.suffix.lower() == ".pjx" or path.name.lower().endswith(".pjx.gz"):
        return path
    folder = path if path.is_dir() else path.parent
    if path is not folder and not path.is_file():
        raise FormatError(path, "no such file; check the name and the folder")
    try:
        found = sorted(each for each in folder.iterdir() if each.suffix.lower() == ".pjx")
    except OSError as error:
        raise FormatError(path, f"its folder cannot be read ({error.strerror or error}); give the .pjx") from None
    if len(found) != 1:
        told = ", ".join(printable(each.name, 40) for each in found[:5]) or "none"
        raise FormatError(path, f"a VAL3 application has one .pjx file, here there is: {told}; give the one to be read")
    return found[0]


def _listed(project: Path, root: Element, kind: str) -> Iterator[Path]:
    """Yield the files of a kind that the project lists; they must lie in its folder."""
    for element in root.all(kind):
        name = element.attributes.get("file", "").replace("\\", "/")
        if not name:
            raise FormatError(project, f"a {kind} without a file; correct the project", line=element.line)
        if not lies_inside(project, name):
            what = (
                f"the {kind} file {printable(name, 60)!r} lies outside of the folder of the application; copy it there"
            )
            raise FormatError(project, what, line=element.line)
        # Named as the user named the project, so that messages show it that way.
        yield project.parent / name


def lies_inside(project: Path, name: str) -> bool:
    """Say whether a file that a project names lies in its folder."""
    try:
        folder = project.resolve().parent
        return (folder / name).resolve().is_relative_to(folder)
    except (OSError, RuntimeError, ValueError):  # too long, a loop of links, a NUL
        return False


def program_of(file: Path, root: Element) -> Program:
    """Return the program of a .pgx file.

    Raises
    ------
    FormatError
        If there is none, or its code does not stand between begin and end.
    """
    program = next(root.all("program"), None)
    code = None if program is None else next(program.all("code"), None)
    if program is None or code is None:
        raise FormatError(file, "holds no program code; is this a .pgx file?", line=root.line)
    names = {each.attributes.get("name", "") for each in program.all("parameter", "local")}
    old_style = {
        each.attributes.get("name", "")
        for part in program.all("paramsection", "localsection")
        for each in part.children
    }
    statements = _statements(file, "".join(code.text), code.text_line)
    return Program(program.attributes.get("name", file.stem), file, tuple(statements), frozenset(names | old_style))


def _statements(file: Path, code: str, first_line: int) -> list[Statement]:
    """Return the statements between begin and end; VAL3 has one in a line."""
    found: list[Statement] = []
    for line, text in enumerate(code.split("\n"), first_line):
        if len(text) > _LONGEST_LINE:
            raise FormatError(file, f"a line of code is longer than {_LONGEST_LINE} characters; cut it", line=line)
        comment = _COMMENT.fullmatch(text)
        if comment:
            text = comment[1]
            found.append(Statement(line, f"//{comment[2]}"))
        if text.strip():
            found.append(Statement(line, text.strip()))
    plain = [at for at, each in enumerate(found) if not each.text.startswith("//")]
    begins_and_ends = plain and [found[at].text.lower() for at in (plain[0], plain[-1])] == ["begin", "end"]
    if not begins_and_ends or len(plain) < 2:
        raise FormatError(file, "the code does not stand between begin and end; is the file complete?", line=first_line)
    return [each for at, each in enumerate(found) if at not in (plain[0], plain[-1])]
