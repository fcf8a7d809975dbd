"""Options of the post of RAPID modules."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from sicp_cam.ranges import Between
from sicp_postprocessors.controllers import ControllerOptions

__all__ = ["RapidOptions"]

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")
_CONFIGURATION = re.compile(r"-?[0-9](?:,-?[0-9]){3}")


@dataclass(frozen=True, slots=True)
class RapidOptions(ControllerOptions):
    """Options of the post `rapid`. Outputs are names of signals; `pose_angles` = own: EZ, EY, EX of the pendant."""

    pose_angles: Literal["xyz", "own"] = "xyz"
    """How `tool` and `cell` are turned: R = Rx Ry Rz, or `own`: EZ, EY, EX of the pendant, R = Rz Ry Rx."""
    tool_name: str = ""
    """Take tool and load from this tooldata of the controller, in place of `tool`."""
    wobj_name: str = ""
    """Take the scan frame from this wobjdata of the controller, in place of `cell`."""
    configuration: str = ""
    """cf1,cf4,cf6,cfx of the first point, such as 0,-1,0,1; without it the arm takes the nearest way there."""
    rotation_deg_s: Annotated[float, Between(0.1, 5000.0)] = 500.0
    """Limit of the tool's turning (v_ori); a move that reaches it is slower than its feed."""
    entry: Literal["main", "run"] = "main"
    """Name of the first procedure: `main`, or run_NAME to be called by a program of your own."""
    split: Literal["procedures", "modules"] = "procedures"
    """Parts of a long path as procedures of the one module, or as modules NAME_001 ... that NAME.pgf lists."""
    module_suffix: Literal["mod", "modx"] = "mod"
    """Suffix of module files: mod for IRC5, modx for OmniCore (RobotWare 7)."""
    quaternion_decimals: Annotated[int, Between(5, 9)] = 7
    """Decimals of quaternions."""

    signal = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")
    signal_words = "the name of a digital output"
    analog = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")
    analog_words = "the name of an analog output"

    def problems(self) -> list[str]:
        """Return what does not go together, one line each."""
        problems = ControllerOptions.problems(self)
        for option, other, given in (
            ("tool_name", "tool", self.tool is not None),
            ("tool_name", "payload", self.payload is not None),
            ("wobj_name", "cell", self.cell is not None),
        ):
            if getattr(self, option) and given:
                problems.append(f"options {option!r} and {other!r} say the same thing twice; give one of them")
        for option in ("tool_name", "wobj_name"):
            if getattr(self, option) and not _NAME.fullmatch(getattr(self, option)):
                problems.append(f"option {option!r} must be a name of up to 32 letters, digits and _")
        if self.configuration and not _CONFIGURATION.fullmatch(self.configuration):
            problems.append("option 'configuration' must be cf1,cf4,cf6,cfx, such as 0,-1,0,1")
        return problems

    @property
    def tool_is_known(self) -> bool:
        """Whether the user says what the tool is."""
        return self.tool is not None or bool(self.tool_name)

    @property
    def cell_is_known(self) -> bool:
        """Whether the user says where the scan frame is."""
        return self.cell is not None or bool(self.wobj_name)
