"""What a walk along a VAL3 application keeps: its moves, what is known so far, and what arguments stand for."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from sicp_cam.findings import Level
from sicp_formats.robot.motion import number_of
from sicp_formats.robot.program import RobotError
from sicp_formats.val3.check_files import Application, Code
from sicp_formats.val3.check_report import Report
from sicp_formats.val3.data import Variables
from sicp_formats.val3.scope import Scope

__all__ = ["Step", "Walker", "blend_of", "pose_of"]

_SIX = ("x", "y", "z", "rx", "ry", "rz")
_DEFAULTS = {"leave": 50.0, "reach": 50.0}


@dataclass(frozen=True, slots=True)
class Step:
    """A move of the walk; `pose` is None where it is computed, `gap` where what came before is not known.

    `stops` is set where the arm comes to rest behind it; `leave` and `reach` are 0 where nothing is blended.
    """

    pose: tuple[float, ...] | None
    father: str
    linear: bool
    leave: float
    reach: float
    gap: bool
    file: Path
    line: int


@dataclass(slots=True)
class Walker:
    """Where a walk is: the moves so far, programs met and still to be met, and what is known of the variables.

    `most` moves are kept, and `left` counts statements down to the end of the walk; `pending` says that moves wait in
    the queue, `gap` that what came last is not known; `told` holds the places of which something was told already.
    """

    application: Application
    report: Report
    most: int
    left: int
    steps: list[Step] = field(default_factory=list)
    stops: set[int] = field(default_factory=set)
    reached: set[str] = field(default_factory=set)
    roots: list[str] = field(default_factory=list)
    gap: bool = True
    pending: bool = False
    depth: int = 0
    scope: Scope = field(init=False)
    blends: dict[tuple[str, str], tuple[float, float]] = field(default_factory=dict)
    told: set[tuple[Path, int]] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.scope = Scope(Variables(dict(self.application.variables)))


def pose_of(walker: Walker, code: Code, argument: str, line: int) -> tuple[tuple[float, ...] | None, str]:
    """Return the six numbers of a declared point and the frame that it stands in; None where it is computed."""
    try:
        name, key = walker.scope.item(argument)
        variable, _, attributes = walker.scope.variables.attributes(name, key)
    except RobotError:
        _beyond(walker, code, argument, line)
        return None, ""
    if variable.type != "point":
        return None, ""
    if key not in variable.values and (code.file, line) not in walker.told:
        walker.told.add((code.file, line))
        message = f"the move goes to {name}[{key}], which has no value: to the origin of its frame; give it one"
        walker.report.add(868, Level.WARN, message, code.file, line, kind="default")
    numbers = [number_of(attributes.get(each, "0")) for each in _SIX]
    known = tuple(number for number in numbers if number is not None)
    return (known if len(known) == len(_SIX) else None), attributes.get("fatherId", "world[0]").strip()


def _beyond(walker: Walker, code: Code, argument: str, line: int) -> None:
    """Tell of an index that a counted loop drives beyond the array; plain indices are told of elsewhere."""
    name, bracket, index = argument.partition("[")
    variable = walker.application.variables.get(name.strip())
    if not bracket or variable is None or name.strip() in code.own or (code.file, line) in walker.told:
        return
    if name.strip() in walker.scope.changed or variable.collection or index.rstrip("] \t").isdecimal():
        return
    try:
        found = walker.scope.whole(index.rpartition("]")[0])
    except RobotError:
        return
    if not 0 <= found < max(variable.size, 1):
        walker.told.add((code.file, line))
        message = f"the loop comes to {name.strip()}[{found}], beyond its {variable.size} elements; correct the loop"
        walker.report.add(866, Level.FAIL, message, code.file, line, kind="loop")


def blend_of(walker: Walker, argument: str) -> tuple[float, float]:
    """Return leave and reach of an mdesc, zeros where it does not blend or is not known."""
    try:
        name, key = walker.scope.item(argument)
        found = walker.blends.get((name, key))
        if found is None:
            variable, _, attributes = walker.scope.variables.attributes(name, key)
            blends = variable.type == "mdesc" and attributes.get("blend", "joint").lower() != "off"
            leave, reach = (number_of(attributes.get(n, str(d))) or 0.0 for n, d in _DEFAULTS.items())
            found = (leave, reach) if blends else (0.0, 0.0)
            walker.blends[name, key] = found
    except RobotError:
        return 0.0, 0.0
    return found
