import errno
import json
import os
import stat
import threading
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sicp_cam.errors import OutputError
from sicp_cam.output import check_free, supersede, write
from sicp_cam.output.names import joined, name_problem

NEW = {
    "edge.csv": b"new csv",
    "edge/edge.pjx": b"new pjx",
    "edge/start.pgx": b"new start",
    "report/error.png": b"new png",
    "result.json": b"new result",
}
OLD = {
    "edge.csv": b"old csv, longer",
    "edge/edge.pjx": b"old pjx",
    "edge/move002.pgx": b"of an earlier split",
    "report/error.png": b"old png",
    "report/second.png": b"old png 2",
    "result.json": b"old result",
    "notes.txt": b"the operator's",
}


def tree(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


def files_of(folder):
    return {name: content for name, content in tree(folder).items() if content is not None}


def fill(folder, files):
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def test_files_are_written_into_a_new_folder(tmp_path):
    out = tmp_path / "a" / "b"
    assert write(out, NEW) == [out / name for name in NEW]
    assert files_of(tmp_path / "a") == {f"b/{name}": content for name, content in NEW.items()}


def test_files_are_written_beside_what_is_there(tmp_path):
    fill(tmp_path, {"notes.txt": b"the operator's"})
    write(tmp_path, NEW)
    assert files_of(tmp_path) == {**NEW, "notes.txt": b"the operator's"}


def test_new_files_have_the_rights_that_the_user_wants(tmp_path):
    earlier = os.umask(0o027)
    try:
        write(tmp_path / "out", NEW)
    finally:
        os.umask(earlier)
    assert stat.S_IMODE((tmp_path / "out/edge.csv").stat().st_mode) == 0o640
    assert stat.S_IMODE((tmp_path / "out/edge").stat().st_mode) == 0o750


def test_nothing_is_replaced_without_force(tmp_path):
    fill(tmp_path, OLD)
    before = tree(tmp_path)
    for attempt in (lambda: write(tmp_path, NEW), lambda: check_free(tmp_path, ["edge.csv", "edge/"])):
        with pytest.raises(OutputError, match=r"edge\.csv, edge.* exist already; use --force \(in Python force=True\)"):
            attempt()
    assert tree(tmp_path) == before


def test_the_programs_of_a_result_that_is_there_are_named_with_it(tmp_path):
    listed = {"outputs": [{"kind": "program", "path": name} for name in ("edge.csv", "edge/edge.pjx", "gone.nc")]}
    fill(tmp_path, {**OLD, "result.json": json.dumps(listed).encode()})
    with pytest.raises(OutputError) as caught:
        check_free(tmp_path, ["result.json"])
    told = "result.json, edge.csv, edge exist already; use --force (in Python force=True) to replace them"
    assert str(caught.value) == f"{tmp_path}: {told}, or another folder"
    (tmp_path / "result.json").write_bytes(b"no JSON")
    with pytest.raises(OutputError, match=r": result\.json exists already; use --force .* to replace it"):
        check_free(tmp_path, ["result.json"])


def test_force_replaces_files_one_by_one_and_folders_whole(tmp_path):
    fill(tmp_path, OLD)
    check_free(tmp_path, ["edge.csv", "edge/", "report/", "result.json"], force=True)
    write(tmp_path, NEW, force=True)
    assert files_of(tmp_path) == {**NEW, "notes.txt": b"the operator's"}
    assert set(tree(tmp_path)) == {*NEW, "notes.txt", "edge", "report"}


def test_a_folder_with_files_of_another_kind_is_not_replaced(tmp_path):
    fill(tmp_path, {**OLD, "edge/wiring.cfg": b"by hand"})
    before = tree(tmp_path)
    with pytest.raises(OutputError, match=r"edge/wiring\.cfg: not of a kind that this run writes"):
        write(tmp_path, NEW, force=True)
    assert tree(tmp_path) == before


def test_a_file_does_not_become_a_folder_nor_a_folder_a_file(tmp_path):
    fill(tmp_path, {"edge": b"a file"})
    with pytest.raises(OutputError, match="edge: is a file and would become a folder"):
        write(tmp_path, NEW, force=True)
    with pytest.raises(OutputError, match="other: is a folder and would become a file"):
        (tmp_path / "other").mkdir()
        write(tmp_path, {"other": b""}, force=True)


def test_an_input_is_never_replaced(tmp_path):
    fill(tmp_path, {"edge.csv": b"the input", "edge/scan.pjx": b"another"})
    (tmp_path / "link.csv").symlink_to(tmp_path / "edge.csv")
    for source in ("edge.csv", "edge/scan.pjx", "link.csv", "edge/../edge.csv"):
        with pytest.raises(OutputError, match="would replace an input of this run"):
            write(tmp_path, NEW, force=True, inputs=[tmp_path / source])
    assert (tmp_path / "edge.csv").read_bytes() == b"the input"


def test_a_link_at_the_target_is_replaced_and_not_followed(tmp_path):
    fill(tmp_path / "elsewhere", {"precious.csv": b"precious", "app/edge.pjx": b"precious"})
    out = tmp_path / "out"
    out.mkdir()
    (out / "edge.csv").symlink_to(tmp_path / "elsewhere/precious.csv")
    (out / "edge").symlink_to(tmp_path / "elsewhere/app")
    (out / "result.json").symlink_to(tmp_path / "nowhere")
    with pytest.raises(OutputError, match="exist already"):
        write(out, NEW)
    write(out, NEW, force=True)
    assert files_of(out) == NEW
    assert not any(path.is_symlink() for path in out.rglob("*"))
    assert files_of(tmp_path / "elsewhere") == {"precious.csv": b"precious", "app/edge.pjx": b"precious"}
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize(
    "name",
    ["../x.csv", "a/../../x", "/etc/x", "", "a//b", "./a", "CON", "nul.csv", "a/Com1.txt", "x.", "x ", "a /b", " x",
     "a\0b", "a\nb", "a\\b", "C:x", "a?b", "\u202ex", "x" * 201, "é" * 101],
)  # fmt: skip
def test_a_name_that_leaves_the_folder_or_cannot_be_copied_anywhere_is_refused(tmp_path, name):
    for attempt in (lambda: write(tmp_path / "out", {name: b""}), lambda: check_free(tmp_path / "out", [name])):
        with pytest.raises(OutputError, match=r"^output name '") as caught:
            attempt()
        assert str(caught.value).isprintable()
    assert tree(tmp_path) == {}


@given(st.text(max_size=30))
def test_a_name_without_a_problem_is_one_step_below_its_folder(name):
    if name_problem(name) is None:
        assert Path("/out", name).parent == Path("/out")
        assert Path("/out", name).name == name


@pytest.mark.parametrize("names", [["a.csv", "A.CSV"], ["edge", "edge/a.pjx"], ["Edge/a", "edge"]])
def test_names_that_meet_on_some_disks_are_refused(tmp_path, names):
    with pytest.raises(OutputError):
        write(tmp_path, dict.fromkeys(names, b""))
    assert tree(tmp_path) == {}


def test_two_posts_may_not_write_one_file():
    assert joined({"csv": {"a.csv": b"1"}, "val3": {"a/a.pjx": b"2"}}) == {"a.csv": b"1", "a/a.pjx": b"2"}
    with pytest.raises(OutputError, match=r"^A\.nc: written by both gcode and mill"):
        joined({"gcode": {"a.nc": b"1"}, "mill": {"A.nc": b"2"}})


def test_an_output_below_a_file_is_refused_before_the_work(tmp_path):
    fill(tmp_path, {"file": b""})
    with pytest.raises(OutputError, match="file: is not a folder"):
        check_free(tmp_path / "file" / "out", ["a.csv"])
    with pytest.raises(OutputError, match="cannot be written: Not a directory; nothing was changed"):
        write(tmp_path / "file" / "out", {"a.csv": b""})


def test_a_folder_without_permission_is_refused_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(OutputError, match="no permission to write there"):
        check_free(tmp_path, ["a.csv"])


STEPS = ("fsync", "rename", "replace", "link", "mkdir", "rmdir")


def failing_at(monkeypatch, step, error):
    """Let the step-th of the calls that change the disk fail, once; return the list of the calls made."""
    calls = []

    def wrapped(name, original):
        def call(*args, **kwargs):
            calls.append(name)
            if len(calls) == step:
                raise error
            return original(*args, **kwargs)

        return call

    for name in STEPS:
        monkeypatch.setattr(os, name, wrapped(name, getattr(os, name)))
    return calls


def count_of_steps(tmp_path, force):
    with pytest.MonkeyPatch.context() as patch:
        calls = failing_at(patch, -1, None)
        write(tmp_path / "count", NEW, force=force)
    return len(calls)


@pytest.mark.parametrize("old", [{}, OLD], ids=["new", "replacing"])
@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.ENOSPC, "No space left on device"),
        PermissionError(errno.EACCES, "Permission denied"),
        KeyboardInterrupt(),
    ],
    ids=["disk full", "permission", "interrupt"],
)
def test_a_failure_at_any_step_leaves_the_folder_as_it_was(tmp_path, monkeypatch, old, error):
    fill(tmp_path / "count", old)
    steps = count_of_steps(tmp_path, force=True)
    assert steps > 15
    failures = 0
    for step in range(1, steps + 1):
        out = tmp_path / f"{step}" / "out"
        fill(out, old)
        before = tree(tmp_path / f"{step}") if old else {}
        (tmp_path / f"{step}").mkdir(exist_ok=True)
        with monkeypatch.context() as patch:
            calls = failing_at(patch, step, error)
            try:
                write(out, NEW, force=True)
            except (OutputError, KeyboardInterrupt) as caught:
                failures += 1
                if calls[step - 1] == "rmdir":  # the removal of leavings, when all was in place
                    assert {name: (out / name).read_bytes() for name in NEW} == NEW
                    continue
                assert tree(tmp_path / f"{step}") == before, f"at {calls[step - 1]}, step {step}"
                if isinstance(caught, OutputError):
                    assert error.strerror in str(caught)
                    assert str(out) in str(caught)
            else:
                # Only what is not needed may fail unseen: a second name, the sync of a folder, making one that exists,
                # and the removal of leavings.
                assert calls[step - 1] in ("link", "fsync", "mkdir", "rmdir"), calls[step - 1]
                assert {name: (out / name).read_bytes() for name in NEW} == NEW
    assert failures >= len(NEW)


def test_what_cannot_be_put_back_is_kept_and_told(tmp_path, monkeypatch):
    fill(tmp_path, OLD)
    replace, rename = os.replace, os.rename

    def broken_replace(source, target):
        if Path(target).name == "report":
            raise OSError(errno.EIO, "Input/output error")
        replace(source, target)

    def broken_rename(source, target):
        if Path(source).parent.name == "old":
            raise OSError(errno.EIO, "Input/output error")
        rename(source, target)

    monkeypatch.setattr(os, "replace", broken_replace)
    monkeypatch.setattr(os, "rename", broken_rename)
    with pytest.raises(
        OutputError, match=r"Input/output error; the earlier .* could not be put back, look in "
    ) as caught:
        write(tmp_path, NEW, force=True)
    kept = Path(str(caught.value).rpartition("look in ")[2])
    assert files_of(kept / "old")["report/error.png"] == b"old png"
    assert files_of(kept / "old")["result.json"] == b"old result"


def test_short_writing_is_noticed(tmp_path, monkeypatch):
    real = os.fsync

    def losing(handle):
        if stat.S_ISREG(os.fstat(handle).st_mode):
            os.truncate(handle, 1)
        real(handle)

    monkeypatch.setattr(os, "fsync", losing)
    with pytest.raises(OutputError, match="1 of 7 bytes arrived on the disk"):
        write(tmp_path / "out", NEW)
    assert tree(tmp_path) == {}


def test_the_result_disappears_first_and_appears_last(tmp_path, monkeypatch):
    fill(tmp_path, OLD)
    seen = []
    replace = os.replace

    def watched(source, target):
        seen.append((Path(target).name, (tmp_path / "result.json").exists()))
        replace(source, target)

    monkeypatch.setattr(os, "replace", watched)
    write(tmp_path, {"result.json": NEW["result.json"], **NEW}, force=True)
    assert [name for name, _ in seen] == ["edge.csv", "edge", "report", "result.json"]
    assert not any(exists for _, exists in seen)


def test_of_two_runs_at_once_one_wins_whole(tmp_path):
    def run(mark):
        for _ in range(8):
            write(tmp_path, dict.fromkeys(NEW, mark), force=True)

    threads = [threading.Thread(target=run, args=(mark,)) for mark in (b"first", b"second")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    contents = files_of(tmp_path)
    assert set(contents) == set(NEW)
    assert len(set(contents.values())) == 1


def test_a_program_that_no_longer_holds_is_renamed_and_nothing_else(tmp_path):
    outputs = [{"kind": "program", "path": "edge/start.pgx"}, {"kind": "program", "path": "edge.csv"}]
    result = json.dumps({"outputs": [*outputs, {"kind": "report", "path": "report.pdf"}]}).encode()
    fill(tmp_path, {"edge/start.pgx": b"go", "edge.csv": b"1", "report.pdf": b"2", "result.json": result})
    fill(tmp_path, {"edge.superseded/old.pgx": b"older"})
    assert supersede(tmp_path) == ["edge", "edge.csv"]
    assert files_of(tmp_path) == {
        "edge.superseded/start.pgx": b"go",
        "edge.csv.superseded": b"1",
        "report.pdf": b"2",
        "result.json.superseded": result,
    }


@pytest.mark.parametrize(
    "result", [b"", b"[]", b'{"outputs": [{"kind": "program", "path": "../x"}]}', b'{"outputs": 3}', None]
)
def test_a_folder_that_is_no_result_of_ours_is_left_alone(tmp_path, result):
    fill(tmp_path, {"x": b"1"} if result is None else {"x": b"1", "result.json": result})
    before = files_of(tmp_path)
    assert supersede(tmp_path) == []
    assert files_of(tmp_path) == before


def test_an_input_is_never_renamed(tmp_path):
    result = json.dumps({"outputs": [{"kind": "program", "path": "edge.csv"}]}).encode()
    fill(tmp_path, {"edge.csv": b"1", "result.json": result})
    assert supersede(tmp_path, [tmp_path / "edge.csv"]) == []
    assert (tmp_path / "edge.csv").exists()
