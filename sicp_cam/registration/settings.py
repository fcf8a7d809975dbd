"""What an operator may set about a registration; every default fits an ordinary job."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["METHODS", "RegistrationSettings"]

METHODS = ("sicp", "rigid", "projection", "paper")


@dataclass(frozen=True, slots=True)
class RegistrationSettings:
    """Settings of the registration.

    Parameters
    ----------
    segments
        Number of pieces of each contour; None lets the residual choose.
    overlap
        Fraction of the mean length of two neighbouring segments that both of them cover; 0.2 to 0.4.
    corner_radius_mm
        Radius of curvature below which a bend of the contour becomes a subdivision point.
    reach_mm
        How far from the rigidly registered contour the scan is looked at; wider than the largest deformation.
    field
        Whether the smooth displacement that the pieces leave is added, in the method `sicp`.
    edge_offset_mm
        How far the part's edge lies outside of the one that the scan shows, in the method `sicp`: positive where the
        scanner rounds the edge off, negative where flash stands out. Found by scanning a part of known size.
    projection_surface
        Form of the deformation over the plane of the contour, in the method `projection`.
    """

    segments: int | None = None
    overlap: float = 0.3
    corner_radius_mm: float = 20.0
    reach_mm: float = 40.0
    field: bool = True
    edge_offset_mm: float = 0.0
    projection_surface: Literal["parabola", "spline"] = "spline"
