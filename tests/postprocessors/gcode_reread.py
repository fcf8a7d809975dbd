"""A small reader of five-axis programs of all dialects, and kinematics of machines, that share no code with the post.

Words are looked at block by block, as a control does; what is not understood is an error. Machines are given as lists
of (letter, direction, point, turns the tool as seen from the part), from the part to the tool.
"""

import re
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

X, Y, Z, SLANT = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.5**0.5, 0.5**0.5)
CHAINS = {
    "head-ac": [("C", Z), ("A", X)],
    "head-bc": [("C", Z), ("B", Y)],
    "head-ab": [("B", Y), ("A", X)],
    "mixed-ac": [("C", Z), ("A", X)],
    "mixed-bc": [("C", Z), ("B", Y)],
    "mixed-ab": [("B", Y), ("A", X)],
    "table-ac": [("C", Z), ("A", X)],
    "table-bc": [("C", Z), ("B", Y)],
    "table-ab": [("B", Y), ("A", X)],
    "nutating-head-bc": [("C", Z), ("B", SLANT)],
    "nutating-mixed-bc": [("C", Z), ("B", SLANT)],
    "nutating-table-bc": [("C", Z), ("B", SLANT)],
}


@dataclass
class Blocks:
    """What a program says: one row a move, in mm and degrees; `actions` is everything else, in order."""

    xyz: list = field(default_factory=list)
    turn: list = field(default_factory=list)
    feeds: list = field(default_factory=list)
    rapid: list = field(default_factory=list)
    actions: list = field(default_factory=list)
    inverse: bool = False
    lines: list = field(default_factory=list)

    def arrays(self):
        return np.array(self.xyz), self.turn, np.array(self.feeds), np.array(self.rapid)


NUMBER = r"[+-]?[0-9]+(?:\.[0-9]*)?"
WORD = re.compile(rf"([A-Z][0-9]=|N[XYZ]|T[XYZ]|[A-Z])({NUMBER})")
HEIDENHAIN = re.compile(r"(BEGIN|END) PGM [A-Z][A-Z0-9_]* MM|CYCL DEF 9\.0 DWELL TIME|STOP|CALL PGM .*|TOOL CALL .*")
SIEMENS = ("TRAORI", "TRAFOOF", "ORIWKS ORIVECT", "ORIWKS ORIAXES")


def read_blocks(text, dialect):
    """Read one file; `dialect` is the name that the post knows it by."""
    blocks, unit, feed = Blocks(), 1.0, None
    numbers = []
    for raw in text.splitlines():
        line = raw
        if dialect == "heidenhain":
            number, line = raw.split(" ", 1)
            numbers.append(int(number))
            line, _, remark = line.partition(";")
        elif dialect == "siemens":
            line, _, remark = line.partition(";")
        else:
            found = re.fullmatch(r"([^()]*)(?:\(([^()]*)\))?", line)
            assert found, line
            line, remark = found[1], found[2] or ""
        line = re.sub(r"^N[0-9]+ ", "", line.strip())
        if remark:
            blocks.actions.append(("comment", remark.strip()))
        if line in ("", "%") or (dialect == "siemens" and line in SIEMENS):
            blocks.actions += [("mode", line)] if line not in ("", "%") else []
            continue
        if dialect == "heidenhain" and (HEIDENHAIN.fullmatch(line) or line.startswith("CYCL DEF 9.1 DWELL ")):
            blocks.actions.append(("text", line))
            continue
        body = re.sub(r"^(LN|L) ", "", line)
        fast = dialect == "heidenhain" and "FMAX" in body
        body = body.replace(" R0 FMAX", "").replace(" FMAX", "") if dialect == "heidenhain" else body
        words = WORD.findall(re.sub(r"(G[0-9]+)\.([0-9])", r"\g<1>\2", body))
        joined = "".join(letter + number for letter, number in words)
        assert joined == re.sub(r"(G[0-9]+)\.([0-9])", r"\g<1>\2", body).replace(" ", ""), raw
        codes = {letter + number for letter, number in words if letter in "GM"}
        values = {letter.rstrip("="): float(number) for letter, number in words if letter not in "GM"}
        unit = 25.4 if codes & {"G20", "G700"} else unit
        blocks.inverse |= "G93" in codes
        if "X" in values and "G4" not in codes:
            moving = {"G0": True, "G1": False}
            kinds = [moving[c] for c in codes if c in moving]
            rapid = fast if dialect == "heidenhain" else kinds[0]
            assert dialect == "heidenhain" or len(codes) == 1, raw
            feed = values.get("F", None if blocks.inverse else feed)
            assert rapid or feed is not None, raw
            blocks.xyz.append([values.pop(letter) * unit for letter in "XYZ"])
            scale = 1.0 if blocks.inverse else unit
            blocks.feeds.append(0.0 if rapid else feed * scale)
            values.pop("F", None)
            blocks.turn.append(values)
            blocks.rapid.append(rapid)
            blocks.lines.append(raw)
            blocks.actions.append(("move", len(blocks.xyz) - 1))
        else:
            blocks.actions.append(("block", line))
    if dialect == "heidenhain":
        assert numbers == list(range(len(numbers)))
    return blocks


def read_program(files, dialect):
    """Read a program of one file."""
    (content,) = files.values()
    return read_blocks(content.decode("ascii"), dialect)


def vectors_of(turn):
    """Return the tool axes that the vector words state; three names of a kind, the last ones where there are two."""
    rows = []
    for values in turn:
        names = next(n for n in (("TX", "TY", "TZ"), ("A3", "B3", "C3"), ("I", "J", "K")) if n[0] in values)
        assert set(values) <= set(names) | {"NX", "NY", "NZ"}, values
        rows.append([values[name] for name in names])
    vectors = np.array(rows)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def rotations_of(chain, turn):
    """Return the rotation of each axis of a chain (letter, direction, ...) for all blocks, and refuse other words."""
    letters = [axis[0] for axis in chain]
    assert all(set(values) == set(letters) for values in turn), turn[:1]
    return [
        Rotation.from_rotvec(np.outer([values[axis[0]] for values in turn], axis[1]), degrees=True) for axis in chain
    ]


def axes_of_words(chain, turn):
    """Return the tool axes (n, 3) in the part, n = R_first R_second z."""
    first, second = rotations_of(chain, turn)
    return (first * second).apply([0.0, 0.0, 1.0])


def tips_of_words(chain, turn, xyz, zero, length):
    """Return the tips (n, 3) in the part; `chain` has (letter, direction, point, "head" or "table") for both axes."""
    rotations = rotations_of(chain, turn)
    tip = np.tile([0.0, 0.0, -length], (len(xyz), 1))
    parts = list(zip(chain, rotations, strict=True))[::-1]
    for axis, rotation in (part for part in parts if part[0][3] == "head"):
        tip = rotation.apply(tip - axis[2]) + axis[2]
    tip = tip + xyz + zero + [0.0, 0.0, length]
    for axis, rotation in (part for part in parts if part[0][3] == "table"):
        tip = rotation.apply(tip - axis[2]) + axis[2]
    return tip - zero
