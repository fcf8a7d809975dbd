"""Judge a VAL3 application without a controller: what it would refuse, what would move wrong, what is risky.

Codes: 850 not well-formed, 851 encoding and line ends, 852 files that are listed or not, 853 names, 854 unit,
855 declarations, 856 numbers, 857 speeds and blends, 858 configurations and orientations, 859 frames and the world,
860 outputs without link, 861 statements, 862 instructions not known, 863 not on a CS9, 864 not declared, 865 not used,
866 beyond an array, 867 arguments and attributes, 868 blends and points along the path, 869 waiting for moves to end.
"""

from __future__ import annotations

from pathlib import Path

from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.val3.check_data import check_data
from sicp_formats.val3.check_files import load
from sicp_formats.val3.check_motion import check_motion
from sicp_formats.val3.check_moves import check_moves
from sicp_formats.val3.check_names import check_names
from sicp_formats.val3.check_report import Report
from sicp_formats.val3.check_symbols import check_symbols
from sicp_formats.val3.check_syntax import check_syntax
from sicp_formats.val3.project import project_file

__all__ = ["check"]


def check(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> tuple[Finding, ...]:
    """Return what is wrong with a VAL3 application of s5 to s8, failures first.

    Parameters
    ----------
    path
        The folder, or any file of it.
    limits
        Caps on the files and on the walk along the path.

    Raises
    ------
    FormatError
        If there is no application, or its .pjx cannot be read.
    """
    project = project_file(path)
    report = Report(project.parent)
    application = load(project, limits, report)
    check_names(application, report)
    check_data(application, report)
    check_syntax(application, report)
    check_symbols(application, report)
    check_moves(application, report)
    check_motion(application, report, limits.path_points)
    return report.findings()
