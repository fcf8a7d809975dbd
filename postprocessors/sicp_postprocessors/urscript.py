"""Universal Robots script: NAME.script, for CB3 and e-Series controllers (PolyScope 3 and 5).

Facts: Universal Robots, The URScript Programming Language; and the user manuals on blends. Poses are p[x,y,z,rx,ry,rz]
in metres with a rotation vector in radians; speeds are m/s; a move with r = 0 ends before the next statement runs.
Blends must not overlap: two neighbouring radii are together shorter than the way between their points. The frame stands
in one variable, and each point is pose_trans of it, so that the operator sees the correction by itself. Not known: the
longest name, and how large a script may be.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from sicp_cam.model import FloatArray, Program, ToolPath
from sicp_cam.ranges import Between
from sicp_cam.rigid_motion import apply, from_parts
from sicp_postprocessors.controllers import ControllerOptions, ControllerPostprocessor
from sicp_postprocessors.moves import Moves
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.orientations import Six, rotation_vectors
from sicp_postprocessors.robot import stop_words
from sicp_postprocessors.rows import rows
from sicp_postprocessors.text import ascii_line

__all__ = ["UrScript", "UrScriptOptions"]

_SIGNAL = re.compile(r"(?:(standard|configurable|tool)_)?([0-7])")
_ANALOG = re.compile(r"(?:standard_)?([01])")
_FEATURE = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
_JOINT_RAD_S = np.pi
_APART = 0.98
_SMALLEST_BLEND_MM = 0.01
_LONGEST_MESSAGE = 100
_RESERVED = """
    and break continue def elif else end enter_critical exit_critical false for global halt if join kill local
    mod not or return run sec switch case default thread true while xor movej movel movep movec servoj servoc
    speedj speedl popup sleep sync textmsg set_tcp set_payload pose_trans part_frame p con prn aux nul
    acos asin atan atan2 ceil cos d2r floor force get_forward_kin get_inverse_kin interpolate_pose length log norm pow
    pose_add pose_dist pose_inv pose_sub r2d random sin sqrt stopj stopl str_len tan to_num to_str wait_for_home
"""


@dataclass(frozen=True, slots=True)
class UrScriptOptions(ControllerOptions):
    """Options of the post `ur`. Outputs are 3, configurable_3 or tool_0; `pose_angles` = own: a rotation vector."""

    pose_angles: Literal["xyz", "own"] = "xyz"
    """How `tool` and `cell` are turned: R = Rx Ry Rz, or `own`: a rotation vector in radians."""
    installation_tcp: bool = False
    """Take tool and payload as the installation has them, in place of `tool` and `payload`."""
    feature: str = ""
    """Take the scan frame from this variable, such as a feature of the installation, in place of `cell`."""
    points: Literal["frame", "base"] = "frame"
    """Points in the frame, by pose_trans; or all numbers in the base."""
    accel_m_s2: Annotated[float, Between(0.01, 50.0)] = 1.2
    """Acceleration of straight moves (a)."""
    joint_accel_rad_s2: Annotated[float, Between(0.01, 50.0)] = 1.4
    """Acceleration of the move to the first point."""
    angle_decimals: Annotated[int, Between(5, 9)] = 7
    """Decimals of rotation vectors in radians."""

    signal = _SIGNAL
    signal_words = "an output such as 3, standard_3, configurable_3 or tool_0"
    analog = _ANALOG
    analog_words = "0 or 1, of the standard analog outputs"

    def problems(self) -> list[str]:
        """Return what does not go together, one line each."""
        problems = ControllerOptions.problems(self)
        for option, other in (("installation_tcp", "tool"), ("installation_tcp", "payload"), ("feature", "cell")):
            if getattr(self, option) and getattr(self, other) is not None:
                problems.append(f"options {option!r} and {other!r} say the same thing twice; give one of them")
        if self.feature and not _FEATURE.fullmatch(self.feature):
            problems.append("option 'feature' must be a name of letters, digits and _")
        if self.feature and self.points == "base":
            problems.append("option 'points' = base needs the cell in numbers; leave 'feature' out")
        return problems

    @property
    def tool_is_known(self) -> bool:
        """Whether the user says what the tool is."""
        return self.tool is not None or self.installation_tcp

    @property
    def cell_is_known(self) -> bool:
        """Whether the user says where the scan frame is."""
        return self.cell is not None or bool(self.feature)


class UrScript(ControllerPostprocessor):
    """Script: one function with movej to the first point and movel to each other one; parts are functions within it."""

    name = "ur"
    summary = "Universal Robots script NAME.script, long paths in functions"
    Options = UrScriptOptions
    options: UrScriptOptions
    largest_mm_s = 5000.0
    largest_analog = 1.0
    suffix = ".script"
    longest_name = 40
    reserved = frozenset(_RESERVED.split())
    convention = "metres and rotation vectors in radians"

    # --- words ---

    def comment(self, text: str) -> str:
        """Return a comment."""
        return f"# {text}"

    def wait(self) -> Iterator[str]:
        """Return nothing: the move before, without a blend, has ended."""
        yield from ()

    def switch(self, signal: str, on: bool) -> Iterator[str]:
        """Return the call that switches an output."""
        match = _SIGNAL.fullmatch(signal)
        kind, number = (match[1] or "standard", match[2]) if match else ("standard", signal)
        yield f"set_{kind}_digital_out({number}, {on})"

    def analog(self, output: str, value: float) -> Iterator[str]:
        """Return the call that sets an analog output, from 0 to 1."""
        yield f"set_standard_analog_out({output.removeprefix('standard_')}, {trimmed(value, 6)})"

    def delay(self, seconds: float) -> Iterator[str]:
        """Return a pause."""
        yield f"sleep({trimmed(seconds, 3)})"

    def operator(self, text: str) -> Iterator[str]:
        """Return a message that holds the program until the operator lets it go on."""
        told = ascii_line(stop_words(text), drop='"\\')[:_LONGEST_MESSAGE].strip()
        yield f'popup("{told}", title="Stop", blocking=True)'

    def setup(self, program: Program) -> Iterator[str]:
        """State the tool and the payload."""
        if self.options.installation_tcp:
            return
        yield f"set_tcp({_pose(self.tool_in_flange())})"
        if self.options.payload is not None:
            mass, *centre = self.options.payload
            yield f"set_payload({trimmed(mass, 4)}, [{', '.join(trimmed(value / 1000.0, 6) for value in centre)}])"

    def frame(self, program: Program) -> Iterator[str]:
        """State the pose of the program frame in the base."""
        if self.options.points == "frame" and not self.options.feature:
            yield f"global part_frame = {_pose(self.pose_in_world(program))}"

    def zones_mm(self, path: ToolPath) -> FloatArray:
        """Return blend radii that do not touch each other, in whole micrometres."""
        zones = np.floor(ControllerPostprocessor.zones_mm(self, path) * _APART * 1000.0) / 1000.0
        return np.where(zones < _SMALLEST_BLEND_MM, 0.0, zones)

    def targets(self, program: Program) -> FloatArray:
        """Return x, y, z in metres and a rotation vector (n, 6), in the frame or in the base."""
        tips, R = program.path.tips_mm, self.rotations(program.path)
        if self.options.points == "base":
            pose = self.pose_in_world(program)
            tips, R = apply(pose, tips), pose[:3, :3] @ R
        return np.column_stack([tips / 1000.0, rotation_vectors(R)])

    def move_joint(self, moves: Moves) -> list[str]:
        """Return the move to the first point, joint by joint."""
        options = self.options
        speed = trimmed(options.joint_percent / 100.0 * _JOINT_RAD_S, 4)
        return rows(f"movej({self._point()}, a={trimmed(options.joint_accel_rad_s2, 4)}, v={speed})", *moves.targets.T)

    def move_linear(self, moves: Moves) -> list[str]:
        """Return straight moves."""
        template = f"movel({self._point()}, a={trimmed(self.options.accel_m_s2, 4)}, v={{:.7t}}, r={{:.6t}})"
        return rows(template, *moves.targets.T, moves.feeds_mm_min / 60_000.0, moves.zones_mm / 1000.0)

    def _point(self) -> str:
        d, a = self.options.decimals + 3, self.options.angle_decimals
        point = f"p[{', '.join([f'{{:.{d}}}'] * 3 + [f'{{:.{a}}}'] * 3)}]"
        return point if self.options.points == "base" else f"pose_trans({self._frame_variable()}, {point})"

    def _frame_variable(self) -> str:
        return self.options.feature or "part_frame"

    # --- files ---

    def own_pose(self, six: Six) -> FloatArray:
        """Return the pose of x, y, z in mm and a rotation vector in radians."""
        return from_parts(Rotation.from_rotvec(six[3:]).as_matrix(), six[:3])

    def frame_words(self) -> str:
        """Return the variable of the frame."""
        return self.options.feature or ("part_frame" if self.options.points == "frame" else "the frame")

    def payload_is_known(self) -> bool:
        """Say whether the payload is stated, or comes with the installation."""
        return self.options.payload is not None or self.options.installation_tcp

    def remarks(self, program: Program) -> Iterator[str]:
        """Return how the points are meant."""
        yield from ControllerPostprocessor.remarks(self, program)
        if self.options.points == "base":
            yield "all points are in the base"

    def reading(self) -> Mapping[str, object] | str:
        """Say that points in the base are not those of the program frame."""
        return {} if self.options.points == "frame" else "the points are in the base, not in the program frame"

    def program_files(self, program: Program, name: str) -> dict[str, bytes]:
        """Return NAME.script."""
        bodies = self.bodies(program)
        names = self.part_names(name, len(bodies))
        lines = [f"def {name}():", *(f"  {line}" for line in self.opening(program))]
        for part, body in zip(names, bodies, strict=False):
            lines += [f"  def {part}():", *(f"    {line}" for line in body), "  end"]
        calls = [f"{part}()" for part in names] or bodies[0]
        lines += [*(f"  {line}" for line in (*calls, *self.closing(program))), "end"]
        return {f"{name}.script": self.encoded(lines)}


def _pose(pose: FloatArray) -> str:
    vector = rotation_vectors(pose[None, :3, :3])[0]
    return f"p[{', '.join(trimmed(value, 9) for value in (*(pose[:3, 3] / 1000.0).tolist(), *vector.tolist()))}]"
