"""ABB RAPID: a module NAME.mod with tool, work object, speeds, zones and moves, for RobotWare 5 to 7.

Facts: ABB, Technical reference manual, RAPID kernel; and RAPID instructions, functions and data types. Names have 32
letters at most; a robtarget is [[x,y,z],[q1..q4],[cf1,cf4,cf6,cfx],[six external axes]], quaternions scalar first, 9E9
for no axis; speeddata are [tip mm/s, turning degrees/s, ...]; zonedata are [stop?, tip mm, turning mm, external mm,
turning degrees, ...], here in the proportions of z1. The work object holds two poses: the cell as user frame, and the
pose of the program frame in the scan frame as object frame, so that the operator sees the correction by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sicp_cam.model import BoolArray, FloatArray, IntArray, Program, ToolPath
from sicp_postprocessors.controllers import ControllerPostprocessor, tool_numbers
from sicp_postprocessors.moves import Moves
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.orientations import Six, pose_from_zyx, quaternions
from sicp_postprocessors.rapid_options import RapidOptions
from sicp_postprocessors.robot import ZERO, stop_words
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.text import ascii_line

__all__ = ["Rapid", "RapidOptions"]

Names: TypeAlias = npt.NDArray[np.bytes_]

_NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
_NO_LOAD = "[0.001,[0,0,0.001],[1,0,0,0],0,0,0]"
_LONGEST_MESSAGE = 40
_MOST_SPEEDS = 100
"""More different speeds than that are written into the moves."""
_PROPORTIONS = (1.0, 1.0, 1.0, 0.1, 1.0, 0.1)
"""Zones of tip, turning (mm), external axes, turning (degrees), linear and turning axes, for each mm of the tip."""
_RESERVED = """
    alias and backward case connect const default div do else elseif endfor endfunc endif endmodule endproc endrecord
    endtest endtrap endwhile error exit false for from func goto if inout local mod module nostepin not noview or pers
    proc raise readonly record retry return step sysmodule task test then to trap true trynext undo until var viewonly
    while with xor main user base num bool string pos orient pose robtarget jointtarget speeddata zonedata tooldata
    wobjdata loaddata confdata extjoint offs reltool stop set reset waittime waitrob movej movel movec moveabsj wpart
    ttool tool0 wobj0 load0 fine con prn aux nul
"""


class Rapid(ControllerPostprocessor):
    """RAPID: MoveJ to the first point, MoveL to each other one; tool and work object are data of the module."""

    name = "rapid"
    summary = "ABB RAPID module NAME.mod, long paths in procedures or modules with NAME.pgf"
    Options = RapidOptions
    options: RapidOptions
    suffix = ".mod"
    line_end = "\r\n"
    longest_name = 31  # of 32: the procedure of a part has one letter more than its module
    reserved = frozenset(_RESERVED.split())
    largest_mm_s = 7000.0
    convention = "mm and quaternions, scalar first"

    def frame_words(self) -> str:
        """Return the name of the work object."""
        return self.options.wobj_name or "wPart"

    # --- words ---

    def comment(self, text: str) -> str:
        """Return a comment."""
        return f"! {text}"

    def wait(self) -> Iterator[str]:
        r"""Return the wait for the arm to stand at its stop point."""
        yield "WaitRob \\InPos;"

    def switch(self, signal: str, on: bool) -> Iterator[str]:
        """Return the setting of an output."""
        yield f"SetDO {signal},{int(on)};"

    def analog(self, output: str, value: float) -> Iterator[str]:
        """Return the setting of an analog output."""
        yield f"SetAO {output},{trimmed(value, 6)};"

    def delay(self, seconds: float) -> Iterator[str]:
        """Return a pause."""
        yield f"WaitTime {trimmed(seconds, 3)};"

    def operator(self, text: str) -> Iterator[str]:
        """Return a message on the pendant, and a stop that the start key ends."""
        told = ascii_line(stop_words(text), drop='"\\')[:_LONGEST_MESSAGE].strip()
        yield f'TPWrite "{told}";'
        yield "Stop;"

    def setup(self, program: Program) -> Iterator[str]:
        r"""Let straight moves find their own configuration, and the first one that which is given."""
        yield "ConfL \\Off;"
        yield f"ConfJ \\{'On' if self.options.configuration else 'Off'};"

    def targets(self, program: Program) -> FloatArray:
        """Return quaternions (n, 4), and the numbers of speed and zone of each move, -1 for rapid and fine."""
        path = program.path
        speeds, zones = self._speeds(path)[0], self._zones(path)[0]
        return np.column_stack([quaternions(self.rotations(path)), speeds, zones])

    def move_joint(self, moves: Moves) -> list[str]:
        """Return the move to the first point."""
        return self._moves_as_text("MoveJ", moves, f"[{self.options.configuration or '0,0,0,0'}]", "vStart")

    def move_linear(self, moves: Moves) -> list[str]:
        """Return straight moves."""
        return self._moves_as_text("MoveL", moves, "[0,0,0,0]", "vRapid")

    def _moves_as_text(self, word: str, moves: Moves, configuration: str, rapid: str) -> list[str]:
        d, q = self.options.decimals, self.options.quaternion_decimals
        position, turn = ",".join([f"{{:.{d}}}"] * 3), ",".join([f"{{:.{q}}}"] * 4)
        target = f"[[{position}],[{turn}],{configuration},{_NO_AXES}]"
        names = (
            self._speed_names(moves, rapid),
            _named(
                [f"zCut{number}" for number in range(1 + _largest(moves.targets[:, 5]))], moves.targets[:, 5], "fine"
            ),
            self._tool_names(moves),
        )
        template = f"{word} {target},{{}},{{}},{{}}\\WObj:={self.frame_words()};"
        return rows(template, *moves.tips_mm.T, *moves.targets.T[:4], *names)

    def _speed_names(self, moves: Moves, rapid: str) -> Names:
        """Return the speed of each move: the name of one that is declared, or written out where there are too many."""
        count = 1 + _largest(moves.targets[:, 4])
        if count <= _MOST_SPEEDS:
            return _named([f"vCut{number}" for number in range(count)], moves.targets[:, 4], rapid)
        feeds = (moves.feeds_mm_min / 60.0).tolist()
        cuts = zip(moves.targets[:, 4].tolist(), feeds, strict=True)
        return words([self._speed(feed) if number >= 0 else rapid for number, feed in cuts])

    def _tool_names(self, moves: Moves) -> Names:
        numbers, place = np.unique(moves.tools, return_inverse=True)
        return words([self._tool_name(number) for number in numbers.tolist()])[place]

    # --- data ---

    def own_pose(self, six: Six) -> FloatArray:
        """Return the pose of x, y, z, EZ, EY, EX: R = Rz Ry Rx."""
        return pose_from_zyx(six)

    def payload_is_known(self) -> bool:
        """Say whether the load is stated, or comes with the controller's tool."""
        return self.options.payload is not None or bool(self.options.tool_name)

    def _data(self, program: Program) -> Iterator[str]:
        path, options = program.path, self.options
        if not options.tool_name:
            for tool in map(self._tool_name, tool_numbers(path)):
                yield f"PERS tooldata {tool}:=[TRUE,{_pose(self.tool_in_flange())},{self._load()}];"
        if not options.wobj_name:
            frames = f"{_pose(self.pose_of_six(options.cell or ZERO))},{_pose(program.T_scan_program)}"
            yield f'PERS wobjdata wPart:=[FALSE,TRUE,"",{frames}];'
        rapid = min(options.rapid_mm_s, options.fastest_mm_s)
        start = min(rapid, self.largest_mm_s * options.joint_percent / 100.0)
        yield f"CONST speeddata vStart:={self._speed(start)};"
        if path.rapid[1:].any():
            yield f"CONST speeddata vRapid:={self._speed(rapid)};"
        feeds = self._speeds(path)[1].tolist()
        for number, feed in enumerate(feeds if len(feeds) <= _MOST_SPEEDS else ()):
            yield f"CONST speeddata vCut{number}:={self._speed(feed / 60.0)};"
        for number, zone in enumerate(self._zones(path)[1].tolist()):
            yield f"CONST zonedata zCut{number}:=[FALSE,{','.join(trimmed(zone * part, 6) for part in _PROPORTIONS)}];"

    def _load(self) -> str:
        if self.options.payload is None:
            return _NO_LOAD
        mass, *centre = (trimmed(value, 4) for value in self.options.payload)
        return f"[{mass},[{','.join(centre)}],[1,0,0,0],0,0,0]"

    def _speed(self, mm_s: float) -> str:
        return f"[{trimmed(max(mm_s, 1e-4), 4)},{trimmed(self.options.rotation_deg_s, 3)},5000,1000]"

    def _tool_name(self, number: int) -> str:
        return self.options.tool_name or (f"tTool{number}" if number >= 0 else "tTool")

    def _speeds(self, path: ToolPath) -> tuple[IntArray, FloatArray]:
        """Return the number of the speed of each move (n,), -1 for rapid moves, and the feeds."""
        return _numbered(self.feeds_mm_min(path), ~path.rapid & (np.arange(len(path)) > 0))

    def _zones(self, path: ToolPath) -> tuple[IntArray, FloatArray]:
        zones = self.zones_mm(path)
        return _numbered(zones, zones > 0.0)

    # --- files ---

    def program_files(self, program: Program, name: str) -> dict[str, bytes]:
        """Return NAME.mod; and the other modules with NAME.pgf, where parts are modules."""
        bodies, suffix = self.bodies(program), self.options.module_suffix
        names = self.part_names(name, len(bodies))
        first = "main" if self.options.entry == "main" else f"run_{name}"[:32]
        calls = [f"{part}p;" for part in names] or bodies[0]
        routines = {first: [*self.opening(program), *calls, *self.closing(program)]}
        parts = {part: {f"{part}p": body} for part, body in zip(names, bodies, strict=False)}
        if self.options.split == "procedures" or not parts:
            for part in parts.values():
                routines |= part
            return {f"{name}.{suffix}": self._module(name, self._data(program), routines)}
        modules = {name: self._module(name, self._data(program), routines)}
        modules |= {part: self._module(part, (), routine) for part, routine in parts.items()}
        listed = [f"  <Module>{module}.{suffix}</Module>" for module in modules]
        pgf = ['<?xml version="1.0" encoding="ISO-8859-1" ?>', "<Program>", *listed, "</Program>"]
        return {f"{name}.pgf": self.encoded(pgf)} | {f"{module}.{suffix}": text for module, text in modules.items()}

    def _module(self, name: str, data: Iterable[str], routines: Mapping[str, Sequence[str]]) -> bytes:
        lines = [f"MODULE {name}", *(f"  {line}" for line in data)]
        for routine, body in routines.items():
            lines += [f"  PROC {routine}()", *(f"    {line}" for line in body), "  ENDPROC"]
        return self.encoded([*lines, "ENDMODULE"])


def _largest(numbers: FloatArray) -> int:
    return int(numbers.max(initial=-1))


def _named(names: list[str], numbers: FloatArray, other: str) -> Names:
    """Return the names of numbers (n,), and another one for -1."""
    return words([other, *names])[numbers.astype(np.int64) + 1]


def _pose(pose: FloatArray) -> str:
    """Return a (4, 4) pose as [[x,y,z],[q1,q2,q3,q4]]."""
    position = ",".join(trimmed(value, 6) for value in pose[:3, 3].tolist())
    turn = ",".join(trimmed(value, 9) for value in quaternions(pose[None, :3, :3])[0].tolist())
    return f"[[{position}],[{turn}]]"


def _numbered(values: FloatArray, which: BoolArray) -> tuple[IntArray, FloatArray]:
    """Return the number of the value of each row (n,), -1 for those not asked for, and the values in their order."""
    numbers = np.full(len(values), -1, np.int64)
    found, first, inverse = np.unique(values[which], return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    numbers[which] = place[inverse]
    return numbers, found[order]
