"""Readers of robot programs that share no code with the posts or the product: each line is known, or it is an error."""

import csv
import io
import math
import re
from dataclasses import dataclass, field

import numpy as np
from post_reread import Reread
from scipy.spatial.transform import Rotation

NUMBER = r"-?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)"


@dataclass
class RobotRun(Reread):
    """What a robot does: also zones in mm, the poses of frame and tool, and settings by name."""

    zones: list = field(default_factory=list)
    frame: np.ndarray | None = None
    tool: np.ndarray | None = None
    settings: dict = field(default_factory=dict)

    def point(self, word, tip, R, feed, rapid, zone):
        self.rotations.append(R)
        self.zones.append(zone)
        self.add(tip, -R[:, 2], feed, rapid)
        self.actions[-1] = (word, len(self.tips) - 1)


def pose(tip, R):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, tip
    return T


def text_of(content, line_end):
    text = content.decode("ascii")
    assert text.endswith(line_end)
    if line_end == "\r\n":
        assert text.count("\n") == text.count("\r\n") == text.count("\r")
    else:
        assert "\r" not in text
    return text.replace("\r\n", "\n")


# --- KUKA ---


def about(axis, degrees):
    """Return the turn about one axis; scipy would take ten times as long for each of very many points."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    rows = {"x": ((1, 0, 0), (0, c, -s), (0, s, c)), "y": ((c, 0, s), (0, 1, 0), (-s, 0, c))}
    return np.array(rows.get(axis, ((c, -s, 0), (s, c, 0), (0, 0, 1))))


def zyx(a, b, c):
    return about("z", a) @ about("y", b) @ about("x", c)


def krl_numbers(text):
    found = re.findall(rf"([A-Z]) ({NUMBER})", text)
    assert ",".join(f"{name} {value}" for name, value in found) == text, text
    return {name: float(value) for name, value in found}


def krl_frame(text):
    v = krl_numbers(text)
    return pose([v["X"], v["Y"], v["Z"]], zyx(v["A"], v["B"], v["C"]))


def read_krl(files, name):
    """Run NAME.src: `files` by file name. Every statement must be one that the post may write."""
    subs, frames = {}, {}
    for file, content in files.items():
        lines = text_of(content, "\r\n").splitlines()
        assert lines[:2] == ["&ACCESS RVP", "&REL 1"]
        if file.endswith(".dat"):
            assert re.fullmatch(r"DEFDAT \w+ PUBLIC", lines[2]) and lines[-1] == "ENDDAT"
            found = [re.fullmatch(r"DECL (?:GLOBAL )?FRAME (\w+)=\{(.*)\}", line) for line in lines]
            frames |= {match[1]: krl_frame(match[2]) for match in found if match}
            continue
        at = 2
        while at < len(lines):
            head = re.fullmatch(r"DEF (\w+)\( \)", lines[at])
            assert head and len(head[1]) <= 24 and head[1] not in subs, lines[at]
            end = lines.index("END", at)
            subs[head[1]] = lines[at + 1 : end]
            at = end + 1
    run = RobotRun()
    state = {"vel": None, "zone": None}
    krl_run(subs, name, frames, run, state)
    return run


KRL_POINT = re.compile(r"(PTP|LIN) \{(.*?)\}( C_DIS)?")
KRL_INI = (
    ";FOLD INI;%{PE}",
    "GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )",
    "INTERRUPT ON 3",
    "BAS (#INITMOV,0 )",
    ";ENDFOLD (INI)",
)


def krl_run(subs, name, frames, run, state):
    for line in subs[name]:
        if line in KRL_INI:
            continue
        if line.startswith("; "):
            run.actions.append(("comment", line[2:]))
        elif move := KRL_POINT.fullmatch(line):
            v = krl_numbers(move[2])
            rapid = move[1] == "PTP"
            assert not rapid or not run.tips, "a joint move within the path"
            zone = state["zone"] if move[3] else 0.0
            R = zyx(v["A"], v["B"], v["C"])
            run.point(move[1], [v["X"], v["Y"], v["Z"]], R, 0.0 if rapid else state["vel"], rapid, zone)
            run.settings |= {key: v[key] for key in "ST" if key in v}
        elif call := re.fullmatch(r"(\w+)\( \)", line):
            krl_run(subs, call[1], frames, run, state)
        elif speed := re.fullmatch(rf"\$VEL\.CP=({NUMBER})", line):
            state["vel"] = float(speed[1]) * 60_000.0
            assert 0.0 < float(speed[1]) <= 3.0
        elif zone := re.fullmatch(rf"\$APO\.CDIS=({NUMBER})", line):
            state["zone"] = float(zone[1])
        elif frame := re.fullmatch(r"\$(BASE|TOOL)=(\w+)", line):
            setattr(run, "frame" if frame[1] == "BASE" else "tool", frames[frame[2]])
        elif output := re.fullmatch(r"\$OUT\[([0-9]+)\]=(TRUE|FALSE)", line):
            assert krl_stands(run), f"{line} while the arm may move"
            run.actions.append(("output", (int(output[1]), output[2] == "TRUE")))
        elif wait := re.fullmatch(rf"WAIT SEC ({NUMBER})", line):
            run.actions.append(("wait", float(wait[1])))
        elif line == "HALT":
            assert krl_stands(run)
            run.actions.append(("stop", None))
        elif setting := re.fullmatch(r"(\$(?:ADVANCE|ORI_TYPE|VEL\.ORI[12]|ACC\.CP|ANOUT\[\d+\]|LOAD))=(.*)", line):
            run.settings[setting[1]] = setting[2]
        elif bas := re.fullmatch(r"BAS \(#(\w+),(.*)\)", line):
            run.settings[bas[1]] = bas[2]
        else:
            raise AssertionError(f"not a statement: {line!r}")


def krl_stands(run):
    """Say whether the interpreter has waited for the arm since the last move."""
    for kind, _ in reversed(run.actions):
        if kind == "wait":
            return True
        if kind in ("PTP", "LIN"):
            return False
    return True


# --- ABB ---


def quaternion(w, x, y, z):
    assert abs(np.linalg.norm([w, x, y, z]) - 1.0) < 1e-4
    return Rotation.from_quat([x, y, z, w]).as_matrix()


def lists(text):
    assert re.fullmatch(rf'(?:[\[\],]|{NUMBER}|9E9|TRUE|FALSE|"")*', text), text
    return eval(text, {"__builtins__": {}}, {"TRUE": True, "FALSE": False})


def rapid_pose(value):
    return pose(value[0], quaternion(*value[1]))


RAPID_MOVE = re.compile(r"(MoveJ|MoveL) (\[.*\]),(\w+|\[[^\]]*\]),(\w+),(\w+)\\WObj:=(\w+);")


def read_rapid(files):
    """Run `main` of the modules; every statement must be one that the post may write."""
    procs, data = {}, {}
    for file, content in files.items():
        lines = [line.strip() for line in text_of(content, "\r\n").splitlines()]
        if file.endswith(".pgf"):
            listed = re.findall(r"<Module>(.*)</Module>", "\n".join(lines))
            assert sorted(listed) == sorted(name for name in files if name.endswith(".mod"))
            continue
        assert lines[0] == f"MODULE {file.removesuffix('.mod')}" and lines[-1] == "ENDMODULE"
        name = None
        for line in lines[1:-1]:
            if head := re.fullmatch(r"PROC (\w+)\(\)", line):
                name = head[1]
                assert len(name) <= 32 and name not in procs
                procs[name] = []
            elif line == "ENDPROC":
                name = None
            elif name is not None:
                procs[name].append(line)
            else:
                declared = re.fullmatch(r"(PERS|CONST) (\w+) (\w+):=(.*);", line)
                assert declared and declared[3] not in data, line
                data[declared[3]] = (declared[2], lists(declared[4]))
    run = RobotRun()
    rapid_run(procs, "main", data, run)
    return run


def rapid_run(procs, name, data, run):
    for line in procs[name]:
        if line.startswith("! "):
            run.actions.append(("comment", line[2:]))
        elif move := RAPID_MOVE.fullmatch(line):
            rapid_move(move, data, run)
        elif call := re.fullmatch(r"(\w+);", line):
            if call[1] == "Stop":
                run.actions.append(("stop", None))
            else:
                rapid_run(procs, call[1], data, run)
        elif output := re.fullmatch(rf"Set(?:DO|AO) (\w+),({NUMBER});", line):
            assert run.actions[-1] == ("InPos", None) or run.actions[-1][0] in ("output", "comment")
            run.actions.append(("output", (output[1], float(output[2]))))
        elif wait := re.fullmatch(rf"WaitTime ({NUMBER});", line):
            run.actions.append(("wait", float(wait[1])))
        elif line == "WaitRob \\InPos;":
            assert not run.zones or run.zones[-1] == 0.0, "no stop point before"
            run.actions.append(("InPos", None))
        elif line in ("ConfL \\Off;", "ConfJ \\On;", "ConfJ \\Off;"):
            run.settings[line.split()[0]] = line
        elif message := re.fullmatch(r'TPWrite "([^"\\]{1,80})";', line):
            run.actions.append(("message", message[1]))
        else:
            raise AssertionError(f"not a statement: {line!r}")


def rapid_move(move, data, run):
    word, target, speed, zone, tool, wobj = move.groups()
    (x, y, z), turn, conf, external = lists(target)
    assert len(conf) == 4 and external == [9e9] * 6
    speeds = lists(speed) if speed.startswith("[") else data[speed][1]
    assert speed.startswith("[") or data[speed][0] == "speeddata"
    assert len(speeds) == 4 and min(speeds) > 0.0
    zones = data[zone][1] if zone != "fine" else [True] + [0.0] * 6
    assert len(zones) == 7
    run.settings[word] = conf
    run.tool = rapid_pose(data[tool][1][1])
    assert data[tool][0] == "tooldata" and data[tool][1][2][0] > 0.0
    robhold, fixed, mechanical, user, part = data[wobj][1]
    assert (robhold, fixed, mechanical) == (False, True, "")
    run.frame = rapid_pose(user) @ rapid_pose(part)
    rapid = speed in ("vStart", "vRapid")
    run.point(word, [x, y, z], quaternion(*turn), speeds[0] * 60.0, rapid, zones[1])


# --- Fanuc ---


def read_ls(files, name):
    """Run a listing and those that it calls; counts, numbers of lines and positions must agree."""
    run = RobotRun()
    ls_run(files, name, run, {})
    return run


LS_POSITION = re.compile(
    rf"P\[([0-9]+)\]\{{\n   GP1:\n    UF : ([0-9]+), UT : ([0-9]+),        CONFIG : '([^']*)',\n"
    rf"    X = ({NUMBER})  mm,    Y = ({NUMBER})  mm,    Z = ({NUMBER})  mm,\n"
    rf"    W = ({NUMBER}) deg,    P = ({NUMBER}) deg,    R = ({NUMBER}) deg\n\}};\n"
)
LS_MOVE = re.compile(r"([JL]) P\[([0-9]+)\] ([0-9]+)(%|mm/sec|cm/min) (FINE|CNT[0-9]+|CD[0-9]+)    ;")


def ls_run(files, name, run, chosen):
    text = text_of(files[f"{name}.ls"], "\r\n")
    head, main, positions = re.fullmatch(r"(.*)\n/APPL\n/MN\n(.*)/POS\n(.*)/END\n", text, re.DOTALL).groups()
    assert head.startswith(f"/PROG  {name}\n/ATTR\n") and re.fullmatch(r"[A-Z][A-Z0-9_]{0,35}", name)
    lines = main.splitlines()
    assert f"LINE_COUNT  = {len(lines)};" in head
    points = {}
    rest = LS_POSITION.sub(lambda found: points.setdefault(int(found[1]), found.groups()) and "", positions)
    assert rest == "", rest[:200]
    used = set()
    for number, line in enumerate(lines, 1):
        assert line.startswith(f"{number:4}:"), line
        statement = line[5:]
        if move := LS_MOVE.fullmatch(statement):
            used.add(int(move[2]))
            ls_move(move, points[int(move[2])], run, chosen)
            continue
        assert statement.startswith("  ") and statement.endswith(" ;"), line
        statement = statement[2:-2].rstrip()
        if statement.startswith("!"):
            assert len(statement) <= 33 and ";" not in statement
            run.actions.append(("comment", statement[1:]))
        elif call := re.fullmatch(r"CALL (\w+)", statement):
            ls_run(files, call[1], run, chosen)
        elif choice := re.fullmatch(r"(UFRAME|UTOOL)_NUM=([0-9]+)", statement):
            chosen[choice[1]] = int(choice[2])
        elif copy := re.fullmatch(r"PR\[([0-9]+)\]=P\[([0-9]+)\]", statement):
            used.add(int(copy[2]))
            chosen[f"PR{copy[1]}"] = ls_pose(points[int(copy[2])])
        elif frame := re.fullmatch(r"(UFRAME|UTOOL)\[[0-9]+\]=PR\[([0-9]+)\]", statement):
            setattr(run, "frame" if frame[1] == "UFRAME" else "tool", chosen[f"PR{frame[2]}"])
        elif output := re.fullmatch(r"([A-Z]O)\[([0-9]+)\]=(ON|OFF|[0-9]+)", statement):
            assert not run.zones or run.zones[-1] == 0.0
            run.actions.append(("output", (output[1], int(output[2]), output[3])))
        elif wait := re.fullmatch(rf"WAIT +({NUMBER})\(sec\)", statement):
            run.actions.append(("wait", float(wait[1])))
        elif message := re.fullmatch(r"MESSAGE\[([^\[\];']{1,24})\]", statement):
            run.actions.append(("message", message[1]))
        elif statement == "PAUSE":
            run.actions.append(("stop", None))
        elif payload := re.fullmatch(r"PAYLOAD\[([0-9]+)\]", statement):
            run.settings["PAYLOAD"] = int(payload[1])
        else:
            raise AssertionError(f"not a statement: {line!r}")
    assert used == set(points)


def ls_pose(position):
    x, y, z, w, p, r = (float(value) for value in position[4:])
    return pose([x, y, z], zyx(r, p, w))


def ls_move(move, position, run, chosen):
    word, _, speed, unit, ending = move.groups()
    assert int(position[1]) == chosen["UFRAME"] and int(position[2]) == chosen["UTOOL"]
    run.settings["CONFIG"] = position[3]
    rapid = word == "J"
    assert (unit == "%") == rapid and int(speed) >= 1 and (not rapid or not run.tips)
    feed = 0.0 if rapid else int(speed) * {"mm/sec": 60.0, "cm/min": 10.0}[unit]
    T = ls_pose(position)
    zone = 0.0 if ending == "FINE" else float(re.sub("[A-Z]", "", ending))
    run.point(word, T[:3, 3], T[:3, :3], feed, rapid, zone)


# --- Universal Robots ---


UR_POSE = rf"p\[({NUMBER}(?:, {NUMBER}){{5}})\]"
UR_MOVE = re.compile(
    rf"(movej|movel)\((?:pose_trans\((\w+), )?{UR_POSE}\)?, a=({NUMBER}), v=({NUMBER})(?:, r=({NUMBER}))?\)"
)


def ur_pose(text):
    values = [float(value) for value in text.split(", ")]
    return pose(np.array(values[:3]) * 1000.0, Rotation.from_rotvec(values[3:]).as_matrix())


def read_ur(files, name):
    """Run the function of a script; blends must not overlap."""
    lines = text_of(files[f"{name}.script"], "\n").splitlines()
    assert lines[0] == f"def {name}():" and lines[-1] == "end"
    functions, main, inside = {}, [], None
    for line in (line.strip() for line in lines[1:-1]):
        if head := re.fullmatch(r"def (\w+)\(\):", line):
            assert inside is None and head[1] not in functions
            inside = functions[head[1]] = []
        elif line == "end":
            assert inside is not None
            inside = None
        else:
            (main if inside is None else inside).append(line)
    assert inside is None
    run, variables = RobotRun(), {}
    ur_run(functions, main, variables, run)
    steps = np.linalg.norm(np.diff(run.tips, axis=0), axis=1)
    zones = np.array(run.zones)
    assert ((zones[:-1] + zones[1:] < steps) | (zones[:-1] + zones[1:] == 0.0)).all(), "blends overlap"
    return run


def ur_run(functions, lines, variables, run):
    for line in lines:
        if line.startswith("# "):
            run.actions.append(("comment", line[2:]))
        elif move := UR_MOVE.fullmatch(line):
            word, frame, point, _, speed, zone = move.groups()
            T = ur_pose(point)
            run.frame = variables[frame] if frame else np.eye(4)
            rapid = word == "movej"
            feed = 0.0 if rapid else float(speed) * 60_000.0
            assert float(speed) > 0.0 and (not rapid or not run.tips)
            run.point(word, T[:3, 3], T[:3, :3], feed, rapid, float(zone or 0.0) * 1000.0)
        elif call := re.fullmatch(r"(\w+)\(\)", line):
            ur_run(functions, functions[call[1]], variables, run)
        elif assigned := re.fullmatch(rf"global (\w+) = {UR_POSE}", line):
            variables[assigned[1]] = ur_pose(assigned[2])
        elif tcp := re.fullmatch(rf"set_tcp\({UR_POSE}\)", line):
            run.tool = ur_pose(tcp[1])
        elif output := re.fullmatch(r"set_(standard|configurable|tool)_digital_out\(([0-7]), (True|False)\)", line):
            assert not run.zones or run.zones[-1] == 0.0
            run.actions.append(("output", (output[1], int(output[2]), output[3] == "True")))
        elif analog := re.fullmatch(rf"set_standard_analog_out\(([01]), ({NUMBER})\)", line):
            run.actions.append(("analog", (int(analog[1]), float(analog[2]))))
        elif wait := re.fullmatch(rf"sleep\(({NUMBER})\)", line):
            run.actions.append(("wait", float(wait[1])))
        elif re.fullmatch(r'popup\("[^"\\]*", title="Stop", blocking=True\)', line):
            assert not run.zones or run.zones[-1] == 0.0
            run.actions.append(("stop", None))
        elif payload := re.fullmatch(r"set_payload\((.*)\)", line):
            run.settings["payload"] = payload[1]
        else:
            raise AssertionError(f"not a statement: {line!r}")


# --- RoboDK ---


def read_robodk(files):
    (content,) = files.values()
    run = RobotRun()
    for number, row in enumerate(csv.reader(io.StringIO(content.decode("ascii")))):
        x, y, z, w, p, r, index, speed, rapid = map(float, row[:9])
        assert index == number and len(row) == 10
        run.point("row", [x, y, z], zyx(r, p, w), speed * 60.0, rapid == 1.0, 0.0)
    return run
