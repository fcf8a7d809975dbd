"""The one place that writes results: all files of a run, or none.

Everything is written and synced in a hidden folder inside the output folder first, then moved into place: files one by
one, folders (a VAL3 application, the pictures) whole, `result.json` last. What stood there before is set aside and
comes back if anything goes wrong, an interrupt included. A folder without `result.json` is not a result.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import secrets
import shutil
import signal
import sys
import threading
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath

from sicp_cam.errors import OutputError, printable
from sicp_cam.output.names import check_names

__all__ = ["MANIFEST", "SUPERSEDED", "check_free", "supersede", "write"]

MANIFEST = "result.json"
"""The file that makes a folder a result."""

SUPERSEDED = ".superseded"
"""What is appended to the name of a program that no longer holds."""

_NAMED = 8
_log = logging.getLogger(__name__)


def check_free(out: Path, names: Iterable[str], force: bool = False, inputs: Iterable[Path] = ()) -> None:
    """Check that files could be written, before the long work begins; changes nothing.

    Parameters
    ----------
    out
        The output folder; it need not exist.
    names
        Relative names with `/`, of files or of folders.
    force
        True if existing files are to be replaced.
    inputs
        Files that must never be replaced.

    Raises
    ------
    OutputError
        If a name would leave the folder or is not portable, something exists already, an input would be replaced,
        a folder that would be replaced holds foreign files, or the folder cannot be written to.
    """
    names = list(names)
    check_names(names)
    _check_folder(out)
    tops = _tops(names)
    existing = [top for top in tops if os.path.lexists(out / top)]
    if existing and not force:
        raise OutputError(f"{printable(str(out))}: {_told(out, existing)}")
    for top in existing:
        _check_replaceable(out / top, [name for name in names if name.startswith(f"{top}/")], inputs)


def write(out: Path, files: Mapping[str, bytes], *, force: bool = False, inputs: Iterable[Path] = ()) -> list[Path]:
    """Write all files of a result below a folder, or leave the folder as it was.

    A folder among the names replaces the earlier one of that name whole, so that no file of an earlier program stays
    between those of the new one. Two runs into the same folder come one after the other (on POSIX systems).

    Parameters
    ----------
    out
        The output folder; made if it does not exist.
    files
        Content by relative name with `/`; `result.json` is put in place last.
    force, inputs
        As in `check_free`, which is asked again.

    Returns
    -------
    list of Path
        The files written, in the order of `files`.

    Raises
    ------
    OutputError
        If anything stands in the way; the message gives the reason, and nothing has changed.
    """
    missing = [folder for folder in (out, *out.parents) if not os.path.lexists(folder)]
    stage = out / f".sicp-cam-{secrets.token_hex(8)}"
    done = False
    try:
        out.mkdir(parents=True, exist_ok=True)
        with _alone(out):
            check_free(out, files, force, inputs)
            stage.mkdir()
            _stage(stage / "new", files)
            with _uninterrupted():
                _move_into_place(out, stage, _tops(files))
                done = True
                _remove(stage)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        reason = error.strerror or str(error)
        raise OutputError(f"{printable(str(out))}: cannot be written: {reason}{_state(out, stage)}") from error
    finally:
        if not done:
            if not _stranded(out, stage):
                _remove(stage)
            for folder in missing:
                with contextlib.suppress(OSError):
                    folder.rmdir()
    return [out / name for name in files]


def supersede(out: Path, inputs: Iterable[Path] = ()) -> list[str]:
    """Rename the programs of an earlier result, because a newer run found that they no longer hold.

    Each program `X` of the folder's `result.json` becomes `X.superseded`, in place of an older one of that name, and so
    does `result.json`: nothing is lost, but no controller loads it and no script takes it for a result.

    Returns
    -------
    list of str
        The names that were changed; empty if the folder holds no result.

    Raises
    ------
    OutputError
        If a program cannot be renamed.
    """
    names = _programs(out)
    if names is None:
        return []
    kept = {Path(path).resolve() for path in inputs}
    tops = [top for top in _tops(names) if os.path.lexists(out / top) and (out / top).resolve() not in kept]
    try:
        for top in [MANIFEST, *tops]:
            aside = out / f"{top}{SUPERSEDED}"
            if aside.is_dir() and not aside.is_symlink():
                _remove(aside)
            else:
                aside.unlink(missing_ok=True)
            (out / top).rename(aside)
    except OSError as error:
        raise OutputError(
            f"{printable(str(out))}: the earlier program no longer holds, and cannot be renamed:"
            f" {error.strerror or error}; remove it by hand"
        ) from error
    return tops


def _programs(out: Path) -> list[str] | None:
    """Return the names of the programs of the result in a folder; None if it holds no result of ours."""
    try:
        listed = json.loads((out / MANIFEST).read_bytes())["outputs"]
        names = [str(entry["path"]) for entry in listed if entry["kind"] == "program"]
        check_names([MANIFEST, *names])
    except (OSError, ValueError, KeyError, TypeError, OutputError):
        return None
    return names


def _told(out: Path, existing: list[str]) -> str:
    """Say what stands in the way, with the programs of a result that would be replaced."""
    programs = _tops(_programs(out) or []) if MANIFEST in existing else []
    listed = [*existing, *(top for top in programs if top not in existing and os.path.lexists(out / top))]
    names = ", ".join(printable(name, 60) for name in listed[:_NAMED]) + (" ..." if len(listed) > _NAMED else "")
    exists, it = ("exists", "it") if len(listed) == 1 else ("exist", "them")
    return f"{names} {exists} already; use --force (in Python force=True) to replace {it}, or another folder"


def _tops(names: Iterable[str]) -> list[str]:
    tops = dict.fromkeys(PurePosixPath(name).parts[0] for name in names)
    return sorted(tops, key=lambda top: top == MANIFEST)


def _check_folder(out: Path) -> None:
    nearest = next(folder for folder in (out.absolute(), *out.absolute().parents) if os.path.lexists(folder))
    if not nearest.is_dir():
        raise OutputError(f"{printable(str(nearest))}: is not a folder, so {printable(str(out))} cannot be one")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise OutputError(f"{printable(str(nearest))}: no permission to write there; use another --out")


def _check_replaceable(target: Path, new: list[str], inputs: Iterable[Path]) -> None:
    place = target.parent.resolve() / target.name
    for source in inputs:
        for known in (source.absolute(), source.resolve()):
            if place in (known, *known.parents):
                raise OutputError(f"{printable(str(target))}: would replace an input of this run; use another --out")
    if target.is_symlink():
        return  # the link itself is replaced, never what it points to
    if target.is_dir() != bool(new):
        what = "a folder and would become a file" if target.is_dir() else "a file and would become a folder"
        raise OutputError(f"{printable(str(target))}: is {what}; use another --name or --out")
    suffixes = {PurePosixPath(name).suffix for name in new if not name.endswith("/")}
    foreign = (Path(folder, name) for folder, _, held in os.walk(target) for name in held)
    for path in foreign if suffixes else ():
        if path.suffix not in suffixes:
            raise OutputError(
                f"{printable(str(path))}: not of a kind that this run writes, but its folder would be replaced whole; "
                "move it away, or use another --name or --out"
            )


@contextlib.contextmanager
def _alone(out: Path) -> Iterator[None]:
    if sys.platform == "win32":
        yield  # a folder cannot be locked there
        return
    import fcntl

    handle = os.open(out, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # some network shares know no locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # signals never arrive here
        return
    held: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: held.append(number))
        for number in (int(signal.SIGINT), int(signal.SIGTERM))
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        for number in dict.fromkeys(held):
            signal.raise_signal(number)


def _stage(new: Path, files: Mapping[str, bytes]) -> None:
    new.mkdir()
    for name, content in files.items():
        target = new / name
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("xb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        if target.stat().st_size != len(content):
            raise OutputError(f"{printable(name)}: {target.stat().st_size} of {len(content)} bytes arrived on the disk")
    for folder, _, _ in os.walk(new):
        _sync_folder(Path(folder))


def _move_into_place(out: Path, stage: Path, tops: list[str]) -> None:
    old = stage / "old"
    old.mkdir()
    try:
        if MANIFEST in tops and os.path.lexists(out / MANIFEST):
            (out / MANIFEST).rename(old / MANIFEST)  # from here on, the folder is no result
        for top in tops:
            _set_aside(out / top, old / top)
            (stage / "new" / top).replace(out / top)
        _sync_folder(out)
    except BaseException:
        _put_back(out, stage, tops)
        raise


def _set_aside(target: Path, aside: Path) -> None:
    if not os.path.lexists(target):
        return
    if not target.is_symlink() and not target.is_dir():
        with contextlib.suppress(OSError):  # not every file system can
            aside.hardlink_to(target)  # a second name: the file stays at its place until it is replaced
            return
    target.rename(aside)


def _put_back(out: Path, stage: Path, tops: list[str]) -> None:
    # Where each thing lies now says what had happened to it, so a second failure on the way does no harm.
    for top in reversed(tops):
        target, new, aside = out / top, stage / "new" / top, stage / "old" / top
        with contextlib.suppress(OSError):  # what stays away is told by _state
            if os.path.lexists(target) and not os.path.lexists(new):
                target.rename(new)
            if os.path.lexists(aside) and not os.path.lexists(target):
                aside.rename(target)


def _stranded(out: Path, stage: Path) -> list[str]:
    old = stage / "old"
    return [path.name for path in old.iterdir() if not os.path.lexists(out / path.name)] if old.is_dir() else []


def _state(out: Path, stage: Path) -> str:
    stranded = _stranded(out, stage)
    if not stranded:
        return "; nothing was changed"
    return f"; the earlier {', '.join(stranded)} could not be put back, look in {printable(str(stage))}"


def _remove(stage: Path) -> None:
    if not os.path.lexists(stage):
        return
    try:
        shutil.rmtree(stage)
    except OSError as error:
        _log.warning("%s: cannot be removed: %s", printable(str(stage)), error.strerror)


def _sync_folder(folder: Path) -> None:
    if sys.platform == "win32":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # not every file system can
            os.fsync(handle)
    finally:
        os.close(handle)
