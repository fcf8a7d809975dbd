import enum
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import pytest

from sicp_cam.errors import JobError
from sicp_cam.options.help import Option, dataclass_options, function_options, parameter_texts, written
from sicp_cam.plugins import options as plugin_options
from sicp_cam.plugins.registry import FORMATS, POSTPROCESSORS, Plugin, listing


class Colour(enum.Enum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True, slots=True)
class Base:
    size: float = 1.5
    """How large, over
    two lines and ``so``."""
    plain: int = 3


@dataclass(frozen=True, slots=True)
class Derived(Base):
    """Options.

    Parameters
    ----------
    plain, colour : int
        From the section.
    mode
        Behind it.

        A second paragraph.

    Raises
    ------
    mode
        Not this.
    """

    colour: Colour = Colour.RED
    mode: Literal["a", "b", "c"] = "a"
    box: tuple[float, float] | None = None
    names: tuple[str, ...] = ()
    many: list[int] = field(default_factory=list)
    must: bool = field(kw_only=True)
    """Under the field."""


def test_a_dataclass_is_described_by_the_texts_under_its_fields_or_its_section():
    assert dataclass_options(Derived) == (
        Option("size", "number", "1.5", "How large, over two lines and `so`."),
        Option("plain", "whole number", "3", "From the section."),
        Option("colour", "red or blue", "red", "From the section."),
        Option("mode", "a, b or c", "a", "Behind it. A second paragraph."),
        Option("box", "2 numbers, separated by commas, or none", "none", ""),
        Option("names", "list of texts, separated by commas", "none", ""),
        Option("many", "list[int]", "none", ""),
        Option("must", "true or false", None, "Under the field."),
    )


def test_ranges_are_told_where_there_are_any():
    types = {option.name: option.type for option in dataclass_options(Base, {"plain": (1, 9)})}
    assert types == {"size": "number of at least 0", "plain": "whole number from 1 to 9"}


def test_a_function_is_described_by_its_section():
    def read(path, *, units=None, chord_mm: float = 0.01, step_mm: float, file: Path | None = None, odd=""):
        """Read.

        Parameters
        ----------
        chord_mm, step_mm
            How fine.
        """

    assert plugin_options.keyword_names(read) == ["chord_mm", "step_mm", "file", "odd"]
    assert function_options(read, ["chord_mm", "step_mm", "file", "odd"]) == (
        Option("chord_mm", "number", "0.01", "How fine."),
        Option("step_mm", "number", None, "How fine."),
        Option("file", "file name, or none", "none", ""),
        Option("odd", "anything", '""', ""),
    )


@pytest.mark.parametrize("doc", [None, "", "One line.", "Notes\n-----\nx\n    y", "Parameters\n----------\n"])
def test_a_docstring_without_parameters_has_no_texts(doc):
    def function():
        pass

    function.__doc__ = doc
    assert not any(parameter_texts(function).values())


def test_a_class_without_source_is_described_all_the_same():
    space = {}
    exec("from dataclasses import dataclass\n@dataclass\nclass Options:\n    size: int = 2\n    'lost'\n", space)
    assert dataclass_options(space["Options"]) == (Option("size", "whole number", "2", ""),)


@pytest.mark.parametrize(
    ("value", "text"),
    [(False, "false"), (0.0, "0.0"), ((), "none"), (("pdf", "png"), "pdf,png"), (Colour.BLUE, "blue")],
)
def test_a_value_is_written_as_it_may_be_typed(value, text):
    assert written(value) == text


@pytest.fixture
def module(tmp_path, monkeypatch):
    def put(source):
        (tmp_path / "foreign.py").write_text(source, encoding="utf-8")
        monkeypatch.syspath_prepend(str(tmp_path))

    yield put
    sys.modules.pop("foreign", None)


def test_a_post_that_does_not_list_its_options_says_so(module):
    module("class Post:\n    '''Writes.'''\n    def __init__(self, options=None): ...\n")
    told = plugin_options.plugin_options(Plugin(POSTPROCESSORS, "foreign", "foreign:Post", "foreign 1.0", False))
    assert (told.role, told.prefix, told.summary) == ("post", "post.foreign", "Writes.")
    assert (told.options, told.any_option) == ((), True)


def test_a_reader_with_free_options_says_so(module):
    module("def read(path, *, units, limits, size: int = 3, **options): ...\n")
    told = plugin_options.plugin_options(Plugin(FORMATS, "scan.x", "foreign:read", "foreign 1.0", False))
    assert ([option.name for option in told.options], told.any_option) == (["format", "size"], True)


def test_a_type_that_is_not_there_is_the_plug_ins_fault(module):
    module("from __future__ import annotations\ndef read(path, *, units, limits, size: Nowhere = 3): ...\n")
    with pytest.raises(JobError, match=r"plug-in foreign:read: .*'Nowhere' is not defined; report it to its author"):
        plugin_options.plugin_options(Plugin(FORMATS, "scan.x", "foreign:read", "foreign 1.0", False))


def test_every_option_of_our_own_plug_ins_has_a_text():
    silent = []
    for plugin in listing()[0]:
        silent += [f"{plugin.name}: {o.name}" for o in plugin_options.plugin_options(plugin).options if not o.text]
    assert silent == []
