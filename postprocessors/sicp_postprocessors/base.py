"""What a postprocessor is: options, findings before it writes, and files."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath
from typing import Any, ClassVar

from sicp_cam.errors import OutputError, PathError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.model import EventKind, Program
from sicp_postprocessors.checks import common_findings
from sicp_postprocessors.options import NoOptions, build_options

__all__ = ["SAFETY_NOTE", "Postprocessor", "failures", "head_remarks"]

SAFETY_NOTE = "not a safety function: verify at reduced speed"
_NAMED_FAILURES = 5


def failures(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings that forbid a program."""
    return [finding for finding in findings if finding.level is Level.FAIL]


def head_remarks(program: Program) -> list[str]:
    """Return what the head of every program says: its name, what made it from what, and that it protects nobody."""
    return [program.name, *program.notes, *program.overridden, SAFETY_NOTE]


class Postprocessor(ABC):
    """Turns a program into the files of one controller.

    A post is pure: it touches no disk and no clock, and the same program gives the same bytes. Controllers that take
    lines of text derive from `template.LinePostprocessor`, which asks them for words and sees to the rest; a whole post
    stands there as an example.
    """

    name: ClassVar[str]
    """Short name, as it stands in a job file."""
    summary: ClassVar[str]
    """One line for the list of plug-ins."""
    Options: ClassVar[type[Any]] = NoOptions
    """Frozen dataclass of the options: each field with a default, and under it a docstring that the user reads."""
    suffix: ClassVar[str] = ""
    """Suffix of the file that it writes, with its dot; none where a program is a folder."""
    holds_axes: ClassVar[bool] = True
    """False: its programs hold tips alone."""
    holds_feeds: ClassVar[bool] = True
    """False: its programs hold no speeds."""
    carries_frame: ClassVar[bool] = False
    """True: its programs state the pose of their frame, so that the operator sees and can change it."""
    written_events: ClassVar[frozenset[EventKind]] = frozenset()
    """Kinds of events that it has words for; others are told as findings, because they would be lost."""
    missing_feed: ClassVar[Level] = Level.FAIL
    """How much a cutting move without feed matters to the controller."""
    options: Any
    """The options of this post, an instance of `Options`."""

    def __init__(self, options: Mapping[str, object] | None = None) -> None:
        """Take options by name; strings are converted to the type of their field.

        Raises
        ------
        JobError
            With every option that is unknown or does not fit.
        """
        self.options = build_options(self.name, self.Options, options or {})

    @classmethod
    def capabilities(cls) -> dict[str, str]:
        """Return what the programs of this post can hold, in words, for the list of plug-ins."""
        held = ["tips", *(["tool axes"] if cls.holds_axes else []), *(["feeds"] if cls.holds_feeds else [])]
        return {
            "moves": " and ".join([", ".join(held[:-1]), held[-1]] if len(held) > 1 else held),
            "events": ", ".join(sorted(cls.written_events)) or "none",
            "frame": "stated in the program" if cls.carries_frame else "that of the coordinates; told, not stated",
            "long paths": "divided" if "max_moves_per_program" in cls.Options.__dataclass_fields__ else "one file",
        }

    def preflight(self, program: Program) -> list[Finding]:
        """Return everything that the controller would refuse or that the operator should know, with move indices.

        A subclass adds to this list. A finding of level FAIL makes `write` raise.
        """
        return common_findings(program, self.missing_feed)

    def write(self, program: Program, noticed: Iterable[Finding] | None = None) -> dict[str, bytes]:
        """Return the files of a program: relative names with forward slashes, and their bytes.

        Parameters
        ----------
        program
            What is to be written.
        noticed
            What `preflight` has returned for this program, where it has been asked already; it can take long.

        Raises
        ------
        PathError
            If `preflight` finds a failure.
        OutputError
            If the post itself makes a file that may not be written.
        """
        failed = failures(self.preflight(program) if noticed is None else noticed)
        if failed:
            told = [f"{f.where}: {f.message}" if f.where else f.message for f in failed[:_NAMED_FAILURES]]
            more = [f"and {len(failed) - _NAMED_FAILURES} more"] if len(failed) > _NAMED_FAILURES else []
            raise PathError(f"post {self.name} refuses {printable(program.name)!r}: {'; '.join(told + more)}")
        files = self.files(program)
        for file in files:
            if not file or PurePosixPath(file).is_absolute() or ".." in PurePosixPath(file).parts or "\\" in file:
                raise OutputError(
                    f"post {self.name} names a file outside its folder: {printable(file)!r}; mend the post"
                )
        return files

    def main_file(self, files: Mapping[str, bytes]) -> str:
        """Return the name of the file that the controller opens, and readers too: the only one, or the first."""
        return next(iter(files))

    def reading(self) -> Mapping[str, object] | str:
        """Return what the reader of the written programs must be told, or why none can compare them with the path.

        What is written is read back and compared before it is kept, wherever a post says how; tips and axes in the
        program frame.
        """
        return f"post {self.name} does not say how its programs are read"

    @abstractmethod
    def files(self, program: Program) -> dict[str, bytes]:
        """Return the files of a program that has passed `preflight`; called by `write` only."""
