"""What all commands share: where words go, how loud, and what an error becomes.

stdout carries results only, stderr everything else. Each problem is one line, `sicp-cam: error: ...`; a traceback shows
with `-vv`, and always stands in the log file.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, TextIO

from cyclopts import Parameter

from sicp_cam.errors import JobError, OutputError, SicpError, printable

__all__ = ["Talk", "forgiving_streams", "logging_to", "reported", "say", "say_json", "terminable"]

_LOGGERS = ("sicp_cam", "sicp_formats", "sicp_postprocessors", "py.warnings")
_LEVEL_NAMES = {logging.WARNING: "warning", logging.INFO: "info", logging.DEBUG: "debug"}
_LINE = 4000

_log = logging.getLogger("sicp_cam.cli")


@Parameter(name="*")
@dataclass(frozen=True)
class Talk:
    """How much is said beside the result.

    Parameters
    ----------
    quiet
        Say errors only; no progress.
    verbose
        Say more: -v the steps, -vv everything, and tracebacks.
    log_file
        Also append everything to this file, with times.
    """

    quiet: Annotated[bool, Parameter(alias="-q", negative="", show_default=False)] = False
    verbose: Annotated[int, Parameter(alias="-v", count=True, show_default=False)] = 0
    log_file: Path | None = None


class TerminatedError(BaseException):
    """The system asked this process to end."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


def reported(work: Callable[[], int], *, as_json: bool = False) -> int:
    """Run the work of a command and return its exit code; an error is told on stderr, and becomes a code.

    Parameters
    ----------
    work
        Returns the exit code.
    as_json
        Also put a document that tells of the failure on stdout, so that there always is exactly one.
    """
    try:
        return work()
    except BaseException as error:
        _log.debug("where it came from", exc_info=error)
        code, kind, problems = _verdict(error)
    for problem in problems:
        _tell(kind, problem)
    if as_json:
        number = 900 + (code if code < 100 else 0)
        findings = [
            {"code": number, "level": "fail", "message": printable(problem, _LINE), "where": ""} for problem in problems
        ]
        say_json({"schema": "sicp-cam/1", "status": "fail", "exit_code": code, "findings": findings})
    return code


def _verdict(error: BaseException) -> tuple[int, str, tuple[str, ...]]:
    if isinstance(error, JobError):
        return error.exit_code, "error", error.problems
    if isinstance(error, SicpError):
        return error.exit_code, "error", (str(error),)
    if isinstance(error, KeyboardInterrupt):
        return 130, "error", ("interrupted",)
    if isinstance(error, TerminatedError):
        return 128 + error.number, "error", (f"ended by {error}",)
    return 1, "bug", (f"{type(error).__name__}: {error}; please report it, with what -vv says",)


def say(text: str) -> None:
    """Put a line of the result on stdout; a reader that has gone away is no error."""
    _put(sys.stdout, text)


def say_json(document: Any) -> None:
    """Put a result on stdout as one JSON document of finite numbers and plain ASCII."""
    say(json.dumps(document, allow_nan=False, indent=2))


@contextlib.contextmanager
def logging_to(talk: Talk) -> Iterator[None]:
    """Send the log of the package to stderr and to the log file, as loud as the user wants, and no longer than this.

    Raises
    ------
    JobError
        If both -q and -v are given.
    OutputError
        If the log file cannot be opened.
    """
    if talk.quiet and talk.verbose:
        raise JobError("-q and -v exclude each other; leave one out")
    level = logging.ERROR if talk.quiet else (logging.WARNING, logging.INFO, logging.DEBUG)[min(talk.verbose, 2)]
    handlers: list[logging.Handler] = [_StderrHandler(level)]
    if talk.log_file is not None:
        handlers.append(_file_handler(talk.log_file))
    loggers = [logging.getLogger(name) for name in _LOGGERS]
    before = [logger.level for logger in loggers]
    logging.captureWarnings(True)
    for logger in loggers:
        logger.setLevel(min(handler.level for handler in handlers))
        for handler in handlers:
            logger.addHandler(handler)
    try:
        yield
    finally:
        logging.captureWarnings(False)
        for logger, earlier in zip(loggers, before, strict=True):
            logger.setLevel(earlier)
            for handler in handlers:
                logger.removeHandler(handler)
        for handler in handlers:
            handler.close()


@contextlib.contextmanager
def terminable() -> Iterator[None]:
    """Turn SIGTERM and a lost terminal into an exception, so that what was begun is undone on the way out."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [signal.SIGTERM] + ([signal.SIGHUP] if sys.platform != "win32" else [])
    before = {number: signal.signal(number, _terminate) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)


def forgiving_streams() -> None:
    """Let names that the terminal's encoding lacks be written escaped instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")


def _terminate(number: int, frame: FrameType | None) -> None:
    raise TerminatedError(number)


def _tell(kind: str, text: str) -> None:
    _put(sys.stderr, f"sicp-cam: {kind}: {printable(text, _LINE)}")


def _put(stream: TextIO | None, text: str) -> None:
    if stream is None:
        return
    try:
        stream.write(f"{text}\n")
        stream.flush()
    except BrokenPipeError:
        # Python flushes once more at its end; let that find something open.
        with contextlib.suppress(OSError, ValueError), Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), stream.fileno())


class _StderrHandler(logging.Handler):
    """Writes to whatever stderr is at the moment, so that a progress bar can step aside."""

    def emit(self, record: logging.LogRecord) -> None:
        level = _LEVEL_NAMES.get(record.levelno, "error")
        _tell(level, record.getMessage())
        if record.exc_info and record.exc_info[0] is not None:
            trace = logging.Formatter().formatException(record.exc_info)
            _put(sys.stderr, "\n".join(printable(line, _LINE) for line in trace.splitlines()))


def _file_handler(path: Path) -> logging.Handler:
    try:
        handler = logging.FileHandler(path, encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise OutputError(f"{printable(str(path))}: the log cannot be written: {error.strerror}") from error
    handler.setLevel(logging.DEBUG)
    handler.setFormatter(_SafeFormatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    return handler


class _SafeFormatter(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return "\n".join(printable(line, _LINE) for line in super().format(record).splitlines())
