"""The arc statements of APT and CL dialects, and the check that their sense was understood.

Three dialects write arcs, and two of them mean opposite things by the same axis:

- Creo, SolidWorks CAM: ``CIRCLE/x,y,z,i,j,k[,r]``, then GOTO: right-hand rule about the axis (PTC's Creo NC help,
  "CL Output for Circular Interpolation"); CAMWorks adds the word CLOCKWISE or COUNTERCLOCKWISE. Creo may list more
  points of the arc in further GOTO statements, where others go straight; which of them was meant the user must say.
- NX: ``CIRCLE/x,y,z,i,j,k,r,t,f,d,e``, then GOTO: *clockwise* about the axis (Siemens' CLSF reference).
- CATIA and Creo's APT format: ``INDIRV/i,j,k`` (direction at the start), ``TLON,GOFWD/(CIRCLE/x,y,z,r),ON,(LINE/...)``:
  the arc ends at the second point of the line.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from sicp_formats.apt.arguments import NUMBER, split_arguments
from sicp_formats.paths.arcs import Arc, Vector, arc_between, cross, dot, minus, norm, unit
from sicp_formats.paths.moves import MoveList

__all__ = [
    "ARC_POINTS",
    "ARC_SENSES",
    "ArcReader",
    "Circle",
    "arc_to",
    "circle_from_line",
    "circle_statement",
    "goes_on",
]

ARC_SENSES = ("auto", "ccw", "cw")
ARC_POINTS = ("refuse", "arc", "straight")

_TLON = re.compile(
    rf"\s*\(\s*CIRCLE\s*/{','.join([NUMBER] * 4)}\)\s*,\s*ON\s*,\s*\(\s*LINE\s*/{','.join([NUMBER] * 6)}\)\s*",
    re.IGNORECASE,
)
_RADIUS_TOLERANCE_MM = 0.05
_STRAIGHT_MM = 0.05
_CLEAR = 0.9  # cosine from which two directions count as the same way or the opposite way


@dataclass(frozen=True, slots=True)
class Circle:
    """An arc statement that waits for its end point: lengths in mm, normal so that the arc runs counter-clockwise."""

    centre: Vector
    normal: Vector
    radius: float | None
    sense: str
    may_go_on: bool
    line: int


def circle_statement(moves: MoveList, numbers: list[float], words: list[str], line: int, sense: str) -> Circle:
    """Return the circle of a CIRCLE statement.

    Parameters
    ----------
    moves
        For the unit and the caps.
    numbers, words
        The arguments that are numbers, and the others.
    sense
        ``ccw`` or ``cw`` about the stated axis; ``auto`` for that of the dialect.
    """
    count = len(numbers)
    if "TIMES" in words:
        raise moves.error("CIRCLE with TIMES (helix of several turns) is not read; output it as points", line)
    with_word = words in (["CLOCKWISE"], ["COUNTERCLOCKWISE"])
    if count not in (6, 7, 11) or (words and not with_word):
        raise moves.error("CIRCLE needs x,y,z,i,j,k, a radius or not, or 11 numbers; output arcs as points", line)
    axis = unit((numbers[3], numbers[4], numbers[5]))
    if axis is None:
        raise moves.error("the axis of CIRCLE has no direction; output arcs as points", line)
    if with_word and max(axis, key=abs) < 0.0:
        raise moves.error(f"CIRCLE with a negative axis and {words[0]} can mean both ways; output arcs as points", line)
    if sense == "auto":
        clockwise = words == ["CLOCKWISE"] or count == 11
        said = words[0].lower() if with_word else "clockwise about the axis (NX)" if count == 11 else "right-hand rule"
    else:
        clockwise, said = sense == "cw", f"path.arc_sense = {sense}"
    mm = moves.mm
    centre = (numbers[0] * mm, numbers[1] * mm, numbers[2] * mm)
    radius = abs(numbers[6]) * mm if count > 6 else None
    normal = (-axis[0], -axis[1], -axis[2]) if clockwise else axis
    return Circle(centre, normal, radius, said, count == 7 and not with_word, line)


def circle_from_line(
    moves: MoveList, arguments: str, start: Vector, direction: Vector, line: int
) -> tuple[Circle, Vector]:
    """Return the circle and the end point of ``TLON,GOFWD/(CIRCLE/x,y,z,r),ON,(LINE/x1,y1,z1,x2,y2,z2)``, in mm."""
    found = _TLON.fullmatch(arguments)
    if found is None:
        raise moves.error("only TLON,GOFWD/(CIRCLE/x,y,z,r),ON,(LINE/6 numbers) is read; output arcs as points", line)
    n = [float(number) * moves.mm for number in found.groups()]
    centre, end = (n[0], n[1], n[2]), (n[7], n[8], n[9])
    moves.check_reach((*start, *n), line)
    normal = unit(cross(minus(start, centre), direction))
    along = unit(minus(start, centre))
    if normal is None or along is None or abs(dot(along, direction)) > 0.5 * norm(direction):
        raise moves.error("INDIRV does not point along the circle at the start of the arc; output arcs as points", line)
    if abs(dot(minus(end, start), normal)) > _RADIUS_TOLERANCE_MM:
        raise moves.error("start, end and INDIRV do not lie in one plane; output arcs as points", line)
    return Circle(centre, normal, abs(n[3]), "INDIRV", False, line), end


def arc_to(moves: MoveList, circle: Circle, start: Vector | None, end: Vector, line: int) -> Arc:
    """Return the arc of a circle from where the tool is to the end point, or raise a FormatError."""
    if start is None:
        raise moves.error("an arc before any position; where does it start?", circle.line)
    moves.check_reach((*start, *end, *circle.centre, circle.radius or 0.0), line)
    arc = arc_between(start, end, circle.centre, circle.normal)
    if arc is None:
        raise moves.error("the arc starts or ends at its own centre; correct it or output arcs as points", circle.line)
    stated = arc.radius_start if circle.radius is None else circle.radius
    off = max(abs(arc.radius_start - stated), abs(arc.radius_end - stated), abs(arc.radius_start - arc.radius_end))
    if off > _RADIUS_TOLERANCE_MM:
        raise moves.error(f"start or end lie {off:.3f} mm off the circle; output arcs as points", circle.line)
    return arc


def goes_on(circle: Circle, arc: Arc, tip: Vector) -> bool:
    """Say whether a point after the end of an arc might be meant as a further point of it, and it matters.

    Creo may list several points of an arc after one CIRCLE (ARC_ONLY), where others go straight. The two readings
    are one where the chord is as good as the arc.
    """
    if not circle.may_go_on:
        return False
    from_foot = minus(tip, arc.foot)
    height = dot(from_foot, arc.normal)
    radius = norm(cross(from_foot, arc.normal))
    chord = norm(minus(tip, arc.end)) / 2.0
    on_circle = abs(height - arc.rise_mm) < 0.01 and abs(radius - arc.radius_end) < 0.01
    sagitta = arc.radius_end - max(arc.radius_end**2 - chord**2, 0.0) ** 0.5
    return on_circle and sagitta > _STRAIGHT_MM


@dataclass(slots=True)
class _SenseVotes:
    """Do arcs leave the way the tool arrives? A file whose arcs mostly run backwards was read in the wrong sense."""

    for_it: int = 0
    against: int = 0
    first_against: int = 0

    def compare(self, tangent: Vector, travel: Vector, line: int) -> None:
        """Count one joint of an arc and a straight cutting move, where it says something."""
        direction = unit(travel)
        cosine = 0.0 if direction is None else dot(tangent, direction)
        if cosine > _CLEAR:
            self.for_it += 1
        elif cosine < -_CLEAR:
            self.against += 1
            self.first_against = self.first_against or line

    def check(self, moves: MoveList) -> None:
        """Raise a FormatError if the sense of the arcs is in doubt."""
        if self.against > self.for_it:
            what = (
                f"{self.against} arcs run against the moves beside them, {self.for_it} with them: is that right? "
                "State their sense with --set path.arc_sense=ccw or cw (about the stated axis)"
            )
            raise moves.error(what, self.first_against)


class ArcReader:
    """Executes the arc statements of one file: waits for the end of each arc, and watches how the arcs join.

    `idle` is True while a straight move needs no look at arcs; `pieces` are (line of the first arc statement, line
    where the arc ends) of every arc.
    """

    __slots__ = (
        "_arc_line", "_circle", "_direction", "_direction_line", "_last", "_moves", "_points", "_sense", "_votes",
        "idle", "pieces",
    )  # fmt: skip

    def __init__(self, moves: MoveList, sense: str, points: str = "refuse") -> None:
        self.idle = True
        self.pieces: list[tuple[int, int]] = []
        self._moves = moves
        self._sense = sense
        self._points = points
        self._direction_line = 0
        self._votes = _SenseVotes()
        self._circle: Circle | None = None
        self._direction: Vector | None = None
        self._last: tuple[Circle, Arc] | None = None
        self._arc_line = 0

    @property
    def circle_waits(self) -> bool:
        """True if the next GOTO ends an arc."""
        return self._circle is not None

    def circle(self, line: int, arguments: str) -> None:
        """CIRCLE/...: the next GOTO ends the arc."""
        self._refuse_waiting()
        self._circle = circle_statement(self._moves, *split_arguments(arguments), line, self._sense)
        self.idle = False

    def direction(self, line: int, arguments: str) -> None:
        """INDIRV/i,j,k: the way in which the next TLON,GOFWD leaves."""
        numbers, words = split_arguments(arguments)
        direction = unit((numbers[0], numbers[1], numbers[2])) if len(numbers) == 3 and not words else None
        if direction is None:
            raise self._moves.error("INDIRV needs the three numbers of a direction; correct the line", line)
        self._direction, self._direction_line = direction, line

    def along(self, line: int, arguments: str) -> Vector:
        """TLON,GOFWD/(CIRCLE/...),ON,(LINE/...): make its arc wait; return the end point."""
        self._refuse_waiting()
        start = self._moves.position()
        if self._direction is None or start is None:
            raise self._moves.error("TLON,GOFWD needs a position and INDIRV before it; output arcs as points", line)
        self._circle, end = circle_from_line(self._moves, arguments, start, self._direction, line)
        self._direction = None
        return end

    def follow(self, tip: Vector, axis: Vector, feed: float, rapid: bool, line: int) -> None:
        """Append the arc that waits, up to its end point."""
        circle, moves, rows = self._circle, self._moves, self._moves.rows
        if circle is None:
            raise self._moves.error("the end of an arc without its circle; output arcs as points", line)
        arc = arc_to(moves, circle, moves.position(), tip, line)
        votes = circle.sense != "INDIRV" and not rapid
        if votes and len(moves) >= 2 and not rows[-2] and rows[-1] != self._arc_line:
            x, y, z = rows[-18:-15]
            self._votes.compare(arc.v, (rows[-9] - x, rows[-8] - y, rows[-7] - z), circle.line)
        i, j, k = rows[-6:-3]
        moves.arc(arc, ((i, j, k), axis), feed, rapid, line, circle.sense)
        self.pieces.append((self._direction_line if circle.sense == "INDIRV" else circle.line, line))
        self._last = (circle, arc) if votes else None
        self._arc_line, self._circle, self.idle = line, None, self._last is None

    def leave(self, tip: Vector | None, line: int, *, rapid: bool) -> bool:
        """Look at a move (None: one that is not compared) before it is appended; say whether it goes on along the arc.

        If it does, its circle waits for it again.
        """
        self._refuse_waiting()
        last, start = self._last, self._moves.position()
        self._last, self.idle = None, True
        if last is None or start is None or tip is None or rapid:
            return False
        if self._points != "straight" and goes_on(*last, tip):
            if self._points == "arc":
                self._circle, self.idle = last[0], False
                return True
            raise self._moves.error(
                "the point after the arc lies on the same circle: straight, or further along the arc? "
                "Say so with --set path.arc_points=arc or straight, or output one point for each arc",
                line,
            )
        self._votes.compare(last[1].end_direction, minus(tip, start), line)
        return False

    def finish(self, *, trusted: bool = False) -> None:
        """Refuse an arc without end, and arcs whose sense is in doubt unless it was stated, or is trusted."""
        self._refuse_waiting()
        if self._sense == "auto" and not trusted:
            self._votes.check(self._moves)

    def _refuse_waiting(self) -> None:
        if self._circle is not None:
            raise self._moves.error("CIRCLE without the GOTO that ends the arc; is a line missing?", self._circle.line)
