import inspect

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sicp_cam import errors
from sicp_cam.errors import FormatError, JobError, OutputError, SicpError, printable

EXIT_CODES = {
    "SicpError": 1,
    "JobError": 2,
    "InputError": 3,
    "FormatError": 3,
    "UnitError": 3,
    "CadError": 3,
    "RegistrationError": 4,
    "AmbiguousPoseError": 4,
    "PathError": 5,
    "OutputError": 6,
    "WarningsError": 7,
    "ReportError": 8,
}


def test_every_error_has_the_exit_code_of_the_contract_and_one_root():
    tree = {name: kind for name, kind in vars(errors).items() if inspect.isclass(kind)}
    assert {name: kind.exit_code for name, kind in tree.items()} == EXIT_CODES
    assert all(issubclass(kind, SicpError) for kind in tree.values())


def test_the_errors_are_the_builtin_ones_too():
    assert issubclass(JobError, ValueError)
    assert issubclass(FormatError, ValueError)
    assert issubclass(OutputError, OSError)


@pytest.mark.parametrize(
    ("place", "expected"),
    [({"line": 7}, "part.apt, line 7: odd"), ({"byte": 0}, "part.apt, byte 0: odd"), ({}, "part.apt: odd")],
)
def test_a_format_error_names_file_and_place(place, expected):
    assert str(FormatError("part.apt", "odd", **place)) == expected


def test_a_job_error_keeps_every_problem():
    error = JobError("a: wrong", "b: missing")
    assert error.problems == ("a: wrong", "b: missing")
    assert str(error) == "a: wrong; b: missing"


def test_text_from_a_file_cannot_move_the_cursor_of_a_terminal():
    error = FormatError("nasty\x1b]0;x\x07\n.ply", "comment '\x1b[2J\r\u202e'")
    assert str(error) == r"nasty\x1b]0;x\x07\n.ply: comment '\x1b[2J\r\u202e'"


@given(st.text(), st.integers(10, 300))
def test_printable_text_is_one_printable_line_of_limited_length(text, limit):
    safe = printable(text, limit)
    assert safe.isprintable()
    assert len(safe) <= limit
