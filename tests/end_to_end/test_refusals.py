"""Whatever is wrong with a job: its exit code, one clear line, and not a single file."""

import json
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest

import sicp_cam
from sicp_cam.alignment import read_alignment
from sicp_cam.errors import AmbiguousPoseError, ReportError
from sicp_cam.rigid_motion import apply, inverse


@pytest.fixture
def disc(bench, tmp_path):
    """Return the words of a disc run; its results would go to `out`."""
    return lambda **changes: bench.words("disc", tmp_path / "out", **changes)


@pytest.fixture(scope="module")
def disc_points(bench):
    return sicp_cam.read_scan(bench.SAMPLES / "disc" / "scan.ply").points_mm


def as_text(file, points):
    np.savetxt(file, points, fmt="%.9g")
    return file


# ---- 2: the job ----


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--frobnicate"], "--frobnicate"),
        (["--method", "best"], "method"),
        (["--align", "nowhere.txt"], "nowhere.txt"),
        (["--contour", "0"], "contour"),
        (["--post", "fanuc"], "fanuc"),
        (["--set", "gates.coverge=0.5"], "coverage"),
        (["--set", "gates.coverage=nan"], "must be a number, not 'nan'"),
        (["--override", "coverge"], "coverage"),
    ],
)
def test_a_job_that_cannot_be_is_exit_2(refused, bench, tmp_path, words, told):
    left_out = {"method": None, "align": None, "contour": None, "post": None, "override": None}
    chosen = {key: value for key, value in left_out.items() if f"--{key}" in words}
    assert told in refused(2, *bench.words("disc", tmp_path / "out", **chosen), *words)


def test_a_contour_that_the_part_does_not_have_is_exit_2(refused, disc):
    assert "it has 1 to " in refused(2, *disc(contour="99"))


# ---- 3: the inputs ----


@pytest.mark.parametrize(
    ("role", "name", "content", "told"),
    [
        ("scan", "scan.ply", "truncated", "byte"),
        ("scan", "scan.ply", b"", "empty"),
        ("scan", "scan.asc", b"", "empty"),
        ("scan", "scan.ply", b"\x1f\x8b\x08\x00" + bytes(100), "gzip"),
        ("cad", "part.step", b"this is a text and no part\n", "part.step"),
        ("cad", "part.step", b"", "empty"),
        ("path", "path.nc", b"", "empty"),
        ("path", "path.nc", b"%\nG21 G90\nG1 X1.0 X2.0 F100\n%\n", "line 3"),
        ("path", "path.apt", b"UNITS/MM\nGOTO/1.0,2.0\n", "line 2"),
        ("scan", "scan.mp4", b"anything", "suffix"),
    ],
)
def test_an_input_that_cannot_be_used_is_exit_3(refused, disc, bench, tmp_path, role, name, content, told):
    file = tmp_path / name
    if content == "truncated":
        content = (bench.SAMPLES / "disc" / "scan.ply").read_bytes()[:-100]
    file.write_bytes(content)
    line = refused(3, *disc(**{role: file}))
    assert name in line
    assert told.lower() in line.lower()


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(0.001, "m"), (1.0 / 25.4, "inch")],
)
def test_a_scan_in_another_unit_is_exit_3_and_the_unit_is_named(refused, disc, disc_points, tmp_path, factor, unit):
    file = as_text(tmp_path / "scan.xyz", disc_points * factor)
    assert f"--scan-units {unit}" in refused(3, *disc(scan=file, scan_units=None))


@pytest.mark.parametrize(("factor", "unit"), [(0.001, "m"), (1.0 / 25.4, "inch")])
def test_a_scan_in_another_unit_is_right_where_it_is_stated(
    cli, disc, bench, corrections, disc_points, tmp_path, factor, unit
):
    file = as_text(tmp_path / "scan.xyz", disc_points * factor)
    done = cli(*disc(scan=file, scan_units=unit), "--json")
    assert done.code == 0
    entry = json.loads(done.out)["inputs"][1]
    assert (entry["units"], entry["unit_stated"]) == (unit, True)
    tips, _ = bench.moves(bench.table(tmp_path / "out" / "disc.csv"), cutting=False)
    np.testing.assert_allclose(tips, corrections("disc").corrected.corrected.tips_mm, atol=0.01)


# ---- 4: the registration ----


@pytest.mark.parametrize("name", ["porthole", "disc"])
def test_a_pose_that_the_geometry_cannot_settle_is_refused_with_the_remedy(refused, bench, tmp_path, name):
    line = refused(4, *bench.words(name, tmp_path / "out", align="auto"))
    assert "symmetric" in line
    assert "give a rough pose or datum pairs with --align FILE" in line
    if name == "disc":
        assert "other side outward" in line


def test_the_library_raises_its_own_kind_of_error_for_it(bench):
    with pytest.raises(AmbiguousPoseError):
        sicp_cam.correct(**bench.inputs("disc"))


def test_scan_normals_settle_which_side_of_a_flat_sheet_is_outward(cli, disc, bench, disc_points, tmp_path):
    """A circle in a flat sheet has no side of its own and no beginning; with the side known the path is the same."""
    true = bench.truth("disc")
    near = np.linalg.norm(disc_points[:, None] - true["path_true"][None, ::4], axis=2).argmin(axis=1)
    scan = bench.write_ply(tmp_path / "scan.ply", disc_points, true["axis_true"][::4][near])
    assert cli(*disc(align="auto", scan=scan)).code == 0
    error = bench.deviation(*bench.moves(bench.table(tmp_path / "out" / "disc.csv")), true)
    assert error.out.mean() <= 0.06
    assert error.axis.mean() <= 0.8


def test_scan_normals_that_contradict_the_given_start_are_told(cli, disc, bench, disc_points, tmp_path):
    scan = bench.write_ply(tmp_path / "scan.ply", disc_points, np.tile(-bench.truth("disc")["R"][:, 2], (3069, 1)))
    done = cli(*disc(scan=scan))
    assert done.code == 4 or "normals" in done.err


@pytest.mark.parametrize(
    ("job", "scanned", "align"),
    [
        ("porthole", "disc", "given"),
        ("porthole", "disc", "auto"),
        ("nosecone", "porthole", "given"),
        ("nosecone", "porthole", "auto"),
    ],
)
def test_the_scan_of_another_part_is_exit_4(refused, bench, tmp_path, job, scanned, align):
    changes = {"align": "auto"} if align == "auto" else {}
    line = refused(4, *bench.words(job, tmp_path / "out", scan=bench.inputs(scanned)["scan"], **changes))
    assert "--align" in line


def test_the_scan_of_another_part_clamped_in_the_same_place_is_refused(refused, bench, disc_points, tmp_path):
    """The worst case: the other part lies where this one should, so that its edge is within reach."""
    to_disc, to_porthole = (
        read_alignment(bench.SAMPLES / name / "pose_rough.txt").T_scan_part for name in ("disc", "porthole")
    )
    file = as_text(tmp_path / "scan.xyz", apply(to_porthole @ inverse(to_disc), disc_points))
    refused(4, *bench.words("porthole", tmp_path / "out", scan=file))


def test_a_part_three_percent_larger_is_refused(refused, bench, tmp_path):
    points = sicp_cam.read_scan(bench.SAMPLES / "porthole" / "scan.ply").points_mm
    centre = points.mean(axis=0)
    file = as_text(tmp_path / "scan.xyz", (points - centre) * 1.03 + centre)
    assert "stretch" in refused(4, *bench.words("porthole", tmp_path / "out", scan=file))


def test_a_broken_gate_of_the_registration_is_exit_4_and_names_its_override(refused, disc):
    line = refused(4, *disc(), "--set", "gates.residual_mm=0.0001")
    assert "residual_mm" in line and "limit 0.0001" in line and "--override residual_mm" in line


# ---- 5: the path ----


def moved_path(bench, tmp_path, shift):
    program = (bench.SAMPLES / "disc" / "path.nc").read_text(encoding="ascii")
    file = tmp_path / "path.nc"
    file.write_text(program.replace("X100.000", f"X{100.0 + shift:.3f}"), encoding="ascii")
    return file


def test_a_path_elsewhere_is_exit_5_and_the_distance_is_named(refused, disc, bench, tmp_path):
    line = refused(5, *disc(path=moved_path(bench, tmp_path, 500.0)))
    assert "mm from the nearest contour" in line and "--path-units" in line


def test_a_path_elsewhere_is_refused_where_the_operator_chose_the_contour_too(refused, disc, bench, tmp_path, disc_run):
    number = disc_run.document["registration"]["contours"][0]["id"]
    line = refused(5, *disc(path=moved_path(bench, tmp_path, 500.0), contour=number))
    assert "path_distance_mm" in line


def test_tool_axes_the_other_way_round_are_refused_or_told(cli, bench, tmp_path):
    """The path lies on the outer edge to the micrometre, but its axes point into the part.

    The inner skin is registered to the scan of the outer one, so that the path comes out 3 mm off, the thickness.
    """
    lines = (bench.SAMPLES / "porthole" / "path.apt").read_text(encoding="ascii").splitlines()
    for number, line in enumerate(lines):
        if line.startswith("GOTO/"):
            x, y, z, i, j, k = line.removeprefix("GOTO/").split(",")
            axis = ",".join(f"{-float(word):.6f}" for word in (i, j, k))
            lines[number] = f"GOTO/{x},{y},{z},{axis}"
    file = tmp_path / "path.apt"
    file.write_text("\n".join(lines) + "\n", encoding="ascii")
    done = cli(*bench.words("porthole", tmp_path / "out", path=file))
    assert done.code in (4, 5) or "axis" in done.err or "axes" in done.err


def test_a_path_in_inches_read_as_millimetres_is_exit_5(refused, disc, bench, tmp_path):
    program = (bench.SAMPLES / "disc" / "path.nc").read_text(encoding="ascii").replace("G21 ", "")
    file = tmp_path / "path.nc"
    file.write_text(program.replace("100.000", "3.937"), encoding="ascii")
    assert "--path-units" in refused(5, *disc(path=file))


@pytest.mark.parametrize("gate", ["correction_mm", "axis_deg", "path_distance_mm"])
def test_a_broken_gate_of_the_path_is_exit_5(refused, disc, gate):
    line = refused(5, *disc(), "--set", f"gates.{gate}=0")
    assert gate in line


def test_every_broken_gate_is_named_on_the_one_line(refused, disc):
    line = refused(5, *disc(), "--set", "gates.correction_mm=0.1", "--set", "gates.axis_deg=0.1")
    assert "--override correction_mm --override axis_deg" in line


def test_the_override_of_one_gate_is_not_that_of_another(refused, disc):
    refused(5, *disc(override="axis_deg"), "--set", "gates.correction_mm=0.1", "--set", "gates.axis_deg=0.1")


def test_an_override_lets_the_program_be_and_stands_in_all_that_is_written(cli, bench, tmp_path):
    words = bench.words("disc", tmp_path / "out", post="val3,gcode,csv", override="correction_mm")
    done = cli(*words, "--set", "gates.correction_mm=0.1", "--json")
    assert done.code == 0
    document = json.loads(done.out)
    (gate,) = [gate for gate in document["gates"] if gate["state"] != "ok"]
    assert (gate["name"], gate["state"], gate["limit"]) == ("correction_mm", "overridden", 0.1)
    assert document["status"] == "warn"
    assert [f["level"] for f in document["findings"] if "correction_mm was overridden" in f["message"]] == ["warn"]
    assert "correction_mm was overridden" in done.err
    assert document == json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    for name in ("disc.nc", "disc/start.pgx"):
        text = (tmp_path / "out" / name).read_text(encoding="utf-8").lower()
        told = f"gate correction_mm overridden by the operator: {gate['value']:.4g}, limit 0.1"
        assert told in " ".join(text.replace("(", " ").replace(")", " ").replace("//", " ").split())
    header, *rows = (tmp_path / "out" / "disc.csv").read_text(encoding="ascii").splitlines()
    assert f"correction_mm overridden by the operator: {gate['value']:.4g} limit 0.1" in header.split(",")[-1]
    assert all(row.endswith(",1") for row in rows)


def test_what_the_method_is_known_for_is_a_warning_and_no_program_under_strict(cli, refused, disc, tmp_path):
    """The rigid pose misses a bent part: the operator asked for it, and is told."""
    line = refused(7, *disc(method="rigid"), "--strict")
    assert "residual_mm" in line and "limit 0.5" in line
    done = cli(*disc(method="rigid"))
    assert done.code == 0
    assert "warning" in done.err and "residual_mm" in done.err and "limit 0.5" in done.err


def test_a_start_pose_far_off_is_exit_4_and_names_its_gate(refused, disc):
    line = refused(4, *disc(), "--set", "gates.pose_mm=1", "--set", "gates.pose_deg=0.5")
    assert "--override pose_mm --override pose_deg" in line
    assert "--override pose_mm" not in refused(4, *disc(), "--set", "gates.pose_deg=0.5")


# ---- 6: the output ----


def test_an_existing_result_is_exit_6_and_stays(cli, disc, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "result.json").write_text("earlier", encoding="ascii")
    done = cli(*disc())
    assert (done.code, done.out) == (6, "")
    assert done.err.count("\n") == 1 and "--force" in done.err
    assert [file.name for file in out.iterdir()] == ["result.json"]
    assert (out / "result.json").read_text(encoding="ascii") == "earlier"


def test_an_existing_program_is_exit_6_even_without_a_result(cli, disc, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "disc.csv").write_text("somebody's", encoding="ascii")
    done = cli(*disc())
    assert (done.code, done.err.count("\n")) == (6, 1)
    assert [file.name for file in out.iterdir()] == ["disc.csv"]
    assert (out / "disc.csv").read_text(encoding="ascii") == "somebody's"


def test_force_replaces_a_result(cli, disc, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "result.json").write_text("earlier", encoding="ascii")
    (out / "disc.csv").write_text("earlier", encoding="ascii")
    assert cli(*disc(), "--force").code == 0
    assert json.loads((out / "result.json").read_text(encoding="ascii"))["schema"] == "sicp-cam/1"
    assert (out / "disc.csv").read_text(encoding="ascii").startswith("x,y,z,i,j,k,feed,rapid,status")


def test_a_folder_that_is_a_file_is_refused(cli, disc, tmp_path):
    (tmp_path / "out").write_text("a file", encoding="ascii")
    done = cli(*disc())
    assert done.code in (2, 6)
    assert "not a folder" in done.err and done.err.count("\n") == 1


def test_an_input_is_never_replaced(cli, bench, tmp_path):
    for name in ("part.step", "scan.ply", "path.nc", "pose_rough.txt"):
        shutil.copy(bench.SAMPLES / "disc" / name, tmp_path / name)
    scan = tmp_path / "disc.csv"
    as_text(scan, sicp_cam.read_scan(tmp_path / "scan.ply").points_mm)
    before = scan.read_bytes()
    done = cli(*bench.words("disc", tmp_path, scan=scan), "--force")
    assert done.code == 6
    assert "would replace an input" in done.err
    assert scan.read_bytes() == before


# ---- 7, 8 and the rest ----


def test_warnings_under_strict_are_exit_7(refused, disc):
    """The program for VAL3 always warns where no tool is declared: the robot would move its flange."""
    line = refused(7, *disc(post="val3"), "--strict")
    assert "--strict" in line and "tool" in line


def test_a_run_without_warnings_passes_strict(cli, disc, tmp_path):
    done = cli(*disc(), "--strict")
    assert (done.code, done.err) == (0, "")
    assert (tmp_path / "out" / "result.json").exists()


def test_a_unit_that_no_one_stated_is_a_warning(cli, refused, disc):
    done = cli(*disc(scan_units=None), "--dry-run", "--json")
    (told,) = [finding for finding in json.loads(done.out)["findings"] if finding["code"] == 409]
    assert told["level"] == "warn" and "mm was taken: the scan is 449.6 mm across, the part 565.7 mm" in told["message"]
    assert "--scan-units" in refused(7, *disc(scan_units=None), "--strict")


def test_a_dry_run_does_everything_but_write(cli, disc, bench, tmp_path):
    done = cli(*disc(), "--dry-run", "--json")
    assert (done.code, done.err) == (0, "")
    document = json.loads(done.out)
    assert [entry["path"] for entry in document["outputs"]] == ["disc.csv"]
    assert bench.tree(tmp_path) == {}
    assert not (tmp_path / "out").exists()
    lines = cli(*disc(), "--dry-run").out.splitlines()
    assert lines[-1] == "dry run: nothing was written"


def test_a_dry_run_is_refused_where_the_run_would_be(refused, disc):
    refused(5, *disc(), "--dry-run", "--set", "gates.correction_mm=0.1")


def test_a_renderer_that_fails_is_exit_8_and_the_program_is_there(cli, bench, monkeypatch, tmp_path):
    """The child that draws cannot even be imported; the curves, the page and the program do not need it."""
    monkeypatch.setattr("sicp_cam.report.scenes._CHILD", "sicp_cam.report.a_module_that_does_not_exist")
    done = cli(*bench.words("disc", tmp_path / "out", report="pdf,png"), "--json")
    assert done.code == 8
    document = json.loads(done.out)
    assert [f["code"] for f in document["findings"] if "picture" in f["message"]] == [701]
    assert document["status"] == "warn"
    assert document == json.loads((tmp_path / "out" / "result.json").read_text(encoding="ascii"))
    assert (tmp_path / "out" / "disc.csv").exists()
    assert (tmp_path / "out" / "report.pdf").read_bytes().startswith(b"%PDF-")
    assert "pictures" in done.err and done.err.count("\n") == 1
    assert "Traceback" not in done.err


@pytest.fixture
def failing_page(monkeypatch):
    """Let the page fail with an error; no picture is drawn."""
    from sicp_cam.report import compose, pdf

    def put(error):
        def failing(document):
            raise error

        monkeypatch.setattr(compose, "pictures", lambda *arguments: ({}, ()))
        monkeypatch.setattr(pdf, "build", failing)

    return put


def test_a_page_that_fails_is_exit_8_and_the_program_is_there(cli, disc, bench, failing_page, tmp_path):
    failing_page(ReportError("report.pdf: the page cannot be set"))
    done = cli(*disc(report="pdf"))
    assert done.code == 8
    assert "the page cannot be set" in done.err and done.err.count("\n") == 1
    assert set(bench.tree(tmp_path / "out")) == {"disc.csv", "result.json"}


def test_a_bug_in_a_page_does_not_cost_the_program(cli, disc, failing_page, tmp_path):
    failing_page(KeyError("font"))
    assert cli(*disc(report="pdf")).code == 8
    assert (tmp_path / "out" / "disc.csv").exists()


def test_a_failed_report_is_told_under_q_too(cli, disc, failing_page):
    failing_page(ReportError("report.pdf: the page cannot be set"))
    done = cli(*disc(report="pdf"), "-q")
    assert done.code == 8
    assert "the page cannot be set" in done.err


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent differently there")
def test_an_interrupt_in_the_midst_leaves_nothing(bench, tmp_path):
    line = [sys.executable, "-m", "sicp_cam", *bench.words("disc", tmp_path / "out", report="pdf"), "-v"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        for told in process.stderr:
            if "register" in told:
                process.send_signal(signal.SIGINT)
                break
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert err.splitlines()[-1] == "sicp-cam: error: interrupted"
    assert bench.tree(tmp_path) == {}


# ---- what does not matter ----


def test_the_number_of_the_contour_gives_what_auto_gives(cli, disc, disc_run, tmp_path):
    number = disc_run.document["registration"]["contours"][0]["id"]
    assert cli(*disc(contour=number)).code == 0
    assert (tmp_path / "out" / "disc.csv").read_bytes() == (disc_run.out / "disc.csv").read_bytes()


def test_the_part_frame_on_the_command_line(cli, disc, bench, disc_run, tmp_path):
    done = cli(*disc(frame="part", post="csv,gcode"), "--json")
    assert done.code == 0
    T = np.array(json.loads(done.out)["registration"]["T_scan_part"])
    here, there = (
        bench.moves(bench.table(folder / "disc.csv"), cutting=False) for folder in (tmp_path / "out", disc_run.out)
    )
    np.testing.assert_allclose(apply(T, here[0]), there[0], atol=2e-4)
    assert "part frame" in (tmp_path / "out" / "disc.nc").read_text(encoding="ascii").lower()[:2000]
