"""Which way the imports run: the plan of the house, read from the code itself."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
GROUND_FLOOR = {"model", "errors", "findings", "units", "limits", "ranges", "rigid_motion", "child_process"}
METHOD = ("contour", "registration", "toolpath")
PLOTTING = {"matplotlib", "pyvista", "vtk", "vtkmodules", "reportlab", "rich", "cyclopts"}
HEAVY = ("OCP", "cadquery", "vtk", "vtkmodules", "pyvista", "matplotlib", "reportlab", "ezdxf")
ENTRY_POINTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]


def modules(*folders):
    found = [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]
    assert found, f"nothing in {folders}"
    return [pytest.param(path, id=str(path.relative_to(ROOT))) for path in found]


def imported(path):
    """Return the dotted names that a module imports, everywhere in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names.add(node.module)
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def rooms(path):
    """Return the first parts below sicp_cam that a module imports."""
    return {name.split(".")[1] for name in imported(path) if name.startswith("sicp_cam.")}


def packages(path):
    return {name.split(".")[0] for name in imported(path)}


def called(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}


@pytest.mark.parametrize("name", sorted(GROUND_FLOOR))
def test_the_ground_floor_stands_on_itself(name):
    path = ROOT / "sicp_cam" / f"{name}.py"
    assert rooms(path) <= GROUND_FLOOR
    assert not packages(path) & {"sicp_formats", "sicp_postprocessors"}


@pytest.mark.parametrize("path", modules("formats/sicp_formats"))
def test_formats_stand_on_the_ground_floor(path):
    assert rooms(path) <= GROUND_FLOOR
    assert "sicp_postprocessors" not in packages(path)


@pytest.mark.parametrize("path", modules("postprocessors/sicp_postprocessors"))
def test_postprocessors_stand_on_the_ground_floor(path):
    assert rooms(path) <= GROUND_FLOOR
    assert "sicp_formats" not in packages(path)


@pytest.mark.parametrize("path", modules(*(f"sicp_cam/{room}" for room in METHOD)))
def test_the_method_takes_arrays_and_gives_arrays(path):
    assert rooms(path) <= GROUND_FLOOR - {"child_process"} | set(METHOD)
    assert not packages(path) & ({"sicp_formats", "sicp_postprocessors", "pathlib", "io", "tempfile"} | PLOTTING)
    assert not called(path) & {"open", "print", "input"}


@pytest.mark.parametrize("path", modules("sicp_cam"))
def test_the_core_finds_formats_and_posts_through_entry_points_only(path):
    assert not packages(path) & {"sicp_formats", "sicp_postprocessors"}


@pytest.mark.parametrize("path", modules("sicp_cam"))
def test_only_the_command_line_knows_the_command_line(path):
    if "cli" not in path.relative_to(ROOT).parts and path.name != "__main__.py":
        assert "cli" not in rooms(path)
        assert not packages(path) & {"cyclopts", "rich"}


@pytest.mark.parametrize("path", modules("sicp_cam/report"))
def test_the_report_knows_neither_jobs_nor_files_of_results(path):
    assert rooms(path) <= GROUND_FLOOR | set(METHOD) | {"report"}


@pytest.mark.parametrize("path", modules("sicp_cam", "formats", "postprocessors"))
def test_no_module_imports_at_its_top_what_is_heavy_but_those_that_run_in_a_child(path):
    if path.name.endswith("_child.py"):
        return
    tree = ast.parse(path.read_text(encoding="utf-8"))
    at_the_top = {
        name.split(".")[0]
        for node in tree.body
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }
    assert not at_the_top & {"pyvista", "vtk", "vtkmodules", "cadquery"}


def loaded_after(code):
    script = f"import sys\n{code}\nprint(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_importing_the_package_loads_nothing_heavy():
    assert not loaded_after("import sicp_cam") & set(HEAVY)


def test_using_the_public_names_loads_neither_cad_kernel_nor_renderer():
    code = "import sicp_cam\nassert all(hasattr(sicp_cam, name) for name in sicp_cam.__all__)"
    assert not loaded_after(code) & set(HEAVY)


def test_every_entry_point_can_be_imported_without_cad_kernel_and_renderer():
    named = [value for group in ENTRY_POINTS.values() for value in group.values()]
    script = "import importlib\n" + "\n".join(
        f"assert callable(getattr(importlib.import_module({module!r}), {attribute!r}))"
        for module, attribute in (value.split(":") for value in sorted(set(named)))
    )
    assert not loaded_after(script) & {"OCP", "cadquery", "vtk", "vtkmodules", "pyvista", "matplotlib"}


@pytest.mark.parametrize("group", [group for group in ENTRY_POINTS if group.startswith("sicp_cam.")])
def test_the_installed_entry_points_are_those_of_the_project_file(group):
    from importlib.metadata import entry_points

    ours = {e.name: e.value for e in entry_points(group=group) if e.dist is not None and e.dist.name == "sicp-cam"}
    assert ours == ENTRY_POINTS[group]
