"""Take the bytes of an input file, refuse what cannot be a CAM input, and record where an object came from."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import stat
import tempfile
import zlib
from collections.abc import Iterator
from io import FileIO
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_cam.model import Source

__all__ = ["LongFile", "check_kind", "describe", "plain_file", "read_bytes", "unit_to_state"]

# A file that was never unpacked, or that a web server or Git put in place of the one that was asked for.
_FOREIGN = (
    (re.compile(rb"\x1f\x8b"), "a gzip archive; name it .gz behind its suffix, or unpack it first"),
    (re.compile(rb"PK\x03\x04"), "a zip archive; unpack it first"),
    (re.compile(rb"BZh[1-9]1AY&SY"), "a bzip2 archive; unpack it first"),
    (re.compile(rb"\xfd7zXZ\x00"), "an xz archive; unpack it first"),
    (re.compile(rb"7z\xbc\xaf\x27\x1c"), "a 7z archive; unpack it first"),
    (re.compile(rb"\x28\xb5\x2f\xfd"), "a zstd archive; unpack it first"),
    (re.compile(rb"%PDF-"), "a PDF document; export the data itself"),
    (
        re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:<!--.{0,400}?-->\s*)?<(?:!doctype\s+html|html[\s>])", re.I | re.S),
        "an HTML page, probably a log-in or error page of a download; fetch the file again",
    ),
    (
        re.compile(rb"version https://git-lfs\.github\.com/spec/"),
        "a Git LFS pointer and not the file itself; run 'git lfs pull'",
    ),
)


def read_bytes(path: Path, limits: Limits) -> bytes:
    """Return the whole content of a regular file, unpacked if its name ends with `.gz`.

    Raises
    ------
    FormatError
        If the file does not exist, is no regular file, may not be read, is empty or larger than `limits.file_bytes`,
        unpacks to more than that or than `limits.archive_ratio` allows, or is another archive, an HTML page, a PDF or
        a Git LFS pointer.
    """
    with _told(path):
        _status(path, limits)
        content = path.read_bytes()
    _check_size(path, len(content), limits)
    if path.suffix.lower() == ".gz":
        content = _unpacked(path, content, limits)
    check_kind(path, content)
    return content


class LongFile:
    """A file that is read in places, so that it never lies in memory as a whole.

    Parameters
    ----------
    path
        The file; a packed one is not unpacked.
    limits
        The cap on its size.

    Raises
    ------
    FormatError
        As `read_bytes` does.
    """

    def __init__(self, path: Path, limits: Limits) -> None:
        self.path = path
        with _told(path):
            status = _status(path, limits)
        self._size, self._written = status.st_size, status.st_mtime_ns
        check_kind(path, self.head(1024))

    def __len__(self) -> int:
        return self._size

    def head(self, size: int) -> bytes:
        """Return the first bytes, fewer if there are no more."""
        return b"".join(self.blocks(0, min(size, self._size), size))

    def blocks(self, begin: int, end: int, size: int) -> Iterator[memoryview]:
        """Yield the bytes from `begin` to `end`, so many at a time; each block takes the memory of the one before.

        Raises
        ------
        FormatError
            If the file can no longer be read, or is not what it was.
        """
        memory = memoryview(bytearray(min(size, end - begin)))
        with self._opened() as file:
            file.seek(begin)
            for start in range(begin, end, size):
                block = memory[: end - start]
                filled = 0
                while filled < len(block):
                    more = file.readinto(block[filled:])
                    if not more:
                        raise self._changed()
                    filled += more
                yield block

    def whole(self) -> bytes:
        """Return all bytes."""
        with self._opened() as file:
            content = file.read()
        if len(content) != self._size:
            raise self._changed()
        return content

    def sha256(self) -> str:
        """Return the SHA-256 of all bytes in hexadecimal digits."""
        with self._opened() as file:
            return hashlib.file_digest(file, "sha256").hexdigest()

    @contextlib.contextmanager
    def _opened(self) -> Iterator[FileIO]:
        """Open the file and see that it is still the same: what is read in places must belong together."""
        with _told(self.path), self.path.open("rb", buffering=0) as file:
            yield file
            status = os.fstat(file.fileno())
        if (status.st_size, status.st_mtime_ns) != (self._size, self._written):
            raise self._changed()

    def _changed(self) -> FormatError:
        return FormatError(self.path, "was written to while it was read; read it again when it is complete")


@contextlib.contextmanager
def plain_file(path: Path, content: bytes) -> Iterator[Path]:
    """Give a library that reads files itself one that is not packed: the file, or a copy for as long as it is needed.

    Parameters
    ----------
    path
        The file, as the user named it.
    content
        What `read_bytes` returned for it.
    """
    if path.suffix.lower() != ".gz":
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="sicp-cam-") as folder:
        copy = Path(folder) / path.stem
        copy.write_bytes(content)
        yield copy


def describe(path: Path, content: bytes | LongFile, *, format: str, unit: str, unit_stated: bool) -> Source:
    """Return the record of an input: its name, format, unit, and the SHA-256 of the file, packed if it is packed.

    >>> describe(Path("a.ply"), b"", format="PLY", unit="mm", unit_stated=False).sha256[:8]
    'e3b0c442'
    """
    if path.suffix.lower() == ".gz":
        content = path.read_bytes()
    sha256 = content.sha256() if isinstance(content, LongFile) else hashlib.sha256(content).hexdigest()
    return Source(str(path), format, sha256, unit, unit_stated)


def check_kind(path: Path, content: bytes) -> None:
    """Refuse a file whose first 1024 bytes are those of an archive, an HTML page, a PDF or a Git LFS pointer.

    Raises
    ------
    FormatError
        With what it is.
    """
    for signature, meaning in _FOREIGN:
        if signature.match(content[:1024]):
            raise FormatError(path, f"is {meaning}", byte=0)


@contextlib.contextmanager
def _told(path: Path) -> Iterator[None]:
    """Turn what the system says of a file into a FormatError."""
    try:
        yield
    except FileNotFoundError:
        raise FormatError(path, "no such file; check the name and the folder") from None
    except OSError as error:
        raise FormatError(path, f"cannot be read ({error.strerror or error})") from None
    except FormatError:
        raise
    except ValueError as error:  # a NUL in the name
        raise FormatError(path, f"is no possible file name ({error})") from None


def _status(path: Path, limits: Limits) -> os.stat_result:
    """Return what the system knows of a regular file of a possible size."""
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise FormatError(path, "is a folder; name a file in it")
    if not stat.S_ISREG(status.st_mode):
        raise FormatError(path, "is no regular file (a device or a pipe); copy the data into a file first")
    _check_size(path, status.st_size, limits)
    return status


def unit_to_state(source: Source | None, unit: str) -> str:
    """Return the unit that a writer may state, "" where millimetres were only taken, because no one said otherwise.

    A writer that stated such a unit would make a fact of it.
    """
    return unit if source is None or source.unit_stated or source.unit != "mm" else ""


def _unpacked(path: Path, packed: bytes, limits: Limits) -> bytes:
    """Unpack the members of a gzip file, never further than the limits allow."""
    cap = int(min(limits.file_bytes, len(packed) * limits.archive_ratio))
    parts: list[bytes] = []
    size = 0
    while packed:
        member = zlib.decompressobj(wbits=31)
        try:
            parts.append(member.decompress(packed, cap + 1 - size))
        except zlib.error:
            if parts and not packed.strip(b"\0"):
                break  # gzip files may be padded with zeros
            raise FormatError(path, "is no gzip file, or a damaged one; pack it again", byte=0) from None
        size += len(parts[-1])
        if size > cap:
            what = (
                f"unpacks to more than {cap} bytes, the limits being file_bytes = {limits.file_bytes} and "
                f"archive_ratio = {limits.archive_ratio:g}; unpack it yourself if it is to be trusted"
            )
            raise FormatError(path, what)
        if not member.eof:
            raise FormatError(path, "the gzip file ends in the middle of its data; it is cut short", byte=len(packed))
        packed = member.unused_data
    if not size:
        raise FormatError(path, "the gzip file has nothing in it; export it again", byte=0)
    return b"".join(parts)


def _check_size(path: Path, size: int, limits: Limits) -> None:
    if size == 0:
        raise FormatError(path, "the file is empty; export it again", byte=0)
    if size > limits.file_bytes:
        raise FormatError(path, f"has {size} bytes, more than the limit file_bytes = {limits.file_bytes}; raise it")
