"""The RAPID reader against modules whose truth is known."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.errors import FormatError, SicpError, UnitError
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.rapid import read_path

CORPUS = Path(__file__).parents[1] / "corpus" / "rapid"
EXT = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
P, Q, R = (f"[[{x},0,0],[0,1,0,0],{EXT}" for x in (0, 9, 20))
END = ",v100,fine,tool0;"


def read(folder: Path, code: str, declared: str = "", **options: object) -> ToolPath:
    (folder / "a.mod").write_text(f"MODULE A\n{declared}\nPROC main()\n{code}\nENDPROC\nENDMODULE\n")
    return read_path(folder / "a.mod", **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


def test_reads_a_module() -> None:
    path = read_path(CORPUS / "trim.mod")
    assert path.tips_mm[:3].tolist() == [[100, 0, 50], [200, 0, 50], [200, 0, 60]]
    assert np.abs(np.linalg.norm(path.tips_mm[2:-1] - [210, 0, 60], axis=1) - 10).max() < 1e-9
    assert np.allclose(path.tips_mm[-2], [220, 0, 60], atol=1e-9)
    # The tool of p20 has its Y along the X of the work object and its Z down.
    assert np.allclose(path.tips_mm[-1], [205, 0, 80], atol=1e-4)
    assert np.allclose(path.axes, [0, 0, 1], atol=1e-7)
    assert np.allclose(path.feeds_mm_min[[0, 1, 2, 3, -1]], [0, 1998, 6000, 1998, 1200])
    assert path.lines[[0, 1, 2, 3, -1]].tolist() == [16, 28, 21, 22, 24]
    assert path.name == "Trim"
    assert codes(path) == {306, 317, 335, 337}
    told = [(e.kind, e.value, e.text, e.line) for e in path.events]
    assert (EventKind.COMMENT, 0.0, 'trim; "the rim"', 13) in told
    assert (EventKind.OTHER, 0.0, "SetDO doSpindle,1", 17) in told
    assert (EventKind.DWELL, 2.0, "WaitTime 2", 18) in told


@settings(deadline=None, max_examples=30)
@given(turn=st.tuples(*[st.floats(-3, 3)] * 3), step=st.tuples(*[st.floats(-99, 99).map(lambda v: round(v, 3))] * 3))
def test_quaternions_and_steps_in_the_tool(turn: tuple[float, ...], step: tuple[float, ...]) -> None:
    rotation = Rotation.from_rotvec(turn)
    x, y, z, w = rotation.as_quat()
    point = f"[[1,2,3],[{w:.9f},{x:.9f},{y:.9f},{z:.9f}],{EXT}"
    a, b, c = step
    with TemporaryDirectory() as folder:
        path = read(Path(folder), f"MoveL {R}{END}\nMoveL RelTool({point},{a:.3f},{b:.3f},{c:.3f}){END}")
    assert np.abs(path.tips_mm[1] - np.array([1, 2, 3]) - rotation.apply(step)).max() < 1e-5
    assert np.abs(path.axes[1] + rotation.as_matrix()[:, 2]).max() < 1e-7


@pytest.mark.parametrize(
    ("code", "line", "words"),
    [
        (f"MoveL p1{END}", 4, "'p1' is declared nowhere"),
        (f"MoveL CRobT(){END}", 4, "is computed"),
        (f"MoveL {P},v99,fine,tool0;", 4, "'v99' is declared nowhere"),
        (f"MoveL {P},vBad,fine,tool0;", 4, "computed by the program"),
        (f"MoveL {P.replace('0,1,0,0', '0,1,1,0')}{END}", 4, "length 1.41421"),
        (f"MoveL [[0,0,0],[1,0,0,0]]{END}", 4, "a robtarget needs"),
        (f"MoveL {P},v100\\T:=5,fine,tool0;", 4, "time of the move"),
        (f"MoveL {P};", 4, "lacks points, speed"),
        (f"MoveL home{END}", 4, "only MoveAbsJ takes them"),
        (f"MoveL {P}{END}\nMoveAbsJ home{END}\nMoveL {Q}{END}", 6, "line 5 stands between two points"),
        (f"MoveL {P}{END}\nMoveL {Q},v100,fine,tool0\\WObj:=w;", 5, "frame changes from wobj0 to w"),
        (f"MoveL {P}{END}\nMoveC {Q},{R}{END}", 5, "on a line"),
        (f"IF di=1 THEN\nMoveL {P}{END}\nENDIF", 4, "decides about motion"),
        (f"IF di=1 MoveL {P}{END}", 4, "decides about motion"),
        (f"FOR i FROM 1 TO 3 DO MoveL Offs({P},i,0,0){END} ENDFOR", 4, "decides about motion"),
        (f"TEST n\nCASE 1: MoveL {P}{END}\nENDTEST", 4, "decides about motion"),
        ("WHILE TRUE DO go; ENDWHILE", 4, "decides about motion"),
        (f"MoveL Offs({P},n,0,0){END}", 4, "declared nowhere"),
        ("gripper;", 4, "path.calls=gripper"),
        ("main;", 4, "within itself"),
        ("PDispSet p;", 4, "displaces the points"),
        (f"pv.trans.x:=5;\nMoveL pv{END}", 5, "computed by the program"),
        (f"MoveL pLoop{END}", 4, "computed by the program"),
        ("VelSet 0,100;", 4, "VelSet needs"),
        (f"MoveL {P},v100", 4, "stands outside|has no end"),
    ],
)
def test_what_would_be_a_guess_is_refused_with_its_line(tmp_path: Path, code: str, line: int, words: str) -> None:
    declared = f"CONST jointtarget home:=[[0,0,0,0,0,0],[0,0,0,0,0,0]]; VAR robtarget pv:={P};"
    declared += "VAR speeddata vBad; CONST robtarget pLoop:=pLoop;"
    with pytest.raises(FormatError, match=words) as caught:
        read(tmp_path, code, declared)
    assert caught.value.line == line


def test_values_change_on_the_way(tmp_path: Path) -> None:
    declared = f"VAR robtarget p:={P};\nVAR speeddata v:=[10,1,1,1];\nVAR num n{{2}}:=[3,4];"
    code = "MoveL p,v,z0,t;\np:=Offs(p,1,0,0);\nMoveL p,v,z0,t;\nv:=v200;\nVelSet 50,90;\n"
    code += "MoveL Offs(p,n{2},0,0),v,z0,t;\nMoveL p,vmax,z0,t;"
    path = read(tmp_path, code, declared)
    assert path.tips_mm[:, 0].tolist() == [0, 1, 5, 1]
    assert path.feeds_mm_min.tolist() == [600, 600, 5400, 0]
    assert codes(path) == {302, 317}


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("hello", 1, "has no end"),
        ("hello;", 1, "outside of a routine"),
        ("MODULE a\nENDMODULE\n", 1, "has no PROC"),
        ("MODULE a\nPROC main()\nStop;\n", 2, "without ENDPROC"),
        ("MODULE a\nPROC main()\nPROC b()\n", 3, "within another"),
        ("MODULE a\nPROC b()\nENDPROC\nPROC c()\nENDPROC\nENDMODULE", 1, "path.program=NAME one of b, c"),
        ("MODULE a\nPROC main()\nENDPROC\nENDMODULE", 1, "holds no move"),
    ],
)
def test_files_that_are_no_programs(tmp_path: Path, text: str, line: int, words: str) -> None:
    (tmp_path / "a.prg").write_text(text)
    with pytest.raises(FormatError) as caught:
        read_path(tmp_path / "a.prg")
    assert caught.value.line == line
    assert words in str(caught.value)


def test_units_are_millimetres(tmp_path: Path) -> None:
    with pytest.raises(UnitError, match="states mm"):
        read(tmp_path, f"MoveL {P}{END}\nMoveL {Q}{END}", units="inch")


def test_a_long_array_takes_no_long_time(tmp_path: Path) -> None:
    targets = ",\n".join(f"[[{x},0,0],[0,1,0,0],{EXT}" for x in range(2000))
    path = read(tmp_path, f"MoveL t{{1}}{END}\nMoveL t{{2000}}{END}", f"CONST robtarget t{{2000}}:=[{targets}];")
    assert path.tips_mm[:, 0].tolist() == [0, 1999]


@settings(deadline=None, max_examples=40)
@given(data=st.data())
def test_damaged_modules_give_a_path_or_a_typed_error(data: st.DataObject) -> None:
    content = bytearray((CORPUS / "trim.mod").read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(
            st.sampled_from(b'[](),;:=\\\r 0.-e!"\x00\xff')
        )
    with TemporaryDirectory() as folder:
        file = Path(folder, "trim.mod")
        file.write_bytes(bytes(content[: data.draw(st.integers(1, 2 * len(content)))]))
        try:
            path = read_path(file)
        except SicpError as error:
            assert str(error).isprintable()
        else:
            assert np.allclose(np.linalg.norm(path.axes, axis=1), 1)


PART = "MODULE B\nPROC cut()\nMoveL {},v100,z1,tool0;\nENDPROC\nENDMODULE\n"


def modules(folder: Path, listed: str = "a.mod", **files: str) -> Path:
    for name, text in files.items():
        (folder / f"{name}.mod").write_text(text)
    (folder / "a.pgf").write_text(
        f"<Program>\n  <Module>{listed}</Module>\n  <Module>C:\\x\\b.mod</Module>\n</Program>"
    )
    return folder / "a.pgf"


MAIN = f"MODULE A\nCONST robtarget q:={Q};\nPROC main()\nMoveJ {P}{END}\ncut;\nENDPROC\nENDMODULE\n"


def test_a_program_of_several_modules_is_read_by_its_list(tmp_path: Path) -> None:
    path = read_path(modules(tmp_path, a=MAIN, b=PART.format("q")))
    assert path.tips_mm[:, 0].tolist() == [0, 9] and path.lines.tolist() == [0, 0]
    with pytest.raises(FormatError, match=r"b\.mod, line 3: 'x' is declared nowhere"):
        read_path(modules(tmp_path, a=MAIN, b=PART.format("x")))
    with pytest.raises(FormatError, match="has the procedure cut in two modules"):
        read_path(modules(tmp_path, a=MAIN.replace("main", "cut"), b=PART.format("q")))
    with pytest.raises(FormatError, match=r"lists c\.mod, which does not lie beside it"):
        read_path(modules(tmp_path, "c.mod", a=MAIN, b=PART.format("q")))
    (tmp_path / "a.pgf").write_text("<Program/>")
    with pytest.raises(FormatError, match="lists no <Module>"):
        read_path(tmp_path / "a.pgf")


def test_without_main_the_procedure_that_no_other_calls_is_the_first(tmp_path: Path) -> None:
    text = f"MODULE A\nPROC b()\nMoveL {Q}{END}\nENDPROC\nPROC a()\nMoveJ {P}{END}\nb;\nENDPROC\nENDMODULE\n"
    (tmp_path / "a.mod").write_text(text)
    assert read_path(tmp_path / "a.mod").tips_mm[:, 0].tolist() == [0, 9]
