"""Fanuc TP programs as listings: NAME.ls, which the controller turns into TP programs (R-30iA, R-30iB, R-30iB Plus).

Facts: FANUC HandlingTool operator's manual; public listings that were loaded into controllers. Orientations are
R = Rz(R) Ry(P) Rx(W) in degrees; L takes mm/sec from 1 to 2000 or cm/min from 1 to 12000, in whole numbers; J takes
percent; CNT rounds corners the more, the faster the arm is, CD by a distance (an option of the controller); outputs
behind FINE switch at the point. A program cannot state a frame by numbers: the values of UFRAME and UTOOL stand in the
head, or the program copies them from positions of its own through a position register. Dates are left out: the
controller sets them. It lists three decimals; public listings have more, here they are four by default.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from sicp_cam.findings import Finding, Level
from sicp_cam.model import BoolArray, FloatArray, Program, ToolPath
from sicp_postprocessors.base import failures
from sicp_postprocessors.checks import stretch_findings
from sicp_postprocessors.controllers import ControllerPostprocessor
from sicp_postprocessors.fanuc_ls_options import FanucLsOptions
from sicp_postprocessors.fanuc_ls_text import frame_values, listing_head, wpr_deg
from sicp_postprocessors.moves import Moves
from sicp_postprocessors.numbers import fixed
from sicp_postprocessors.options import flag
from sicp_postprocessors.orientations import Six, pose_from_zyx
from sicp_postprocessors.robot import stop_words
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.text import ascii_line, ascii_lines

__all__ = ["FanucLs", "FanucLsOptions"]

_LONGEST_REMARK = 32
_LONGEST_MESSAGE = 24
_LONGEST_WAIT_S = 300.0
_FRAMES = ("UFRAME", "UTOOL")
_EXACT = 1e-3
_ROUNDED = 0.01
_RESERVED = "abort call else end endfor endif for if jmp lbl pause run select then wait user mnedit con prn aux nul"


class FanucLs(ControllerPostprocessor):
    """Listing: J to the first point, L to each other one, positions P[n] with the frames they stand in."""

    name = "ls"
    summary = "Fanuc TP listing NAME.ls, long paths in programs that it calls"
    Options = FanucLsOptions
    options: FanucLsOptions
    suffix = ".ls"
    line_end = "\r\n"
    reserved = frozenset(_RESERVED.split())
    largest_mm_s = 2000.0
    convention = "mm and degrees, R = Rz(R) Ry(P) Rx(W)"

    @property
    def longest_name(self) -> int:  # type: ignore[override]
        """Return the letters of a name, by the option."""
        return self.options.longest_name

    # --- words ---

    def comment(self, text: str) -> str:
        """Return a remark."""
        return f"  !{text} ;"

    def comments(self, text: str) -> list[str]:
        """Return text as remarks, which are short."""
        return [self.comment(line) for line in ascii_lines(text.replace(";", ","), width=_LONGEST_REMARK)]

    def wait(self) -> Iterator[str]:
        """Return nothing: the move before ends with FINE."""
        yield from ()

    def switch(self, signal: str, on: bool) -> Iterator[str]:
        """Return the assignment of an output."""
        kind, number = signal[: -len(signal.lstrip("DRO"))] or "DO", signal.lstrip("DRO")
        yield f"  {kind}[{number}]={'ON' if on else 'OFF'} ;"

    def analog(self, output: str, value: float) -> Iterator[str]:
        """Return the assignment of an analog or group output, a whole number."""
        kind, number = output[: -len(output.lstrip("AGO"))] or "AO", output.lstrip("AGO")
        yield f"  {kind}[{number}]={value:.0f} ;"

    def delay(self, seconds: float) -> Iterator[str]:
        """Return a pause, in hundredths."""
        while seconds > 0.0:
            yield f"  WAIT {fixed(min(seconds, _LONGEST_WAIT_S), 2).removeprefix('0'):>6}(sec) ;"
            seconds -= _LONGEST_WAIT_S

    def operator(self, text: str) -> Iterator[str]:
        """Return a message, and a pause that the start key ends."""
        told = ascii_line(stop_words(text), drop="[];'")[:_LONGEST_MESSAGE].strip()
        yield f"  MESSAGE[{told}] ;"
        yield "  PAUSE ;"

    def setup(self, program: Program) -> Iterator[str]:
        """Tell or set the frames, and choose the payload."""
        options = self.options
        if options.frame_register is not None:
            for number, name in enumerate(_FRAMES, 1):
                yield f"  PR[{options.frame_register}]=P[{number}]    ;"
                yield f"  {name}[{getattr(options, name.lower())}]=PR[{options.frame_register}] ;"
        if options.payload_schedule is not None:
            yield f"  PAYLOAD[{options.payload_schedule}] ;"

    def frame(self, program: Program) -> Iterator[str]:
        """Choose the user frame and the tool."""
        yield f"  UFRAME_NUM={self.options.uframe} ;"
        yield f"  UTOOL_NUM={self.options.utool} ;"

    def zones_mm(self, path: ToolPath) -> FloatArray:
        """Return the zones: CD counts whole millimetres."""
        zones = ControllerPostprocessor.zones_mm(self, path)
        return zones if self.options.rounding == "CNT" else np.floor(zones)

    def targets(self, program: Program) -> FloatArray:
        """Return the number of each move's position in its program, and W, P, R in degrees."""
        numbers = np.concatenate([np.arange(len(part)) for part in self.parts(program.path)])
        first = 1 if self.options.frame_register is None else len(_FRAMES) + 1
        return np.column_stack([numbers + first, wpr_deg(self.rotations(program.path))])

    def move_joint(self, moves: Moves) -> list[str]:
        """Return the move to the first point, axis by axis."""
        percent = max(1, min(100, int(self.options.joint_percent)))
        return rows(f"J P[{{:d}}] {percent}% FINE    ;", moves.targets[:, 0])

    def move_linear(self, moves: Moves) -> list[str]:
        """Return straight moves with speed and termination."""
        values, in_mm_s = self._speeds(moves.feeds_mm_min)
        units = np.where(in_mm_s, b"mm/sec", b"cm/min")
        return rows("L P[{:d}] {:d}{} {}    ;", moves.targets[:, 0], values, units, self._endings(moves.zones_mm))

    def _endings(self, zones_mm: FloatArray) -> npt.NDArray[np.bytes_]:
        if self.options.rounding == "CNT":
            return words(["FINE", f"CNT{self.options.cnt}"])[(zones_mm > 0.0).astype(np.int64)]
        whole, place = np.unique(zones_mm.astype(np.int64), return_inverse=True)
        return words([f"CD{zone}" if zone else "FINE" for zone in whole.tolist()])[place]

    def _speeds(self, feeds_mm_min: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return whole numbers (n,), and where they are in mm/sec and not in cm/min; never faster than the feed."""
        mm_s, cm_min = (np.maximum(np.floor(feeds_mm_min / each + 1e-6), 1.0) for each in (60.0, 10.0))
        in_mm_s = np.asarray(np.abs(mm_s * 60.0 - feeds_mm_min) <= _EXACT * feeds_mm_min)
        if self.options.speed_unit != "auto":
            in_mm_s = np.full(len(feeds_mm_min), self.options.speed_unit == "mm/sec")
        return np.where(in_mm_s, mm_s, cm_min), in_mm_s

    # --- files ---

    def program_name(self, program: Program) -> str:
        """Return the name in capitals, as the controller shows it."""
        return ControllerPostprocessor.program_name(self, program).upper()

    def own_pose(self, six: Six) -> FloatArray:
        """Return the pose of x, y, z, W, P, R."""
        x, y, z, w, p, r = six
        return pose_from_zyx((x, y, z, r, p, w))

    def frame_words(self) -> str:
        """Return the user frame."""
        return f"UFRAME[{self.options.uframe}]"

    def payload_is_known(self) -> bool:
        """Say whether a schedule is chosen."""
        return self.options.payload_schedule is not None

    def remarks(self, program: Program) -> Iterator[str]:
        """Return what the frames must hold, and how the points are meant."""
        yield from ControllerPostprocessor.remarks(self, program)
        options = self.options
        if options.cell is not None:
            yield "the world of most arms lies at the height of axis 2"
        for told, name, pose in (
            (options.cell, self.frame_words(), self.pose_in_world(program)),
            (options.tool, f"UTOOL[{options.utool}]", self.tool_in_flange()),
        ):
            if told is not None:
                yield f"{name} {frame_values(pose)}"

    def program_files(self, program: Program, name: str) -> dict[str, bytes]:
        """Return NAME.ls, and the programs that it calls."""
        name = name.upper()
        path, targets, bodies = program.path, self.targets(program), self.bodies(program)
        names = self.part_names(name, len(bodies))
        stretches = [slice(part.start, part.stop) for part in self.parts(path)]
        positions = [self._position_texts(path.tips_mm[s], targets[s], self.options.uframe) for s in stretches]
        calls = [f"  CALL {part}    ;" for part in names] or bodies[0]
        main = [*self.opening(program), *calls, *self.closing(program)]
        files = {name: (main, self._frame_positions(program) + (b"" if names else positions[0]))}
        for part, body, points in zip(names, bodies, positions, strict=False):
            files[part] = ([*self.frame(program), *body], points)
        return {f"{each}.ls": self._listing(each, *content) for each, content in files.items()}

    def _listing(self, name: str, lines: Sequence[str], positions: bytes) -> bytes:
        numbered = [f"{number:4}:{line}" for number, line in enumerate(lines, 1)]
        return (
            self.encoded([*listing_head(name, len(numbered)), *numbered, "/POS"]) + positions + self.encoded(["/END"])
        )

    def _frame_positions(self, program: Program) -> bytes:
        """Return the positions P[1] and P[2] that hold the frames which the program sets."""
        if self.options.frame_register is None:
            return b""
        poses = np.stack([self.pose_in_world(program), self.tool_in_flange()])
        targets = np.column_stack([np.arange(1, len(_FRAMES) + 1), wpr_deg(poses[:, :3, :3])])
        return self._position_texts(poses[:, :3, 3], targets, 0)

    def _position_texts(self, tips_mm: FloatArray, targets: FloatArray, uframe: int) -> bytes:
        """Return entries of /POS, which hold nothing but numbers and are not looked through again."""
        options, d, a = self.options, self.options.decimals, self.options.angle_decimals
        template = (
            f"P[{{:d}}]{{{{\n   GP1:\n    UF : {uframe}, UT : {options.utool},        "
            f"CONFIG : '{options.configuration}',\n"
            f"    X = {{:.{d}}}  mm,    Y = {{:.{d}}}  mm,    Z = {{:.{d}}}  mm,\n"
            f"    W = {{:.{a}}} deg,    P = {{:.{a}}} deg,    R = {{:.{a}}} deg\n}}}};"
        )
        text = "\n".join([*rows(template, targets[:, 0], *tips_mm.T, *targets.T[1:]), ""])
        return text.replace("\n", self.line_end).encode("ascii")

    # --- what is told ---

    def cell_on_controller(self) -> bool:
        """Say whether the user frame is taken to be the scan frame."""
        return self.options.cell is None

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every controller, and those about frames, speeds and corners."""
        findings = super().preflight(program)
        if failures(findings):
            return findings
        return [*findings, *self._set_up_findings(), *self._rounding_findings(program.path)]

    def _set_up_findings(self) -> list[Finding]:
        options = self.options
        if options.frame_register is not None:
            return []
        words = flag(self.name, "frame_register", "N")
        message = (
            f"UFRAME[{options.uframe}] and UTOOL[{options.utool}] are taken as the controller has them; compare them "
            f"with the head of the program, or let the program set them: give tool, cell and {words}"
        )
        return [Finding(671, Level.WARN, message)]

    def _rounding_findings(self, path: ToolPath) -> list[Finding]:
        feeds, options = self.feeds_mm_min(path), self.options
        values, in_mm_s = self._speeds(feeds)
        written = values * np.where(in_mm_s, 60.0, 10.0)
        off = (np.abs(written - feeds) > _ROUNDED * feeds) & (np.arange(len(path)) > 0)
        slow, fast = off & (written < feeds), off & (written > feeds)
        message = "the speed is a whole number and differs by over 1 percent; change the feed, or speed_unit"
        findings = stretch_findings(path, slow, 674, Level.WARN, message)
        message = "the speed is below 1 cm/min or 1 mm/sec, the least that the controller takes; raise the feed"
        findings += stretch_findings(path, fast, 674, Level.FAIL, message)
        if options.configuration == type(options)().configuration:
            words = flag(self.name, "configuration", "TEXT")
            message = (
                f"every point says CONFIG {options.configuration}, as nobody has said otherwise; if the arm stands in "
                f"another one there, give it with {words}"
            )
            findings.append(Finding(676, Level.WARN, message))
        if options.rounding == "CNT" and (self.zones_mm(path) > 0.0).any():
            message = (
                f"corners are rounded by CNT{options.cnt}, which depends on the speed: blend_mm and blend_corner_mm do "
                f"not hold; try it, or lower {flag(self.name, 'cnt', '0')}"
            )
            findings.append(Finding(672, Level.WARN, message))
        return findings
