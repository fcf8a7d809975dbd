import re
import sys
from pathlib import Path

import numpy as np
import pytest

from sicp_cam import plugins
from sicp_cam.errors import InputError, JobError
from sicp_cam.job.layers import settings
from sicp_cam.limits import Limits
from sicp_cam.model import Scan
from sicp_cam.plugins import registry as plugin_registry

READER = """
import numpy as np
from sicp_cam.model import Scan

def read_scan(path, *, units=None, limits, scale: float = 1.0, names: tuple[str, ...] = (), skip: bool = False):
    read_scan.told = (path, units, limits, scale, names, skip)
    return Scan(np.full((3, 3), scale))

def read_nonsense(path, *, units=None, limits):
    return "no scan"

def read_free(path, *, units=None, limits, **options):
    read_free.told = options
    return Scan(np.zeros((3, 3)))

class Post:
    def __init__(self, options=None):
        self.options = options
"""


@pytest.fixture
def distribution(tmp_path, monkeypatch):
    """Install a distribution with one module and some entry points, for this test only."""
    installed = []

    def install(name, entry_points, source=READER):
        folder = tmp_path / name
        info = folder / f"{name}-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
        lines = [f"[{group}]\n{entry} = {name}:{attribute}\n" for group, entry, attribute in entry_points]
        (info / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")
        (folder / f"{name}.py").write_text(source, encoding="utf-8")
        monkeypatch.syspath_prepend(str(folder))
        installed.append(name)

    yield install
    for name in installed:
        sys.modules.pop(name, None)


FORMATS, POSTS = plugin_registry.FORMATS, plugin_registry.POSTPROCESSORS


OUR_POSTS = {"apt", "csv", "dxf", "gcode", "krl", "ls", "rapid", "robodk", "same", "ur", "val3"}


def test_our_own_readers_and_posts_are_listed_with_their_owner():
    found, findings = plugin_registry.listing()
    ours = {(p.group, p.name): p for p in found if p.owner.startswith("sicp-cam ")}
    assert ours[FORMATS, "scan.ply"].value == "sicp_formats.ply:read_scan"
    assert {name for group, name in ours if group == POSTS} == OUR_POSTS
    assert not [finding for finding in findings if finding.level != "info"]


def test_a_foreign_reader_gets_the_file_and_its_options_in_their_types(distribution, tmp_path):
    distribution("alpha", [(FORMATS, "scan.alpha", "read_scan")])
    limits = Limits(points=5)
    options = {
        key.removeprefix("options.scan."): value
        for key, value in settings({}, ["scan.scale=2.5", "scan.names=a,b", "scan.skip=yes"]).values.items()
    }
    scan = plugins.read_scan(tmp_path / "part.ALPHA", units="inch", limits=limits, options=options)
    assert scan.points_mm[0, 0] == 2.5
    assert sys.modules["alpha"].read_scan.told == (tmp_path / "part.ALPHA", "inch", limits, 2.5, ("a", "b"), True)


def test_wrong_options_are_refused_together_with_what_the_reader_takes(distribution):
    distribution("alpha", [(FORMATS, "scan.alpha", "read_scan")])
    with pytest.raises(JobError) as caught:
        plugins.read_scan(Path("part.alpha"), options={"scal": 1.0, "scale": "1.5", "units": "mm", "path": "x"})
    assert caught.value.problems == (
        "scan.scal: unknown option; did you mean scale?",
        "scan.scale: must be a number, not the text '1.5'",
        "scan.units: unknown option; known: format, names, scale, skip",
        "scan.path: unknown option; known: format, names, scale, skip",
    )


def test_a_reader_with_free_options_gets_them_as_stated(distribution):
    distribution("alpha", [(FORMATS, "scan.alpha", "read_free")])
    plugins.read_scan(Path("part.alpha"), options={"anything": [1, 2]})
    assert sys.modules["alpha"].read_free.told == {"anything": [1, 2]}


def test_an_unknown_suffix_is_answered_with_the_known_ones():
    with pytest.raises(InputError) as caught:
        plugins.read_part(Path("folder/part.dwg"))
    message = str(caught.value)
    assert message.startswith(
        "folder/part.dwg: no reader for a part with the suffix '.dwg'; readable: brep, brp, iges, igs, obj"
    )
    assert "--set part.format=" in message


def test_a_file_can_be_treated_as_if_it_had_another_suffix(distribution):
    distribution("alpha", [(FORMATS, "scan.alpha", "read_scan")])
    for suffix in ("alpha", ".alpha", "ALPHA"):
        assert isinstance(plugins.read_scan(Path("part.dat"), options={"format": suffix}), Scan)
    with pytest.raises(JobError, match=r"^scan.format: no reader for 'beta' as a scan; readable: alpha, asc"):
        plugins.read_scan(Path("part.alpha"), options={"format": "beta"})
    with pytest.raises(JobError, match=r"^scan.format: must be a suffix such as 'csv', not 3"):
        plugins.read_scan(Path("part.alpha"), options={"format": 3})


def test_reader_and_options_can_be_checked_without_a_file(distribution):
    distribution("alpha", [(FORMATS, "scan.alpha", "read_scan")])
    nowhere = Path("nowhere")
    plugins.check_reader("scan", nowhere / "part.alpha", {"scale": 2.0})
    plugins.check_reader("scan", nowhere / "part.dat", {"format": "alpha", "skip": True})
    assert not hasattr(sys.modules["alpha"].read_scan, "told")
    with pytest.raises(InputError, match=r"part\.dwg: no reader for a scan with the suffix '\.dwg'"):
        plugins.check_reader("scan", nowhere / "part.dwg")
    with pytest.raises(JobError, match=r"^scan\.scal: unknown option; did you mean scale\?"):
        plugins.check_reader("scan", nowhere / "part.alpha", {"scal": 2.0})


def test_the_roles_of_a_file_are_those_that_can_read_it():
    assert plugins.roles(Path("a.stl")) == ("scan", "part")
    assert plugins.roles(Path("a.APT")) == ("path",)
    assert plugins.roles(Path("a")) == ()


def test_a_reader_that_answers_with_something_else_is_named(distribution):
    distribution("alpha", [(FORMATS, "scan.alpha", "read_nonsense")])
    with pytest.raises(JobError, match="alpha:read_nonsense answered with a str instead of a Scan"):
        plugins.read_scan(Path("part.alpha"))


def test_two_owners_of_a_name_are_both_named_when_it_is_needed_and_when_it_is_listed(distribution):
    distribution("alpha", [(FORMATS, "scan.ply", "read_scan")])
    with pytest.raises(JobError, match=r"^scan\.ply: claimed by ") as caught:
        plugins.read_scan(Path("part.ply"))
    assert "alpha 1.0 (alpha:read_scan)" in str(caught.value)
    assert "sicp-cam " in str(caught.value)
    found, findings = plugin_registry.listing()
    assert [finding.message for finding in findings if finding.code == 801] == [str(caught.value)]
    assert len([plugin for plugin in found if (plugin.group, plugin.name) == (FORMATS, "scan.ply")]) == 2
    assert "alpha" not in sys.modules


def test_a_name_is_taken_over_through_the_override_group(distribution):
    distribution("alpha", [(f"{FORMATS}.override", "scan.ply", "read_scan")])
    assert plugins.read_scan(Path("part.ply"), options={"scale": 7.0}).points_mm[0, 0] == 7.0
    _, findings = plugin_registry.listing()
    assert [finding.code for finding in findings] == [803]
    assert re.match(r"scan\.ply: alpha 1\.0 takes it over from sicp-cam ", findings[0].message)


def test_two_overrides_of_a_name_are_refused(distribution):
    distribution("alpha", [(f"{FORMATS}.override", "scan.ply", "read_scan")])
    distribution("beta", [(f"{FORMATS}.override", "scan.ply", "read_scan")])
    with pytest.raises(JobError, match=r"alpha 1\.0.*beta 1\.0|beta 1\.0.*alpha 1\.0"):
        plugins.reader("scan", Path("part.ply"))


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("raise RuntimeError('no licence\\x1b[2J')", r"RuntimeError: no licence\x1b[2J"),
        ("import there_is_no_such_module", "ModuleNotFoundError: No module named 'there_is_no_such_module'"),
        ("", "AttributeError: module 'alpha' has no attribute 'read_scan'"),
    ],
)
def test_a_plug_in_that_cannot_be_imported_is_named_and_only_where_it_is_needed(distribution, source, reason):
    distribution("alpha", [(FORMATS, "scan.alpha", "read_scan")], source)
    with pytest.raises(JobError) as caught:
        plugins.read_scan(Path("part.alpha"))
    assert str(caught.value).startswith("plug-in scan.alpha (alpha:read_scan, from alpha 1.0) cannot be loaded")
    assert reason in str(caught.value)
    found, findings = plugin_registry.listing()
    assert not findings
    alone = tuple(plugin for plugin in found if plugin.name == "scan.alpha")
    assert [(finding.code, finding.message) for finding in plugin_registry.broken(alone)] == [(802, str(caught.value))]
    assert plugins.reader("scan", Path("part.ply"))


def test_an_entry_point_without_role_is_listed_as_never_used(distribution):
    distribution("alpha", [(FORMATS, "ply", "read_scan"), (FORMATS, "mesh.ply", "read_scan")])
    _, findings = plugin_registry.listing()
    assert [(finding.code, finding.where) for finding in findings] == [(804, "mesh.ply"), (804, "ply")]


def test_a_post_gets_its_options(distribution):
    distribution("alpha", [(POSTS, "alpha", "Post")])
    assert plugins.postprocessor("alpha", {"spin_deg": 90.0}).options == {"spin_deg": 90.0}


def test_an_unknown_post_is_answered_with_the_nearest():
    with pytest.raises(JobError, match=r"no postprocessor 'val'; did you mean val3\?"):
        plugins.postprocessor("val")
    with pytest.raises(JobError, match=r"no postprocessor 'VAL3'; did you mean val3\?"):
        plugins.postprocessor("VAL3")
    with pytest.raises(JobError, match="no postprocessor 'XYZ'; known: " + ", ".join(sorted(OUR_POSTS))):
        plugins.postprocessor("XYZ")


# CONTRIBUTING.md shows whole plug-ins; what it shows must work.


def example(number):
    text = (Path(__file__).resolve().parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[number]


def test_the_format_of_the_contributing_guide_reads_a_file_it_describes(distribution, tmp_path):
    distribution("raw_points", [(FORMATS, "scan.f32", "read_scan")], example(0))
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1.5, 0]], "<f4")
    (tmp_path / "part.f32").write_bytes(points.tobytes())
    scan = plugins.read_scan(tmp_path / "part.f32", units="m", options={"columns": 3})
    np.testing.assert_allclose(scan.points_mm, points * 1000.0)
    assert (scan.source.format, scan.source.unit, scan.source.unit_stated) == ("f32", "m", True)
    (tmp_path / "short.f32").write_bytes(points.tobytes()[:-1])
    with pytest.raises(InputError, match=r"short\.f32, byte 24: "):
        plugins.read_scan(tmp_path / "short.f32")


def test_the_post_of_the_contributing_guide_writes_a_program(distribution):
    from sicp_cam.model import Program, Status, ToolPath

    distribution("linear_post", [(POSTS, "linear", "Linear")], example(1))
    axes = [[0, 0, 1], [0, 0, 1]]
    path = ToolPath([[0, 0, 50], [0, 0, 5]], axes, [0, 600], [True, False], [1, 2])
    program = Program("edge", path, (Status.APPROACH, Status.COVERED))
    files = plugins.postprocessor("linear", {"decimals": "1"}).write(program)
    assert files == {
        "edge.lin": b"PROGRAM edge\n; edge\n; not a safety function: verify at reduced speed\n"
        b"FAST 0.0 0.0 50.0 0.0 0.0 1.0\nLIN 0.0 0.0 5.0 0.0 0.0 1.0 600.0\nEND\n"
    }
