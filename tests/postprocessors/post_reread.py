"""Readers of written programs that share no code with the posts: what a controller would do, statement by statement."""

import csv
import io
import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass
class Reread:
    """What a program does: moves as rows, and every action in order as (kind, value)."""

    tips: list = field(default_factory=list)
    axes: list = field(default_factory=list)
    feeds: list = field(default_factory=list)
    rapid: list = field(default_factory=list)
    actions: list = field(default_factory=list)
    rotations: list = field(default_factory=list)

    def add(self, tip, axis, feed, rapid):
        self.actions.append(("move", len(self.tips)))
        self.tips.append(tip)
        self.axes.append(np.asarray(axis) / np.linalg.norm(axis))
        self.feeds.append(feed)
        self.rapid.append(rapid)


def read_csv(files):
    (content,) = files.values()
    rows = list(csv.DictReader(io.StringIO(content.decode("ascii"))))
    result = Reread()
    for row in rows:
        x, y, z, i, j, k, feed = (float(row[name]) for name in ("x", "y", "z", "i", "j", "k", "feed"))
        result.add((x, y, z), (i, j, k), feed, {"0": False, "1": True}[row["rapid"]])
    return result, rows


WORD = re.compile(r"([A-Z][0-9]*=|[A-Z])([+-]?[0-9]+(?:\.[0-9]*)?)")


def read_gcode(files, head="AC"):
    """Run G-code; `head` says what the words A, B and C mean. Unknown text is an error."""
    (content,) = files.values()
    result, unit, mode, feed = Reread(), 1.0, None, 0.0
    for raw in content.decode("ascii").splitlines():
        line = re.sub(r"\([^()]*\)|;.*", lambda c: result.actions.append(("comment", c[0])) or "", raw).strip()
        assert "(" not in line and ")" not in line
        line = re.sub(r"^N[0-9]+ ", "", line)
        if line in ("", "%", "TRAORI", "TRAFOOF", "ORIWKS ORIVECT"):
            result.actions += [("mode", line)] if line not in ("", "%") else []
            continue
        words = WORD.findall(line.replace("G43.", "G43"))
        assert "".join(a + b for a, b in words) == line.replace("G43.", "G43").replace(" ", ""), line
        codes = [a + b for a, b in words if a in "GMTO"]
        values = {a.rstrip("="): float(b) for a, b in words if a not in ("G", "M", "N")}
        if {"G20", "G700"} & set(codes):
            unit = 25.4
        if "G4" in codes:
            result.actions.append(("dwell", values.get("P", values.get("F", values.get("X")))))
            continue
        for code in codes:
            if code in ("G0", "G1"):
                mode = code
            elif code[0] == "T":
                result.actions.append(("tool", int(code[1:])))
            else:
                result.actions.append(("code", code))
        if "S" in values:
            result.actions.append(("speed", values["S"]))
        if "X" in values:
            feed = values.get("F", feed / unit) * unit
            tip = [values[name] * unit for name in "XYZ"]
            result.add(tip, gcode_axis(values, head), 0.0 if mode == "G0" else feed, mode == "G0")
    return result


def gcode_axis(values, head):
    if "I" in values:
        return [values[name] for name in "IJK"]
    if "A3" in values:
        return [values[name] for name in ("A3", "B3", "C3")]
    turn = Rotation.from_euler("z", values["C"], degrees=True)
    tilt = Rotation.from_euler(head[0].lower().translate({97: "x", 98: "y"}), values[head[0]], degrees=True)
    return (turn * tilt).apply([0.0, 0.0, 1.0])


NS = {
    "pjx": "{http://www.staubli.com/robotics/VAL3/Project/3}",
    "dtx": "{http://www.staubli.com/robotics/VAL3/Data/2}",
    "pgx": "{http://www.staubli.com/robotics/VAL3/Program/2}",
}
TYPE = "{http://www.w3.org/2001/XMLSchema-instance}type"


@dataclass
class Val3Application:
    """A VAL3 folder as a controller loads it."""

    name: str
    data: dict
    types: dict
    code: dict

    def pose(self, variable):
        value = self.data[variable][0]
        T = np.eye(4)
        T[:3, :3] = Rotation.from_euler("XYZ", [float(value[n]) for n in ("rx", "ry", "rz")], degrees=True).as_matrix()
        T[:3, 3] = [float(value[n]) for n in "xyz"]
        return T


def load_val3(files):
    """Load a folder strictly: byte order mark, CRLF, everything listed, every array as long as it says."""
    folders = {file.split("/")[0] for file in files}
    assert len(folders) == 1
    (name,) = folders
    trees = {}
    for file, content in files.items():
        assert content.startswith(b"\xef\xbb\xbf<?xml"), file
        assert content.count(b"\n") == content.count(b"\r\n") == content.count(b"\r"), file
        trees[file.split("/")[1]] = ET.fromstring(content)
    project = trees[f"{name}.pjx"]
    assert project.find(f"{NS['pjx']}Parameters").get("millimeterUnit") == "true"
    listed = [e.get("file") for e in project.iter(f"{NS['pjx']}Program")]
    assert sorted(listed) == sorted(file for file in trees if file.endswith(".pgx"))
    assert [e.get("file") for e in project.iter(f"{NS['pjx']}Data")] == [f"{name}.dtx"]
    data, types = {}, {}
    for declared in trees[f"{name}.dtx"].iter(f"{NS['dtx']}Data"):
        values = [dict(value.attrib) for value in declared]
        assert [int(value.pop("key")) for value in values] == list(range(int(declared.get("size"))))
        assert declared.get(TYPE) == "array" and declared.get("name") not in data
        data[declared.get("name")], types[declared.get("name")] = values, declared.get("type")
    code = {}
    for file in listed:
        (program,) = list(trees[file])
        assert program.get("name") == file.removesuffix(".pgx")
        lines = [line.strip() for line in program.find(f"{NS['pgx']}Code").text.split("\n")]
        assert lines[0] == "begin" and lines[-1] == "end"
        code[program.get("name")] = lines[1:-1]
    return Val3Application(name, data, types, code)


MOVE = re.compile(r"(movej|movel)\((\w+)\[(\d+)\],(\w+),(\w+)(?:\[(\d+)\])?\)")
SIMPLE = {
    "output": re.compile(r"(do\w+)=(true|false)"),
    "delay": re.compile(r"delay\(([0-9.]+)\)"),
    "number": re.compile(r"(n\w+)=([0-9.]+)"),
    "analog": re.compile(r"aioSet\((\w+),([0-9.]+)\)"),
    "reset": re.compile(r"(bContinue)=false"),
    "operator": re.compile(r"wait\((bContinue|diContinue)(?:==(true|false))?\)"),
    "log": re.compile(r'logMsg\("([^"\\]*)"\)'),
}


def read_val3(files):
    """Run the application from start; a statement that is not understood is an error."""
    app, result = load_val3(files), Reread()
    _run(app, "start", result)
    return app, result


def _run(app, program, result):
    for line in app.code[program]:
        if line.startswith("//"):
            result.actions.append(("comment", line[2:].strip()))
        elif line in ("waitEndMove()", "resetMotion()"):
            result.actions.append((line[:-2], None))
        elif call := re.fullmatch(r"call (\w+)\(\)", line):
            _run(app, call[1], result)
        elif move := MOVE.fullmatch(line):
            _move(app, move, result)
        else:
            _simple(app, line, result)


def _simple(app, line, result):
    for kind, pattern in SIMPLE.items():
        if match := pattern.fullmatch(line):
            if kind not in ("delay", "log"):
                assert match[1] in app.data, f"{match[1]} is not declared"
            result.actions.append((kind, match.groups()))
            return
    raise AssertionError(f"not a statement: {line!r}")


def _move(app, move, result):
    instruction, array, index, tool, speed, speed_index = move.groups()
    assert (app.types[array], app.types[tool], app.types[speed]) == ("pointRx", "tool", "mdesc")
    point, mdesc = app.data[array][int(index)], app.data[speed][int(speed_index or 0)]
    R = Rotation.from_euler("XYZ", [float(point[n]) for n in ("rx", "ry", "rz")], degrees=True).as_matrix()
    assert point["fatherId"] == "fPart[0]"
    result.rotations.append(R)
    rapid = speed in ("mRapid", "mStart")
    result.add([float(point[n]) for n in "xyz"], -R[:, 2], float(mdesc["tmax"]) * 60.0, rapid)
    result.actions[-1] = (instruction, {"point": point, "tool": tool, "mdesc": mdesc, "index": len(result.tips) - 1})


def axis_error_deg(axes, others):
    """Return the largest angle between rows of two sets of unit vectors."""
    crossed = np.linalg.norm(np.cross(axes, others), axis=1)
    return float(np.degrees(np.arctan2(crossed, np.einsum("ni,ni->n", axes, others))).max())
