"""Correct CAM tool paths to the scanned shape of sagging parts with Subdivision-ICP.

::

    import sicp_cam

    result = sicp_cam.correct(cad="part.step", scan="scan.ply", path="trim.apt")
    result.write("val3", "out/")
    result.report("report.pdf")
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sicp_cam.correction import PartRegistration, register
    from sicp_cam.errors import (
        AmbiguousPoseError,
        CadError,
        FormatError,
        InputError,
        JobError,
        OutputError,
        PathError,
        RegistrationError,
        ReportError,
        SicpError,
        UnitError,
        WarningsError,
    )
    from sicp_cam.findings import Finding, Level
    from sicp_cam.model import (
        Contour,
        Event,
        EventKind,
        Part,
        Program,
        Scan,
        Source,
        Status,
        ToolPath,
        TriangleMesh,
    )
    from sicp_cam.scripting import correct, read_part, read_path, read_scan

__all__ = [
    "AmbiguousPoseError",
    "CadError",
    "Contour",
    "Event",
    "EventKind",
    "Finding",
    "FormatError",
    "InputError",
    "JobError",
    "Level",
    "OutputError",
    "Part",
    "PartRegistration",
    "PathError",
    "Program",
    "RegistrationError",
    "ReportError",
    "Scan",
    "SicpError",
    "Source",
    "Status",
    "ToolPath",
    "TriangleMesh",
    "UnitError",
    "WarningsError",
    "correct",
    "read_part",
    "read_path",
    "read_scan",
    "register",
]

_HOMES = {
    "errors": (
        """AmbiguousPoseError CadError FormatError InputError JobError OutputError PathError RegistrationError
        ReportError SicpError UnitError WarningsError"""
    ),
    "findings": "Finding Level",
    "model": "Contour Event EventKind Part Program Scan Source Status ToolPath TriangleMesh",
    "correction": "PartRegistration register",
    "scripting": "correct read_part read_path read_scan",
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names.split()}


def __getattr__(name: str) -> object:
    """Load a public name from its module when it is first used, so that the command line starts without scipy."""
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"sicp_cam.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
