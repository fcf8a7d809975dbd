"""`sicp-cam doctor`: what this machine has, and what it lacks."""

from __future__ import annotations

import platform
import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from typing import Annotated

from cyclopts import Parameter

from sicp_cam.cli.session import Talk, logging_to, reported, say, say_json
from sicp_cam.errors import JobError, printable

__all__ = ["doctor"]

# Native code may hang or crash where a driver is missing, so each trial runs in a process of its own.
_TRIALS = {
    "CAD kernel": "import OCP.STEPControl",
    "pictures": (
        "import pyvista\n"
        "plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))\n"
        "plotter.add_mesh(pyvista.Sphere())\n"
        "if plotter.screenshot(return_img=True).std() == 0: raise RuntimeError('the picture is blank')"
    ),
}
_SECONDS = 120
_PACKAGES = ("numpy", "scipy", "trimesh", "cadquery", "cadquery-ocp", "vtk", "pyvista", "matplotlib", "reportlab")
_MISSING_LIBRARY = re.compile(r"(lib[\w.+-]+\.so[.\d]*): cannot open shared object file")
_DEBIAN = {
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libX11.so.6": "libx11-6",
    "libXrender.so.1": "libxrender1",
    "libXext.so.6": "libxext6",
    "libgomp.so.1": "libgomp1",
    "libexpat.so.1": "libexpat1",
}


def doctor(
    *,
    as_json: Annotated[bool, Parameter(name="--json", negative="", show_default=False)] = False,
    talk: Talk = Talk(),  # noqa: B008  # frozen
) -> int:
    """Try the parts that need system libraries - the CAD kernel and off-screen pictures - and list versions.

    Parameters
    ----------
    as_json
        Print one JSON document.
    talk
        How much is said.
    """
    with logging_to(talk):
        return reported(lambda: _run(as_json, talk.quiet), as_json=as_json)


def _run(as_json: bool, quiet: bool) -> int:
    trials = {name: _tried(code) for name, code in _TRIALS.items()}
    lacking = tuple(f"{name}: {_advice(problem)}" for name, problem in trials.items() if problem)
    if lacking:
        raise JobError(*lacking)
    versions = {"python": platform.python_version(), **{name: _version(name) for name in ("sicp-cam", *_PACKAGES)}}
    if as_json:
        say_json({"schema": "sicp-cam/1", "trials": dict.fromkeys(trials, "ok"), "versions": versions})
    elif not quiet:
        for name in trials:
            say(f"{name}: ok")
        for name, number in versions.items():
            say(f"{name} {number}")
    return 0


def _tried(code: str) -> str:
    """Run a line of Python in a process of its own and return what went wrong; empty if nothing did."""
    try:
        trial = subprocess.run(
            [sys.executable, "-c", code],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {_SECONDS} s"
    if trial.returncode == 0:
        return ""
    words = [line for line in (trial.stderr + trial.stdout).splitlines() if line.strip()]
    return words[-1] if words else f"ended with exit code {trial.returncode}"


def _advice(problem: str) -> str:
    missing = _MISSING_LIBRARY.search(problem)
    if missing is None:
        return f"{printable(problem)}; on Debian or Ubuntu try: apt-get install libgl1 libegl1 libx11-6 libxrender1"
    library = missing[1]
    if library in _DEBIAN:
        return f"the system library {library} is missing; on Debian or Ubuntu: apt-get install {_DEBIAN[library]}"
    return f"the system library {library} is missing; install the package that holds it"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
