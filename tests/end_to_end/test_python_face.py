"""The library as a script uses it, word by word as the documentation shows it."""

import logging

import numpy as np
import pytest

import sicp_cam
from sicp_cam.errors import JobError, OutputError, SicpError


@pytest.fixture
def folder(bench, monkeypatch, tmp_path):
    """A folder with the nose cone's files under the names of the example; its pose follows from its geometry."""
    for name, file in (("part.step", "part.step"), ("scan.ply", "scan.ply"), ("trim.apt", "path.apt")):
        (tmp_path / name).symlink_to(bench.SAMPLES / "nosecone" / file)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def unrendered(monkeypatch):
    """Leave out the three-dimensional pictures, which cost seconds and are tested with the command."""
    from sicp_cam.report import compose

    monkeypatch.setattr(compose, "pictures", lambda *arguments: ({}, ()))


def test_the_example_of_the_documentation(folder, corrections, unrendered, monkeypatch, capfd):
    """Word by word; only the arithmetic of the registration is not repeated, since the next test repeats it."""
    made = corrections("nosecone")
    monkeypatch.setattr("sicp_cam.pipeline.register_contours", lambda *given, **options: made.registration.result)

    result = sicp_cam.correct(cad="part.step", scan="scan.ply", path="trim.apt")
    result.write("val3", "out/")
    result.write("gcode", "out/")
    result.write("csv", "out/")
    result.report("report.pdf")

    assert (folder / "out" / "corrected" / "corrected.pjx").exists()
    assert (folder / "out" / "corrected.nc").exists()
    assert (folder / "out" / "corrected.csv").exists()
    assert (folder / "report.pdf").read_bytes().startswith(b"%PDF-")

    monkeypatch.setattr("sicp_cam.correction.register_contours", lambda *given, **options: made.registration.result)
    part = sicp_cam.read_part("part.step")
    scan = sicp_cam.read_scan("scan.ply", units="mm")
    path = sicp_cam.read_path("trim.apt")
    registration = sicp_cam.register(part, scan, path=path, method="sicp")
    corrected = registration.apply(path)

    np.testing.assert_array_equal(corrected.corrected.tips_mm, result.corrected.corrected.tips_mm)
    assert len(part.contours) == result.document()["inputs"][0]["count"]
    assert (len(scan.points_mm), len(path)) == (50_941, result.document()["inputs"][2]["count"])
    captured = capfd.readouterr()
    assert captured.out == "", "the library never prints"


def test_register_and_apply_give_what_correct_gives(bench, corrections):
    """Nothing is patched here: arrays in, arrays out."""
    made = corrections("disc")
    part = sicp_cam.read_part(bench.inputs("disc")["cad"])
    scan = sicp_cam.read_scan(bench.inputs("disc")["scan"], units="mm")
    path = sicp_cam.read_path(bench.inputs("disc")["path"])
    from sicp_cam.alignment import read_alignment

    align = read_alignment(bench.SAMPLES / "disc" / "pose_rough.txt").T_scan_part
    before = path.tips_mm.copy(), scan.points_mm.copy()
    registration = sicp_cam.register(part, scan, path=path, method="sicp", align=align)
    corrected = registration.apply(path)
    np.testing.assert_array_equal(corrected.corrected.tips_mm, made.corrected.corrected.tips_mm)
    np.testing.assert_array_equal(corrected.corrected.axes, made.corrected.corrected.axes)
    assert corrected.status == made.corrected.status
    np.testing.assert_array_equal(path.tips_mm, before[0])
    np.testing.assert_array_equal(scan.points_mm, before[1])


def test_keywords_are_the_keys_of_a_job(bench, corrections):
    made = corrections("disc", method="sicp", registration__segments=14)
    assert len(made.registration.result.contours[0].segments) == 14


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"methode": "sicp"}, "did you mean method?"),
        ({"registration__segmets": 3}, "did you mean segments?"),
        ({"scan": "nowhere.ply"}, "nowhere.ply: no such file"),
        ({"gates__coverage": float("nan")}, "finite"),
        ({"override": "everything"}, "no gate 'everything'"),
    ],
)
def test_a_wrong_keyword_is_a_job_error(bench, settings, told):
    with pytest.raises(JobError) as caught:
        sicp_cam.correct(**{**bench.inputs("disc"), **settings})
    assert told in str(caught.value)


def test_every_problem_of_a_job_is_told_at_once(bench):
    with pytest.raises(JobError) as caught:
        sicp_cam.correct(**bench.inputs("disc"), methode="sicp", frame="world", contour=0)
    assert len(caught.value.problems) == 3


def test_files_are_not_replaced_and_inputs_never(corrections, tmp_path):
    made = corrections("disc")
    made.write("csv", tmp_path)
    before = (tmp_path / "disc.csv").read_bytes()
    with pytest.raises(OutputError, match="exists"):
        made.write("csv", tmp_path)
    (again,) = made.write("csv", tmp_path, force=True)
    assert again.read_bytes() == before


def test_options_of_a_post_are_keywords(corrections, tmp_path):
    with pytest.raises(JobError, match="spin"):
        corrections("disc").write("val3", tmp_path, spin="fast")
    with pytest.raises(JobError, match="no postprocessor 'kuka'"):
        corrections("disc").write("kuka", tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("read", [sicp_cam.read_part, sicp_cam.read_scan, sicp_cam.read_path])
def test_a_file_that_is_not_there_is_an_input_error(read, tmp_path):
    suffix = {"read_part": "step", "read_scan": "ply", "read_path": "apt"}[read.__name__]
    with pytest.raises(sicp_cam.InputError, match=f"gone.{suffix}"):
        read(tmp_path / f"gone.{suffix}")
    with pytest.raises(SicpError):
        read(tmp_path / "file.unknown")


def test_nothing_is_written_and_nothing_printed_by_correct(bench, capfd, caplog, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    capfd.readouterr()
    with caplog.at_level(logging.DEBUG):
        sicp_cam.correct(**bench.inputs("disc"), align=bench.SAMPLES / "disc" / "pose_rough.txt")
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")
    assert list(tmp_path.iterdir()) == []


def test_the_report_says_why_it_failed(corrections, monkeypatch, tmp_path):
    from sicp_cam.report import compose, pdf

    def failing(document):
        raise sicp_cam.ReportError("report.pdf: the page cannot be set")

    monkeypatch.setattr(compose, "pictures", lambda *arguments: ({}, ()))
    monkeypatch.setattr(pdf, "build", failing)
    with pytest.raises(sicp_cam.ReportError, match="cannot be set"):
        corrections("disc").report(tmp_path / "report.pdf")
    assert list(tmp_path.iterdir()) == []
