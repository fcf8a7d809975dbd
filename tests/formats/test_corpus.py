"""One small file per variant of each format, through the same door as every user's file."""

import functools
import gzip
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from sicp_cam import plugins
from sicp_cam.errors import InputError, SicpError, UnitError
from sicp_cam.findings import Level
from sicp_cam.model import Part, Scan

CORPUS = Path(__file__).parent.parent / "corpus"
PARTS_OF_A_PROGRAM = {".dtx", ".pgx", ".dat"}
IN_A_CHILD = {"step", "brep", "iges"}
TOLD = {
    "apt/camworks.clt": {"cutcom": "ignore", "cycles": "points"},
    "apt/creo.ncl": {"arc_points": "arc"},
    "ascii/thousands.txt": {"decimal": ","},
    "csv/robodk_xyzwpr.csv": {"columns": "x,y,z,w,p,r,-", "euler": "zyx"},
    "gcode/fanuc_g43_4.nc": {"rotary": "AC"},
    "gcode/haas_g234.nc": {"rotary": "BC"},
    "gcode/heidenhain.iso": {"rotary": "AC"},
    "gcode/linuxcnc_g93.ngc": {"rotary": "BC"},
    "gcode/siemens_rotary.mpf": {"rotary": "BC"},
}
"""What the user must say of a seed, because its words leave it open."""
REFUSED = {"step/external_parts.step": "is an assembly whose parts are in other files (bolt.stp, nut.stp)"}


def named(file):
    return file.relative_to(CORPUS).as_posix()


def kind(file):
    return file.relative_to(CORPUS).parts[0]


SEEDS = [
    file
    for file in sorted(CORPUS.rglob("*.*"))
    if file.is_file()
    and named(file) not in REFUSED
    and (file.suffix not in PARTS_OF_A_PROGRAM or kind(file) == "ascii")
]
QUICK = [seed for seed in SEEDS if kind(seed) not in IN_A_CHILD]
ALONE = [seed for seed in QUICK if kind(seed) not in ("val3", "krl", "fanuc_ls") and seed.suffix != ".gz"]


def role(seed):
    return "path" if kind(seed) == "csv" else plugins.roles(seed)[0]


@functools.cache
def reader(seed):
    """Look a reader up once: finding plug-ins anew for each damaged file would take longer than reading it."""
    return plugins.reader(role(seed), seed)


def read(file, seed, **more):
    told = {**TOLD.get(named(seed), {}), **more}
    try:
        return reader(seed)(file, **told)
    except UnitError as error:
        if "no unit" not in str(error):
            raise
        return reader(seed)(file, units="mm", **told)


def points(thing):
    if isinstance(thing, Scan):
        return thing.points_mm
    return thing.mesh.vertices_mm if isinstance(thing, Part) else thing.tips_mm


@pytest.mark.parametrize("seed", SEEDS, ids=named)
def test_every_seed_is_read(seed):
    found = read(seed, seed)
    assert len(points(found)) > 1
    assert np.isfinite(points(found)).all()
    assert not [finding for finding in found.findings if finding.level is Level.FAIL]


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_says_why(name):
    with pytest.raises(InputError, match=re.escape(REFUSED[name])):
        read(CORPUS / name, CORPUS / name)


@pytest.mark.parametrize("seed", ALONE, ids=named)
def test_a_packed_seed_is_the_same(seed, tmp_path):
    packed = tmp_path / f"{seed.name}.gz"
    packed.write_bytes(gzip.compress(seed.read_bytes()))
    assert np.array_equal(points(read(packed, seed)), points(read(seed, seed)))


@pytest.mark.parametrize("recover", [False, True], ids=["strict", "recover"])
@pytest.mark.parametrize("seed", QUICK, ids=named)
def test_a_damaged_seed_gives_data_or_an_error_that_names_the_file(seed, tmp_path, recover):
    content = seed.read_bytes()
    noise = np.random.default_rng(len(content))
    shutil.copytree(seed.parent, tmp_path / "seed")
    file = tmp_path / "seed" / seed.name
    for _ in range(4):
        damaged = bytearray(content[: int(noise.integers(1, len(content) + 1))])
        for place in noise.integers(0, len(damaged), 2):
            damaged[place] = int(noise.integers(0, 256))
        file.write_bytes(damaged)
        try:
            assert len(points(read(file, seed, recover=recover)))
        except SicpError as error:
            assert seed.stem in str(error)
            assert str(error).isprintable()


@pytest.mark.parametrize("seed", [seed for seed in QUICK if role(seed) == "path"], ids=named)
def test_a_program_that_can_be_written_again_is_the_same_byte_for_byte(seed):
    path = read(seed, seed)
    if path.original is None:
        assert kind(seed) in ("dxf", "fanuc_ls", "krl", "nci", "rapid", "urscript", "val3")
        return
    written = path.original.rewritten(path, np.arange(len(path)))
    assert written.content == seed.read_bytes()
    assert path.original.suffix == seed.suffix
