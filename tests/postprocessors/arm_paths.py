"""Paths of arms built from joints, so that their truth is known."""

import numpy as np
from post_programs import path_of

from sicp_postprocessors.arm import arm_findings, forward
from sicp_postprocessors.orientations import pose_from_six

TOOL = pose_from_six((0.0, 0.0, 150.0, 0.0, 0.0, 0.0))
FORWARD = ("lefty", "epositive", "wpositive")


def poses_of(arm, joints_deg, tool=TOOL):
    """Return tips and rotations of the tool in the world for joints (n, 6)."""
    R, places_mm = forward(arm, np.asarray(joints_deg, dtype=float))
    return places_mm + R @ tool[:3, 3], R @ tool[:3, :3]


def findings_of(arm, joints_deg, *, feed_mm_s=10.0, rapid=None, tool=TOOL, **more):
    """Return the findings of the path whose moves end at the given joints; the first is rapid unless told."""
    tips, R = poses_of(arm, joints_deg, tool)
    rapid = np.arange(len(tips)) == 0 if rapid is None else np.array(rapid)
    path = path_of(tips, -R[:, :, 2], np.where(rapid, 0.0, feed_mm_s * 60.0), rapid)
    return arm_findings(path, tips, R, np.full(len(tips), feed_mm_s), tool, arm, **more)


def told(findings, code):
    return [finding for finding in findings if finding.code == code]
