"""Stäubli VAL3: an application folder for CS8C (s7) and CS9 (s8) controllers.

The rigid part of a correction can stay in the frame `fPart`, where the operator sees it; the points then hold the rest.
"""

from __future__ import annotations

import re

from sicp_cam.findings import Finding, Level
from sicp_cam.model import EventKind, FloatArray, Program
from sicp_postprocessors.base import Postprocessor, failures, head_remarks
from sicp_postprocessors.checks import event_findings, first_move_findings, frame_name, in_scan_frame, name_findings
from sicp_postprocessors.numbers import LARGEST, trimmed
from sicp_postprocessors.options import flag
from sicp_postprocessors.text import ascii_name
from sicp_postprocessors.val3_code import (
    closing,
    comments,
    event_statements,
    event_variables,
    move_statements,
    programs_of,
    stopping,
    tool_names,
)
from sicp_postprocessors.val3_findings import (
    axis_findings,
    cell_findings,
    flange_findings,
    spindle_findings,
    stop_findings,
    tool_findings,
)
from sicp_postprocessors.val3_motion import motion_of, path_angles
from sicp_postprocessors.val3_options import Six, Val3Options
from sicp_postprocessors.val3_poses import pose_from_six, six_from_pose
from sicp_postprocessors.val3_xml import Variable, data_file, program_file, project_file

__all__ = ["Val3", "Val3Options", "application_name"]

_LONGEST_NAME = 15
_ZERO: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
# The language's own words, and the names that Windows keeps for devices: the folder is copied with it.
_RESERVED = re.compile(
    r"begin|end(if|for|while|switch)?|if|then|else(if)?|for|to|step|do|while|until|switch|case|default|break|call|return"
    r"|and|or|xor|not|true|false|world|flange|start|stop|global|void|num|bool|string|dio|aio|sio|frame|tool|trsf"
    r"|(point|joint)(rx|rs)?|mdesc|config|con|prn|aux|nul|(com|lpt)[1-9]",
    re.IGNORECASE,
)


class Val3(Postprocessor):
    """VAL3 application: project, data, `start`, `stop`, and further programs where the path is long.

    One `pointRx` for each move, in the frame `fPart`; straight moves at the feed of the path; outputs after the arm has
    come to rest. Only instructions that CS8C and CS9 share.
    """

    name = "val3"
    summary = "Staubli VAL3 application folder (s7 XML) for CS8C and CS9 controllers"
    Options = Val3Options
    options: Val3Options

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, and what the operator must set or know before the robot moves."""
        findings = super().preflight(program)
        if failures(findings):
            return findings
        path, options = program.path, self.options
        angles_deg = path_angles(path, options)
        findings += [
            *name_findings(program, application_name(program.name)),
            *first_move_findings(path),
            *event_findings(path.events, {EventKind.OTHER}, "it is a word of another controller"),
            *cell_findings(path, options, self.name),
            *spindle_findings(path, options, self.name),
            *tool_findings(path, self.name),
            *axis_findings(path, angles_deg),
            *flange_findings(path, angles_deg, self.name),
            *stop_findings(path, options, self.name),
        ]
        if not abs(self._world_program(program)[:3, 3]).max() <= LARGEST:
            words = flag(self.name, "cell", "x,y,z,rx,ry,rz")
            findings.append(Finding(605, Level.FAIL, f"the frame fPart lies beyond {LARGEST:g} mm; check {words}"))
        return findings

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the application folder."""
        application = application_name(program.name)
        motion = motion_of(program.path, self.options)
        tools = tool_names(program.path)
        programs = self._programs(program, move_statements(motion, tools))
        variables = [
            Variable("fPart", "frame", [_pose(six_from_pose(self._world_program(program)), "world[0]")]),
            *self._tools(tools),
            *event_variables(program.path, self.options),
            *motion.variables,
        ]
        files = {f"{name}.pgx": program_file(name, code) for name, code in programs.items()}
        data = f"{application}.dtx"
        files |= {
            f"{application}.pjx": project_file(self.options.version, files, data),
            data: data_file(variables),
        }
        return {f"{application}/{file}": content for file, content in sorted(files.items())}

    def _programs(self, program: Program, moves: list[str]) -> dict[str, list[str]]:
        """Return the statements of every program by its name, start and stop among them."""
        path = program.path
        events = event_statements(path, self.options)
        stretches = programs_of(path.rapid, self.options.max_moves_per_program)
        bodies = []
        for stretch in stretches:
            body = [line for i in stretch for line in (*events.get(i, []), moves[i])]
            bodies.append(body + (events.get(len(path), []) if stretch.stop == len(path) else []))
        # What an aborted run left in the motion queue must not move the arm now.
        head = [*self._head(program), "resetMotion()"]
        if len(bodies) == 1:
            return {"start": [*head, *bodies[0], *closing(path)], "stop": stopping(path)}
        parts = {f"move{number:03d}": body for number, body in enumerate(bodies)}
        calls = [f"call {name}()" for name in parts]
        return {"start": [*head, *calls, *closing(path)], "stop": stopping(path), **parts}

    def _head(self, program: Program) -> list[str]:
        options = self.options
        remarks = [
            *head_remarks(program),
            self._frame_remark(program),
            self._world_remark(),
            "points: mm and degrees, R = Rx Ry Rz, in frame fPart; tool Z points out of the flange into the work",
        ]
        if options.blends:
            reach, off = trimmed(options.blend_mm, 6), trimmed(options.blend_corner_mm, 6)
            remarks.append(f"points between cuts are blended: within {reach} mm, corners cut by {off} mm at most")
        if options.first_run:
            speed = trimmed(options.first_run_mm_s, 3)
            remarks.append(f"first run: no blending, no move faster than {speed} mm/s")
        return [line for remark in remarks for line in comments(remark)]

    def _frame_remark(self, program: Program) -> str:
        """Return what fPart is the pose of: the scan frame, or the part in it where the points keep its coordinates."""
        if self.options.cell is None:
            pose = f"the {frame_name(program)} frame" if in_scan_frame(program) else "the part in the scan frame"
            taken = f"the {'scan' if program.corrected else 'path'} frame"
            return f"fPart is the pose of {pose}; no cell is given, so {taken} is taken as the robot's world"
        if in_scan_frame(program):
            return f"fPart is the pose of the {frame_name(program)} frame in the robot's world: the option cell"
        return "fPart is the pose of the part in the robot's world: the option cell times its pose in the scan frame"

    def _world_remark(self) -> str:
        """Return where the world's origin lies, and from where the given cell was measured."""
        options, world = self.options, "the robot's world is at the shoulder (axes 1 and 2), not on the base plate"
        if options.world_origin == "base_plate":
            pose = "the scan frame is taken to lie there" if options.cell is None else "cell was measured from there"
            height = trimmed(options.shoulder_height_mm, 3)
            return f"{world}, which is {height} mm below; {pose}, and fPart is shifted by that"
        return world if options.cell is None else f"{world}; cell was measured from the shoulder"

    def _world_program(self, program: Program) -> FloatArray:
        """Return the pose of the program frame in VAL3's world, whose origin is the shoulder."""
        pose = pose_from_six(self.options.cell or _ZERO) @ program.T_scan_program
        pose[2, 3] -= self.options.shoulder_height_mm
        return pose

    def _tools(self, names: list[str]) -> list[Variable]:
        # Every VAL3 tool names an output for a gripper; valve1 is the one that each controller has.
        pose = _pose(self.options.tool or _ZERO, "flange[0]") | {"ioLink": "valve1"}
        return [Variable(name, "tool", [pose]) for name in dict.fromkeys(names)]


def application_name(name: str) -> str:
    """Return a program name as VAL3 takes it for an application: 15 letters and digits, a letter first.

    >>> application_name("trim_porthole-left side 2"), application_name("start")
    ('trimportholelef', 'startApp')
    """
    plain = ascii_name(name, _LONGEST_NAME)
    return f"{plain}App" if _RESERVED.fullmatch(plain) else plain


def _pose(six: tuple[float, ...], father: str) -> dict[str, str]:
    decimals = (6, 6, 6, 9, 9, 9)
    names = ("x", "y", "z", "rx", "ry", "rz")
    values = {name: trimmed(v, d) for name, v, d in zip(names, six, decimals, strict=True)}
    return values | {"fatherId": father}
