"""Options of the VAL3 post."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, TypeAlias

from sicp_cam.errors import JobError
from sicp_postprocessors.options import THIS_POST, flag, outside

__all__ = ["Six", "Val3Options"]

Six: TypeAlias = tuple[float, float, float, float, float, float]
_VERSION = re.compile(r"[A-Za-z0-9_.]{1,40}")


@dataclass(frozen=True, slots=True)
class Val3Options:
    """Options of the post `val3`. Poses are x, y, z in mm and rx, ry, rz in degrees, R = Rx Ry Rz."""

    version: str = "s7.10.2"
    """Version that the project file states."""
    tool: Six | None = None
    """Pose of the tool tip in the flange, Z out of the flange into the work; zero, with a warning, if left out."""
    cell: Six | None = None
    """Pose of the scan frame in the robot's world; the identity, with a warning, if left out."""
    world_origin: Literal["shoulder", "base_plate"] = "shoulder"
    """Where `cell` is measured from. VAL3's own world lies at the shoulder, axes 1 and 2."""
    shoulder_height_mm: float = 0.0
    """Height of the shoulder above the base plate, for `base_plate`: 375 for a TX2-60, 478 for a TX2-90."""
    spin_deg: float = 0.0
    """Angle rz of the tool about its own axis."""
    spin: Literal["fixed", "transport"] = "fixed"
    """Keep rz along the path, or turn the tool no more than its axis turns."""
    shoulder: Literal["ssame", "lefty", "righty", "sfree"] = "ssame"
    """Side of the shoulder at the first point, which is reached joint by joint; later points keep it."""
    elbow: Literal["esame", "epositive", "enegative", "efree"] = "esame"
    """Way that the elbow bends at the first point; later points keep it."""
    wrist: Literal["wsame", "wpositive", "wnegative", "wfree"] = "wsame"
    """Way that the wrist bends at the first point; later points keep it."""
    approach_vel_percent: float = 10.0
    """Joint speed of the move to the first point."""
    rapid_mm_s: float = 250.0
    """Tip speed of rapid moves, and the most that the move to the first point may reach."""
    rotation_deg_s: float = 9999.0
    """Limit of the tool's turning in every move; a move that reaches it is slower than its feed."""
    accel_percent: float = 100.0
    """Acceleration and deceleration of every move, of the robot's nominal value."""
    blend: Literal["off", "Cartesian"] = "Cartesian"
    """Round the points between two cutting moves; or `off`: come to rest at every point."""
    blend_mm: float = 0.5
    """Where blending leaves and reaches the path, at most; never more than half of the shorter neighbouring segment."""
    blend_corner_mm: float = 0.05
    """How far a blend may cut a corner, at most: where the path turns sharply, leave and reach are shorter for it."""
    first_run: bool = False
    """Write a program for the first run: no blending, and no move faster than `first_run_mm_s`."""
    first_run_mm_s: float = 50.0
    """Speed that no move of a first run exceeds."""
    spindle_link: str = ""
    r"""Digital output that starts the spindle clockwise, such as BasicIO-1\%Q0."""
    spindle_ccw_link: str = ""
    """Digital output that starts it counter-clockwise; without it such a path is refused."""
    spindle_dwell_s: float = 2.0
    """Pause after a start of the spindle."""
    spindle_speed: Literal["none", "num", "aio"] = "none"
    """Leave the speed to the spindle drive, or write it to a number nSpindle, or to an analog output aoSpindle."""
    spindle_speed_link: str = ""
    """Analog output of the spindle speed, for `spindle_speed` = aio."""
    spindle_speed_scale: float | None = None
    """Value for one rev/min, such as 0.0005 for 10 V at 20000 rev/min; must be given for aio, and is 1 for num."""
    coolant_link: str = ""
    """Digital output of coolant or extraction."""
    continue_link: str = ""
    """Digital input that ends a stop or tool change; without it the operator sets the variable bContinue to true."""
    log_messages: bool = False
    """Write stops and tool changes to the controller's log."""
    decimals: int = 4
    """Decimals of positions, which are in mm."""
    angle_decimals: int = 5
    """Decimals of angles in degrees."""
    max_points_per_array: int = 2000
    """Longer paths get several arrays; what a controller takes depends on its memory."""
    max_moves_per_program: int = 2000
    """Longer paths are split into programs move000, move001, ..., at rapid moves where there are any."""
    style: Literal["per-move"] = "per-move"
    """One statement for each move."""

    def __post_init__(self) -> None:
        problems = [
            *outside("shoulder_height_mm", self.shoulder_height_mm, 0.0, 10_000.0),
            *outside("spin_deg", self.spin_deg, -360.0, 360.0),
            *outside("approach_vel_percent", self.approach_vel_percent, 0.1, 100.0),
            *outside("rapid_mm_s", self.rapid_mm_s, 0.1, 10_000.0),
            *outside("rotation_deg_s", self.rotation_deg_s, 0.1, 99_999.0),
            *outside("accel_percent", self.accel_percent, 1.0, 500.0),
            *outside("blend_mm", self.blend_mm, 0.001, 1000.0),
            *outside("blend_corner_mm", self.blend_corner_mm, 0.001, 1000.0),
            *outside("first_run_mm_s", self.first_run_mm_s, 0.1, 250.0),
            *outside("spindle_dwell_s", self.spindle_dwell_s, 0.0, 600.0),
            *outside("spindle_speed_scale", self.speed_scale, 1e-6, 1e3),
            *outside("decimals", self.decimals, 4, 9),
            *outside("angle_decimals", self.angle_decimals, 4, 9),
            *outside("max_points_per_array", self.max_points_per_array, 1, 1_000_000),
            *outside("max_moves_per_program", self.max_moves_per_program, 1, 1_000_000),
        ]
        if not _VERSION.fullmatch(self.version):
            problems.append("option 'version' must look like s7.10.2")
        if (self.world_origin == "base_plate") != (self.shoulder_height_mm > 0):
            problems.append("options 'world_origin' = base_plate and 'shoulder_height_mm' belong together; give both")
        if (self.spindle_speed == "aio") != bool(self.spindle_speed_link):
            problems.append("options 'spindle_speed' = aio and 'spindle_speed_link' belong together; give both")
        if self.spindle_speed == "aio" and self.spindle_speed_scale is None:
            problems.append(
                "option 'spindle_speed' = aio writes to an analog output, and needs its value for one rev/min; "
                f"give {flag(THIS_POST, 'spindle_speed_scale', '0.0005')} for 10 V at 20000 rev/min"
            )
        if problems:
            raise JobError(*problems)

    @property
    def speed_scale(self) -> float:
        """Value for one rev/min: 1 where none is given."""
        return 1.0 if self.spindle_speed_scale is None else self.spindle_speed_scale

    @property
    def blends(self) -> bool:
        """Whether points between cutting moves are rounded."""
        return self.blend == "Cartesian" and not self.first_run
