from __future__ import annotations

import ast
import io
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from sicp_cam import report
from sicp_cam.errors import ReportError
from sicp_cam.model import TriangleMesh
from sicp_cam.report import scenes
from sicp_cam.report.camera import looking_at, pixels
from sicp_cam.report.lettering import Key, Label, Lettering
from sicp_cam.report.scenes import Arrows, Dots, Line, Scene, Surface, render
from sicp_cam.report.views import loops_scene

HEAD_PX = 108


def opened(png: bytes) -> np.ndarray:
    return np.round(255 * matplotlib.image.imread(io.BytesIO(png), format="png")[:, :, :3]).astype(int)


def every_layer() -> Scene:
    corners = np.array([[0.0, 0, 0], [100, 0, 0], [100, 50, 0], [0, 50, 0]])
    camera = looking_at(corners, np.array([0.0, -0.3, 1.0]), width_px=320, height_px=180)
    dots = np.array([[20.0, 10.0, -3.0], [80.0, 40.0, -3.0]])
    return Scene(
        (
            Surface(TriangleMesh(corners, [[0, 1, 2], [0, 2, 3]]), "#d4d4d4"),
            Dots(dots, np.array([[255, 0, 0], [0, 0, 255]], np.uint8), 8.0, lift_mm=5.0),
            Line(np.array([[10.0, 25, 0], [10, 25, 0], [90, 25, 0]]), "#00a000", 5.0, lift_mm=5.0),
            Arrows(np.array([[50.0, 25, 0]]), np.array([[0.0, 0.0, 1.0]]), 20.0, "#ffa000", lift_mm=5.0),
        ),
        camera,
        Lettering(
            "Title $\\frac{", "<b>literal</b>", (Key("a key", "#00a000"),), labels=(Label("1", corners, "#000"),)
        ),
    )


@pytest.fixture(scope="module")
def drawn() -> list[bytes]:
    return render([every_layer(), every_layer()])


def test_things_are_where_the_camera_says(drawn: list[bytes]) -> None:
    scene, picture = every_layer(), opened(drawn[0])
    dots = scene.layers[1]
    assert isinstance(dots, Dots)
    for place, colour in zip(pixels(scene.camera, dots.points_mm), dots.colours, strict=True):
        x, y = int(place[0]), HEAD_PX + scene.camera.height_px - 1 - int(place[1])
        assert np.abs(picture[y, x] - colour.astype(int)).max() <= 3
    x, y = pixels(scene.camera, np.array([[30.0, 25.0, 0.0]]))[0]
    assert picture[HEAD_PX + scene.camera.height_px - 1 - int(y), int(x)] == pytest.approx([0, 160, 0], abs=3)


def test_every_layer_is_in_the_picture(drawn: list[bytes]) -> None:
    picture = opened(drawn[0]).reshape(-1, 3)
    assert opened(drawn[0]).shape == (180 + 108 + 112, 320, 3)
    orange = (picture[:, 0] > 150) & (picture[:, 1] > 60) & (picture[:, 2] < 60) & (picture[:, 0] > picture[:, 1] + 50)
    grey = (np.ptp(picture, axis=1) < 3) & (picture[:, 0] > 120) & (picture[:, 0] < 235)
    assert orange.sum() > 50
    assert grey.sum() > 5000


def test_the_same_scene_gives_the_same_bytes(drawn: list[bytes]) -> None:
    assert drawn[0] == drawn[1]


def test_loops_are_numbered_beside_each_other_even_where_they_coincide() -> None:
    phi = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    circle = 50 * np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)
    scene = loops_scene(circle * 1.5, None, [circle, circle - [0, 0, 2.0]], [1, 2], title="part.step")
    assert [label.text for label in scene.lettering.labels] == ["1", "2"]
    assert scene.lettering.subtitle == "2 loops"
    assert scene.camera.towards_eye[2] == pytest.approx(np.cos(np.radians(20)), abs=1e-6)
    assert all(len(label.places_mm) > 1 for label in scene.lettering.labels)


def test_open_loops_are_not_joined() -> None:
    chain = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0]])
    scene = loops_scene(chain, None, [chain, chain], [1, 2], np.array([0.0, 0, 1]), closed=[True, False])
    assert [len(layer.points_mm) for layer in scene.layers if isinstance(layer, Line)] == [4, 3]


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("import os; os.abort()", "SIGABRT"),
        ("raise RuntimeError('no driver')", "no driver"),
        ("import time; time.sleep(30)", "no answer within 0.8 s"),
    ],
)
def test_a_dying_or_hanging_renderer_is_an_error_and_nothing_more(monkeypatch, tmp_path, code: str, told: str) -> None:
    (tmp_path / "dying_renderer.py").write_text(code)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(scenes, "_CHILD", "dying_renderer")
    with pytest.raises(ReportError, match=told) as caught:
        render([every_layer()], timeout_s=0.8 if "sleep" in code else 30.0)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 8


def test_nothing_to_draw_starts_no_renderer(monkeypatch) -> None:
    monkeypatch.setattr(scenes, "_CHILD", "no_such_module")
    assert render([]) == []


def test_only_the_child_imports_the_renderer() -> None:
    room = Path(report.__file__).parent
    importing = {
        path.name
        for path in room.glob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Import | ast.ImportFrom)
        and any(word in ast.unparse(node) for word in ("pyvista", "vtk", "scenes_child"))
    }
    assert importing == {"scenes_child.py"}
