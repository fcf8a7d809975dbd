"""Cut Fanuc listings (.LS) into their statements and positions.

A listing has the sections /PROG, /ATTR, /APPL, /MN with one numbered statement a line, /POS with the positions, /END.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from sicp_cam.errors import FormatError, printable
from sicp_formats.robot.motion import NUMBER
from sicp_formats.robot.program import Statement

__all__ = ["Listing", "Position", "read_listing"]

_SECTION = re.compile(r"/(PROG|ATTR|APPL|MN|POS|END)\b[ \t]*(.*)", re.ASCII)
_NAME = re.compile(r"[A-Za-z_][\w-]*", re.ASCII)
_NUMBERED = re.compile(r"[ \t]*(?:[0-9]+[ \t]*)?:(.*)", re.ASCII)
_HEAD = re.compile(r"[ \t]*P\[[ \t]*([0-9]{1,9})[ \t]*(?::[^\]]*)?\][ \t]*\{(.*)", re.ASCII)
_GROUP = re.compile(r"GP[ \t]*([0-9])[ \t]*:", re.ASCII)
_FRAME = re.compile(r"\b(UF|UT)[ \t]*:[ \t]*([0-9]{1,3}|F)\b", re.ASCII)
_VALUE = re.compile(rf"\b([XYZWPR]|[JE][1-9])[ \t]*=[ \t]*({NUMBER}|\*+)[ \t]*(mm|deg|)", re.ASCII)
_POSE = ("X", "Y", "Z", "W", "P", "R")
_LONGEST_POSITION = 60


@dataclass(frozen=True, slots=True)
class Position:
    """A position: x, y, z in mm and W, P, R in degrees, or None for joint angles; None for a frame: the current one."""

    line: int
    pose: tuple[float, ...] | None
    external: tuple[float, ...]
    user_frame: int | None
    tool: int | None


@dataclass(slots=True)
class Listing:
    """A program: name, statements in order, positions by number, the line where it ends, and whether /END is there."""

    file: Path
    name: str = ""
    statements: list[Statement] = field(default_factory=list)
    positions: dict[int, Position] = field(default_factory=dict)
    lines: int = 0
    ended: bool = False


def read_listing(path: Path, lines: list[str]) -> Listing:
    """Return the statements and positions of a listing.

    Raises
    ------
    FormatError
        If the text is no listing, or a statement or position is cut short or stands twice.
    """
    found, section = Listing(path, lines=len(lines)), ""
    sections: dict[str, list[Statement]] = {}
    for number, line in enumerate(lines, 1):
        head = _SECTION.match(line)
        if head is None:
            if section not in ("", "END"):
                sections[section].append(Statement(number, line))
            elif line.strip() and not section:
                raise FormatError(path, "text before /PROG; is this a listing of a Fanuc program (.ls)?", line=number)
            continue
        section = head[1]
        if section == "PROG" and sections:
            raise FormatError(path, "a second /PROG begins; give each program a file of its own", line=number)
        if section == "PROG":
            found.name = _program_name(path, head[2], number)
        sections.setdefault(section, [])
    if "PROG" not in sections or "MN" not in sections:
        raise FormatError(path, "has no /PROG and /MN; is this a listing of a Fanuc program (.ls)?", line=1)
    found.ended = section == "END"
    found.statements = _statements(path, sections["MN"])
    found.positions = _positions(path, sections.get("POS", []))
    return found


def _program_name(path: Path, text: str, line: int) -> str:
    name = _NAME.match(text)
    if name is None:
        raise FormatError(path, "/PROG without a name; correct the line", line=line)
    return name[0]


def _statements(path: Path, lines: Iterable[Statement]) -> list[Statement]:
    """Return the statements: what stands behind the line numbers, up to a semicolon, without it."""
    found, held, begun = list[Statement](), list[str](), 0
    for line in lines:
        numbered = _NUMBERED.fullmatch(line.text)
        if numbered is None and line.text.strip():
            told = printable(line.text.strip(), 40)
            raise FormatError(
                path, f"'{told}' has no line number and colon before it; correct the line", line=line.line
            )
        text = numbered[1].strip() if numbered else ""
        if not text and not held:
            continue
        begun = begun if held else line.line
        held.append(text.removesuffix(";").strip())
        if text.endswith(";"):
            found.append(Statement(begun, " ".join(held).strip()))
            held = []
    if held:
        told = printable(held[0], 40)
        raise FormatError(path, f"'{told}' has no end (;); is the file complete?", line=begun)
    return [statement for statement in found if statement.text]


def _positions(path: Path, lines: Iterable[Statement]) -> dict[int, Position]:
    found, held, number, begun = dict[int, Position](), list[str](), 0, 0
    for line in lines:
        head = _HEAD.fullmatch(line.text)
        if head and held:
            break
        if head:
            number, begun = int(head[1]), line.line
            if number in found:
                raise FormatError(path, f"P[{number}] stands twice; delete one of them", line=line.line)
        elif not held:
            if line.text.strip():
                raise FormatError(path, f"'{printable(line.text, 40)}' is no position; correct it", line=line.line)
            continue
        held.append(head[2] if head else line.text)
        if "}" in held[-1]:
            found[number] = _position(path, number, "\n".join(held), begun)
            held = []
        elif len(held) > _LONGEST_POSITION:
            break
    if held:
        raise FormatError(path, f"P[{number}] has no end (}};); is the file complete?", line=begun)
    return found


def _position(path: Path, number: int, text: str, line: int) -> Position:
    groups = _GROUP.split(text)
    group_texts = dict(zip(groups[1::2], groups[2::2], strict=True))
    first = group_texts.pop("1", "" if group_texts else groups[0])
    values = _values(path, number, first, line)
    frames = {name: None if value == "F" else int(value) for name, value in _FRAME.findall(first)}
    missing = [name for name in _POSE if name not in values]
    joints = any(name[0] == "J" for name in values)
    if missing and not joints:
        raise FormatError(path, f"P[{number}] lacks {', '.join(missing)}; correct it", line=line)
    others = [_values(path, number, each, line) for each in group_texts.values()]
    external = [value for name, value in values.items() if name[0] == "E"]
    external += [value for each in others for value in each.values()]
    pose = None if joints else tuple(values[name] for name in _POSE)
    return Position(line, pose, tuple(external), frames.get("UF"), frames.get("UT"))


def _values(path: Path, number: int, text: str, line: int) -> dict[str, float]:
    values: dict[str, float] = {}
    for name, value, unit in _VALUE.findall(text):
        if value.startswith("*"):
            raise FormatError(path, f"{name} of P[{number}] was never taught (***); teach the position", line=line)
        if unit != ("mm" if name in ("X", "Y", "Z") else "deg") and name in _POSE:
            what = f"{name} of P[{number}] is in '{unit}' and not in {'mm' if name in 'XYZ' else 'deg'}; correct it"
            raise FormatError(path, what, line=line)
        if name in values:
            raise FormatError(path, f"{name} of P[{number}] stands twice; correct it", line=line)
        values[name] = float(value)
        if not math.isfinite(values[name]):
            raise FormatError(path, f"{name} of P[{number}] is too large to be a number; correct it", line=line)
    return values
