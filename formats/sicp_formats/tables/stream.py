"""A long text file, block by block of whole lines, so that it never lies in memory as a whole.

Small files, and those that are packed or UTF-16, are read and decoded at once; the others as they are, and hashed
beside the work on them.
"""

from __future__ import annotations

import codecs
import hashlib
import stat
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_cam.model import Source
from sicp_formats.source import check_kind, describe, read_bytes

__all__ = ["Block", "TextStream", "open_text"]

BLOCK_BYTES = 2**20
"""About the size of a block: large enough for the parser, small enough for the cache."""

HEAD_BYTES = 2**22
"""What `TextStream.head` shows at most, whatever the size of a block."""

_KIND_BYTES = 1024
_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


@dataclass(frozen=True, slots=True)
class Block:
    """Whole lines in a row, each ended by LF except perhaps the last one of the file.

    Parameters
    ----------
    text
        The lines.
    line, byte
        1-based line and 0-based byte at which they begin; bytes count in the text as it was decoded.
    lines
        Number of lines.
    """

    text: bytes
    line: int
    byte: int
    lines: int


class TextStream:
    """Lines taken from the front of a text.

    Parameters
    ----------
    path
        The file, for messages.
    file
        Its text, at the beginning.
    limits
        The cap on lines.
    content
        All bytes of the file where they were read at once; None where `file` is the file itself.
    """

    def __init__(self, path: Path, file: BinaryIO, limits: Limits, content: bytes | None) -> None:
        self.path = path
        self._file, self._limits, self._content = file, limits, content
        self._digest, self._worker = hashlib.sha256(), ThreadPoolExecutor(1)
        self._hashing: Future[None] | None = None
        self._rest, self._line, self._byte, self._ended = b"", 1, 0, False
        self._returns_only = False
        self._fill(HEAD_BYTES)
        if b"\n" not in self._rest and b"\r" in self._rest:  # lines as old Macintoshes ended them
            self._returns_only = True
            self._rest = self._rest.replace(b"\r", b"\n")
        if self._rest.startswith(codecs.BOM_UTF8):
            self._rest, self._byte = self._rest[len(codecs.BOM_UTF8) :], len(codecs.BOM_UTF8)

    @property
    def line(self) -> int:
        """Line that comes next, 1-based."""
        return self._line

    def head(self) -> Block:
        """Show the first lines, up to `HEAD_BYTES`, and leave them where they are; to be called first."""
        return self._block(len(self._rest) if self._ended else self._rest.rfind(b"\n") + 1)

    def take(self, lines: int | None = None) -> Block | None:
        """Take the next lines: a block of them, never more than `lines`; None at the end.

        Raises
        ------
        FormatError
            If a line has no end within the limit, or the file can no longer be read.
        """
        while b"\n" not in self._rest and not self._ended:
            if len(self._rest) > self._limits.line_bytes:
                what = f"the line has more bytes than the limit line_bytes = {self._limits.line_bytes}; is it text?"
                raise FormatError(self.path, what, line=self._line)
            self._fill(BLOCK_BYTES)
        if not self._rest or lines == 0:
            return None
        block = self._block(self._end(lines))
        self._rest = self._rest[len(block.text) :]
        self._line += block.lines
        self._byte += len(block.text)
        return block

    def source(self, *, format: str, unit: str, unit_stated: bool) -> Source:
        """Return the record of the file, all of which must have been taken."""
        if self._content is not None:
            return describe(self.path, self._content, format=format, unit=unit, unit_stated=unit_stated)
        self._settle()
        return Source(str(self.path), format, self._digest.hexdigest(), unit, unit_stated)

    def close(self) -> None:
        """Let go of the file."""
        self._worker.shutdown()
        self._file.close()

    def _block(self, end: int) -> Block:
        text = self._rest[:end]
        ends = np.count_nonzero(np.frombuffer(text, np.uint8) == ord("\n"))  # much faster than bytes.count
        lines = int(ends) + (text != b"" and not text.endswith(b"\n"))
        return Block(text, self._line, self._byte, lines)

    def _end(self, lines: int | None) -> int:
        """Return how many bytes to take: whole lines, about a block of them, and no more lines than asked for."""
        # Less than a block beyond this one goes with it: it would only be a small one.
        size = BLOCK_BYTES if len(self._rest) >= 2 * BLOCK_BYTES else len(self._rest)
        end = self._rest.rfind(b"\n", 0, size) + 1 or self._rest.find(b"\n") + 1 or len(self._rest)
        if self._ended and len(self._rest) <= size:
            end = len(self._rest)
        if lines is None or self._rest.count(b"\n", 0, end) < lines:
            return end
        return int(np.flatnonzero(np.frombuffer(self._rest, np.uint8, end) == ord("\n"))[lines - 1]) + 1

    def _fill(self, size: int) -> None:
        try:
            more = self._file.read(size)
        except OSError as error:
            raise FormatError(self.path, f"cannot be read ({error.strerror or error})") from None
        self._ended = len(more) < size
        if self._content is None:
            self._settle()
            self._hashing = self._worker.submit(self._digest.update, more)
        self._rest += more.replace(b"\r", b"\n") if self._returns_only else more

    def _settle(self) -> None:
        if self._hashing is not None:
            self._hashing.result()


@contextmanager
def open_text(path: Path, limits: Limits) -> Iterator[TextStream]:
    """Open a file of text for as long as it is needed.

    Raises
    ------
    FormatError
        As `source.read_bytes` does, or if the file is marked as UTF-16 and is not.
    """
    file = _long_file(path, limits)
    content = None if file is not None else read_bytes(path, limits)
    stream = TextStream(path, file or BytesIO(_decoded(path, content or b"")), limits, content)
    try:
        yield stream
    finally:
        stream.close()


def _long_file(path: Path, limits: Limits) -> BinaryIO | None:
    """Return a file that is worth reading in blocks, or None where `read_bytes` does or refuses."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode) or not HEAD_BYTES < status.st_size <= limits.file_bytes:
            return None
        if path.suffix.lower() == ".gz":
            return None
        file = path.open("rb", buffering=0)
    except (OSError, ValueError):
        return None
    try:
        start = file.read(_KIND_BYTES)
        check_kind(path, start)
        file.seek(0)
    except (FormatError, OSError) as error:
        file.close()
        if isinstance(error, FormatError):
            raise
        return None
    if start.startswith(_UTF16):
        file.close()
        return None
    return file


def _decoded(path: Path, content: bytes) -> bytes:
    """Return UTF-16 as UTF-8, and everything else as it is."""
    if not content.startswith(_UTF16):
        return content
    try:
        return content.decode("utf-16").encode("utf-8")
    except UnicodeError as error:
        start = getattr(error, "start", 0)
        raise FormatError(path, "is marked as UTF-16 and is not; save it as UTF-8", byte=start) from None
