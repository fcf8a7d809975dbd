"""Stäubli VAL3: an application folder for CS8C (s6, s7) and CS9 (s8) controllers.

The rigid part of a correction can stay in the frame `fPart`, where the operator sees it; the points then hold the rest.
"""

from __future__ import annotations

from sicp_postprocessors.val3.names import application_name
from sicp_postprocessors.val3.options import Val3Options
from sicp_postprocessors.val3.post import Val3

__all__ = ["Val3", "Val3Options", "application_name"]
