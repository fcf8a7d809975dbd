"""How far a run has come: a bar on a terminal, log lines elsewhere."""

from __future__ import annotations

import contextlib
import logging
import os
import sys
from collections.abc import Callable, Iterator

__all__ = ["progress_shown"]

_log = logging.getLogger("sicp_cam.cli")


@contextlib.contextmanager
def progress_shown(quiet: bool) -> Iterator[Callable[[str, float], None]]:
    """Give a function that takes the name of the step and the fraction done, 0 to 1, and shows them.

    Nothing but log lines appears where stderr is no terminal that can move its cursor.
    """
    if quiet or not _moving_terminal():
        yield _logged()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
        task = bar.add_task("", total=1.0)

        def show(step: str, fraction: float) -> None:
            bar.update(task, description=step, completed=fraction)

        yield show


def _logged() -> Callable[[str, float], None]:
    told: list[str] = []

    def tell(step: str, fraction: float) -> None:
        if told[-1:] != [step]:
            told.append(step)
            _log.info("%s ...", step)

    return tell


def _moving_terminal() -> bool:
    terminal = sys.stderr is not None and sys.stderr.isatty()
    return terminal and os.environ.get("TERM", "").lower() not in ("dumb", "unknown", "")
