import os
import stat
from pathlib import Path

import pytest

from sicp_cam.beside import beside
from sicp_cam.job.input_files import absent, is_pose, no_job, wrong_places

POSE = "1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n"


@pytest.mark.parametrize(
    "text",
    [
        POSE,
        "\ufeff# T\n\n" + POSE.replace(" ", ", "),
        POSE.replace(" ", ";").replace("0\n", "0 # a row\n"),
        POSE + "\n",
    ],
)
def test_a_pose_is_known_however_it_is_written(tmp_path, text):
    (tmp_path / "pose.txt").write_text(text, encoding="utf-8")
    assert is_pose(tmp_path / "pose.txt")


@pytest.mark.parametrize(
    "text",
    [
        "",
        POSE + "0 0 0 1\n",
        POSE.replace("0 0 0 1", "0 0 0 2"),
        POSE.replace(" ", "\n"),
        "a b c d\n" + POSE,
        "\0",
        "#\n" * 9999,
    ],
    ids=["empty", "five", "last", "column", "header", "binary", "long"],
)
def test_what_is_no_pose_is_none(tmp_path, text):
    (tmp_path / "points.txt").write_text(text, encoding="utf-8")
    assert not is_pose(tmp_path / "points.txt")


def test_what_cannot_be_read_is_no_pose(tmp_path):
    (tmp_path / "points.bin").write_bytes(b"\xff\xfe\x00")
    assert not is_pose(tmp_path / "points.bin")
    assert not is_pose(tmp_path / "nowhere.txt")
    assert not is_pose(tmp_path)


def test_the_nearest_name_of_the_folder_is_told(tmp_path):
    for name in ("Part.STEP", "scan.ply"):
        (tmp_path / name).write_bytes(b"")
    assert absent(tmp_path / "part.stp") == f"no such file (did you mean {tmp_path}/Part.STEP?)"
    assert absent(tmp_path / "xyz") == "no such file"
    assert absent(tmp_path / "a" / "part.step") == f"no such file; there is no folder {tmp_path}/a"


def test_a_nasty_name_of_the_folder_stays_on_its_line(tmp_path):
    (tmp_path / "part\x1b[2J.step").write_bytes(b"")
    assert absent(tmp_path / "part.step").isprintable()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may list every folder")
def test_a_folder_that_may_not_be_listed_gives_no_hint(tmp_path):
    tmp_path.chmod(stat.S_IXUSR)
    assert absent(tmp_path / "part.step") == "no such file"


def test_what_may_be_several_things_is_said_to_be():
    assert no_job(Path("mesh.stl")) == "this is a scan or a part, no job file; give it with --scan or --cad"
    assert no_job(Path("job.toml")) is None


def test_only_what_cannot_be_read_in_its_role_is_wrong():
    stl, csv = Path("a.stl"), Path("a.csv")
    assert wrong_places({"part": stl, "scan": csv, "path": csv}) == {}
    assert wrong_places({"part": Path("a.dwg"), "scan": Path("a")}) == {}


def test_three_files_in_a_ring_are_told_one_by_one():
    files = {"part": Path("a.asc"), "scan": Path("a.nc"), "path": Path("a.step")}
    assert list(wrong_places(files)) == ["part", "scan", "path"]
    assert all("give another file with" in text for text in wrong_places(files).values())


def test_an_error_of_work_beside_reaches_who_asks_for_its_answer():
    with pytest.raises(ZeroDivisionError):
        beside(lambda: 1 // 0).result()
