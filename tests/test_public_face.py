"""The public names: one list, one table of homes, one block of imports, and they agree."""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import sicp_cam

SOURCE = ast.parse(Path(sicp_cam.__file__).read_text(encoding="utf-8"))


def type_checking_imports():
    (block,) = [node for node in SOURCE.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    return {
        (statement.module, name.name)
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for name in statement.names
        if name.asname is None
    }


def lazy_table():
    (value,) = [
        node.value for node in SOURCE.body if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_HOMES"
    ]
    return {(f"sicp_cam.{home}", name) for home, names in ast.literal_eval(value).items() for name in names.split()}


def test_what_a_type_checker_sees_is_what_is_loaded():
    assert type_checking_imports() == lazy_table()
    assert len({name for _, name in lazy_table()}) == len(lazy_table()), "a name has two homes"


def test_all_is_the_table_sorted_and_without_repetition():
    assert sicp_cam.__all__ == sorted(name for _, name in lazy_table())


@pytest.mark.parametrize(("home", "name"), sorted(lazy_table()))
def test_every_public_name_is_the_one_of_its_home(home, name):
    value = getattr(sicp_cam, name)
    assert value is getattr(import_module(home), name)
    assert name in import_module(home).__all__
    assert value.__doc__


def test_the_list_of_names_is_that_of_all():
    assert dir(sicp_cam) == sorted(sicp_cam.__all__)


@pytest.mark.parametrize("name", ["registre", "_HOME", "numpy", "__wrapped__"])
def test_an_unknown_name_is_an_attribute_error(name):
    with pytest.raises(AttributeError, match=f"module 'sicp_cam' has no attribute '{name}'"):
        getattr(sicp_cam, name)
    with pytest.raises(ImportError):
        exec(f"from sicp_cam import {name}", {})


def test_a_star_import_brings_exactly_the_public_names():
    space = {}
    exec("from sicp_cam import *", space)
    assert {name for name in space if not name.startswith("__")} == set(sicp_cam.__all__)


def test_names_cost_only_what_they_need():
    """The errors and the readers' face come without scipy, so that a command line starts at once."""
    code = (
        "import sys, sicp_cam\n"
        "assert not {'numpy', 'scipy'} & set(sys.modules), 'at import'\n"
        "sicp_cam.FormatError, sicp_cam.correct, sicp_cam.Finding\n"
        "assert not {'scipy', 'trimesh', 'OCP', 'pyvista', 'matplotlib'} & set(sys.modules), 'at first use'\n"
    )
    run = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")


def test_a_name_once_loaded_stays():
    assert sicp_cam.JobError is sicp_cam.JobError
    assert "JobError" in vars(sicp_cam)


def test_the_errors_form_one_tree():
    errors = [getattr(sicp_cam, name) for name in sicp_cam.__all__ if name.endswith("Error")]
    assert sicp_cam.SicpError in errors
    assert all(issubclass(error, sicp_cam.SicpError) for error in errors)


def test_every_module_of_the_package_says_what_is_public():
    rooms = Path(sicp_cam.__file__).parent
    silent = []
    for file in sorted(rooms.rglob("*.py")):
        names = {
            ast.unparse(target)
            for node in ast.parse(file.read_text(encoding="utf-8")).body
            if isinstance(node, ast.Assign | ast.AnnAssign)
            for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        }
        body = [node for node in ast.parse(file.read_text(encoding="utf-8")).body if not isinstance(node, ast.Expr)]
        if body and "__all__" not in names and file.name != "__main__.py":
            silent.append(str(file.relative_to(rooms)))
    assert silent == []
