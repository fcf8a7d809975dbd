"""Long tables, block by block: the quick parser and the slow one agree, and every repair is told."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Scan
from sicp_formats.ascii import read_scan
from sicp_formats.tables import stream as text_stream
from sicp_formats.tables.blocks import quick_numbers
from sicp_formats.tables.rows import numbers, text_lines

CORPUS = Path(__file__).parents[1] / "corpus" / "ascii"
RNG = np.random.default_rng(11)
POINTS = np.round(RNG.uniform(-900, 900, (700, 3)), 4)
NORMALS = np.tile([[0.0, 0.0, 1.0], [0.6, 0.8, 0.0]], (350, 1))
ROWS = [" ".join(map(repr, row)) for row in POINTS.tolist()]


def write(folder: Path, content: str | bytes, name: str = "scan.xyz") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def codes(scan: Scan) -> list[int]:
    return [int(each.code) for each in scan.findings]


cell = st.one_of(
    st.floats().map(repr),
    st.text("0123456789+-.eE", max_size=6),
    st.sampled_from(
        ["1e400", "1e", "1_0", "0x1", "nan", "inf", "-1.#IND", "NA", '"1"', "", "1e-400", "9" * 400, "1\r2"]
    ),
)


@settings(max_examples=200, deadline=None)
@given(
    rows=st.lists(st.lists(cell, min_size=2, max_size=4), min_size=1, max_size=5),
    delimiter=st.sampled_from([None, ";", "\t", ","]),
    end=st.sampled_from(["\n", "\r\n", " \n", "\n\n"]),
)
@example(rows=[["1", "2", "3"], ["1", "2"]], delimiter=None, end="\n")
@example(rows=[["1", "2", "3"], ["1", "2", "3", "4"], ["1", "2"]], delimiter=";", end="\n")
@example(rows=[["1", "2", "1e400"]], delimiter=",", end="\n")
@example(rows=[["1", "", "3"]], delimiter="\t", end="\n")
@example(rows=[["1 2", "2", "3"]], delimiter=";", end="\n")
def test_the_quick_parser_never_says_anything_else(rows: list[list[str]], delimiter: str | None, end: str) -> None:
    text = "".join((delimiter or " ").join(row) + end for row in rows).encode()
    quick = quick_numbers(text, 3, delimiter=delimiter)
    try:
        strict, _ = numbers(Path(), text_lines(Path(), text, DEFAULT_LIMITS), 3, finite=(0, 1, 2), delimiter=delimiter)
    except FormatError:
        assert quick is None
        return
    assert quick is None or np.array_equal(quick, strict)


@settings(max_examples=50, deadline=None)
@given(rows=st.lists(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3), min_size=1, max_size=20))
def test_the_quick_parser_is_exact(rows: list[tuple[float, float, float]]) -> None:
    text = "\n".join(" ".join(map(repr, row)) for row in rows).encode()
    found = quick_numbers(text, 3)
    assert found is not None and found.tolist() == [list(row) for row in rows]


@pytest.mark.parametrize("name", ["plain", "comments", "counts", "named", "quoted", "returns", "trailing", "broken"])
def test_the_size_of_a_block_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setattr(text_stream, "HEAD_BYTES", 4000)
    content = {
        "plain": "\n".join(ROWS),
        "comments": "\n\n".join(row if at % 9 else f"# {at}\n{row}" for at, row in enumerate(ROWS)),
        "counts": "\n".join(["300", *ROWS[:300], "400", *ROWS[300:]]),
        "named": "# x y z\n" + "\r\n".join(ROWS),
        "quoted": "\n".join('"' + row.replace(" ", '" "') + '"' for row in ROWS),
        "returns": "\r".join(ROWS) + "\r",
        "trailing": "\n".join(row.replace(" ", ";") + ";" for row in ROWS),
        "broken": "\n".join(row if at % 10 != 3 else "no row" for at, row in enumerate(ROWS)),
    }[name]
    path = write(tmp_path, content)
    found = []
    for size in (64, 1000, 2**22):
        monkeypatch.setattr(text_stream, "BLOCK_BYTES", size)
        found.append(read_scan(path, recover=name == "broken"))
    kept = [at for at in range(700) if name != "broken" or at % 10 != 3]
    for scan in found:
        assert np.array_equal(scan.points_mm, POINTS[kept])
        assert (scan.source, scan.findings) == (found[0].source, found[0].findings)


def test_errors_name_the_same_line_in_every_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_stream, "HEAD_BYTES", 4000)
    lines = [*ROWS[:500], "1 2 x", *ROWS[500:600], "9" * 70_000, *ROWS[600:]]
    for size in (64, 1000, 2**22):
        monkeypatch.setattr(text_stream, "BLOCK_BYTES", size)
        with pytest.raises(FormatError, match=r"line 501: 'x'.*--recover"):
            read_scan(write(tmp_path, "\n".join(lines)))
        with pytest.raises(FormatError, match=r"line 601: .*line_bytes"):
            read_scan(write(tmp_path, "\n".join(lines[:500] + lines[501:])))
        with pytest.raises(FormatError, match=r"line 101: .*limit points = 100"):
            read_scan(write(tmp_path, "\n".join(ROWS)), limits=Limits(points=100))


def test_a_long_file_is_hashed_like_a_short_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = "\n".join(ROWS).encode()
    whole = read_scan(write(tmp_path, content)).source
    packed = read_scan(write(tmp_path, gzip.compress(content), "scan.xyz.gz"))
    monkeypatch.setattr(text_stream, "HEAD_BYTES", 1000)
    assert read_scan(write(tmp_path, content)).source == whole
    assert np.array_equal(packed.points_mm, POINTS)
    wide = write(tmp_path, content.decode().encode("utf-16"))
    assert np.array_equal(read_scan(wide).points_mm, POINTS)


@pytest.mark.parametrize(
    "start", [b"PK\x03\x04", b"<!DOCTYPE html>\n", b"version https://git-lfs.github.com/spec/v1\n"]
)
def test_a_long_file_that_is_no_text_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start: bytes) -> None:
    monkeypatch.setattr(text_stream, "HEAD_BYTES", 100)
    with pytest.raises(FormatError, match=r"zip archive|HTML page|Git LFS"):
        read_scan(write(tmp_path, start + b"1 2 3\n" * 100))


@pytest.mark.parametrize(
    "bad", ["1 2", "1 2 3 4", "1 2 x", "nan nan nan", "-1.#IND 0 0", "1.#QNAN 1 2", "1e400 1 2", "?"]
)
@pytest.mark.parametrize("at", [0, 5, 300])
def test_recover_drops_bad_rows_and_says_so(tmp_path: Path, bad: str, at: int) -> None:
    path = write(tmp_path, "\n".join([*ROWS[:at], bad, *ROWS[at:350], bad, *ROWS[350:]]) + "\n")
    with pytest.raises(FormatError) as caught:
        read_scan(path)
    # Before any other row, a longer one cannot be told from the rule.
    assert caught.value.line == at + 1 + (at == 0 and bad == "1 2 3 4")
    if at == 300:
        assert "--recover" in str(caught.value)
    scan = read_scan(path, recover=True)
    assert np.array_equal(scan.points_mm, POINTS)
    dropped = [each for each in scan.findings if each.code == 150]
    assert dropped or (at == 0 and 111 in codes(scan))
    assert all(each.level is Level.WARN for each in scan.findings)
    if at:
        assert dropped[0].message.startswith("2 rows") and dropped[0].where.endswith(f"line {at + 1}")


def test_recover_refuses_what_is_mostly_bad(tmp_path: Path) -> None:
    path = write(tmp_path, "\n".join([*ROWS[:300], *["1 2"] * 301]))
    with pytest.raises(FormatError, match=r"line 301: 301 of 601 rows.*is it a scan"):
        read_scan(path, recover=True)
    with pytest.raises(FormatError):
        read_scan(write(tmp_path, "\n".join(["1 2", "3 4 5"] * 5 + ["x y"] * 9)), recover=True)


@pytest.mark.parametrize("declared", [699, 701])
def test_recover_takes_a_wrong_count(tmp_path: Path, declared: int) -> None:
    path = write(tmp_path, "\n".join([str(declared), *ROWS]), "scan.pts")
    with pytest.raises(FormatError, match=rf"line 1: {declared} rows are declared, 700 present.*--recover"):
        read_scan(path)
    scan = read_scan(path, recover=True)
    assert np.array_equal(scan.points_mm, POINTS) and codes(scan) == [151]


def test_a_file_of_several_counts_holds_several_scans(tmp_path: Path) -> None:
    lines = ["300", *ROWS[:300], "", "400", *ROWS[300:]]
    scan = read_scan(write(tmp_path, "\n".join(lines), "scan.pts"))
    assert np.array_equal(scan.points_mm, POINTS) and codes(scan) == [141]
    lines[0] = "299"
    with pytest.raises(FormatError, match=r"line 1: 299 rows are declared, 300 present"):
        read_scan(write(tmp_path, "\n".join(lines), "scan.pts"))


def rows(*blocks: np.ndarray) -> str:
    return "".join(" ".join(f"{value:.10g}" for value in row) + "\n" for row in np.column_stack(blocks))


COLOURS = RNG.integers(0, 256, (700, 3))
HALF = np.full((700, 3), 0.5)


@pytest.mark.parametrize(
    ("name", "blocks", "layout"),
    [
        ("a.xyzn", (POINTS, 2 * NORMALS), "x y z nx ny nz"),
        ("a.xyzrgb", (POINTS, HALF), "x y z red green blue"),
        ("a.pts", (POINTS, COLOURS[:, 0], COLOURS), "x y z intensity red green blue"),
        ("a.xyz", (POINTS, COLOURS[:, 0], COLOURS), "x y z column_4 column_5 column_6 column_7"),
        ("a.xyz", (POINTS, NORMALS * (np.arange(700) % 50 > 0)[:, None]), "x y z nx ny nz"),
        ("a.xyz", (POINTS, NORMALS, COLOURS), "x y z nx ny nz red green blue"),
    ],
)
def test_what_suffix_and_numbers_prove_is_told(
    tmp_path: Path, name: str, blocks: tuple[np.ndarray, ...], layout: str
) -> None:
    scan = read_scan(write(tmp_path, rows(*blocks), name))
    assert (scan.normals is not None) == ("nx" in layout)
    assert [*scan.columns] == [name for name in layout.split() if name not in ("x", "y", "z", "nx", "ny", "nz")]
    found = [each for each in scan.findings if each.code == 120]
    assert len(found) == 1 and layout in found[0].message and found[0].level is Level.INFO


def test_choices_are_named(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"scan\.columns=.*such as .*x,y,z,nx,ny,nz or x,y,z,r,g,b or r,g,b,x,y,z"):
        read_scan(write(tmp_path, rows(POINTS, HALF)))
    with pytest.raises(FormatError, match=r"line 1: .*such as skip,x,y,z or x,y,z,i"):
        read_scan(write(tmp_path, rows(np.arange(700), POINTS)))
    scan = read_scan(write(tmp_path, rows(COLOURS, POINTS)), columns="r,g,b,x,y,z")
    assert np.array_equal(scan.points_mm, POINTS) and np.array_equal(scan.columns["blue"], COLOURS[:, 2])


@pytest.mark.parametrize("point", ["P{}", '"P {}"', '"P;{}"', "N{}_a"])
def test_points_may_have_names(tmp_path: Path, point: str) -> None:
    content = "".join(f"{point.format(at)} {row}\n" for at, row in enumerate(ROWS))
    assert np.array_equal(read_scan(write(tmp_path, content)).points_mm, POINTS)
    content = '"name" X Y Z\n' + content
    named = read_scan(write(tmp_path, content))
    assert np.array_equal(named.points_mm, POINTS) and codes(named) == [110]


def test_seeds_of_the_corpus() -> None:
    expected = [[1.5, 2.25, 3.0], [4.0, -5.5, 6.125], [7.0, 8.0, -9.75], [1234.5, 0.5, 0.25]]
    seeds = sorted(CORPUS.iterdir())
    assert len(seeds) >= 8
    for seed in seeds:
        options = {"decimal": ","} if "thousands" in seed.name else {}
        assert read_scan(seed, **options).points_mm.tolist() == expected, seed.name


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), recover=st.booleans())
def test_whatever_happens_to_the_bytes(tmp_path: Path, data: st.DataObject, recover: bool) -> None:
    seed = data.draw(st.sampled_from(sorted(CORPUS.iterdir())))
    content = bytearray(seed.read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    if data.draw(st.booleans()):
        content = content[:at]
    else:
        content[at] = data.draw(st.integers(0, 255))
    try:
        scan = read_scan(write(tmp_path, bytes(content), seed.name), recover=recover)
    except (FormatError, UnitError, JobError):
        return
    assert np.isfinite(scan.points_mm).all() and len(scan.points_mm) <= 5
