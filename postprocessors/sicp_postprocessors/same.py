"""The program that was read, written again in its own words with the corrected coordinates.

Codes: 650 the program cannot be written again, 651 an override has no place in it. The findings of whoever writes the
program again keep their codes.
"""

from __future__ import annotations

from collections.abc import Mapping

from sicp_cam.findings import Finding, Level
from sicp_cam.model import EventKind, Program, Rewritten
from sicp_postprocessors.base import Postprocessor, failures
from sicp_postprocessors.checks import frame_findings, name_findings
from sicp_postprocessors.text import file_stem

__all__ = ["Same"]


class Same(Postprocessor):
    """The words, comments and layout of the program that was read; only coordinates, axes and inverse times differ.

    Where nothing is corrected, every byte is as it was: so there is no head of ours, and a program with an overridden
    gate, which must say so, is refused.
    """

    name = "same"
    summary = "the program that was read, in its own dialect, with corrected coordinates"
    written_events = frozenset(EventKind)
    missing_feed = Level.WARN

    def __init__(self, options: Mapping[str, object] | None = None) -> None:
        super().__init__(options)
        self._last: tuple[Program, Rewritten] | None = None

    def reading(self) -> str:
        """Say nothing: whoever writes the program again has read it back already."""
        return ""

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, and those of writing the program again."""
        findings = [*super().preflight(program), *_refusals(program)]
        if failures(findings):
            return findings
        remedy = "let the control run the program in the frame T_scan_part of the result, or run with --frame scan"
        return [
            *findings,
            *name_findings(program, file_stem(program.name)),
            *frame_findings(program, Level.WARN, remedy),
            *self._rewritten(program).findings,
        ]

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the one file, with the suffix of the program that was read."""
        original = program.path.original
        suffix = original.suffix if original is not None else ""
        return {file_stem(program.name) + suffix: self._rewritten(program).content}

    def _rewritten(self, program: Program) -> Rewritten:
        """Write the program again, once for `preflight` and `files` of the same program."""
        if self._last is None or self._last[0] is not program:
            original, moves = program.path.original, program.source_moves
            written = original.rewritten(program.path, moves) if original is not None and moves is not None else None
            self._last = (program, written or Rewritten(b""))
        return self._last[1]


def _refusals(program: Program) -> list[Finding]:
    cannot = "the program cannot be written again in its own words"
    if program.path.original is None:
        why = "its format cannot be written again (APT, CL, G-code and CSV can); use another post"
        return [Finding(650, Level.FAIL, f"{cannot}: {why}")]
    if program.source_moves is None:
        return [Finding(650, Level.FAIL, f"{cannot}: which of its moves is which is not known; use another post")]
    if program.overridden:
        why = "it has no place to say that a gate was overridden; use another post, or keep the limits"
        return [Finding(651, Level.FAIL, f"{cannot}: {why}")]
    return []
