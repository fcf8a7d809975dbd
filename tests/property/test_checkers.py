"""Whatever bytes a program has: its checker ends with findings or says what is wrong with the file, never otherwise."""

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_formats import path_text
from sicp_formats.apt.check import check as check_apt
from sicp_formats.fanuc_ls.check import check as check_ls
from sicp_formats.gcode.check import check as check_gcode
from sicp_formats.krl.check import check as check_krl
from sicp_formats.path_csv.check import check as check_csv
from sicp_formats.rapid.check import check as check_rapid
from sicp_formats.urscript.check import check as check_ur

CORPUS = Path(__file__).parents[1] / "corpus"
CSV = b"x,y,z,i,j,k,feed,rapid,status\n0,0,9,0,0,1,0,1,approach\n0,0,5,0,0,1,900,0,covered\n"
CHECKERS = {
    "gcode/three_axis_arcs.nc": check_gcode,
    "gcode/siemens_traori.mpf": check_gcode,
    "apt/autodesk.apt": check_apt,
    "krl/trim.src": check_krl,
    "rapid/trim.mod": check_rapid,
    "fanuc_ls/TRIM.LS": check_ls,
    "urscript/trim.script": check_ur,
    "a.csv": check_csv,
    "a.txt": path_text.check,
}
ODD = [b"9" * 400, b"1e999", b"-", b".", b"\xff", b"\0", b"\n", b"(", b")", b"[", b"]", b"{", b"}", b'"', b";", b"#",
       b"%", b"=", b",", b"G93 ", b"F0", b"G18 G2 X1 I5\n", b"N5", b"LIN ", b"p[1,2]", b"P[99]", b"r=1", b":=",
       b"M30\n", b"END\n", b"$VEL.CP=", b"C_DIS", b"\\WObj:=", b"GOTO/", b"/POS\n", b"\xc3\xa4"]  # fmt: skip
CHANGE = st.tuples(st.floats(0.0, 1.0), st.integers(0, 30), st.one_of(st.sampled_from(ODD), st.binary(max_size=3)))


def changed(content, changes):
    """Put bytes in the place of others, each at a share of the length."""
    for share, cut, put in changes:
        at = int(share * len(content))
        content = content[:at] + put + content[at + cut :]
    return content


def content_of(name):
    return CSV if name.startswith("a.") else (CORPUS / name).read_bytes()


@pytest.mark.parametrize("name", CHECKERS)
@settings(deadline=None, max_examples=50)
@given(changes=st.lists(CHANGE, min_size=1, max_size=4), cut=st.one_of(st.none(), st.floats(0.0, 1.0)))
def test_damaged_programs_are_judged_or_refused(name, changes, cut):
    content = changed(content_of(name), changes)
    content = content if cut is None else content[: int(cut * len(content))]
    with TemporaryDirectory() as folder:
        file = Path(folder, Path(name).name)
        file.write_bytes(content)
        try:
            found = CHECKERS[name](file)
        except FormatError as error:
            assert str(error).isprintable()
            return
    assert all(isinstance(each, Finding) and type(each.code) is int for each in found)
    assert all(each.message.isprintable() and each.where.startswith(str(file)) for each in found)


REAL = [("gcode", check_gcode), ("apt", check_apt), ("krl", check_krl), ("rapid", check_rapid), ("fanuc_ls", check_ls),
        ("urscript", check_ur)]  # fmt: skip


@pytest.mark.parametrize(
    ("file", "checker"),
    [
        pytest.param(file, checker, id=file.name)
        for folder, checker in REAL
        for file in sorted((CORPUS / folder).iterdir())
        if file.suffix != ".dat"
    ],
)
def test_programs_as_cam_systems_and_controllers_write_them_do_not_fail(file, checker):
    assert [(f.code, f.message) for f in checker(file) if f.level is Level.FAIL] == []
