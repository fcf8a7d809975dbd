"""The NCI reader against paths whose truth is known; the records are made by us, after published readers of them."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError, JobError, SicpError
from sicp_cam.findings import Level
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.nci import read_path

CORPUS = Path(__file__).parents[1] / "corpus" / "nci"
MOVES = "0\n0 0. 0. 9. -2. 0\n1\n0 1. 0. 0. 500. 0\n"


def read(tmp_path: Path, text: str | bytes, **options: object) -> ToolPath:
    file = tmp_path / "path.nci"
    file.write_bytes(text if isinstance(text, bytes) else text.encode("latin-1"))
    return read_path(file, **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


def refused(tmp_path: Path, text: str, line: int, *words: str, **options: object) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text, **options)
    assert caught.value.line == line
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)


def test_five_axis_moves_arcs_and_events() -> None:
    path = read_path(CORPUS / "five_axis.nci")
    assert path.name == "EDGE"
    assert codes(path) == {301, 306}
    assert path.tips_mm[:3].tolist() == [[10, -5, 50], [10, -5, 0], [10, 0, 0]]
    arc = path.tips_mm[path.lines == 24]
    assert np.abs(np.linalg.norm(arc, axis=1) - 10).max() < 1e-9
    assert (arc[:, :2] > -1e-9).all()
    assert arc[-1].tolist() == [0, 10, 0]
    assert path.tips_mm[-3:].tolist() == [[-5, 10, 0], [-6, 10, 0.5], [-6, 10, 50]]
    assert np.allclose(path.axes[-3:], [[0, 0, 1], [0.6, 0, 0.8], [0.6, 0, 0.8]])
    assert path.rapid.tolist() == [True] + [False] * (len(path) - 2) + [True]
    assert path.feeds_mm_min[[1, 2, 3, -3, -2, -1]].tolist() == [600, 600, 600, 300, 300, 0]
    told = [(e.kind, e.value) for e in path.events if e.kind is not EventKind.OTHER and e.kind is not EventKind.COMMENT]
    assert told == [
        (EventKind.TOOL, 3), (EventKind.SPINDLE, 9000), (EventKind.COOLANT, 1), (EventKind.DWELL, 1.5),
    ]  # fmt: skip
    assert "edge, finishing" in [e.text for e in path.events]
    assert any(e.text == "20001 8 FLAT ENDMILL" for e in path.events)


def test_lines_and_an_arc_in_the_yz_plane() -> None:
    path = read_path(CORPUS / "lines.nci", units="inch")
    assert path.source is not None
    assert path.source.unit_stated
    arc = path.tips_mm[path.lines == 13] / 25.4
    assert np.abs(np.hypot(arc[:, 1] + 5, arc[:, 2] + 1) - 5).max() < 1e-9
    assert arc[:, 2].min() == pytest.approx(-6, abs=0.01)  # clockwise about x
    assert [e.value for e in path.events if e.kind is EventKind.SPINDLE] == [-3000]
    assert path.feeds_mm_min[1] == pytest.approx(200 * 25.4)


@pytest.mark.parametrize(("code", "turn_deg"), [(3, 90), (2, -270)])
@pytest.mark.parametrize("order", ["0 0", "40 0", "0 40"])
def test_sense_of_arcs_and_either_order_of_plane_and_compensation(
    tmp_path: Path, code: int, turn_deg: float, order: str
) -> None:
    text = f"0\n0 10. 0. 1. -2. 0\n{code}\n{order} 0. 10. 0. 0. 1. 300. 0 0\n1003\n0\n"
    path = read(tmp_path, text)
    angles = np.degrees(np.unwrap(np.arctan2(path.tips_mm[:, 1], path.tips_mm[:, 0])))
    assert angles[-1] - angles[0] == pytest.approx(turn_deg)


@pytest.mark.parametrize("order", ["1 0", "1 40", "40 1"])
def test_arcs_in_yz_turn_about_x(tmp_path: Path, order: str) -> None:
    text = f"0\n0 5. 10. 0. -2. 0\n3\n{order} 0. 10. 0. 0. 7. 300. 0 0\n1003\n0\n"
    path = read(tmp_path, text)
    assert path.tips_mm[-1].tolist() == [7, 0, 10]
    assert (path.tips_mm[1:-1, 1:] > 0).all()
    assert (np.diff(path.tips_mm[:, 0]) > 0).all()  # a helix


def test_missing_end_and_unknown_parameters_are_findings(tmp_path: Path) -> None:
    path = read(tmp_path, "1099\n1 2 3\n20500\nx\n" + MOVES, units="mm")
    assert codes(path) == {308, 316}
    assert [e.text for e in path.events] == ["1099 1 2 3", "20500 x"]


def test_compensation_can_be_ignored(tmp_path: Path) -> None:
    text = MOVES + "1\n41 2. 0. 0. -1. 0\n1003\n0\n"
    refused(tmp_path, text, 6, "tool radius", "path.cutcom=ignore")
    path = read(tmp_path, text, cutcom="ignore", units="mm")
    assert codes(path) == {323}
    assert path.findings[0].level is Level.WARN


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (MOVES + "81\n0 1. 2. 3.\n", 5, ["drilling"]),
        (MOVES + "100\n1. 2. 3.\n", 5, ["drilling"]),
        (MOVES + "200\n1\n", 5, ["threading"]),
        (MOVES + "1018\n1\n", 5, ["subprograms"]),
        (MOVES + "12\n1. 2. 3. 4. 5. 6.\n", 5, ["code 12", "might move"]),
        (MOVES + "1\n0 1. x 3. 5. 0\n", 6, ["needs 5 numbers"]),
        (MOVES + "1\n0 1. 2.\n", 6, ["needs 5 numbers"]),
        (MOVES + "1\n0 1. 2. 3. 0. 0\n", 6, ["feed"]),
        (MOVES + "1\n0 1. 2. 3. -3. 0\n", 6, ["feed"]),
        (MOVES + "1\n7 1. 2. 3. -1. 0\n", 6, ["compensation"]),
        (MOVES + "1\n0 1e9 2. 3. -1. 0\n", 6, ["coordinate_mm"]),
        (MOVES + "1\n0 1e400 2. 3. -1. 0\n", 6, ["coordinate_mm"]),
        (MOVES + "11\n1. 2. 3. 1. 2. 3. -1. 0\n", 6, ["axis is (0, 0, 0)"]),
        (MOVES + "3\n0 2 0. 10. 0. 0. 1. -1. 0 0\n", 6, ["XZ plane"]),
        (MOVES + "3\n0 0 0. 10. 50. 0. 1. -1. 0 0\n", 6, ["one circle"]),
        ("3\n0 0 0. 10. 50. 0. 1. -1. 0 0\n", 2, ["before any position"]),
        ("1014\n1. 0. 0. 0. 0. 1. 0. -1. 0.\n" + MOVES, 2, ["tool plane", "Top"]),
        ("1027\n1. 0. 0. 0. 1. 0. 0. 0. 1. 5. 0. 0.\n" + MOVES, 2, ["work coordinate system"]),
        ("1002\n0 100 2 1.5 1 1 0 9. 6. 0\n" + MOVES, 2, ["tool number"]),
        (MOVES + "4\n-1.\n", 6, ["dwell"]),
        (MOVES + "hello\n1\n", 5, ["no NCI code"]),
        ("G0 X1 Y2\nG1 X2\n", 1, ["no NCI code"]),
        (MOVES + "4\n", 6, ["--recover"]),
        (MOVES + "1002\n0 1. 4.", 6, ["--recover"]),
    ],
)
def test_bad_records_name_their_line(tmp_path: Path, text: str, line: int, words: list[str]) -> None:
    refused(tmp_path, text, line, *words)


def test_a_cut_file_can_be_read_without_its_last_record(tmp_path: Path) -> None:
    for cut in ("4\n", "1002\n0 3. 4.", "1001", "1014\n1. 0."):
        with pytest.raises(FormatError, match="--recover"):
            read(tmp_path, MOVES + cut)
        path = read(tmp_path, MOVES + cut, recover=True, units="mm")
        assert len(path) == 2
        assert codes(path) == {316, 350}
    refused(tmp_path, MOVES + "1\n0 3. 4.\n1003\n0\n", 6, "5 numbers", recover=True)


@pytest.mark.parametrize(
    "cut", ["1\n", "1", "1\n0 3. 4.", "0\n0 3.", "2\n0 0 1.", "11\n1. 2. 3. 4.", "12\n", "81\n0 1."]
)
def test_a_cut_motion_is_never_left_out(tmp_path: Path, cut: str) -> None:
    for recover in (False, True):
        with pytest.raises(FormatError) as caught:
            read(tmp_path, MOVES + cut, recover=recover)
        assert caught.value.line in (5, 6)
        assert "--recover" not in str(caught.value)


def test_a_file_without_end_that_ends_in_a_cut_is_a_warning(tmp_path: Path) -> None:
    for rest, level in (
        ("", Level.WARN), ("0\n0 1. 0. 9. -2. 0\n", Level.INFO), ("1\n0 1. 0. 9. -1. 0\n", Level.INFO),
        ("0\n0 1. 0. 9. -2. 0", Level.WARN),
    ):  # fmt: skip
        (found,) = [f for f in read(tmp_path, MOVES + rest).findings if f.code == 316]
        assert found.level is level


def test_binary_and_packed_files_say_what_they_are(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"binary NCI file, .* ASCII NCI"):
        read(tmp_path, b"NCI\0\1\2")
    with pytest.raises(FormatError, match="zip archive"):
        read(tmp_path, b"PK\x03\x04....")


def test_bad_options_are_job_errors(tmp_path: Path) -> None:
    with pytest.raises(JobError, match=r"path\.cutcom"):
        read(tmp_path, MOVES, cutcom="x")
    with pytest.raises(JobError, match=r"path\.chord_mm"):
        read(tmp_path, MOVES, chord_mm=0.0)


coordinate = st.floats(-9999.0, 9999.0).map(lambda value: round(value, 4))
rows = st.lists(st.tuples(coordinate, coordinate, coordinate, st.integers(1, 9000)), min_size=2, max_size=12)


@settings(deadline=None, max_examples=50)
@given(path=rows.filter(lambda found: len({row[:3] for row in found}) > 1))
def test_written_moves_are_read_back(path: list[tuple[float, float, float, int]], tmp_path_factory) -> None:  # type: ignore[no-untyped-def]
    text = "".join(f"11\n{x} {y} {z} {x + 0.6} {y} {z + 0.8} {feed} 0\n" for x, y, z, feed in path) + "1003\n0\n"
    found = read(tmp_path_factory.mktemp("nci"), text)
    assert found.tips_mm.tolist() == [list(row[:3]) for row in path]
    assert np.abs(found.axes - [0.6, 0, 0.8]).max() < 1e-9
    assert found.feeds_mm_min.tolist() == [row[3] for row in path]


@settings(deadline=None, max_examples=100)
@given(data=st.data())
def test_damaged_files_give_a_path_or_a_typed_error(data: st.DataObject, tmp_path_factory) -> None:  # type: ignore[no-untyped-def]
    damaged = bytearray((CORPUS / "five_axis.nci").read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        place = data.draw(st.integers(0, len(damaged) - 1))
        damaged[place] = data.draw(st.one_of(st.integers(0, 255), st.sampled_from(b"0123456789. -\n")))
    del damaged[data.draw(st.integers(1, len(damaged))) :]
    try:
        path = read(tmp_path_factory.mktemp("nci"), bytes(damaged), recover=data.draw(st.booleans()))
    except SicpError as error:
        assert "path.nci" in str(error)
        assert str(error).isprintable()
    else:
        assert np.allclose(np.linalg.norm(path.axes, axis=1), 1)
