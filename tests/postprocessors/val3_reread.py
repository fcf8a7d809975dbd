"""Load and run written VAL3 applications of both dialects, loops too, with no code of the post or of the reader."""

import re
import xml.etree.ElementTree as ET

import post_reread
from post_reread import Reread, Val3Application, load_val3

FOR = re.compile(r"for (\w+)=(\d+) to (\d+)")
SETTING = re.compile(r"(?:dio|aio)Link\((\w+),io:\w+\)|setPayload\((\w+),(\w+),(\w+),(\w+)\)")
SECTIONS = (
    *("aio", "bool", "configRs", "config", "dio", "frame", "jointRs", "joint"),
    *("mdesc", "num", "pointRs", "point", "sio", "string", "tool", "trsf"),
)


def load(files):
    """Load a folder strictly: s7 if its root is Project, else s6."""
    project = next(content for name, content in files.items() if name.endswith(".pjx"))
    return load_val3(files) if b"<Project" in project else load_s6(files)


def run(files):
    """Return the application and what it does from start; a statement that is not understood is an error."""
    app, result = load(files), Reread()
    _run(app, app.code["start"], result, {})
    return app, result


def load_s6(files):
    (name,) = {file.split("/")[0] for file in files}
    trees = {}
    for file, content in files.items():
        assert content.startswith(b"\xef\xbb\xbf<?xml") and content.count(b"\n") == content.count(b"\r\n"), file
        trees[file.split("/")[1]] = ET.fromstring(content)
    project = trees[f"{name}.pjx"]
    assert project.tag == "{ProjectNameSpace}project"
    assert [child.tag.split("}")[1] for child in project] == [
        "parameters", "programSection", "dataSection", "aliasSection"
    ]  # fmt: skip
    assert project[0].get("millimeterUnit") == "true" and re.fullmatch(r"s6[.0-9]+", project[0].get("version"))
    listed = [each.get("file") for each in project[1]]
    assert sorted(listed) == sorted(file for file in trees if file.endswith(".pgx"))
    assert [each.get("file") for each in project[2]] == [f"{name}.dtx"]
    assert [each.get("name") for each in project[3]] == ["io"]
    data, types = {}, {}
    root = trees[f"{name}.dtx"]
    assert root.tag == "{DataNameSpace}dataList"
    assert [section.tag.split("}")[1] for section in root] == [f"{kind}Section" for kind in SECTIONS]
    for section in root:
        for variable in section:
            kind = variable.tag.split("}")[1]
            assert f"{kind}Section" in section.tag and variable.get("name") not in data
            types[variable.get("name")] = f"{kind}Rx" if kind in ("point", "joint") else kind
            data[variable.get("name")] = list(_values_s6(variable, kind))
    code = {}
    for file in listed:
        (program,) = list(trees[file])
        assert program.get("name") == file.removesuffix(".pgx")
        lines = [line.strip() for line in next(program.iter("{ProgramNameSpace}code")).text.split("\n")]
        assert lines[0] == "begin" and lines[-1] == "end"
        code[program.get("name")] = lines[1:-1]
    return Val3Application(name, data, types, code)


def _values_s6(variable, kind):
    if kind in ("dio", "aio"):
        assert not len(variable)
        yield from [{}] * int(variable.get("size"))
        return
    father = {}
    elements = list(variable)
    if kind in ("point", "frame", "tool"):
        stated = elements.pop(0)
        assert stated.tag.endswith({"point": "pFather", "frame": "fFather", "tool": "tFather"}[kind])
        father = {"fatherId": f"{stated.get('name')}[{stated.get('fatherIndex')}]"}
    for index, element in enumerate(elements):
        assert element.tag == f"{{DataNameSpace}}value{kind.capitalize()}" and element.get("index") == str(index)
        value = {key: text for key, text in element.attrib.items() if key != "index"}
        for inner in element:
            if not inner.tag.endswith("}io"):
                value |= inner.attrib
        yield value | father


def _run(app, lines, result, numbers):
    at = 0
    while at < len(lines):
        loop = FOR.fullmatch(lines[at])
        call = re.fullmatch(r"call (\w+)\(\)", lines[at])
        if loop:
            end = lines.index("endFor", at)
            assert app.types[loop[1]] == "num"
            for value in range(int(loop[2]), int(loop[3]) + 1):
                _run(app, lines[at + 1 : end], result, {**numbers, loop[1]: value})
            at = end
        elif call:
            _run(app, app.code[call[1]], result, numbers)
        elif setting := SETTING.fullmatch(lines[at]):
            assert all(name in app.data for name in setting.groups() if name)
            result.actions.append(("setting", lines[at]))
        else:
            _statement(app, _resolved(app, lines[at], numbers), result)
        at += 1


def _resolved(app, line, numbers):
    """Put the values of counters and of arrays of numbers in place of their names."""
    for name, value in numbers.items():
        line = re.sub(rf"\b{name}\b", str(value), line)
        line = re.sub(r"\b(nCut\d*)\[(\d+)\]", lambda m: app.data[m[1]][int(m[2])]["value"], line)
    return line


def _statement(app, line, result):
    if line.startswith("//"):
        result.actions.append(("comment", line[2:].strip()))
    elif line in ("waitEndMove()", "resetMotion()"):
        result.actions.append((line[:-2], None))
    elif move := post_reread.MOVE.fullmatch(line):
        post_reread._move(app, move, result)
    else:
        post_reread._simple(app, line, result)
