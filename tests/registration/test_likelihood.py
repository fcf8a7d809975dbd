import numpy as np
import pytest

from sicp_cam.registration.likelihood import MOST, most_likely


def bell(*peaks):
    """Return a function of stiffness with maxima of (decade, height), each one decade wide."""
    return lambda x: max(height - (np.log10(x) - decade) ** 2 for decade, height in peaks)


@pytest.mark.parametrize("decade", [0.7, 2.0, 4.4, 6.0, 9.3])
def test_the_maximum_is_found_within_half_a_step(decade):
    assert np.log10(most_likely(bell((decade, 0.0)))) == pytest.approx(decade, abs=0.26)


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (1.0, 0.0)])
def test_the_higher_of_two_maxima_is_found(low, high):
    found = np.log10(most_likely(bell((2.0, low), (8.0, high))))
    assert found == pytest.approx(2.0 if low > high else 8.0, abs=0.26)


def test_from_a_start_the_nearest_maximum_is_climbed():
    two = bell((2.0, 1.0), (8.0, 0.0))
    assert np.log10(most_likely(two, start=1e9)) == pytest.approx(8.0, abs=0.26)
    assert np.log10(most_likely(two, start=1e1)) == pytest.approx(2.0, abs=0.26)


def test_what_always_rises_ends_at_the_bounds():
    assert most_likely(np.log10) == pytest.approx(MOST)
    falling = most_likely(lambda x: -np.log10(x), least=50.0)
    assert 50.0 <= falling < 50.0 * np.sqrt(10.0)
    assert 50.0 <= most_likely(lambda x: -np.log10(x), start=1e4, least=50.0) < 50.0 * np.sqrt(10.0)


def test_a_least_stiffness_beyond_all_steps_is_taken():
    assert most_likely(np.log10, least=10.0 * MOST) == 10.0 * MOST


def test_no_stiffness_is_tried_twice_or_below_the_least():
    tried = []

    def evidence(x):
        tried.append(x)
        return bell((3.0, 0.0))(x)

    most_likely(evidence, least=20.0)
    assert len(set(tried)) == len(tried) < 20
    assert min(tried) >= 20.0
