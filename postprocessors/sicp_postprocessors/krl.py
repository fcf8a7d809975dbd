"""KUKA KRL: NAME.src with the moves and NAME.dat with tool and base, for KSS 5 to 8 (KR C2, KR C4, KR C5).

Facts: KUKA System Software, Expert Programming and KRL syntax (quick guide 8.x). Names have 24 letters at most;
orientations are R = Rz(A) Ry(B) Rx(C) in degrees; $VEL.CP is in m/s; the interpreter runs ahead of the arm until a wait
(WAIT SEC 0). C_DIS leaves the path at $APO.CDIS before the point. Not tried on a controller: the exact limit of lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from sicp_cam.model import EventKind, FloatArray, Program, ToolPath
from sicp_cam.ranges import Between
from sicp_postprocessors.controllers import ControllerOptions, ControllerPostprocessor, labelled, tool_numbers
from sicp_postprocessors.moves import Moves, events_in_order
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.orientations import Six, euler_zyx, pose_from_zyx
from sicp_postprocessors.rows import rows, words

__all__ = ["Krl", "KrlOptions"]

_HEAD = ["&ACCESS RVP", "&REL 1"]
_INI = (
    ";FOLD INI;%{PE}",
    "GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )",
    "INTERRUPT ON 3",
    "BAS (#INITMOV,0 )",
    ";ENDFOLD (INI)",
)
_FOLD = re.compile(r"(?:END)?FOLD", re.IGNORECASE)
_MM_MIN_PER_M_S = 60_000.0
_RESERVED = """
    and anin anout b_and b_exor b_not b_or bool brake case cast_from cast_to ccirc channel char circ circ_rel
    cirr cont confirm const continue copen cpend cread csts_t cwrite decl def defdat deffct default delay
    digin disable do else enable end enddat endfct endfor endif endloop endspline endswitch endwhile enum
    error exit ext extfct external false for frame global goto halt home if import in int interrupt is lin
    lin_rel load loop maximum minimum not off on or out pos e6pos axis e6axis private prio ptp ptp_rel
    ptp_spline public pulse real repeat resume return scirc sec signal slin spl spline spline_rel spls sptp
    sql_stmt state step string struc switch then to tool base trigger true until unit wait when while with
    world bas ir_stopm success part_base part_tool part_load con prn aux nul
    abs acos asin atan2 cos forward inverse inv_pos round sin sqrt tan
"""


@dataclass(frozen=True, slots=True)
class KrlOptions(ControllerOptions):
    """Options of the post `krl`. Outputs are numbers n of $OUT[n]; `pose_angles` = own: A, B, C."""

    pose_angles: Literal["xyz", "own"] = "xyz"
    """How `tool` and `cell` are turned: R = Rx Ry Rz, or `own`: A, B, C, R = Rz(A) Ry(B) Rx(C)."""
    tool_number: Annotated[int | None, Between(1, 128)] = None
    """Take tool and load from the controller's TOOL_DATA and LOAD_DATA of this number, in place of `tool`."""
    base_number: Annotated[int | None, Between(1, 128)] = None
    """Take the scan frame from the controller's BASE_DATA of this number, in place of `cell`."""
    status: Annotated[int | None, Between(0, 31)] = None
    """S of the first point, as the pendant shows it there; without it the arm keeps its configuration."""
    turn: Annotated[int | None, Between(0, 63)] = None
    """T of the first point; goes with `status`."""
    rotation_deg_s: Annotated[float, Between(0.1, 2000.0)] = 200.0
    """Limit of the tool's turning ($VEL.ORI1, $VEL.ORI2); a move that reaches it is slower than its feed."""
    accel_m_s2: Annotated[float | None, Between(0.01, 50.0)] = None
    """Acceleration along the path ($ACC.CP); the controller's own if left out."""
    advance: Annotated[int, Between(1, 5)] = 5
    """Moves that the interpreter runs ahead of the arm ($ADVANCE)."""
    split: Literal["subprograms", "files"] = "subprograms"
    """Parts of a long path as subprograms of the one file, or as files NAME_001.src ... with data that are GLOBAL."""
    angle_decimals: Annotated[int, Between(3, 7)] = 5
    """Decimals of angles in degrees."""

    signal = re.compile(r"[1-9][0-9]{0,3}")
    signal_words = "the number n of $OUT[n], 1 to 9999"
    analog = re.compile(r"[1-9]|[12][0-9]|3[0-2]")
    analog_words = "the number n of $ANOUT[n], 1 to 32"

    def problems(self) -> list[str]:
        """Return what does not go together, one line each."""
        problems = ControllerOptions.problems(self)
        problems += [*self.one_of("tool_number", "tool"), *self.one_of("tool_number", "payload")]
        problems += self.one_of("base_number", "cell")
        if (self.status is None) != (self.turn is None):
            problems.append("options 'status' and 'turn' belong together; give both")
        return problems

    @property
    def tool_is_known(self) -> bool:
        """Whether the user says what the tool is."""
        return self.tool is not None or self.tool_number is not None

    @property
    def cell_is_known(self) -> bool:
        """Whether the user says where the scan frame is."""
        return self.cell is not None or self.base_number is not None


class Krl(ControllerPostprocessor):
    """KRL: PTP to the first point, LIN to each other one; $BASE and $TOOL as data that the operator can see."""

    name = "krl"
    summary = "KUKA KRL program: NAME.src and NAME.dat, long paths in parts"
    Options = KrlOptions
    options: KrlOptions
    suffix = ".src"
    line_end = "\r\n"
    longest_name = 24
    convention = "mm and degrees, R = Rz(A) Ry(B) Rx(C)"
    reserved = frozenset(_RESERVED.split())
    largest_mm_s = 3000.0
    largest_analog = 1.0
    modal_speed = True
    modal_zone = True

    # --- words ---

    def comment(self, text: str) -> str:
        """Return a comment that opens no fold."""
        return f"; {'- ' if _FOLD.match(text) else ''}{text.replace('%{', '% {')}"

    def wait(self) -> Iterator[str]:
        """Return what holds the interpreter until the arm is there."""
        yield "WAIT SEC 0"

    def switch(self, signal: str, on: bool) -> Iterator[str]:
        """Return the assignment of an output."""
        yield f"$OUT[{signal}]={'TRUE' if on else 'FALSE'}"

    def analog(self, output: str, value: float) -> Iterator[str]:
        """Return the assignment of an analog output, -1 to 1."""
        yield f"$ANOUT[{output}]={trimmed(value, 6)}"

    def delay(self, seconds: float) -> Iterator[str]:
        """Return a pause."""
        yield f"WAIT SEC {trimmed(seconds, 3)}"

    def operator(self, text: str) -> Iterator[str]:
        """Return a stop that the start key ends."""
        yield "HALT"

    def setup(self, program: Program) -> Iterator[str]:
        """Initialise motion, and state everything that the path relies on."""
        options = self.options
        yield from _INI
        yield f"BAS (#VEL_PTP,{trimmed(options.joint_percent, 1)})"
        yield f"$ADVANCE={options.advance}"
        yield "$ORI_TYPE=#VAR"
        yield f"$VEL.ORI1={trimmed(options.rotation_deg_s, 3)}"
        yield f"$VEL.ORI2={trimmed(options.rotation_deg_s, 3)}"
        if options.accel_m_s2 is not None:
            yield f"$ACC.CP={trimmed(options.accel_m_s2, 4)}"

    def frame(self, program: Program) -> Iterator[str]:
        """Choose the base: that of the data file, or the controller's."""
        number = self.options.base_number
        yield "$BASE=PART_BASE" if number is None else f"BAS (#BASE,{number})"

    def tool(self, number: int, text: str, *, first: bool) -> Iterator[str]:
        """Choose the tool: that of the data file, or the controller's."""
        if not first:
            yield from self.comments(f"tool {number} {text}")
        if self.options.tool_number is not None:
            yield f"BAS (#TOOL,{self.options.tool_number})"
            return
        yield f"$TOOL={_tool_name(number)}"
        if self.options.payload is not None:
            yield "$LOAD=PART_LOAD"

    def speed(self, feed_mm_min: float) -> Iterator[str]:
        """State the speed along the path in m/s."""
        yield f"$VEL.CP={trimmed(max(feed_mm_min / _MM_MIN_PER_M_S, 1e-8), 8)}"

    def zone(self, radius_mm: float) -> Iterator[str]:
        """State the distance of approximation, where there is one: moves without C_DIS come to rest."""
        if radius_mm > 0.0:
            yield f"$APO.CDIS={trimmed(radius_mm, 6)}"

    def targets(self, program: Program) -> FloatArray:
        """Return A, B, C (n, 3) in degrees."""
        return euler_zyx(self.rotations(program.path))

    def move_joint(self, moves: Moves) -> list[str]:
        """Return the move to the first point, axis by axis."""
        status, turn = self.options.status, self.options.turn
        return rows(f"PTP {{{{{self._pose()}{{}}}}}}", *_columns(moves), words([_state(status, turn)] * len(moves)))

    def move_linear(self, moves: Moves) -> list[str]:
        """Return straight moves; those with a zone run on."""
        passed = np.where(moves.zones_mm > 0.0, b" C_DIS", b"")
        return rows(f"LIN {{{{{self._pose()}}}}}{{}}", *_columns(moves), passed)

    def _pose(self) -> str:
        """Return the template of a point without its braces."""
        d, a = self.options.decimals, self.options.angle_decimals
        return f"X {{:.{d}}},Y {{:.{d}}},Z {{:.{d}}},A {{:.{a}}},B {{:.{a}}},C {{:.{a}}}"

    # --- files ---

    def own_pose(self, six: Six) -> FloatArray:
        """Return the pose of x, y, z, A, B, C."""
        return pose_from_zyx(six)

    def frame_words(self) -> str:
        """Return the base in the words of the controller."""
        number = self.options.base_number
        return "the base" if number is None else f"BASE_DATA[{number}]"

    def payload_is_known(self) -> bool:
        """Say whether the load is stated, or comes with the controller's tool."""
        return self.options.payload is not None or self.options.tool_number is not None

    def program_files(self, program: Program, name: str) -> dict[str, bytes]:
        """Return NAME.src, NAME.dat, and the parts."""
        bodies = self.bodies(program)
        names = self.part_names(name, len(bodies))
        calls = [f"{part}( )" for part in names] or bodies[0]
        main = [*_HEAD, f"DEF {name}( )", *self.opening(program), *calls, *self.closing(program), "END"]
        parts = {part: [f"DEF {part}( )", *body, "END"] for part, body in zip(names, bodies, strict=False)}
        files = {f"{name}.src": main, f"{name}.dat": self._data(program, name)}
        if self.options.split == "files":
            files |= {f"{part}.src": [*_HEAD, *lines] for part, lines in parts.items()}
        else:
            main += [line for lines in parts.values() for line in lines]
        return {file: self.encoded(lines) for file, lines in files.items()}

    def _data(self, program: Program, name: str) -> list[str]:
        options = self.options
        # Parts in files of their own see the data of this one only where they are global.
        in_files = options.split == "files" and len(self.parts(program.path)) > 1
        declared = "DECL GLOBAL" if in_files else "DECL"
        lines = [*_HEAD, f"DEFDAT {name} PUBLIC", "EXT BAS (BAS_COMMAND :IN,REAL :IN )", "DECL INT SUCCESS"]
        if options.base_number is None:
            lines += [f"{declared} FRAME PART_BASE={_frame(self.pose_in_world(program))}"]
        if options.tool_number is None:
            tools = dict.fromkeys(map(_tool_name, _tools_told(program.path)))
            lines += [f"{declared} FRAME {tool}={_frame(self.tool_in_flange())}" for tool in tools]
        if options.payload is not None:
            mass, *centre = options.payload
            place = labelled((*centre, 0.0, 0.0, 0.0), "XYZABC")
            lines += [f"{declared} LOAD PART_LOAD={{M {trimmed(mass, 3)},CM {{{place}}},J {{X 0,Y 0,Z 0}}}}"]
        return [*lines, "ENDDAT"]


def _columns(moves: Moves) -> list[FloatArray]:
    return [*moves.tips_mm.T, *moves.targets.T]


def _state(status: int | None, turn: int | None) -> str:
    return "" if status is None else f",S {status},T {turn}"


def _tools_told(path: ToolPath) -> list[int]:
    """Return the tools that the program chooses, also where no move follows."""
    told = [int(event.value) for event in events_in_order(path) if event.kind is EventKind.TOOL]
    return [*tool_numbers(path), *told]


def _tool_name(number: int) -> str:
    return f"PART_TOOL_{number}" if number >= 0 else "PART_TOOL"


def _frame(pose: FloatArray) -> str:
    angles = euler_zyx(pose[None, :3, :3])[0]
    return f"{{{labelled((*pose[:3, 3].tolist(), *angles.tolist()), 'XYZABC', 9)}}}"
