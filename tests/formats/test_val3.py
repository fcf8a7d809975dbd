"""The VAL3 reader against applications whose truth is known, and against what our own post writes."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.errors import FormatError, JobError, SicpError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import Event, EventKind, Program, Status, ToolPath
from sicp_formats.val3 import read_path
from sicp_formats.val3.check import check
from sicp_postprocessors.val3 import Val3

CORPUS = Path(__file__).parents[1] / "corpus" / "val3"
PJX = (
    '<Project xmlns="http://www.staubli.com/robotics/VAL3/Project/3"><Parameters millimeterUnit="true" />'
    '<Programs><Program file="start.pgx" /></Programs><Database><Data file="a.dtx" /></Database></Project>'
)
POINTS = """<Datas>
<Data name="p" type="pointRx" size="4"><Value key="0" rx="180"/><Value key="1" x="1" rx="180"/></Data>
<Data name="j" type="jointRx" size="1" />
<Data name="m" type="mdesc"><Value key="0" tmax="10"/></Data>
<Data name="f" type="frame"><Value key="0" fatherId="f[0]"/></Data>
<Data name="q" type="pointRx"><Value key="0" fatherId="f[0]"/></Data>
<Data name="n" type="num"><Value key="0" value="0.5"/></Data>
<Data name="bad" type="pointRx"><Value key="0" x="1,5"/></Data>
</Datas>"""


def application(folder: Path, code: str, *, data: str = POINTS, project: str = PJX) -> Path:
    (folder / "a.pjx").write_text(project)
    (folder / "a.dtx").write_text(f"<Database>\n{data}\n</Database>")
    (folder / "start.pgx").write_text(
        f'<Programs><Program name="start"><Code><![CDATA[begin\n{code}\nend]]></Code></Program></Programs>'
    )
    return folder / "a.pjx"


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


@pytest.mark.parametrize("name", ["trims7.pjx", "trims7.dtx", "start.pgx", "."])
def test_reads_an_application_from_any_of_its_files(name: str) -> None:
    path = read_path(CORPUS / "trims7" / name)
    # fPart is 1000 mm along x and 100 mm down, turned by 90 degrees: its x is the world's y.
    assert np.allclose(
        path.tips_mm,
        [[1000, 10, -50], [1000, 10, -100], [1000, 20, -100], [994.5, 30, -100], [994.5, 30, -50]],
        atol=1e-9,
    )
    # Tool Z is down, along x of fPart (the world's y), down; the axis points the other way.
    assert np.allclose(path.axes, [[0, 0, 1], [0, 0, 1], [0, -1, 0], [0, 0, 1], [0, 0, 1]], atol=1e-12)
    assert path.feeds_mm_min.tolist() == [0, 1500, 3000, 1500, 0]
    assert path.rapid.tolist() == [True, False, False, False, True]
    assert path.source is not None and (path.source.unit, path.source.unit_stated) == ("mm", True)
    assert path.source.path.endswith(".pjx")
    assert path.lines.tolist() == [0] * 5  # two files: a line alone would mislead
    assert codes(path) == {317, 335}
    told = [(e.kind, e.value, e.text, e.before_move) for e in path.events]
    assert (EventKind.COMMENT, 0.0, 'trim "the // rim"', 0) in told
    assert (EventKind.COMMENT, 0.0, "above", 0) in told
    assert (EventKind.OTHER, 0.0, "doSpindle=true", 1) in told
    assert (EventKind.DWELL, 1.5, "delay(1.5)", 1) in told


def test_a_program_can_be_chosen_and_frames_kept() -> None:
    path = read_path(CORPUS / "trims7" / "trims7.pjx", program="cut", frame="keep", tool_axis="z")
    assert path.tips_mm.tolist() == [[10, 0, 0], [20, 0, 0], [30, 5.5, 0]]
    assert np.allclose(path.axes, [[0, 0, -1], [1, 0, 0], [0, 0, -1]], atol=1e-12)
    assert path.lines.tolist() == [9, 9, 9]
    assert "kept as they stand in fPart[0]" in path.findings[0].message


def test_reads_the_dialect_of_s6_in_inches() -> None:
    path = read_path(CORPUS / "trims6" / "trims6.pjx")
    assert np.allclose(path.tips_mm, 25.4 * np.array([[1, 2, 3], [2, 2, 3], [1, 2, 3]]))
    assert path.axes.tolist() == [[0, 0, 1]] * 3
    assert np.allclose(path.feeds_mm_min, [0, 25.4 * 60, 25.4 * 120])
    assert path.lines.tolist() == [7, 8, 10]
    assert path.events[0].text == "für den Rand"
    with pytest.raises(UnitError, match="states inch"):
        read_path(CORPUS / "trims6" / "trims6.pjx", units="mm")


@pytest.mark.parametrize(
    ("code", "line", "words"),
    [
        ("movel(p[0],t,m)\nmovel(p[9],t,m)", 3, "beyond the 4 elements"),
        ("movel(x,t,m)", 2, "in no .dtx file"),
        ("movel(p[0],t,mFast)", 2, "no declared mdesc"),
        ("movel(p[i],t,m)", 2, "'i' is in no .dtx file"),
        ("movel(p[n],t,m)", 2, "no whole number"),
        ("movel(lib:p,t,m)", 2, "from a library"),
        ("movel(here(t,world),t,m)", 2, "is computed"),
        ("movel(appro(p[0],{0,0,n,0,0,0}),t,m)", 2, "not six numbers"),
        ("movel(p[0],t)", 2, "3 arguments"),
        ("movel(j,t,m)", 2, "only movej takes them"),
        ("movel(p[0],t,m)\nmovej(j,t,m)\nmovel(p[1],t,m)", 4, "line 3 stands between two points"),
        ("p[1]=p[0]\nmovel(p[1],t,m)", 3, "changed by the program"),
        ("setFrame(p[0],p[1],p[2],f)\nmovel(q,t,m)", 3, "changed by the program"),
        ("m.tvel=n*2", 2, "m.tvel is computed"),
        ("if bFast\nmovel(p[0],t,m)\nendIf", 2, "decides about motion"),
        ("while true\ncall go()\nendWhile", 2, "decides about motion"),
        ("for i=0 to 3 step 0\nmovel(p[i],t,m)\nendFor", 2, "step of 0"),
        ("for i=0 to n2\nmovel(p[i],t,m)\nendFor", 2, "in no .dtx file"),
        ("for i=0 to 3\nmovel(p[i],t,m)", 2, "is not closed"),
        ("endIf", 2, "closes nothing"),
        ("call cut()", 2, "path.calls=cut"),
        ("call start()", 2, "within itself"),
        ("call start(1)", 2, "has arguments"),
        ('taskCreate "x",10,go()', 2, "may move the robot"),
        ("$Xmovel(p[0],t,m)", 2, "may move the robot"),
        ("return", 2, "leave the program"),
        ("movel(q,t,m)", 2, "its own father"),
        ("movec(p[0],p[1],t,m)", 2, "before the first known point"),
        ("movel(p[0],t,m)\nmovec(p[1],p[0],t,m)", 3, "on a line"),
    ],
)
def test_what_would_be_a_guess_is_refused_with_file_and_line(tmp_path: Path, code: str, line: int, words: str) -> None:
    with pytest.raises(FormatError) as caught:
        read_path(application(tmp_path, code))
    assert words in str(caught.value)
    assert (Path(caught.value.path).name, caught.value.line) == ("start.pgx", line)
    assert str(caught.value).isprintable()


def test_numbers_of_the_data_file_are_named_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"a\.dtx, line 9: bad\[0\]: x = '1,5' is no number"):
        read_path(application(tmp_path, "movel(bad,t,m)"))


@pytest.mark.parametrize(
    ("project", "words"),
    [
        (PJX.replace("start.pgx", "../start.pgx"), "outside of the folder"),
        (PJX.replace("start.pgx", "/etc/passwd"), "outside of the folder"),
        (PJX.replace("start.pgx", "C\\\\..\\..\\x.pgx"), "outside of the folder"),
        (PJX.replace("a.dtx", "b.dtx"), "no such file"),
        (PJX.replace('"true"', '"maybe"'), "neither true nor false"),
        (PJX.replace("start.pgx", "other.pgx"), "lists no program 'start'"),
        ("<!DOCTYPE a [<!ENTITY x 'y'>]>" + PJX, "DOCTYPE"),
        (PJX[:-5], "no well-formed XML"),
        ("<html2></html2>", "not the root of a .pjx"),
        ("hello", "no well-formed XML"),
        ("<a>" * 100, "nested too deep"),
    ],
)
def test_bad_projects_are_refused(tmp_path: Path, project: str, words: str) -> None:
    with pytest.raises(FormatError) as caught:
        read_path(application(tmp_path, "movel(p[0],t,m)", project=project))
    assert words in str(caught.value)


def test_entities_do_not_expand(tmp_path: Path) -> None:
    bomb = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 12))
    project = f'<?xml version="1.0"?>\n<!DOCTYPE x [<!ENTITY l0 "ha">{bomb}]>\n<Project>&l11;</Project>'
    with pytest.raises(FormatError, match=r"a\.pjx, line 2: has a DOCTYPE"):
        read_path(application(tmp_path, "", project=project))


def test_which_application_is_meant_must_be_clear(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"one \.pjx file, here there is: none"):
        read_path(tmp_path)
    application(tmp_path, "movel(p[0],t,m)\nmovel(p[1],t,m)")
    (tmp_path / "b.pjx").write_text(PJX)
    with pytest.raises(FormatError, match=r"here there is: a\.pjx, b\.pjx"):
        read_path(tmp_path / "start.pgx")
    with pytest.raises(FormatError, match="no such file"):
        read_path(tmp_path / "gone.pgx")
    for wrong in ({"frame": "world"}, {"tool_axis": "w"}, {"feed_mm_min": -1.0}):
        with pytest.raises(JobError):
            read_path(tmp_path / "a.pjx", **wrong)  # type: ignore[arg-type]


def test_speeds_that_do_not_limit_the_tip_are_no_feed(tmp_path: Path) -> None:
    data = POINTS.replace('<Value key="0" tmax="10"/>', "")
    path = read_path(application(tmp_path, "movel(p[0],t,m)\nmovel(p[1],t,m)", data=data))
    assert path.feeds_mm_min.tolist() == [0, 0]
    assert codes(path) == {302}
    file = application(tmp_path, "movel(p[0],t,m)\nm.tvel=5\nmovel(p[1],t,m)", data=data)
    assert read_path(file, feed_mm_min=7.0).feeds_mm_min.tolist() == [7, 300]


def test_conditions_without_motion_are_kept_as_text(tmp_path: Path) -> None:
    code = (
        "movej(j,t,m)\nwhile !isPowered()\ndelay(1)\nendWhile\nfoo(1)\nmovel(p[0],t,m)\nmovel(p[1],t,m)\nmovej(j,t,m)"
    )
    path = read_path(application(tmp_path, code))
    assert [f.message for f in path.findings if f.code == 337] == [
        "1 conditions and loops without motion in them were not executed: while !isPowered()"
    ]
    assert codes(path) == {308, 335, 337}
    assert path.lines.tolist() == [7, 8]
    kept = [e.text for e in path.events if e.kind is EventKind.OTHER]
    assert kept == ["tool t", "while !isPowered()", "delay(1)", "endWhile", "foo(1)"]


def test_calls_that_move_nothing_can_be_named(tmp_path: Path) -> None:
    file = application(tmp_path, "call io:suck()\nmovel(p[0],t,m)\nmovel(p[1],t,m)")
    assert codes(read_path(file, calls="blow, IO:suck")) == {338}


def test_loops_come_to_an_end(tmp_path: Path) -> None:
    file = application(tmp_path, "for i=0 to 999999999\nmovel(p[0],t,m)\nendFor")
    with pytest.raises(FormatError, match="path_points = 50"):
        read_path(file, limits=Limits(path_points=50))
    idle = application(tmp_path, "for i=0 to 999999999\nfor k=1 to 0\nmovel(p[0],t,m)\nendFor\nendFor")
    with pytest.raises(FormatError, match="do not come to an end"):
        read_path(idle, limits=Limits(path_points=50))


def test_an_arc_runs_through_its_point(tmp_path: Path) -> None:
    data = POINTS.replace(
        '<Value key="0" rx="180"/>',
        '<Value key="0" x="10" rx="180"/><Value key="2" y="10" rx="180"/><Value key="3" x="-10" rx="180"/>',
    )
    path = read_path(application(tmp_path, "movej(p[0],t,m)\nmovec(p[2],p[3],t,m)", data=data))
    assert np.abs(np.linalg.norm(path.tips_mm, axis=1) - 10).max() < 1e-9
    assert path.tips_mm[:, 1].min() >= -1e-9
    assert path.tips_mm[-1].tolist() == [-10, 0, 0]


def programs() -> st.SearchStrategy[Program]:
    turns = st.tuples(*[st.one_of(st.floats(-180, 180), st.sampled_from([-180.0, -90.0, 0.0, 90.0, 180.0]))] * 2)
    row = st.tuples(st.tuples(*[st.floats(-3000, 3000)] * 3), turns, st.integers(1, 20_000), st.booleans())
    return st.lists(row, min_size=2, max_size=8, unique_by=lambda found: found[0]).map(program)


def program(rows: list[tuple[tuple[float, ...], tuple[float, ...], int, bool]]) -> Program:
    axes = -Rotation.from_euler("XY", [turn for _, turn, *_ in rows], degrees=True).as_matrix()[:, :, 2]
    rapid = np.array([index == 0 or fast for index, (*_, fast) in enumerate(rows)])
    feeds = np.where(rapid, 0.0, [feed for *_, feed, _ in rows])
    path = ToolPath(
        np.array([tip for tip, *_ in rows]), axes, feeds, rapid, np.arange(len(rows)), (Event(1, EventKind.DWELL, 0.5),)
    )
    return Program("round", path, (Status.COVERED,) * len(rows))


@settings(deadline=None, max_examples=40)
@given(
    program=programs(),
    cell=st.booleans(),
    split=st.booleans(),
    transport=st.booleans(),
    style=st.sampled_from(["split", "per-move", "loop"]),
    dialect=st.sampled_from(["s7", "s6"]),
)
def test_what_our_post_writes_is_read_back(
    program: Program, cell: bool, split: bool, transport: bool, style: str, dialect: str
) -> None:
    options: dict[str, object] = {"spin": "transport" if transport else "fixed", "style": style, "dialect": dialect}
    if cell:
        options["cell"] = (100.0, -20.0, 5.0, 10.0, 20.0, 30.0)
    if split:
        options |= {"max_moves_per_program": 2, "max_points_per_array": 3}
    with TemporaryDirectory() as folder:
        for name, content in Val3(options).files(program).items():
            file = Path(folder, name)
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(content)
        found = read_path(Path(folder, "round", "round.pjx"), frame="keep")
        in_world = read_path(Path(folder, "round", "round.pjx"))
        assert [f for f in check(Path(folder, "round")) if f.level is Level.FAIL] == []
    path = program.path
    assert np.abs(found.tips_mm - path.tips_mm).max() <= 1e-3
    sines = np.linalg.norm(np.cross(found.axes, path.axes), axis=1)
    assert np.degrees(sines.max()) <= 1e-3 and (np.sum(found.axes * path.axes, axis=1) > 0).all()
    assert np.abs(found.feeds_mm_min - path.feeds_mm_min).max() <= 1e-3
    assert found.rapid.tolist() == path.rapid.tolist()
    assert (EventKind.DWELL, 0.5, 1) in [(e.kind, e.value, e.before_move) for e in found.events]
    if cell:
        R = Rotation.from_euler("XYZ", [10, 20, 30], degrees=True).as_matrix()
        assert np.abs(in_world.tips_mm - (path.tips_mm @ R.T + [100, -20, 5])).max() <= 1e-3


@settings(deadline=None, max_examples=50)
@given(data=st.data())
def test_damaged_applications_give_a_path_or_a_typed_error(data: st.DataObject) -> None:
    with TemporaryDirectory() as folder:
        for file in (CORPUS / "trims7").rglob("*.*"):
            copy = Path(folder) / file.relative_to(CORPUS / "trims7")
            copy.parent.mkdir(exist_ok=True)
            content = bytearray(file.read_bytes())
            for _ in range(data.draw(st.integers(0, 2))):
                content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
            copy.write_bytes(bytes(content[: data.draw(st.sampled_from([len(content), len(content) // 2, 99999]))]))
        try:
            path = read_path(Path(folder, "trims7.pjx"))
        except SicpError as error:
            assert str(error).isprintable()
        else:
            assert np.isfinite(path.tips_mm).all()


def test_conditions_do_not_change_what_they_ask_about(tmp_path: Path) -> None:
    code = "if isInRange(p[1])\nlogMsg(1)\nendIf\nnId=movel(p[0],t,m)\nmovel(p[1],t,m)"
    assert read_path(application(tmp_path, code)).tips_mm[:, 0].tolist() == [0, 1]
    changed = code.replace("logMsg(1)", "p[1]=p[0]")
    with pytest.raises(FormatError, match=r"start\.pgx, line 5: 'p' is changed by the program"):
        read_path(application(tmp_path, changed))


@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_stretches_taken_in_one_go_are_those_taken_line_by_line(data: st.DataObject) -> None:
    """Whatever stands in a program: the same path, events and findings, or the same error."""
    plain = st.one_of(st.floats(-400, 400).map(repr), st.sampled_from(["90", "-180", "1E2", "270.0", "45"]))
    number = st.integers(0, 499).flatmap(lambda odd: plain if odd else st.sampled_from(["nan", "1,5", "1e999"]))
    values = "".join(
        f'<Value key="{key}" x="{key}" rx="{data.draw(number)}" ry="{data.draw(number)}" rz="{data.draw(number)}"/>'
        if data.draw(st.integers(0, 99))
        else f'<Value key="{key}" x="7" fatherId="g[0]"/>'
        for key in range(12)
    )
    variables = (
        f'<Datas><Data name="p" type="pointRx" size="14">{values}</Data>'
        '<Data name="m" type="mdesc" size="2"><Value key="0" tmax="10"/><Value key="1" tmax="20"/></Data>'
        '<Data name="mRapid" type="mdesc"/><Data name="g" type="frame"><Value key="0" z="100" rx="30"/></Data>'
        '<Data name="n" type="num" size="14"><Value key="3" value="1"/><Value key="5" value="1"/></Data>'
        '<Data name="i" type="num"/></Datas>'
    )
    move = st.tuples(st.integers(0, 12), st.sampled_from(["m[0]", "m[1]", "mRapid", "m"]), st.sampled_from(["t", "u1"]))
    moving = move.map(lambda m: f"movel(p[{m[0]}],{m[2]},{m[1]})")
    harmless = st.sampled_from(["// on", "delay(1)", "m.tvel=7", "i=3", "movej(p[2],t,m)", "if i>1\nlogMsg(i)\nendIf"])
    odd = st.sampled_from(["p[1]=p[0]", "g.trsf.x=1", "movel(p[3],t,mNone)", "movel(p[13],t)"])
    line = st.integers(0, 99).flatmap(lambda at: moving if at < 85 else harmless if at < 99 else odd)
    loops = st.sampled_from(["m[0]", "m[n[i]]", "mRapid"]).flatmap(
        lambda speed: st.tuples(st.integers(0, 4), st.integers(6, 13)).map(
            lambda ends: f"for i={ends[0]} to {ends[1]}\nmovel(p[i],t,{speed})\nendFor"
        )
    )
    code = "\n".join(data.draw(st.lists(st.one_of(line, line, line, loops), min_size=1, max_size=30)))
    frame = data.draw(st.sampled_from(["keep", "apply"]))
    with TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        file = application(Path(folder), code, data=variables)
        told = []
        for fewest in (1, 10**9):
            patch.setattr("sicp_formats.val3.stretch.FEWEST", fewest)
            try:
                path = read_path(file, frame=frame)
            except SicpError as error:
                told.append(str(error))
            else:
                told.append((path.tips_mm.round(9).tolist(), path.axes.round(12).tolist(), path.feeds_mm_min.tolist(),
                             path.rapid.tolist(), path.lines.tolist(), path.events, path.findings))  # fmt: skip
        assert told[0] == told[1]
