import pytest
from hypothesis import given
from hypothesis import strategies as st

from sicp_cam.errors import UnitError
from sicp_cam.units import MM_PER_UNIT, likely_unit_mistake, mm_per_unit


def test_factors_are_exact():
    assert {unit: mm_per_unit(unit) for unit in MM_PER_UNIT} == {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}


@pytest.mark.parametrize("unit", ["Mm", "feet", "", "in"])
def test_an_unknown_unit_is_refused_with_the_known_ones(unit):
    with pytest.raises(UnitError, match="use one of mm, cm, m, inch") as caught:
        mm_per_unit(unit)
    assert repr(unit) in str(caught.value)


@given(st.sampled_from(["cm", "m", "inch"]), st.floats(0.85, 1.15))
def test_a_unit_mistake_is_named_whatever_the_parts_small_differences(unit, stretch):
    assert likely_unit_mistake(stretch / MM_PER_UNIT[unit]) == unit


@given(st.floats(0.5, 2.0))
def test_an_honest_ratio_is_no_unit_mistake(ratio):
    assert likely_unit_mistake(ratio) is None
