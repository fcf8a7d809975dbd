import pytest

from sicp_cam.errors import UnitError
from sicp_cam.units import MM_PER_UNIT, mm_per_unit


def test_factors_are_exact():
    assert {unit: mm_per_unit(unit) for unit in MM_PER_UNIT} == {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}


@pytest.mark.parametrize("unit", ["Mm", "feet", "", "in"])
def test_an_unknown_unit_is_refused_with_the_known_ones(unit):
    with pytest.raises(UnitError, match="use one of mm, cm, m, inch") as caught:
        mm_per_unit(unit)
    assert repr(unit) in str(caught.value)
