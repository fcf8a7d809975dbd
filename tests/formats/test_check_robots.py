"""Each defect of a KRL, RAPID, Fanuc or URScript program, put into a good one, is told with its code and its place."""

import pytest

from sicp_formats import fanuc_ls, krl, rapid, urscript
from sicp_formats.fanuc_ls.check import check as check_ls
from sicp_formats.krl.check import check as check_krl
from sicp_formats.rapid.check import check as check_rapid
from sicp_formats.urscript.check import check as check_ur

KRL = """&ACCESS RVP
DEF trim()
BAS(#INITMOV,0)
$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}
$TOOL=TOOL_DATA[2]
$APO.CDIS=2
PTP XP1
$VEL.CP=0.05
LIN {X 100,Y 0,Z 5,A 0,B 90,C 0}
LIN {X 110} C_DIS
LIN {Y 20} C_DIS
LIN {Z 50}
END
"""
KRL_DATA = """DEFDAT trim
DECL E6POS XP1={X 100,Y 0,Z 50,A 0,B 0,C 180,S 2,T 10}
ENDDAT
"""
EXT = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
RAPID = f"""MODULE Trim
PERS tooldata tTrim:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
PERS wobjdata wPart:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
CONST speeddata vCut:=[33.3,500,5000,1000];
CONST robtarget p1:=[[0,0,50],[0,1,0,0],{EXT};
PROC main()
MoveJ p1,v1000,fine,tTrim\\WObj:=wPart;
MoveL [[0,0,5],[0,1,0,0],{EXT},vCut,fine,tTrim\\WObj:=wPart;
MoveL [[20,0,5],[0,1,0,0],{EXT},vCut,z5,tTrim\\WObj:=wPart;
MoveL [[20,30,5],[0,1,0,0],{EXT},vCut,fine,tTrim\\WObj:=wPart;
ENDPROC
ENDMODULE
"""
POINT = "\tUF : 1, UT : 1,\n\tX = {} mm, Y = 0.000 mm, Z = {} mm,\n\tW = 180.000 deg, P = 0.000 deg, R = 0.000 deg"
LS = f"""/PROG  A
/ATTR
LINE_COUNT = 6;
/MN
   1:  UFRAME_NUM=1 ;
   2:  UTOOL_NUM=1 ;
   3:  !approach ;
   4:J P[1] 20% FINE ;
   5:L P[2] 30mm/sec FINE ;
   6:L P[3] 30mm/sec CNT50 ;
/POS
P[1]{{
   GP1:
{POINT.format(0, 50)}
}};
P[2]{{
   GP1:
{POINT.format(0, 5)}
}};
P[3]{{
   GP1:
{POINT.format(20, 5)}
}};
/END
"""
UR = """def trim():
  set_tcp(p[0.0, 0.0, 0.15, 0.0, 0.0, 0.0])
  part = p[0.4, -0.1, 0.02, 0.0, 0.0, 1.5707963]
  movej(pose_trans(part, p[0.1, 0.0, 0.05, 3.14159265, 0.0, 0.0]), a=1.4, v=1.05)
  movel(pose_trans(part, p[0.1, 0.0, 0.005, 3.14159265, 0.0, 0.0]), a=1.2, v=0.05)
  movel(pose_trans(part, p[0.12, 0.0, 0.005, 3.14159265, 0.0, 0.0]), a=1.2, v=0.05, r=0.004)
  movel(pose_trans(part, p[0.12, 0.03, 0.005, 3.14159265, 0.0, 0.0]), a=1.2, v=0.05)
end
"""
GOOD = {"krl": KRL, "rapid": RAPID, "ls": LS, "ur": UR}
FILES = {"krl": "trim.src", "rapid": "trim.mod", "ls": "A.ls", "ur": "trim.script"}
CHECKS = {"krl": check_krl, "rapid": check_rapid, "ls": check_ls, "ur": check_ur}
READERS = {"krl": krl, "rapid": rapid, "ls": fanuc_ls, "ur": urscript}
LONG = "p1234567890123456789012345678901234567890"
BROKEN = [
    # program, old, new, code, level, line, words
    ("krl", "PTP XP1", "LIN XP1", 880, "warn", 7, "the controller wants PTP"),
    ("krl", "DEF trim()", "DEF trimming()", 881, "warn", 2, "called trimming, the file trim"),
    ("krl", "END\n", f"END\nDEF {LONG}()\nEND\n", 881, "fail", 14, "at most 24"),
    ("krl", "PTP XP1", "PTP XP2", 882, "fail", 7, "the point XP2 is declared neither"),
    ("krl", "$APO", "DECL E6POS XP3={X 1,Y 1,Z 1}\n$APO", 882, "info", 6, "XP3 is declared and never used"),
    ("krl", "CP=0.05", "CP=0", 883, "fail", 8, "0 m/s is not possible"),
    ("krl", "CP=0.05", "CP=50", 883, "fail", 8, "are these mm/s?"),
    ("krl", "$VEL.CP=0.05", "BAS(#VEL_CP,50)", 883, "fail", 8, "are these mm/s?"),
    ("krl", "BAS(#INITMOV,0)", "", 883, "warn", 0, ""),
    ("krl", "CDIS=2", "CDIS=6", 884, "warn", 10, "the zone of 6 mm is more than half of the way of 10 mm"),
    ("krl", "LIN {Y 20} C_DIS", "LIN {Y 3} C_DIS", 884, "warn", 10, "half of the way of 3 mm"),
    ("krl", "$TOOL=TOOL_DATA[2]\n", "", 886, "warn", 6, "before $TOOL is set"),
    ("krl", "$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}\n", "", 886, "warn", 6, "before $BASE is set"),
    ("krl", "&ACCESS RVP", ";gr\u00fcn", 889, "warn", 1, "no ASCII character"),
    ("rapid", "ENDMODULE\n", "", 880, "fail", 11, "no ENDMODULE"),
    ("rapid", "MODULE Trim", f"MODULE {LONG}", 881, "fail", 1, "at most 32"),
    ("rapid", "main()", f"{LONG}()", 881, "fail", 6, "at most 32"),
    ("rapid", "MoveJ p1,", "MoveJ p2,", 882, "fail", 7, "the point p2 is declared nowhere"),
    ("rapid", "MoveJ p1,v1000", "MoveJ p1,v1001", 882, "fail", 7, "the speed v1001 is declared nowhere"),
    ("rapid", "z5,", "z7,", 882, "fail", 9, "the zone z7 is declared nowhere"),
    ("rapid", "MoveJ p1,v1000", "MoveJ p1,p1", 882, "fail", 7, "p1 is a robtarget and no speeddata"),
    ("rapid", "PROC main", "CONST zonedata zX:=[FALSE,1,1,1,1,1,1];\nPROC main", 882, "info", 6, "zX is declared"),
    ("rapid", "33.3", "0", 883, "fail", 4, "0 mm/s is not possible"),
    ("rapid", "33.3", "60000", 883, "fail", 4, "are these mm/min?"),
    ("rapid", ",z5,", ",z15,", 884, "warn", 9, "the zone of 15 mm is more than half of the way of 20 mm"),
    ("rapid", "[[20,30,5],[0,1,0,0]", "[[20,30,5],[0,0.99,0,0]", 885, "fail", 10, "length 0.99, not 1"),
    ("rapid", "p1:=[[0,0,50],[0,1,0,0]", "p1:=[[0,0,50],[0.1,1,0,0]", 885, "fail", 5, "length 1.00499"),
    ("rapid", "PERS tooldata", "CONST tooldata", 886, "fail", 2, "must be declared as PERS"),
    ("rapid", "MoveJ p1,v1000,fine,tTrim", "MoveJ p1,v1000,fine,tOther", 886, "warn", 7, "tOther is not declared"),
    ("rapid", "PROC main()", "PROC main()\n! gr\u00fcn", 889, "warn", 7, "no ASCII character"),
    ("ls", "LINE_COUNT = 6", "LINE_COUNT = 9", 880, "warn", 3, "LINE_COUNT is 9, and there are 6 lines"),
    ("ls", "/END\n", "", 880, "fail", 29, "no /END"),
    ("ls", "/PROG  A", "/PROG  B", 881, "warn", 1, "called B, the file A"),
    ("ls", "   5:L", "   7:L", 881, "warn", 9, "the line number is 7, not 5"),
    ("ls", "L P[2]", "L P[4]", 882, "fail", 9, "P[4] is not in /POS"),
    ("ls", "   3:  !approach ;", "   3:J P[2] 5% FINE ;", 882, "warn", 0, ""),
    ("ls", "L P[2] 30mm", "L P[2] 0mm", 883, "fail", 9, "0 mm/sec is not possible in a L move"),
    ("ls", "L P[2] 30mm", "L P[2] 9000mm", 883, "fail", 9, "are these mm/min?"),
    ("ls", "J P[1] 20%", "J P[1] 200%", 883, "fail", 8, "200% is not possible"),
    ("ls", "L P[2] 30mm/sec", "L P[2] 30%", 883, "fail", 9, "30% is not possible in a L move"),
    ("ls", "CNT50", "CNT500", 884, "fail", 10, "CNT500: at most 100"),
    ("ls", "CNT50", "", 884, "fail", 10, "neither FINE nor CNT"),
    ("ls", "   1:  UFRAME_NUM=1 ;", "   1:  UFRAME_NUM=2 ;", 886, "fail", 8, "taught in UFRAME 1, and UFRAME_NUM is 2"),
    ("ls", "   2:  UTOOL_NUM=1 ;", "   2:  !no tool ;", 886, "warn", 8, "before UTOOL_NUM is set"),
    ("ls", "!approach", "!\u00e4", 889, "warn", 7, "no ASCII character"),
    ("ur", "0.12, 0.03, 0.005", "120.0, 0.03, 0.005", 887, "fail", 7, "are these millimetres?"),
    ("ur", "0.12, 0.03, 0.005, 3.14159265", "0.12, 0.03, 0.005, 180.0", 885, "fail", 7, "are these degrees?"),
    ("ur", "a=1.2, v=0.05, r=0.004", "a=1.2, v=50, r=0.004", 883, "fail", 6, "are these mm/s?"),
    ("ur", "a=1.2, v=0.05, r=0.004", "a=1.2, v=0, r=0.004", 883, "fail", 6, "the speed 0 is not possible"),
    ("ur", "a=1.2, v=0.05, r=0.004", "a=-1, v=0.05, r=0.004", 883, "fail", 6, "the acceleration -1 is not possible"),
    ("ur", "r=0.004", "r=0.012", 884, "warn", 6, "the zone of 12 mm is more than half of the way of 20 mm"),
    ("ur", "r=0.004", "r=-0.004", 884, "fail", 6, "the blend radius -0.004"),
    ("ur", "v=0.05)\nend", "v=0.05, r=0.001)\nend", 884, "warn", 7, "the last move has a blend radius"),
    ("ur", "  set_tcp(p[0.0, 0.0, 0.15, 0.0, 0.0, 0.0])\n", "", 886, "warn", 3, "before set_tcp"),
    ("ur", "  set_tcp", "  def lift():\n    sleep(1)\n  end\n  set_tcp", 882, "info", 2, "lift is declared and never"),
    ("ur", "  set_tcp", "  x = 1\n  set_tcp", 882, "info", 2, "the variable x is declared and never used"),
    (
        "ur",
        "movel(pose_trans(part, p[0.12, 0.03, 0.005, 3.14159265, 0.0, 0.0])",
        "movel(q",
        882,
        "fail",
        7,
        "q is assigned",
    ),
    ("ur", "  set_tcp", "  # gr\u00fcn\n  set_tcp", 889, "warn", 2, "no ASCII character"),
]


def written(tmp_path, name, text, data=KRL_DATA):
    file = tmp_path / FILES[name]
    file.write_text(text, encoding="utf-8")
    if name == "krl":
        (tmp_path / "trim.dat").write_text(data, encoding="utf-8")
    return file


@pytest.mark.parametrize("name", GOOD)
def test_a_good_program_has_no_findings_and_can_be_read(tmp_path, name):
    file = written(tmp_path, name, GOOD[name])
    assert CHECKS[name](file) == ()
    assert len(READERS[name].read_path(file)) >= 3


@pytest.mark.parametrize(("name", "old", "new", "code", "level", "line", "words"), BROKEN)
def test_a_defect_is_told_with_its_code_and_line(tmp_path, name, old, new, code, level, line, words):
    assert GOOD[name].count(old) == 1
    file = written(tmp_path, name, GOOD[name].replace(old, new))
    found = CHECKS[name](file)
    if not words:
        assert found == ()
        return
    told = next((f.code, f.level.value, f.where) for f in found if words in f.message)
    assert told == (code, level, f"{file}, line {line}")


@pytest.mark.parametrize(
    ("old", "new", "code", "level", "line", "words"),
    [
        ("DEFDAT trim", "DEFDAT trimming", 881, "fail", 1, "DEFDAT is called trimming"),
        ("DEFDAT trim\n", "", 880, "fail", 1, "no DEFDAT"),
        ("ENDDAT\n", "", 880, "fail", 2, "no ENDDAT"),
        ("ENDDAT", "DECL E6POS XP9={X 1}\nENDDAT", 882, "info", 3, "XP9 is declared and never used"),
        ("ENDDAT", "DECL E6POS XP1={X 1}\nENDDAT", 882, "fail", 3, "XP1 is declared twice"),
        ("ENDDAT", f"DECL E6POS {LONG}={{X 1}}\nENDDAT", 881, "fail", 3, "at most 24"),
        ("ENDDAT", ";gr\u00fcn\nENDDAT", 889, "warn", 3, "no ASCII character"),
    ],
)
def test_the_data_file_of_krl_is_checked_too(tmp_path, old, new, code, level, line, words):
    file = written(tmp_path, "krl", KRL, KRL_DATA.replace(old, new))
    told = next((f.code, f.level.value, f.where) for f in check_krl(file) if words in f.message)
    assert told == (code, level, f"{tmp_path / 'trim.dat'}, line {line}")


def test_rapid_data_may_be_made_of_other_data_and_stand_in_routines(tmp_path):
    text = RAPID.replace("PROC main()", "PROC main()\nVAR robtarget p9:=p1;\nMoveJ p9,v50,fine,tTrim\\WObj:=wPart;")
    text = text.replace("MoveJ p1,v1000,fine,tTrim\\WObj:=wPart;\n", "")
    assert check_rapid(written(tmp_path, "rapid", text)) == ()


def test_a_tool_of_another_module_is_told_once(tmp_path):
    lines = [line for line in RAPID.splitlines() if "tooldata" not in line]
    found = check_rapid(written(tmp_path, "rapid", "\n".join(lines)))
    assert [(f.code, f.where[-6:]) for f in found] == [(886, "line 6")]


def test_programs_that_are_called_are_checked_with_what_rules_then(tmp_path):
    """The frames of the program that calls hold in the one that is called; defects are told in their own file."""
    main, moves = KRL.partition("LIN {X 110} C_DIS\n")[::2]
    file = written(tmp_path, "krl", f"{main}trim_001( )\nEND\n")
    part = tmp_path / "TRIM_001.SRC"
    part.write_text(f"DEF trim_001( )\nLIN {{X 110}} C_DIS\n{moves}", encoding="ascii")
    assert check_krl(file) == ()
    part.write_text(part.read_text().replace("LIN {Z 50}", "LIN XP7"), encoding="ascii")
    assert [(f.code, f.where) for f in check_krl(file)] == [(882, f"{part}, line 4")]


def test_listings_that_are_called_are_checked_with_the_frames_that_are_chosen(tmp_path):
    text = LS.replace("LINE_COUNT = 6", "LINE_COUNT = 7").replace("/POS", "   7:  CALL PART ;\n/POS")
    file = written(tmp_path, "ls", text)
    called = (
        f"/PROG  PART\n/MN\n   1:L P[1] 30mm/sec FINE ;\n/POS\nP[1]{{\n   GP1:\n{POINT.format(20, 50)}\n}};\n/END\n"
    )
    (tmp_path / "PART.LS").write_text(called, encoding="ascii")
    assert check_ls(file) == ()
    (tmp_path / "PART.LS").write_text(called.replace("UT : 1", "UT : 4"), encoding="ascii")
    (found,) = check_ls(file)
    assert (found.code, found.where) == (886, f"{tmp_path / 'PART.LS'}, line 3")


def test_programs_that_call_each_other_are_checked_once(tmp_path):
    file = written(tmp_path, "krl", KRL.replace("LIN {Z 50}", "LIN {Z 50}\nother( )"))
    (tmp_path / "other.src").write_text("DEF other( )\ntrim( )\nother( )\nEND\n", encoding="ascii")
    assert check_krl(file) == ()
