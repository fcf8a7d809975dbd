"""A model of a six-axis arm: kinematics files, forward and inverse kinematics, and what they say of a path."""

from sicp_postprocessors.arm.files import arm_from_text, arm_names, load_arm
from sicp_postprocessors.arm.findings import arm_findings, no_arm_finding
from sicp_postprocessors.arm.kinematics import CONFIGURATIONS, Configuration, forward, inverse
from sicp_postprocessors.arm.model import Arm, Joint
from sicp_postprocessors.arm.options import ArmOptions

__all__ = [
    "CONFIGURATIONS",
    "Arm",
    "ArmOptions",
    "Configuration",
    "Joint",
    "arm_findings",
    "arm_from_text",
    "arm_names",
    "forward",
    "inverse",
    "load_arm",
    "no_arm_finding",
]
