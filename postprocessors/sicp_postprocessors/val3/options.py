"""Options of the VAL3 post."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from sicp_cam.ranges import Between
from sicp_postprocessors.options import THIS_POST, flag
from sicp_postprocessors.robot_options import RobotOptions, output_words

__all__ = ["Val3Options"]

_VERSION = re.compile(r"s[0-9][A-Za-z0-9_.]{0,39}")
_LINK_S6 = re.compile(r"(?:io:)?[A-Za-z_][A-Za-z0-9_]{0,39}(?:\[[0-9]{1,4}\])?", re.ASCII)
_HEAVIEST_KG = 1000.0


@dataclass(frozen=True, slots=True)
class Val3Options(RobotOptions):
    r"""Options of the post `val3`. Outputs are links such as BasicIO-1\%Q0, for s6 names of the library io: bOut0."""

    dialect: Literal["s7", "s6"] = "s7"
    """XML of the files: s7 for CS8C controllers from s7.0 on and for CS9 (s8), s6 for older ones."""
    version: str = ""
    """Version that the project file states, such as s7.11 or s8.10.3; left out, s7.10.2 or s6.8 by the dialect."""
    style: Literal["split", "per-move", "loop"] = "split"
    """One statement a move, in programs that are divided at retracts; or all in one; or loops over the points."""
    world_origin: Literal["shoulder", "base_plate"] = "shoulder"
    """Where `cell` is measured from. VAL3's own world lies at the shoulder, axes 1 and 2."""
    shoulder_height_mm: Annotated[float, Between(0.0, 10_000.0)] = 0.0
    """Height of the shoulder above the base plate, for `base_plate`: 375 for a TX2-60, 478 for a TX2-90."""
    shoulder: Literal["ssame", "lefty", "righty", "sfree"] = "ssame"
    """Side of the shoulder at the first point, which is reached joint by joint; later points keep it."""
    elbow: Literal["esame", "epositive", "enegative", "efree"] = "esame"
    """Way that the elbow bends at the first point; later points keep it."""
    wrist: Literal["wsame", "wpositive", "wnegative", "wfree"] = "wsame"
    """Way that the wrist bends at the first point; later points keep it."""
    rotation_deg_s: Annotated[float, Between(0.1, 99_999.0)] = 9999.0
    """Limit of the tool's turning in every move; a move that reaches it is slower than its feed."""
    accel_percent: Annotated[float, Between(1.0, 500.0)] = 100.0
    """Acceleration and deceleration of every move, of the robot's nominal value."""
    payload: tuple[float, float, float, float] | None = None
    """Mass of the tool in kg, and its centre of mass x, y, z in the flange in mm, for setPayload; s7 only."""
    spindle_speed: Literal["none", "num", "aio"] = "none"
    """Leave the speed to the spindle drive, or write it to a number nSpindle, or to an analog output aoSpindle."""
    spindle_speed_output: str = ""
    """Analog output of the spindle speed, for `spindle_speed` = aio."""
    spindle_speed_scale: Annotated[float | None, Between(1e-6, 1e3)] = None
    """Value for one rev/min, such as 0.0005 for 10 V at 20000 rev/min; must be given for aio, and is 1 for num."""
    continue_input: str = ""
    """Digital input that ends a stop or tool change; without it the operator sets the variable bContinue to true."""
    log_messages: bool = False
    """Write stops and tool changes to the controller's log."""
    decimals: Annotated[int, Between(4, 9)] = 4
    """Decimals of positions, which are in mm."""
    angle_decimals: Annotated[int, Between(4, 9)] = 5
    """Decimals of angles in degrees."""
    max_points_per_array: Annotated[int, Between(1, 1_000_000)] = 2000
    """Longer paths get several arrays of points and speeds; what a controller takes depends on its memory."""

    def problems(self) -> list[str]:
        """Return what does not go together, one line each."""
        problems = [*RobotOptions.problems(self), *self._dialect_problems()]
        if (self.world_origin == "base_plate") != (self.shoulder_height_mm > 0):
            problems.append("options 'world_origin' = base_plate and 'shoulder_height_mm' belong together; give both")
        if (self.spindle_speed == "aio") != bool(self.spindle_speed_output):
            problems.append("options 'spindle_speed' = aio and 'spindle_speed_output' belong together; give both")
        if self.spindle_speed == "aio" and self.spindle_speed_scale is None:
            problems.append(
                "option 'spindle_speed' = aio writes to an analog output, and needs its value for one rev/min; "
                f"give {flag(THIS_POST, 'spindle_speed_scale', '0.0005')} for 10 V at 20000 rev/min"
            )
        if self.payload is not None and not 0.0 < self.payload[0] <= _HEAVIEST_KG:
            problems.append(f"option 'payload' must begin with a mass above 0 and up to {_HEAVIEST_KG:g} kg")
        return problems

    def _dialect_problems(self) -> list[str]:
        problems = []
        if self.version and (
            not _VERSION.fullmatch(self.version) or (self.version[:2] < "s7") != (self.dialect == "s6")
        ):
            problems.append("option 'version' must look like s7.10.2, or s6.8 for the dialect s6")
        own = {"doSpindle", "doSpindleCcw", "doCoolant", "diContinue"} & set(self.links.values())
        problems += [f"{name!r} is a name of the program's own; link another output" for name in sorted(own)]
        if self.dialect == "s7":
            return problems
        if self.payload is not None:
            problems.append("option 'payload' is for the dialect s7: how an s6 controller is told is not known")
        problems += [
            f"option {name!r} must be a name of the library io for the dialect s6, such as bOut0"
            for name, link in self.links.items()
            if link and not _LINK_S6.fullmatch(link)
        ]
        return problems

    @property
    def links(self) -> dict[str, str]:
        """Inputs and outputs by the options that name them."""
        names = ("spindle_output", "spindle_ccw_output", "spindle_speed_output", "coolant_output", "continue_input")
        links = {name: getattr(self, name) for name in names}
        return links | {f"outputs ({link})": link for link in self.user_outputs}

    @property
    def user_outputs(self) -> dict[str, str]:
        """Variables of the outputs that words of the path switch, by their links."""
        links = dict.fromkeys(link for link, _ in output_words(self.outputs)[0].values())
        return {link: f"doUser{number}" for number, link in enumerate(links, 1)}

    @property
    def cell_origin(self) -> str:
        """What `cell` is measured from, in words."""
        return "base plate" if self.world_origin == "base_plate" else "world"

    @property
    def commands_speed(self) -> bool:
        """Whether the program states the speed of the spindle."""
        return self.spindle_speed != "none"

    @property
    def speed_scale(self) -> float:
        """Value for one rev/min: 1 where none is given."""
        return 1.0 if self.spindle_speed_scale is None else self.spindle_speed_scale
