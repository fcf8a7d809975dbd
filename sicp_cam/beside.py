"""Run work beside this thread, in one that an interrupted process does not wait for."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

__all__ = ["beside"]

_Answer = TypeVar("_Answer")


def beside(work: Callable[[], _Answer]) -> Future[_Answer]:
    """Start work in a daemon thread and return what will hold its answer, or the error that it raised.

    An executor would hold up Ctrl-C, or an error of this thread, until the work is done.

    >>> beside(lambda: 6 * 7).result()
    42
    """
    future: Future[_Answer] = Future()

    def run() -> None:
        try:
            answer = work()
        except BaseException as error:
            future.set_exception(error)
        else:
            future.set_result(answer)

    threading.Thread(target=run, daemon=True).start()
    return future
