"""A part that is known as triangles only: a trimmed curved skin as STL, its scan as text, its path as APT."""

import json

import numpy as np
import pytest
import trimesh

from sicp_cam.model import TriangleMesh
from sicp_cam.rigid_motion import apply, from_parts, rotate

SIZE_MM, WIDE_MM, RINGS, SIDES = 80.0, 60.0, 16, 240
POSE = from_parts(
    np.array([[0.0, -1.0, 0.0], [np.cos(0.3), 0.0, -np.sin(0.3)], [np.sin(0.3), 0.0, np.cos(0.3)]]),
    [900.0, -300.0, 450.0],
)


def sag(u, w):
    return -4.0 * np.cos(np.pi * u / 320.0) * np.cos(np.pi * w / 260.0)


@pytest.fixture(scope="module")
def job(synthetic, bench, tmp_path_factory):
    """Write the files, and give the truth: a skin of radius 600 with an egg-shaped opening that sags by 4 mm."""
    folder = tmp_path_factory.mktemp("mesh")
    outline, sheet = synthetic.egg(SIZE_MM), synthetic.cylinder(600.0)
    bent = synthetic.bent(sheet, sag)
    edge, _, inward = outline.sampled(outline.length_mm / SIDES)
    depth = np.linspace(0.0, WIDE_MM, RINGS)
    places = (edge[None] + depth[:, None, None] * inward[None]).reshape(-1, 2)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(RINGS - 1), np.arange(SIDES), indexing="ij"))
    a, b = i * SIDES + j, (i + 1) * SIDES + j
    c, d = (i + 1) * SIDES + (j + 1) % SIDES, i * SIDES + (j + 1) % SIDES
    faces = np.concatenate([np.stack([a, d, c], 1), np.stack([a, c, b], 1)])
    bench.write_stl(folder / "skin.stl", TriangleMesh(sheet(places), faces))
    scan = synthetic.scan(synthetic.material([outline], spacing_mm=2.0, depth_mm=45.0), bent, noise_mm=0.04, pose=POSE)
    np.savetxt(folder / "scan.xyz", scan.points_mm, fmt="%.5f")
    nominal = synthetic.contour(outline, sheet, step_mm=2.0, rings_mm=())
    rows = [
        "GOTO/" + ",".join(f"{v:.6f}" for v in (*p, *n))
        for p, n in zip(nominal.points_mm, nominal.normals, strict=True)
    ]
    above = "GOTO/" + ",".join(
        f"{v:.6f}" for v in (*(nominal.points_mm[0] + 50.0 * nominal.normals[0]), *nominal.normals[0])
    )
    lines = [
        "PARTNO/SKIN",
        "UNITS/MM",
        "MULTAX",
        "RAPID",
        above,
        "FEDRAT/1200,MMPM",
        *rows,
        rows[0],
        "RAPID",
        above,
        "FINI",
    ]
    (folder / "trim.apt").write_text("\n".join(lines) + "\n", encoding="ascii")
    np.savetxt(folder / "pose.txt", synthetic.disturbed(POSE, 4))
    true = synthetic.contour(outline, bent, step_mm=2.0, rings_mm=())
    truth = {
        "path_true": apply(POSE, true.points_mm), "axis_true": rotate(POSE, true.normals),
        "inward": rotate(POSE, np.cross(true.normals, true.tangents)),
    }  # fmt: skip
    return folder, truth


@pytest.mark.parametrize("align", ["auto", "pose.txt"])
def test_a_path_on_a_mesh_is_corrected(job, cli, bench, tmp_path, align):
    folder, truth = job
    start = align if align == "auto" else folder / align
    files = ["--cad", folder / "skin.stl", "--scan", folder / "scan.xyz", "--path", folder / "trim.apt"]
    done = cli("correct", *files, "--align", start, "--out", tmp_path / "out", "--report", "none", "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert document["inputs"][0]["format"] == "STL binary"
    assert document["inputs"][0]["count"] == 2
    error = bench.deviation(*bench.moves(bench.table(tmp_path / "out" / "corrected.csv")), truth)
    assert error.both.mean() <= 0.6
    assert error.out.mean() <= 0.06
    assert error.axis.mean() <= 0.8
    assert document["registration"]["rigid"]["out"]["rms"] > 4.0 * document["registration"]["corrected"]["out"]["rms"]


def test_a_smooth_closed_mesh_is_refused(job, refused, tmp_path, bench):
    folder, _ = job
    ball = trimesh.creation.icosphere(subdivisions=3, radius=25.0)
    file = bench.write_stl(tmp_path / "ball.stl", TriangleMesh(ball.vertices, ball.faces))
    files = ["--cad", file, "--scan", folder / "scan.xyz", "--path", folder / "trim.apt"]
    line = refused(3, "correct", *files, "--out", tmp_path / "out", "--report", "none")
    assert "ball.stl" in line and "no open edge" in line


def test_tool_axes_that_point_into_the_part_are_refused_or_told(job, cli, tmp_path):
    """CL data with the axis the other way round: the holder would come through the skin."""
    folder, _ = job
    turned = []
    for line in (folder / "trim.apt").read_text(encoding="ascii").splitlines():
        if line.startswith("GOTO/"):
            x, y, z, i, j, k = (float(word) for word in line.removeprefix("GOTO/").split(","))
            line = f"GOTO/{x:.6f},{y:.6f},{z:.6f},{-i:.6f},{-j:.6f},{-k:.6f}"
        turned.append(line)
    file = tmp_path / "trim.apt"
    file.write_text("\n".join(turned) + "\n", encoding="ascii")
    files = [
        "--cad",
        folder / "skin.stl",
        "--scan",
        folder / "scan.xyz",
        "--path",
        file,
        "--align",
        folder / "pose.txt",
    ]
    done = cli("correct", *files, "--out", tmp_path / "out", "--report", "none")
    assert done.code in (4, 5) or "axis" in done.err or "axes" in done.err
