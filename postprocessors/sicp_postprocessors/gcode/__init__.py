"""Five-axis G-code: dialects and kinematics as data."""

from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.gcode.post import GCode

__all__ = ["GCode", "GCodeOptions"]
