"""What a user may state about an APT or CL file."""

from __future__ import annotations

from dataclasses import dataclass

from sicp_cam.errors import JobError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.apt.arcs import ARC_POINTS, ARC_SENSES
from sicp_formats.apt.frames import FRAME_CHOICES
from sicp_formats.paths.moves import check_options

__all__ = ["AptOptions"]

_CHOICES = {
    "frame": FRAME_CHOICES,
    "arc_sense": ARC_SENSES,
    "arc_points": ARC_POINTS,
    "cutcom": ("refuse", "ignore"),
    "cycles": ("refuse", "points"),
}


@dataclass(frozen=True, slots=True)
class AptOptions:
    """What the user stated about a file, as the parameters of `sicp_formats.apt.read_path`.

    Raises
    ------
    JobError
        If an option is not valid.
    """

    units: str | None = None
    limits: Limits = DEFAULT_LIMITS
    feed_mm_min: float | None = None
    chord_mm: float = 0.005
    step_mm: float = 2.0
    frame: str = "refuse"
    arc_sense: str = "auto"
    arc_points: str = "refuse"
    cutcom: str = "refuse"
    cycles: str = "refuse"
    recover: bool = False

    def __post_init__(self) -> None:
        check_options(feed_mm_min=self.feed_mm_min, chord_mm=self.chord_mm, step_mm=self.step_mm)
        problems = [
            f"path.{name} = {getattr(self, name)!r} must be one of {', '.join(choices)}"
            for name, choices in _CHOICES.items()
            if getattr(self, name) not in choices
        ]
        if problems:
            raise JobError(*problems)
