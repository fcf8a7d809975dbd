"""Conversions from file to file, with the real readers and writers."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from sicp_cam import plugins
from sicp_cam.conversion import Conversion, convert
from sicp_cam.errors import JobError, OutputError
from sicp_cam.model import Scan

APT = (
    b"PARTNO/TRIM\r\nUNITS/MM\r\nMULTAX/ON\r\nRAPID\r\nGOTO/0,0,50.,0,0,1\r\nFEDRAT/600,MMPM\r\n"
    b"GOTO  / 0.,0,1.25 $\r\n , 0,0,1\r\nINSERT/M8\r\nGOTO/10.5,0,1.25\r\nGOTO/10.5,20,1.25,0.1,0,0.9949874\r\nFINI\r\n"
)


@pytest.fixture
def scan_file(tmp_path):
    random = np.random.default_rng(3)
    normals = random.normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    scan = Scan(random.uniform(-300.0, 300.0, (40, 3)), normals, columns={"intensity": np.arange(40.0)})
    file = tmp_path / "scan.ply"
    file.write_bytes(plugins.encoded("scan", file, scan))
    return file


def converted(source, name, **more):
    target = source.with_name(name)
    return target, convert(Conversion(source, target, **more))


@pytest.mark.parametrize("name", ["b.asc", "b.xyz", "b.csv", "b.txt", "b.ply", "b.pcd", "b.ply.gz"])
def test_a_scan_becomes_another_and_nothing_is_lost(scan_file, name):
    target, document = converted(scan_file, name, role="scan")
    before, after = plugins.read_scan(scan_file), plugins.read_scan(target)
    assert np.array_equal(before.points_mm, after.points_mm)
    assert np.allclose(before.normals, after.normals, atol=1e-15, rtol=0.0)
    assert np.array_equal(before.columns["intensity"], after.columns["intensity"])
    assert document["read_back"] == {"count": 40, "largest_difference_mm": 0.0}
    assert document["outputs"][0]["units"] == "mm"
    json.dumps(document, allow_nan=False)


def test_what_a_format_has_no_place_for_is_said(scan_file):
    _, document = converted(scan_file, "b.pts", role="scan")
    told = " ".join(finding["message"] for finding in document["findings"])
    assert "normals" in told
    assert document["status"] == "warn"


def test_a_cloud_does_not_become_a_mesh(scan_file):
    with pytest.raises((JobError, OutputError)):
        converted(scan_file, "b.stl", role="scan")
    assert not scan_file.with_name("b.stl").exists()


@pytest.mark.parametrize("name", ["b.ply", "b.stl", "b.obj", "b.off"])
def test_a_mesh_with_seams_becomes_another_and_its_seams_are_closed(tmp_path, name):
    corners = [[0, 0, 0], [9, 0, 0], [9, 9, 0], [0, 9, 0], [0, 0, 0], [9, 9, 0]]
    scan = Scan(corners, faces=[[0, 1, 2], [4, 5, 3]])
    source = tmp_path / "a.ply"
    source.write_bytes(plugins.encoded("scan", source, scan))
    target, document = converted(source, name, role="part")
    assert document["read_back"] == {"count": 4, "largest_difference_mm": 0.0}
    assert len(plugins.read_part(target).mesh.faces) == 2
    _, document = converted(target, "c.xyz", role="scan")
    assert "triangles" in " ".join(finding["message"] for finding in document["findings"])


def test_the_unit_of_what_is_written_is_that_asked_for(scan_file):
    target, document = converted(scan_file, "b.ply", out_units="inch", role="scan")
    assert document["outputs"][0]["units"] == "inch"
    again = plugins.read_scan(target, units="inch")
    assert np.allclose(again.points_mm, plugins.read_scan(scan_file).points_mm, atol=1e-9, rtol=0.0)


def test_a_unit_that_was_only_taken_does_not_become_a_fact(tmp_path):
    source = tmp_path / "inch.xyz"
    source.write_text("0 0 0\n1 0 0\n0 1 0\n0 0 1.5\n", encoding="ascii")
    for name in ("b.ply", "b.asc", "b.csv"):
        target, document = converted(source, name, role="scan")
        assert [finding["code"] for finding in document["findings"]] == [409]
        assert plugins.read_scan(target).source.unit_stated is False
        assert plugins.read_scan(target, units="inch").points_mm.max() == 1.5 * 25.4
    mesh = tmp_path / "mesh.off"
    mesh.write_text("OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1.5\n3 0 1 2\n3 0 1 3\n", encoding="ascii")
    for name in ("d.ply", "d.stl", "d.obj", "d.off", "d.pcd"):
        target, _ = converted(mesh, name, role="scan")
        assert plugins.read_scan(target).source.unit_stated is False
        target, _ = converted(mesh, f"{name}.gz", role="scan", units="inch", out_units="inch")
        stated = plugins.read_scan(target).source
        assert (stated.unit, stated.unit_stated) == ("mm" if ".off" in name else "inch", ".off" not in name)
    with pytest.raises(JobError, match="states no unit, so there is none to be changed"):
        converted(source, "c.ply", role="scan", out_units="m")
    target, _ = converted(source, "c.ply", role="scan", units="inch", out_units="m")
    assert plugins.read_scan(target).points_mm.max() == pytest.approx(1.5 * 25.4)


def test_what_a_program_reads_back_as_is_compared(tmp_path, monkeypatch):
    source = tmp_path / "a.apt"
    source.write_bytes(APT)
    made = plugins.postprocessor("csv").write
    post = plugins.postprocessor("csv")
    monkeypatch.setattr(type(post), "write", lambda self, program, noticed: {"b.csv": _shifted(made(program)["b.csv"])})
    with pytest.raises(OutputError, match=r"reads back as something else .*off by more than 0\.002 mm, this one by 1 "):
        converted(source, "b.csv")
    assert not (tmp_path / "b.csv").exists()


def _shifted(table):
    return table.replace(b"10.5000", b"11.5000")


def test_a_program_whose_reader_must_be_told_more_is_said_not_to_be_compared(tmp_path):
    source = tmp_path / "a.apt"
    source.write_bytes(APT)
    _, document = converted(source, "b.nc", out_options={"orientation": "rotary", "machine": "nutating-head-bc"})
    assert document["read_back"] is None
    assert [finding["code"] for finding in document["findings"] if finding["code"] == 652]
    head = (tmp_path / "b.nc").read_text(encoding="ascii")
    assert "coordinates in the path frame" in head and "scan" not in head.replace("not corrected to any scan", "")


def test_a_packed_file_has_the_same_bytes_each_time(scan_file):
    first, _ = converted(scan_file, "b.ply.gz")
    second, _ = converted(scan_file, "c.ply.gz")
    assert first.read_bytes() == second.read_bytes()
    assert gzip.decompress(first.read_bytes()).startswith(b"ply")


def test_a_program_in_its_own_words_is_byte_identical(tmp_path):
    source = tmp_path / "a.apt"
    source.write_bytes(APT)
    target, document = converted(source, "b.apt")
    assert target.read_bytes() == APT
    assert document["read_back"] == {"count": 4, "largest_difference_mm": 0.0}


@pytest.mark.parametrize("name", ["b.csv", "b.nc"])
def test_a_path_becomes_another_program(tmp_path, name):
    source = tmp_path / "a.apt"
    source.write_bytes(APT)
    target, document = converted(source, name)
    assert document["outputs"][0]["kind"] == "program"
    assert document["read_back"]["largest_difference_mm"] <= 0.00051
    assert target.exists()


def test_a_drawing_becomes_apt(tmp_path):
    import ezdxf

    drawing = ezdxf.new("R2010", units=4)
    drawing.modelspace().add_lwpolyline([(0, 0), (100, 0), (100, 50), (0, 50)], close=True)
    source = tmp_path / "a.dxf"
    drawing.saveas(source)
    target, document = converted(source, "b.apt")
    path = plugins.read_path(target)
    assert document["read_back"]["count"] == len(path)
    assert np.allclose(path.tips_mm.max(axis=0), (100.0, 50.0, 0.0))


def test_a_program_that_is_a_folder_is_named_by_the_target(tmp_path):
    source = tmp_path / "a.apt"
    source.write_bytes(APT)
    convert(Conversion(source, tmp_path / "trim", post="val3"))
    assert (tmp_path / "trim" / "trim.pjx").exists()


def test_an_existing_file_is_kept_unless_forced(scan_file):
    target = scan_file.with_name("b.xyz")
    target.write_bytes(b"mine")
    with pytest.raises(OutputError):
        convert(Conversion(scan_file, target))
    assert target.read_bytes() == b"mine"
    convert(Conversion(scan_file, target, force=True))
    assert target.read_bytes() != b"mine"


@pytest.mark.parametrize(
    ("target", "what"),
    [
        ("b.mp4", "nothing writes the suffix '.mp4'"),
        ("b.nc", "is read as a scan or a part, and that cannot become a path"),
    ],
)
def test_pairs_that_make_no_sense_are_refused(scan_file, target, what):
    with pytest.raises(JobError, match=what):
        convert(Conversion(scan_file, Path(scan_file.parent, target)))


def test_what_does_not_read_back_is_not_written(scan_file, monkeypatch):
    monkeypatch.setattr(plugins, "encoded", lambda *_, **__: b"x,y,z\n0,0,0\n1,0,0\n0,1,0\n")
    with pytest.raises(OutputError, match="40 points were to be written, 3 read back"):
        convert(Conversion(scan_file, scan_file.with_name("b.csv"), role="scan"))
    assert not scan_file.with_name("b.csv").exists()
