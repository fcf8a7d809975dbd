"""In which configuration an arm follows a path: the one that was asked for, or those that would do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_postprocessors.arm.along import JointPath, Places, follow
from sicp_postprocessors.arm.kinematics import CONFIGURATIONS, Configuration
from sicp_postprocessors.arm.model import Arm

__all__ = ["Choice", "Possible", "choose", "matching", "possible"]


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """What was found about the configurations of an arm along a path.

    Parameters
    ----------
    followed
        The joints in the best of the configurations that were asked for: one that follows the whole path and stays
        furthest from the joint limits; where none does, the one that breaks them on the fewest places.
    asked
        Configurations that fit what was asked for: several where a word was left open.
    good
        Those of them that follow the whole path.
    others
        Where none does: other configurations that would, the best first.
    """

    followed: JointPath
    asked: tuple[Configuration, ...]
    good: tuple[Configuration, ...]
    others: tuple[Configuration, ...]


def matching(words: Iterable[str]) -> tuple[Configuration, ...]:
    """Return the configurations that fit words such as `lefty`; any other word leaves its part open.

    >>> [str(c) for c in matching(("lefty", "esame", "wpositive"))]
    ['lefty, epositive, wpositive', 'lefty, enegative, wpositive']
    """
    asked = set(words)
    fitting = CONFIGURATIONS
    for part in ("shoulder", "elbow", "wrist"):
        known = asked & {getattr(configuration, part) for configuration in CONFIGURATIONS}
        fitting = tuple(c for c in fitting if not known or getattr(c, part) in known)
    return fitting


def choose(arm: Arm, places: Places, asked: tuple[Configuration, ...]) -> Choice:
    """Follow the path in the configurations that were asked for, and in the others where none of these does."""
    best, good = _best(arm, places, asked)
    left = tuple(c for c in CONFIGURATIONS if c not in asked)
    if good or not left:
        return Choice(best, asked, good, ())
    other, can = _best(arm, places, left)
    return Choice(best, asked, good, tuple(sorted(can, key=lambda c: c != other.configuration)))


@dataclass(frozen=True, slots=True, eq=False)
class Possible:
    """What each configuration can do of a path.

    Parameters
    ----------
    cuts
        For each configuration, (c,) which cuts it follows by itself, whatever it must do between them.
    places
        (m,) places that some configuration comes to, within the joint limits.
    """

    cuts: dict[Configuration, BoolArray]
    places: BoolArray


def possible(arm: Arm, places: Places, cut_of_move: IntArray, cuts: int) -> Possible:
    """Return what each configuration can do of a path.

    Parameters
    ----------
    arm, places
        The arm, and the path.
    cut_of_move, cuts
        (n,) number of the cut that each move belongs to, -1 for none; and how many there are, at least one.
    """
    cut = cut_of_move[places.move]
    rows = np.flatnonzero(cut >= 0)
    starts = np.flatnonzero(np.diff(cut[rows], prepend=-1))
    follows, somewhere = {}, np.zeros(len(places.move), np.bool_)
    for configuration in CONFIGURATIONS:
        followed = follow(arm, places, configuration)
        reached, joints = followed.solution.reachable, followed.joints_deg
        np.logical_or(somewhere, reached & _turns_fit(arm, joints, joints), out=somewhere)
        least = np.minimum.reduceat(joints[rows], starts)
        most = np.maximum.reduceat(joints[rows], starts)
        holds = np.zeros(cuts, np.bool_)
        whole = np.logical_and.reduceat(reached[rows], starts)
        holds[cut[rows][starts]] = whole & _turns_fit(arm, least, most)
        follows[configuration] = holds
    return Possible(follows, somewhere)


def _turns_fit(arm: Arm, least: FloatArray, most: FloatArray) -> BoolArray:
    """Say whether there are whole turns that bring all joints (k, 6) within their limits."""
    low, high = arm.limits_deg
    with np.errstate(invalid="ignore"):
        fit = np.floor((high - most + 1e-6) / 360.0) >= np.ceil((low - least - 1e-6) / 360.0)
    fits: BoolArray = np.all(fit | np.isinf(low), axis=1)
    return fits


def _best(
    arm: Arm, places: Places, configurations: tuple[Configuration, ...]
) -> tuple[JointPath, tuple[Configuration, ...]]:
    """Return the joints in the best of some configurations, and which of these follow the whole path."""
    best, good = follow(arm, places, configurations[0]), []
    for configuration in configurations:
        followed = best if configuration is configurations[0] else follow(arm, places, configuration)
        if not followed.broken.any():
            good.append(configuration)
        if _rank(followed) < _rank(best):
            best = followed
    return best, tuple(good)


def _rank(followed: JointPath) -> tuple[int, float]:
    return int(np.count_nonzero(followed.broken)), -followed.margin_deg
