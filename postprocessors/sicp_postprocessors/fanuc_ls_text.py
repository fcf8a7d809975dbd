"""The fixed words of Fanuc listings: their head, and frames as the pendant shows them."""

from __future__ import annotations

from sicp_cam.model import FloatArray
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.orientations import euler_zyx
from sicp_postprocessors.text import ascii_line

__all__ = ["frame_values", "listing_head", "wpr_deg"]

_LONGEST_COMMENT = 16


def wpr_deg(R: FloatArray) -> FloatArray:
    """Return W, P, R (n, 3) in degrees of rotations (n, 3, 3)."""
    return euler_zyx(R)[:, ::-1]


def frame_values(pose: FloatArray) -> str:
    """Return what a frame (4, 4) must hold, as the pendant shows it."""
    values = zip("XYZWPR", (*pose[:3, 3].tolist(), *wpr_deg(pose[None, :3, :3])[0].tolist()), strict=True)
    return " ".join(f"{name}={trimmed(value, 4)}" for name, value in values)


def listing_head(name: str, lines: int) -> list[str]:
    """Return what stands before the numbered statements of a listing."""
    return [
        f"/PROG  {name}",
        "/ATTR",
        "OWNER       = MNEDITOR;",
        f'COMMENT     = "{ascii_line(name)[:_LONGEST_COMMENT]}";',
        "PROG_SIZE   = 0;",
        "FILE_NAME   = ;",
        "VERSION     = 0;",
        f"LINE_COUNT  = {lines};",
        "MEMORY_SIZE = 0;",
        "PROTECT     = READ_WRITE;",
        "TCD:  STACK_SIZE    = 0,",
        "      TASK_PRIORITY = 50,",
        "      TIME_SLICE    = 0,",
        "      BUSY_LAMP_OFF = 0,",
        "      ABORT_REQUEST = 0,",
        "      PAUSE_REQUEST = 0;",
        "DEFAULT_GROUP   = 1,*,*,*,*;",
        "CONTROL_CODE    = 00000000 00000000;",
        "/APPL",
        "/MN",
    ]
