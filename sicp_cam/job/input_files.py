"""Say what a file is, where it is not what was wanted: absent, given in the wrong place, or no measurement at all."""

from __future__ import annotations

import contextlib
import itertools
import re
from collections.abc import Mapping
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.options.values import closest
from sicp_cam.plugins import roles

__all__ = ["FLAGS", "absent", "is_pose", "no_job", "wrong_places"]

FLAGS: Mapping[str, str] = {"part": "--cad", "scan": "--scan", "path": "--path"}
"""The flag that takes a file of each role."""

_NAMES_LOOKED_AT = 10_000
_POSE_BYTES = 4096


def absent(path: Path) -> str:
    """Say that a file does not exist, and which one of its folder may have been meant."""
    folder = path.parent
    if not folder.is_dir():
        return f"no such file; there is no folder {printable(str(folder))}"
    names: list[str] = []
    with contextlib.suppress(OSError):
        names = [entry.name for entry in itertools.islice(folder.iterdir(), _NAMES_LOOKED_AT)]
    near = closest(path.name, names)
    return f"no such file (did you mean {printable(str(folder / near))}?)" if near else "no such file"


def no_job(path: Path) -> str | None:
    """Say what a file is that was given in place of a job file, by its suffix; None if that tells nothing.

    >>> no_job(Path("part.step"))
    'this is a part, no job file; give it with --cad'
    """
    readable = roles(path)
    if not readable:
        return None
    return f"this is {_either(readable)}, no job file; give it with {' or '.join(FLAGS[role] for role in readable)}"


def wrong_places(files: Mapping[str, Path]) -> dict[str, str]:
    """Find files that cannot be read in the role in which they were given, but in another one; opens none.

    Parameters
    ----------
    files
        File by role.

    Returns
    -------
    dict
        What is wrong by role; of two files in each other's place the first only.

    >>> wrong_places({"part": Path("scan.asc"), "scan": Path("part.step")})
    {'part': 'scan.asc is read as a scan, not as a part: are --cad and --scan swapped?'}
    """
    readable = {role: roles(path) for role, path in files.items()}
    wrong: dict[str, str] = {}
    paired: set[str] = set()
    for role, known in readable.items():
        if role in known or not known or role in paired:
            continue
        swapped = [other for other in known if role in readable.get(other, ())]
        paired.update(swapped)
        flag = FLAGS[role]
        both = " and ".join(FLAGS[each] for each in FLAGS if each in (role, *swapped[:1]))
        advice = f": are {both} swapped?" if swapped else f"; give another file with {flag}"
        wrong[role] = f"{printable(str(files[role]))} is read as {_either(known)}, not as a {role}{advice}"
    return wrong


def is_pose(path: Path) -> bool:
    """Return whether a file holds four rows of four numbers, the last of them 0 0 0 1: a pose, not points."""
    try:
        if path.stat().st_size > _POSE_BYTES:
            return False
        lines = path.read_text(encoding="utf-8-sig").splitlines()
        stated = [line.partition("#")[0].strip() for line in lines]
        rows = [[float(word) for word in re.split(r"[,;\s]+", line)] for line in stated if line]
    except (OSError, ValueError):
        return False
    return [len(row) for row in rows] == [4, 4, 4, 4] and rows[3] == [0.0, 0.0, 0.0, 1.0]


def _either(known: tuple[str, ...]) -> str:
    return " or ".join(f"a {role}" for role in known)
