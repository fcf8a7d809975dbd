"""Where the tool goes: the modal state of a G-code program and the moves, arcs and tool axes of its blocks."""

from __future__ import annotations

import math

from sicp_cam.model import EventKind
from sicp_formats.gcode.axis import axis_from_angles, axis_from_vector
from sicp_formats.gcode.codes import HOMING, MOTION, kept_words, one_of, unknown_m
from sicp_formats.gcode.keywords import TIP_CONTROL_OFF, TIP_CONTROL_ON
from sicp_formats.gcode.machine import Machine
from sicp_formats.gcode.words import Block, GCodeError
from sicp_formats.gcode.work_offset import WorkOffset
from sicp_formats.paths.arcs import Vector, arc_between, centre_for_radius
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList

__all__ = ["MOVING_LETTERS", "Motion"]

_PLANES: dict[float, tuple[Vector, str, str]] = {
    17.0: ((0.0, 0.0, 1.0), "IJ", "K"),
    18.0: ((0.0, 1.0, 0.0), "IK", "J"),
    19.0: ((1.0, 0.0, 0.0), "JK", "I"),
}
_TIP_CONTROL = frozenset({43.4, 43.5, 234.0, 169.0})
_PLANES_OF_ARCS = frozenset(_PLANES)
_DISTANCE = frozenset({90.0, 91.0})
_CENTRE_DISTANCE = frozenset({90.1, 91.1})
_SWITCHED_BY_M = {128.0, 428.0}  # tool tip control of Heidenhain's ISO dialect and of LinuxCNC's sample machines
MOVING_LETTERS = ("X", "Y", "Z", "A", "B", "C", "I", "J", "K", "R", "A3", "B3", "C3")
_RADIUS_TOLERANCE_MM = 0.01


class Motion:
    """Position, tool axis and modes of one program; lengths in mm.

    `mode` is the G code of the motion (None after G80), `position` holds None for an axis that is not known, `angles`
    the rotary angles in degrees. `vector_words` says that I J K state the tool axis, `tip_control` that the control
    keeps the tip in place while the tool turns, `offset` is the work offset.
    """

    __slots__ = (
        "_centre_absolute", "_homed", "_last_feed", "_machine", "_may_lack_feed", "_moves", "_plane", "_rotary",
        "absolute", "angles", "axis", "axis_stated", "mode", "offset", "position", "tip_control", "vector_words",
    )  # fmt: skip

    def __init__(self, moves: MoveList, machine: Machine, rotary: str | None, *, may_lack_feed: bool) -> None:
        self.position: list[float | None] = [None, None, None]
        self.axis: Vector = (0.0, 0.0, 1.0)
        self.mode: float | None = None
        self.absolute = True
        self.offset = WorkOffset()
        self._moves = moves
        self._machine = machine
        self._rotary = rotary
        self._may_lack_feed = may_lack_feed
        self.axis_stated = False
        self.angles = dict.fromkeys("ABC", 0.0)
        self._plane = 17.0
        self._centre_absolute = False
        self.vector_words = False
        self.tip_control = False
        self._homed = False
        self._last_feed = 0.0

    def take_modes(self, block: Block, line: int) -> None:
        """Take the modal codes of a block; codes and keywords that only a control needs become one event."""
        motion = one_of(block, MOTION)
        self.mode = self.mode if motion is None else None if motion == 80.0 else motion
        self._plane = one_of(block, _PLANES_OF_ARCS) or self._plane
        distance, centre = one_of(block, _DISTANCE), one_of(block, _CENTRE_DISTANCE)
        self.absolute = self.absolute if distance is None else distance == 90.0
        self._centre_absolute = self._centre_absolute if centre is None else centre == 90.1
        for code in block.g:
            if code in _TIP_CONTROL or code == 49.0:
                self.vector_words, self.tip_control = code == 43.5, code != 49.0
        if any(keyword.startswith(TIP_CONTROL_ON) for keyword in block.keywords) or _SWITCHED_BY_M & set(block.m):
            self.tip_control = True
        if TIP_CONTROL_OFF in block.keywords:
            self.tip_control = False
        for word in unknown_m(block):
            self._moves.note(Notice.WORD_UNKNOWN, line, word)
        self.offset.take(block, line)
        arc = (self.mode or 0.0) >= 2.0 and any(letter in block.words for letter in "XYZIJK")
        text = kept_words(block, arc=arc)
        if text:
            self._moves.event(EventKind.OTHER, line, 0.0, text)

    def go_home(self, block: Block, line: int) -> None:
        """Forget the axes that go to a machine position, which is not known in the frame of the part."""
        if 28.0 not in block.g and 30.0 not in block.g and self.mode not in (None, 0.0):
            raise GCodeError("a cutting move in machine coordinates (G53); post it in the frame of the part")
        named = [axis for axis, letter in enumerate("XYZ") if letter in block.words] or [0, 1, 2]
        words = [f"{letter}{block.words.pop(letter)}" for letter in "XYZABC" if letter in block.words]
        codes = [f"G{code:g}" for code in block.g if code in HOMING]
        for axis in named:
            self.position[axis] = None
        self._homed = len(self._moves) > 0
        self._moves.note(Notice.HOME_LEFT_OUT if self._homed else Notice.POSITION_UNKNOWN, line)
        self._moves.event(EventKind.OTHER, line, 0.0, " ".join(codes + words))

    def move(self, block: Block, line: int) -> None:
        """Execute the coordinates, orientation and arc words of a block; they are taken out of it."""
        if self.mode is None:
            raise GCodeError("coordinates without a motion mode (G0 to G3); state one")
        self.offset.use()
        words = block.words
        start, axis_before = list(self.position), self.axis
        text = [f"G{self.mode:g}", *(f"{letter}{words[letter]}" for letter in "XYZABC" if letter in words)]
        turned = self._rotary is not None and any(letter in words for letter in "ABC")
        end = [self._target(letter, axis, block) for axis, letter in enumerate("XYZ")]
        self._turn_axis(block, line)
        centre_words = {letter: words.pop(letter) for letter in "IJKRP" if letter in words}
        self.position = end
        rapid = self.mode == 0.0
        if None in end:
            if not rapid:
                raise GCodeError("a cutting move before X, Y and Z are known; post the whole start position")
            self._moves.note(Notice.HOME_LEFT_OUT if self._homed else Notice.POSITION_UNKNOWN, line)
            self._moves.event(EventKind.OTHER, line, 0.0, " ".join(text))
            return
        if turned and any(self.angles.values()) and not self.tip_control:
            self._moves.note(Notice.NO_TIP_CONTROL, line)
        tip = (end[0] or 0.0, end[1] or 0.0, end[2] or 0.0)
        if self.mode >= 2.0:
            self._arc(start, tip, axis_before, centre_words, block.manners, line)
            return
        if centre_words:
            letter = next(iter(centre_words))
            raise GCodeError(f"{letter} word with no G2 or G3 that uses it; correct the line")
        length = 0.0 if None in start else math.dist(tip, [c or 0.0 for c in start])
        self._moves.move(tip, self.axis, 0.0 if rapid else self._feed(length), rapid, line)

    def is_absolute(self, letter: str, block: Block) -> bool:
        """Say whether a coordinate or rotary word of a block is absolute: by G90, G91, or its own AC(...), IC(...)."""
        manner = block.manners.get(letter)
        return self.absolute if manner is None else manner != "IC"

    def _target(self, letter: str, axis: int, block: Block) -> float | None:
        number, here = block.words.pop(letter, None), self.position[axis]
        if number is None:
            return here
        if self.is_absolute(letter, block):
            return float(number) * self._moves.mm
        if here is None:
            raise GCodeError(f"incremental {letter} before the position is known; post absolute coordinates (G90)")
        return here + float(number) * self._moves.mm

    def _feed(self, length_mm: float) -> float:
        feed = self._machine.feed_mm_min(length_mm)
        if length_mm == 0.0 and self._machine.feed_mode == 93.0:
            # The tip stays while the tool turns: it has no speed of its own.
            feed = self._last_feed
        self._last_feed = feed
        if feed == 0.0 and not self._may_lack_feed:
            missing = "F and, for G95, the speed of a turning spindle" if self._machine.feed_mode == 95.0 else "F"
            raise GCodeError(
                f"cannot do G{self.mode:g} with zero feed rate; state {missing}, or a feed with "
                "--set path.feed_mm_min=..."
            )
        return feed

    def _turn_axis(self, block: Block, line: int) -> None:
        words = block.words
        vector = axis_from_vector(words, ("A3", "B3", "C3"))
        if self.vector_words and vector is None:
            vector = axis_from_vector(words, ("I", "J", "K"))
            if vector is not None and self.mode is not None and self.mode >= 2.0:
                raise GCodeError("I J K of an arc under G43.5 can mean centre or tool axis; post G1 blocks")
            for letter in "IJK" if vector is not None else "":
                words.pop(letter, None)
        for letter in ("A3", "B3", "C3"):
            words.pop(letter, None)
        if vector == (0.0, 0.0, 0.0):
            if not self.axis_stated:
                raise GCodeError("the tool axis is (0, 0, 0) and none was stated before; state one")
            self._moves.note(Notice.AXIS_ZERO, line)
        elif vector is not None:
            self.axis, self.axis_stated = vector, True
        self._turn_rotaries(block)

    def _turn_rotaries(self, block: Block) -> None:
        words = block.words
        stated = {letter: float(words.pop(letter)) for letter in "ABC" if letter in words}
        if not stated:
            return
        for letter, angle in stated.items():
            self.angles[letter] = angle if self.is_absolute(letter, block) else self.angles[letter] + angle
            if angle and (self._rotary is None or letter not in self._rotary):
                raise GCodeError(
                    f"{letter}{angle:g}: what the rotary axes do to the tool is not known; say so with "
                    "--set path.rotary=AC (head-head, or BC, AB, BA), or post tool axis vectors"
                )
        if self._rotary is not None:
            self.axis = axis_from_angles(self._rotary, self.angles)

    def _arc(
        self,
        start: list[float | None],
        end: Vector,
        axis_before: Vector,
        words: dict[str, str],
        manners: dict[str, str],
        line: int,
    ) -> None:
        if None in start:
            raise GCodeError("an arc before X, Y and Z are known; post the whole start position")
        begin = (start[0] or 0.0, start[1] or 0.0, start[2] or 0.0)
        plane_normal, letters, forbidden = _PLANES[self._plane]
        normal = plane_normal if self.mode == 3.0 else (-plane_normal[0], -plane_normal[1], -plane_normal[2])
        if float(words.pop("P", "1")) != 1.0:
            raise GCodeError("P word: arcs of several turns are not read; post each turn as an arc")
        if float(words.pop(forbidden, "0")) != 0.0:
            raise GCodeError(f"{forbidden} word given for arc in the plane G{self._plane:g}; correct the line")
        reach = max((abs(float(number)) for number in words.values()), default=0.0) * self._moves.mm
        self._moves.check_reach((*begin, *end, reach), line)
        centre = self._arc_centre(begin, end, normal, words, manners, letters)
        arc = arc_between(begin, end, centre, normal)
        if arc is None:
            raise GCodeError("zero-radius arc; correct the line")
        if abs(arc.radius_start - arc.radius_end) > _RADIUS_TOLERANCE_MM:
            raise GCodeError(
                f"radius to end of arc ({arc.radius_end:.4f} mm) differs from radius to start "
                f"({arc.radius_start:.4f} mm); correct the line"
            )
        self._moves.arc(arc, (axis_before, self.axis), self._feed(arc.length_mm), False, line, "G2, G3")

    def _arc_centre(
        self,
        begin: Vector,
        end: Vector,
        normal: Vector,
        words: dict[str, str],
        manners: dict[str, str],
        letters: str,
    ) -> Vector:
        radius = words.pop("R", None)
        if (radius is None) == (not words):
            what = "mixed radius-ijk format" if words else "R i j k words all missing"
            raise GCodeError(f"{what} for arc: state either R or {' '.join(letters)}")
        mm = self._moves.mm
        if radius is not None:
            found = centre_for_radius(begin, end, normal, float(radius) * mm, _RADIUS_TOLERANCE_MM)
            if found is None:
                raise GCodeError("arc radius too small to reach end point, or full circle with R; correct the line")
            return found
        if self._centre_absolute and len(words) != len(letters):
            raise GCodeError(f"{' and '.join(letters)} are both needed for the absolute centre of an arc (G90.1)")
        centre = list(begin)
        for letter, number in words.items():
            axis = "IJK".index(letter)
            absolute = self._centre_absolute if letter not in manners else manners[letter] != "IC"
            centre[axis] = float(number) * mm + (0.0 if absolute else begin[axis])
        return (centre[0], centre[1], centre[2])
