"""PCD: every kind of data gives the known points, and every damaged file is refused with its line or byte."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError, JobError, SicpError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import Scan
from sicp_formats.pcd import read_scan, write_scan
from sicp_formats.pcd.lzf import decompress

CORPUS = Path(__file__).resolve().parents[1] / "corpus" / "pcd"
POINTS = np.array([[0.0, 0.0, 0.0], [10.5, 0.25, -3.0], [0.0, 20.0, 1.5], [10.0, 20.0, 2.0]])
ROWS = b"0 0 0\n10.5 0.25 -3\n0 20 1.5\n10 20 2\n"
SINGLES = POINTS.astype("<f4").tobytes()
HEAD = b"""# .PCD v.7 - Point Cloud Data file format
VERSION .7
FIELDS x y z
SIZE 4 4 4
TYPE F F F
COUNT 1 1 1
WIDTH 4
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS 4
DATA ascii
"""
BINARY = HEAD.replace(b"ascii", b"binary")
COMPRESSED = HEAD.replace(b"ascii", b"binary_compressed")
modest = settings(
    deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)


def sized(head: bytes, points: int) -> bytes:
    return head.replace(b"WIDTH 4", b"WIDTH %d" % points).replace(b"POINTS 4", b"POINTS %d" % points)


def write(folder: Path, content: bytes) -> Path:
    path = folder / "scan.pcd"
    path.write_bytes(content)
    return path


def compress(raw: bytes) -> bytes:
    """Compress plainly: a back reference wherever three bytes were met before, literals between."""
    packed, literals = bytearray(), bytearray()
    met: dict[bytes, int] = {}
    position = 0
    while position < len(raw):
        key = raw[position : position + 3]
        before = met.get(key, -(10**6))
        met[key] = position
        if len(key) < 3 or position - before > 8192:
            literals.append(raw[position])
            position += 1
            continue
        length = 3
        while length < 264 and position + length < len(raw) and raw[before + length] == raw[position + length]:
            length += 1
        packed += runs(literals)
        literals.clear()
        high, low = divmod(position - before - 1, 256)
        packed += bytes([(length - 2 << 5) + high, low] if length < 9 else [224 + high, length - 9, low])
        position += length
    return bytes(packed + runs(literals))


def runs(literals: bytearray) -> bytes:
    cut = [literals[first : first + 32] for first in range(0, len(literals), 32)]
    return b"".join(bytes([len(run) - 1]) + run for run in cut)


def compressed(raw: bytes = POINTS.astype("<f4").T.tobytes()) -> bytes:
    packed = compress(raw)
    return COMPRESSED + struct.pack("<II", len(packed), len(raw)) + packed


def codes(scan: Scan) -> list[tuple[int, str]]:
    return [(int(each.code), str(each.level)) for each in scan.findings]


class TestVariants:
    @pytest.mark.parametrize(
        ("name", "columns", "found"),
        [
            ("ascii.pcd", {"intensity": [0, 1, 2, 3]}, []),
            ("compressed.pcd", {"ring": [1, 2, 3, 4]}, []),
            ("organised.pcd", {}, [(131, "info")]),
            (
                "binary_mixed_fields.pcd",
                {"red": [1, 255, 0, 0], "green": [2, 0, 255, 0], "blue": [255, 0, 0, 255], "label": [-1, 2, 3, 4]},
                [(130, "info"), (110, "info")],
            ),
        ],
    )
    def test_corpus(self, name: str, columns: dict[str, list[int]], found: list[tuple[int, str]]) -> None:
        scan = read_scan(CORPUS / name)
        assert np.array_equal(scan.points_mm, POINTS)
        assert {key: values.tolist() for key, values in scan.columns.items()} == columns
        assert codes(scan) == found and scan.faces is None

    @pytest.mark.parametrize("content", [HEAD + ROWS, BINARY + SINGLES, compressed()])
    def test_the_three_kinds_of_data(self, tmp_path: Path, content: bytes) -> None:
        scan = read_scan(write(tmp_path, content))
        assert np.array_equal(scan.points_mm, POINTS) and scan.findings == ()
        assert scan.source is not None and not scan.source.unit_stated

    @pytest.mark.parametrize(
        ("old", "new"),
        [
            (b"VERSION .7", b"VERSION 0.6"),
            (b"VIEWPOINT 0 0 0 1 0 0 0\n", b""),
            (b"COUNT 1 1 1\n", b""),
            (b"POINTS 4\n", b""),
            (b"VERSION .7\nFIELDS", b"VERSION .5\nCOLUMNS"),
            (b"\n", b"\r\n"),
            (b"WIDTH 4\nHEIGHT 1\n", b""),
            (b"FIELDS", b"# note\n\nFIELDS"),
            (b"x y z", b"X Y Z"),
        ],
    )
    def test_headers_that_differ(self, tmp_path: Path, old: bytes, new: bytes) -> None:
        for head, body in ((HEAD, ROWS), (BINARY, SINGLES)):
            assert np.array_equal(read_scan(write(tmp_path, head.replace(old, new) + body)).points_mm, POINTS)

    def test_normals(self) -> None:
        scan = read_scan(CORPUS / "binary_mixed_fields.pcd")
        assert scan.normals is not None and (scan.normals == [0, 0, 1]).all()

    @pytest.mark.parametrize("kind", ["F", "U", "I"])
    def test_packed_colours_in_text(self, tmp_path: Path, kind: str) -> None:
        bits = np.array([0x0102FF, 0xFF0000, 0x00FF00, 0x0000FF], "<u4")
        words = bits if kind != "F" else bits.view("<f4")
        head = HEAD.replace(b"x y z", b"x y z rgb").replace(b"4 4 4", b"4 4 4 4").replace(b"1 1 1", b"1 1 1 1", 1)
        head = head.replace(b"F F F", b"F F F " + kind.encode())
        rows = b"".join(
            row + b" " + str(word).encode() + b"\n"
            for row, word in zip(ROWS.split(b"\n"), words.tolist(), strict=False)
        )
        columns = read_scan(write(tmp_path, head + rows)).columns
        assert {name: values.tolist() for name, values in columns.items()} == {
            "red": [1, 255, 0, 0],
            "green": [2, 0, 255, 0],
            "blue": [255, 0, 0, 255],
        }

    @pytest.mark.parametrize("kept", [True, False])
    def test_padding_in_compressed_data(self, tmp_path: Path, kept: bool) -> None:
        head = COMPRESSED.replace(b"x y z", b"x _ y z").replace(b"4 4 4", b"4 1 4 4").replace(b"1 1 1", b"1 3 1 1", 1)
        head = head.replace(b"F F F", b"F U F F")
        x, y, z = (column.astype("<f4").tobytes() for column in POINTS.T)
        raw = x + b"\7" * 12 * kept + y + z
        packed = compress(raw)
        path = write(tmp_path, head + struct.pack("<II", len(packed), len(raw)) + packed)
        assert np.array_equal(read_scan(path).points_mm, POINTS)

    def test_zeros_behind_the_data_fill_the_page(self, tmp_path: Path) -> None:
        assert codes(read_scan(write(tmp_path, BINARY + SINGLES + b"\0" * 9))) == [(101, "info")]
        (finding,) = read_scan(write(tmp_path, compressed() + b"123")).findings
        assert finding.level is Level.WARN and finding.where.endswith(f"byte {len(compressed())}")
        (finding,) = read_scan(write(tmp_path, HEAD + ROWS + b"1 2 3\n")).findings
        assert finding.level is Level.WARN and finding.where.endswith("line 16")

    def test_the_pose_of_the_sensor_is_told_and_not_applied(self, tmp_path: Path) -> None:
        scan = read_scan(write(tmp_path, HEAD.replace(b"0 0 0 1 0", b"1 -2 3.5 0.5 0.5") + ROWS))
        assert np.array_equal(scan.points_mm, POINTS) and codes(scan) == [(130, "info")]
        assert "1 -2 3.5 0.5 0.5 0 0" in scan.findings[0].message and scan.findings[0].where.endswith("line 9")

    def test_rays_without_return_are_left_out_of_organised_clouds_only(self, tmp_path: Path) -> None:
        rows = ROWS.replace(b"0 20 1.5", b"0 nan 1.5") + b"1 2 3\n2 2 7\n"
        head = HEAD.replace(b"POINTS 4", b"POINTS 6")
        path = write(tmp_path, head.replace(b"WIDTH 4\nHEIGHT 1", b"WIDTH 3\nHEIGHT 2") + rows)
        scan = read_scan(path)
        assert len(scan.points_mm) == 5 and codes(scan) == [(131, "info")]
        assert scan.findings[0].message.startswith("1 of 6") and scan.findings[0].where.endswith("line 14")
        with pytest.raises(FormatError, match=r"line 14: the point 0 nan 1.5 is not finite; .*--recover"):
            read_scan(write(tmp_path, head.replace(b"WIDTH 4", b"WIDTH 6") + rows))


class TestRecover:
    @pytest.mark.parametrize(
        ("content", "code"),
        [
            (sized(HEAD, 6) + ROWS + b"nan 1 1\ninf 0 0\n", 164),
            (sized(HEAD, 9) + ROWS, 163),
            (sized(HEAD, 9) + ROWS + b"1 2 3.1", 163),
            (sized(BINARY, 9) + SINGLES + b"1234567", 163),
            (sized(BINARY, 5) + SINGLES + b"\xff" * 12, 164),
        ],
    )
    def test_what_is_there_is_read(self, tmp_path: Path, content: bytes, code: int) -> None:
        path = write(tmp_path, content)
        with pytest.raises(FormatError, match="--recover"):
            read_scan(path)
        scan = read_scan(path, recover=True)
        assert np.array_equal(scan.points_mm, POINTS) and codes(scan) == [(code, "warn")]

    def test_normals_in_part_are_ignored(self, tmp_path: Path) -> None:
        path = write(
            tmp_path,
            BINARY.replace(b"x y z", b"x y z normal_x")
            .replace(b"4 4 4", b"4 4 4 4")
            .replace(b"F F F", b"F F F F")
            .replace(b"1 1 1", b"1 1 1 1", 1)
            + np.column_stack([POINTS, POINTS[:, 0]]).astype("<f4").tobytes(),
        )
        with pytest.raises(FormatError, match=r"line 3: the normals have only normal_x; .*--recover"):
            read_scan(path)
        scan = read_scan(path, recover=True)
        assert scan.normals is None and codes(scan) == [(166, "warn")] and not scan.columns


def packed_as(packed: bytes, size: int = 48) -> bytes:
    return COMPRESSED + struct.pack("<II", len(packed), size) + packed


@pytest.mark.parametrize(
    ("content", "place", "word"),
    [
        (b"", "byte 0", "empty"),
        (b"289814.15 4320978.61 170.76\n", "line 1", "'289814.15' is no key"),
        (b"\x1c", "line 1", "is no key of a PCD header"),
        (HEAD[: HEAD.index(b"DATA")], "line 11", "no DATA line"),
        (b"# nothing but a comment", "line 2", "no DATA line"),
        (HEAD.replace(b".7\n", b".9\n"), "line 2", "'.9'; versions 0.5 to 0.7"),
        (HEAD.replace(b"FIELDS x y z\n", b""), "line 10", "no FIELDS"),
        (HEAD.replace(b"SIZE 4 4 4\n", b""), "line 10", "no SIZE"),
        (HEAD.replace(b"FIELDS x y z", b"FIELDS"), "line 3", "no fields"),
        (HEAD.replace(b"x y z", b"x y w"), "line 3", "no z among the fields"),
        (HEAD.replace(b"x y z", b"x y y"), "line 3", "field y is there twice"),
        (HEAD.replace(b"SIZE 4 4 4", b"SIZE 4 4"), "line 4", "SIZE has 2 values for 3 fields"),
        (HEAD.replace(b"F F F", b"F F F F"), "line 5", "TYPE has 4 values"),
        (HEAD.replace(b"F F F", b"F F D"), "line 5", "field z has the type D of size 4"),
        (HEAD.replace(b"4 4 4", b"4 4 2"), "line 5", "type F of size 2"),
        (HEAD.replace(b"COUNT 1 1 1", b"COUNT 1 1 0"), "line 6", "count '0'"),
        (HEAD.replace(b"COUNT 1 1 1", b"COUNT 1 1 99999999"), "line 6", "count '99999999'"),
        (HEAD.replace(b"x y z", b"x y z h i").replace(b"4 4 4", b"4 4 4 8 8").replace(b"F F F", b"F F F F F").replace(
            b"1 1 1", b"1 1 1 65535 65535", 1), "line 6", "131073 values a point"),
        (HEAD.replace(b"WIDTH 4", b"WIDTH -4"), "line 7", "WIDTH is '-4'"),
        (HEAD.replace(b"WIDTH 4", b"WIDTH 4 4"), "line 7", "'4 4'"),
        (HEAD.replace(b"HEIGHT 1", b"HEIGHT 2"), "line 10", "WIDTH 4 x HEIGHT 2 are not POINTS 4"),
        (HEAD.replace(b"VIEWPOINT 0 0 0 1 0 0 0", b"VIEWPOINT 0 0 0 1 0 0"), "line 9", "instead of 7 numbers"),
        (HEAD.replace(b"VIEWPOINT 0", b"VIEWPOINT nan"), "line 9", "instead of 7 numbers"),
        (HEAD.replace(b"POINTS 4", b"POINTS x"), "line 10", "POINTS is 'x'"),
        (HEAD.replace(b"POINTS 4\n", b"POINTS 4\nPOINTS 4\n"), "line 11", "a second POINTS"),
        (sized(HEAD, 0), "line 10", "no points"),
        (HEAD.replace(b"WIDTH 4\nHEIGHT 1\n", b"").replace(b"POINTS 4\n", b""), "line 8", "neither POINTS nor WIDTH"),
        (HEAD.replace(b"ascii", b"zip"), "line 11", "unknown data 'zip'"),
        (sized(HEAD, 999999999999999) + ROWS, "line 10", "999999999999999 points of 3 numbers"),
        (HEAD + ROWS.replace(b"0 20", b"0,5 20"), "line 14", "decimal comma"),
        (HEAD + ROWS.replace(b"0 20", b"0 20 7"), "line 14", "4 columns instead of 3"),
        (HEAD + ROWS.replace(b"0 20", b"0x1 20"), "line 14", "'0x1' is not a number"),
        (HEAD + ROWS.replace(b"0 20", b"1e9 20"), "line 14", "coordinate_mm"),
        (sized(BINARY, 4294967295) + SINGLES, f"byte {len(BINARY) + 18}", "4294967295 points x 12 B"),
        (BINARY + SINGLES[:-1], f"byte {len(BINARY)}", "4 points x 12 B are declared, 47 B present"),
        (COMPRESSED + b"123", f"byte {len(COMPRESSED)}", "compressed data are missing"),
        (compressed()[:-1], f"byte {len(COMPRESSED)}", "cut short"),
        (packed_as(b"\0a", 47), f"byte {len(COMPRESSED) + 4}", "declare 47 B for 4 points x 12 B"),
        (packed_as(b"\0a"), f"byte {len(COMPRESSED) + 10}", "unpacks to 1 of the declared 48"),
        (packed_as(b"\0a\xe0\xff\0"), f"byte {len(COMPRESSED) + 10}", "more than the declared 48"),
        (packed_as(b"\0a\x20\x05"), f"byte {len(COMPRESSED) + 10}", "before the beginning"),
        (packed_as(b"\0a\xe0\x05"), f"byte {len(COMPRESSED) + 10}", "a back reference is cut short"),
        (packed_as(b"\x1fa"), f"byte {len(COMPRESSED) + 8}", "a run of literals is cut short"),
        (HEAD.replace(b"# .PCD", b"# unit mm\n# unit m\n#"), "line 2", "states the unit m"),
        (b"# x\n" * 20_000, "line 10001", "header_lines"),
        (b"#" * 2_000_000, "line 1", "header_bytes"),
    ],
)  # fmt: skip
def test_damaged_files_are_refused_with_their_place(tmp_path: Path, content: bytes, place: str, word: str) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FormatError) as caught:
        read_scan(path)
    message = str(caught.value)
    assert message.startswith(f"{path}, {place}:") and word in message and "\n" not in message


def test_limits_are_kept(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="limit points = 3") as caught:
        read_scan(write(tmp_path, BINARY + SINGLES), limits=Limits(points=3))
    assert caught.value.line == 10


class TestLzf:
    @modest
    @given(raw=st.binary(max_size=2000) | st.lists(st.sampled_from([b"abc", b"abcd" * 90, b"\0" * 700])).map(b"".join))
    def test_unpacks_what_was_packed(self, raw: bytes) -> None:
        assert decompress(compress(raw), len(raw)) == raw

    @modest
    @given(packed=st.binary(max_size=300), size=st.integers(0, 4000))
    def test_noise_is_unpacked_or_refused(self, packed: bytes, size: int) -> None:
        try:
            assert len(decompress(packed, size)) == size
        except ValueError as error:
            assert isinstance(error.args[0], int) and isinstance(error.args[1], str)

    def test_nothing_unpacks_to_more_than_is_declared(self) -> None:
        with pytest.raises(ValueError, match="more than the declared 1000 bytes"):
            decompress(b"\0a" + b"\xe0\xff\0" * 1_000_000, 1000)


class TestWriter:
    @modest
    @given(
        rows=st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 3), max_size=10),
        normals=st.booleans(),
        data=st.sampled_from(["binary", "ascii"]),
        column=st.floats(allow_infinity=False),
    )
    def test_written_and_read_is_the_same(
        self, tmp_path: Path, rows: list[tuple[float, float, float]], normals: bool, data: str, column: float
    ) -> None:
        points = np.array([*POINTS, *rows]) + 0.0
        columns = {"intensity": np.full(len(points), column), "a b": np.arange(float(len(points)))}
        up = np.tile([0.6, 0.0, 0.8], (len(points), 1)) if normals else None
        path = write(tmp_path, write_scan(Scan(points, up, columns=columns), data=data))  # type: ignore[arg-type]
        again = read_scan(path)
        assert np.array_equal(again.points_mm, points)
        assert (again.normals is None) == (up is None) and (
            again.normals is None or again.normals.tolist() == [[0.6, 0.0, 0.8]] * len(points)
        )
        assert list(again.columns) == ["intensity", "a_b"]
        assert np.array_equal(again.columns["intensity"], columns["intensity"], equal_nan=True)
        assert again.source is not None and (again.source.unit, again.source.unit_stated) == ("mm", True)

    def test_units(self, tmp_path: Path) -> None:
        path = write(tmp_path, write_scan(Scan(POINTS), unit="m"))
        assert np.allclose(read_scan(path).points_mm, POINTS, rtol=1e-15)
        with pytest.raises(UnitError, match="line 2: the file states m, the job mm"):
            read_scan(path, units="mm")

    def test_what_cannot_be_written_is_refused(self) -> None:
        with pytest.raises(JobError, match="data: 'zip' is none of binary, ascii"):
            write_scan(Scan(POINTS), data="zip")  # type: ignore[arg-type]
        for name in ("_", "z", "normal_x", ""):
            with pytest.raises(JobError, match="of a column"):
                write_scan(Scan(POINTS, columns={name: np.zeros(4)}))


SEEDS = [path.read_bytes() for path in sorted(CORPUS.glob("*.pcd"))]


@settings(modest, max_examples=50)
@given(data=st.data(), recover=st.booleans())
def test_changed_and_cut_files_are_read_or_refused(tmp_path: Path, data: st.DataObject, recover: bool) -> None:
    content = bytearray(data.draw(st.sampled_from(SEEDS)))
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = write(tmp_path, bytes(content[: data.draw(st.integers(0, len(content)))]))
    try:
        scan = read_scan(path, recover=recover)
        assert np.isfinite(scan.points_mm).all() and len(scan.points_mm) >= 3
    except SicpError as error:
        assert str(path) in str(error)
