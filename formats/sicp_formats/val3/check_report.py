"""Collect what a linter finds, so that one mistake made ten thousand times is told a few times and counted."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from sicp_cam.errors import FormatError, printable
from sicp_cam.findings import Finding, Level

__all__ = ["Report"]

_TOLD = 10
_ORDER = {Level.FAIL: 0, Level.WARN: 1, Level.INFO: 2}


@dataclass(slots=True)
class Report:
    """The findings about one application; files are named as seen from its folder.

    Parameters
    ----------
    folder
        Folder of the application.
    """

    folder: Path
    _found: list[tuple[Level, int, Finding]] = field(default_factory=list)
    _counts: dict[tuple[int, Level, str], int] = field(default_factory=dict)

    def add(self, code: int, level: Level, message: str, file: Path, line: int = 0, *, kind: str = "") -> None:
        """Take a finding; of one code and `kind` only the first ten are told one by one.

        Parameters
        ----------
        code, level, message
            As in `Finding`.
        file, line
            Where; line 0 where the file as a whole is meant.
        kind
            What findings that differ in their names only have in common.
        """
        key = code, level, kind
        self._counts[key] = self._counts.get(key, 0) + 1
        if self._counts[key] <= _TOLD:
            place = printable(self._relative(file)) + (f", line {line}" if line > 0 else "")
            self._found.append((level, len(self._found), Finding(code, level, printable(message, 400), place)))

    def error(self, code: int, error: FormatError, file: Path) -> None:
        """Take an error of a reader as a failure."""
        what = error.what if error.byte is None else f"{error.what} (byte {error.byte})"
        self.add(code, Level.FAIL, what, file, error.line or 0)

    def findings(self) -> tuple[Finding, ...]:
        """Return the findings: failures first, then warnings, then notes, each in the order of the files."""
        more = [
            (level, len(self._found) + at, Finding(code, level, f"and {count - _TOLD} more of this kind"))
            for at, ((code, level, _), count) in enumerate(self._counts.items())
            if count > _TOLD
        ]
        ordered = sorted([*self._found, *more], key=lambda found: (_ORDER[found[0]], found[1]))
        return tuple(finding for _, _, finding in ordered)

    def _relative(self, file: Path) -> str:
        try:
            return file.relative_to(self.folder).as_posix() or file.name
        except ValueError:
            return file.name
