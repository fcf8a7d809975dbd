"""The displacement field: the smoothest motion in the surface that brings a contour to the edge of the scan.

A scan covers the surface with rho points per mm^2 up to its edge. Seen from the rigid pose a point lies at depth h_i,
and x_i = h_i - w(s_i) . B_i behind the edge if w is the displacement. Points lie behind x = 0 and none before it, so
that with psi(x) = exp(-x / tau) the sums agree on the true edge: for every function f of arc length

    sum psi(x_i) f(s_i) = tau r k integral rho f ds,    k = exp(sigma^2 / (2 tau^2)),

sigma being the noise of a point and r the density at the rim over that of the interior. Taking f = dx/dc for all
coefficients c of w makes this the minimum of a convex function; scaled by eta = sum psi / sum psi^2, so that its
curvature is the inverse of the scatter that the equations have for points at random, the field minimises

    eta [sum psi(x_i) - r k integral rho w . B ds] + 1/2 stiffness integral |w''|^2 ds

by Newton steps. The stiffness is the one of largest marginal likelihood (Laplace's approximation; Wood 2011): the data
choose over what length the edge is averaged. The smaller tau is, the fewer points settle the edge and the less the
density matters; it is lowered in stages, each of which looks at the points around the edge that the last one found.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import trapezoid
from scipy.linalg import cho_factor, cho_solve
from scipy.special import ndtr

from sicp_cam.contour.splines import LocalRows
from sicp_cam.model import FloatArray
from sicp_cam.registration.in_surface import InSurface
from sicp_cam.registration.likelihood import most_likely

__all__ = ["EdgeFit", "EdgePoints", "fit_to_edge", "moment"]

CAP = 1.5
"""Points further outside of the edge than this many decay lengths weigh no more than one there."""
DECAYS_SPACINGS = (0.4, 0.15, 0.06)
"""Decay length of each stage, in point spacings."""
LEAST_DECAY_NOISE = 2.0
"""Least decay length, in standard deviations of a point."""
BEFORE_EDGE_DECAYS, BEHIND_EDGE_DECAYS = 3.0, 8.0
"""Which points a stage looks at."""
STRAY_ZONE_SPACINGS, STRAY_ZONE_NOISE = (-1.5, -0.4), 4.0
"""Depths at which no point should lie, the last at least so many standard deviations outside: what does is counted, and
its share in the moment taken off."""
RIM_ZONE_SPACINGS, RIM_ZONE_NOISE = (0.03, 0.25), 1.5
"""Depths between which the rim's density is counted; the first at least so many standard deviations of a point."""
RIM_ZONE_NODES = np.linspace(0.0, 1.0, 65)
RIM_DENSITY = (0.8, 2.5)
RIM_ROUNDS = 4
DENSITY_DOUBT = 0.3
"""Standard uncertainty of the logarithm of the rim's density over samplings; the edge is in doubt by tau times that."""
STIFFNESS, LEAST_STIFFNESS = 1e6, 1e3
"""Stiffness of the fit that the first look at the points takes, and the least, both for a contour a metre long."""
DISPLACEMENT_SHARE, LARGE, RARE = 0.01, 5e-4, 0.01
"""A field of a given stiffness moves about 0.01 length^1.5 / stiffness^0.5. More than 1 / 2000 of the length is as
rare as 1 in 100, for a part that bends keeps its lengths: a prior of the stiffness (Simpson et al. 2017) that it takes
more than chance to outweigh."""
FIRST_STIFFNESS = 1e2
RIDGE, SLIDE_SPACINGS = 1e-6, 5.0
"""Weight that keeps every coefficient solvable, and how far a contour may well slide along itself."""
NEWTON_STEPS = 30
LONGEST_STEP_DECAYS, CONVERGED_DECAYS = 2.0, 0.02


@dataclass(frozen=True, slots=True, eq=False)
class EdgePoints:
    """The points on the surface near an edge, and how many there should be.

    Parameters
    ----------
    s_mm, depth_mm
        (n,) arc length, rising, and depth into the material from the curve as it is.
    rim_mm
        (n,) mean depth of the rim there.
    stations_mm, per_mm
        (k,) arc lengths, and the points per mm of depth that the interior's density puts on the stretch of contour
        about each; 0 where the scan shows no edge.
    spacing_mm, noise_mm
        Point spacing, and standard deviation of a point.
    """

    s_mm: FloatArray
    depth_mm: FloatArray
    rim_mm: FloatArray
    stations_mm: FloatArray
    per_mm: FloatArray
    spacing_mm: float
    noise_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class EdgeFit:
    """A displacement field.

    Parameters
    ----------
    coefficients
        (2 K,) see `in_surface`.
    information
        (2 K, 2 K) inverse of their covariance.
    stiffness
        Weight of the roughness.
    decay_mm
        tau of the last stage.
    rim_density
        r.
    halves
        Coefficients found from the even and from the odd points alone.
    """

    coefficients: FloatArray
    information: FloatArray
    stiffness: float
    decay_mm: float
    rim_density: float
    halves: tuple[FloatArray, FloatArray]

    def uncertainty_mm(self, rows: LocalRows) -> FloatArray:
        """Return the standard uncertainty of w . B for n rows: of the points' scatter and of their density."""
        dense = rows.dense()
        spread = np.einsum("ij,ji->i", dense, cho_solve(cho_factor(self.information), dense.T))
        # Where few points lie within tau, the logarithm of their moment has a longer tail than its curvature says.
        spread = spread * (1.0 + spread / self.decay_mm**2)
        return np.asarray(np.sqrt(spread + (DENSITY_DOUBT * self.decay_mm) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class _Stage:
    """What one stage looks at: its points, their rows and depths behind the rigid pose, tau, strays, and eta."""

    rows: LocalRows
    depth_mm: FloatArray
    expected: FloatArray
    space: InSurface
    points: EdgePoints
    decay_mm: float
    stray: float
    weight: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class _Solution:
    coefficients: FloatArray
    information: FloatArray
    stiffness: float
    cost: float


def moment(x_mm: FloatArray, decay_mm: float) -> FloatArray:
    """Return psi(x) = exp(-x / tau), held at exp(CAP) outside of the edge."""
    psi: FloatArray = np.exp(np.minimum(-x_mm / decay_mm, CAP))
    return psi


def fit_to_edge(space: InSurface, points: EdgePoints, *, rough: bool = False) -> EdgeFit:
    """Find the displacement field of a contour.

    Parameters
    ----------
    space
        The displacements to choose from.
    points
        What the scan shows near the edge.
    rough
        True to leave out the last stage.
    """
    rows, before = space.rows(points.s_mm), space.moved_inward_mm(points.s_mm)
    depth, expected = points.depth_mm + before, space.rows(points.stations_mm).summed(points.per_mm)
    shown, total = space.rows(points.stations_mm[points.per_mm > 0.0]), float(points.per_mm.sum())
    c, ratio = _near_rim(rows, points.rim_mm + before, space, points), 1.0
    stiffness, first = None, STIFFNESS * space.curve.length_mm / 1e3
    decays = DECAYS_SPACINGS[:-1] if rough else DECAYS_SPACINGS
    for number, decay in enumerate(decays):
        tau = max(decay * points.spacing_mm, LEAST_DECAY_NOISE * points.noise_mm)
        behind = depth - rows.times(c)
        near = (behind > -BEFORE_EDGE_DECAYS * tau) & (behind < BEHIND_EDGE_DECAYS * tau)
        stray = _stray_density(behind, points, total)
        stage = _Stage(rows.taken(near), depth[near], expected, space, points, tau, stray)
        c = _newton(stage, ratio, c, stiffness or first).coefficients
        stage = replace(stage, weight=_weight(stage, c))
        # A stage between the first and the last only brings the points nearer.
        settles = number in (0, len(decays) - 1)
        found = _likeliest(stage, ratio, c) if settles else _newton(stage, ratio, c, stiffness or first)
        c, stiffness = found.coefficients, found.stiffness
        # Half of the points find the edge with twice the variance.
        blur = float(np.sqrt(points.noise_mm**2 + 2.0 * _mean_variance(found, shown)))
        for _ in range(RIM_ROUNDS if number else 0):
            behind, halves = _halves(stage, ratio, found)
            ratio = _rim_density(behind, blur, tau, points, total)
    found = _newton(stage, ratio, c, found.stiffness)
    return EdgeFit(found.coefficients, found.information, found.stiffness, tau, ratio, halves)


def _near_rim(rows: LocalRows, rim_mm: FloatArray, space: InSurface, points: EdgePoints) -> FloatArray:
    """Return the coefficients of a field that runs along the scan's rim."""
    hold = _hold(space, points)
    stiffness = FIRST_STIFFNESS * space.curve.length_mm / 1e3 / points.spacing_mm**2
    A = rows.gram(np.ones(len(rim_mm)) / points.spacing_mm**2) + stiffness * space.rough + np.diag(hold)
    return np.asarray(cho_solve(cho_factor(A), rows.summed(rim_mm / points.spacing_mm**2) + hold * space.moved))


def _hold(space: InSurface, points: EdgePoints) -> FloatArray:
    """Return the weight that holds each coefficient where the curve is: sliding along it, which the edge lets go."""
    return np.asarray(RIDGE + space.slides / (SLIDE_SPACINGS * points.spacing_mm) ** 2)


def _stray_density(behind_mm: FloatArray, points: EdgePoints, total: float) -> float:
    """Return the density of points outside of the edge over that of the interior."""
    first, last = np.array(STRAY_ZONE_SPACINGS) * points.spacing_mm
    high = min(float(last), -STRAY_ZONE_NOISE * points.noise_mm)
    low = high + float(first - last)
    return int(np.count_nonzero((behind_mm > low) & (behind_mm < high))) / max(total * (high - low), 1.0)


def _mean_variance(solution: _Solution, rows: LocalRows) -> float:
    """Return the mean variance of w . B over n rows."""
    dense = rows.dense()
    spread = cho_solve(cho_factor(solution.information), dense.T @ dense)
    return float(np.trace(spread)) / max(len(dense), 1)


def _rim_density(behind_mm: FloatArray, blur_mm: float, tau: float, points: EdgePoints, total: float) -> float:
    """Return the density just behind the edge over that of the interior, weighted as the moment weighs it.

    Scanners that thin their points to one per voxel leave up to twice the density at the rim, because a voxel that the
    edge cuts keeps its point too. Taken for the interior's density this would put the edge outside of the material.
    The depth of each point is blurred by its noise and the edge's: fewer are seen close behind it than lie there.
    """
    first, last = np.array(RIM_ZONE_SPACINGS) * points.spacing_mm
    low = max(first, RIM_ZONE_NOISE * points.noise_mm)
    depth = low + (last - first) * RIM_ZONE_NODES
    inside = behind_mm[(behind_mm > low) & (behind_mm < depth[-1])]
    would_be = total * trapezoid(np.exp(-depth / tau) * ndtr(depth / max(blur_mm, 1e-9)), depth)
    return float(np.clip(np.exp(-inside / tau).sum() / would_be, *RIM_DENSITY)) if would_be > 0.0 else 1.0


def _weight(stage: _Stage, c: FloatArray) -> float:
    """Return the curvature of the equations over their scatter, for points that lie at random."""
    psi = moment(stage.depth_mm - stage.rows.times(c), stage.decay_mm)
    at_random = float(2.0 * np.exp(-1.5 * (stage.points.noise_mm / stage.decay_mm) ** 2))
    return min(at_random, float(psi[psi < np.exp(CAP)].sum() / max(float((psi * psi).sum()), 1e-12)))


def _halves(stage: _Stage, ratio: float, whole: _Solution) -> tuple[FloatArray, tuple[FloatArray, FloatArray]]:
    """Fit the even and the odd points alone.

    Returns
    -------
    behind_mm
        (n,) depth of each point behind the edge that the *other* half found: free of what a point does to its own fit.
    halves
        Coefficients of the two fits.
    """
    even = np.arange(len(stage.depth_mm)) % 2 == 0
    behind, found = np.empty(len(even)), []
    for half in (even, ~even):
        part = replace(stage, rows=stage.rows.taken(half), depth_mm=stage.depth_mm[half], expected=0.5 * stage.expected)
        found.append(_newton(part, ratio, whole.coefficients, whole.stiffness).coefficients)
        behind[~half] = stage.depth_mm[~half] - stage.rows.taken(~half).times(found[-1])
    return behind, (found[0], found[1])


def _likeliest(stage: _Stage, ratio: float, start: FloatArray) -> _Solution:
    """Return the field of the most likely stiffness."""
    tried: dict[float, _Solution] = {}
    last = start

    def evidence(stiffness: float) -> float:
        nonlocal last
        tried[stiffness] = solution = _newton(stage, ratio, last, stiffness)
        last = solution.coefficients
        half_determinant = float(np.sum(np.log(np.diag(cho_factor(solution.information)[0]))))
        usual = LARGE / DISPLACEMENT_SHARE / np.sqrt(stage.space.curve.length_mm)
        prior = float(np.log(RARE) / usual / np.sqrt(stiffness))
        free = float(0.5 * stage.space.bends * np.log(stiffness))
        return float(free + prior - solution.cost - half_determinant)

    return tried[most_likely(evidence, least=LEAST_STIFFNESS, unit=stage.space.curve.length_mm / 1e3)]


def _newton(stage: _Stage, ratio: float, start: FloatArray, stiffness: float) -> _Solution:
    tau, sigma = stage.decay_mm, stage.points.noise_mm
    eta = stage.weight
    strays = stage.stray * (np.exp(CAP) - 1.0 + (BEFORE_EDGE_DECAYS - CAP) * np.exp(CAP))
    wanted = (ratio * np.exp(0.5 * (sigma / tau) ** 2) + strays) * stage.expected
    rows, c, rough, moved = stage.rows, start, stage.space.rough, stage.space.moved
    hold = _hold(stage.space, stage.points)
    for _ in range(NEWTON_STEPS):
        psi = moment(stage.depth_mm - rows.times(c), tau)
        bend = np.where(psi < np.exp(CAP), psi, 0.0)
        slope = eta * (rows.summed(psi) / tau - wanted) + stiffness * (rough @ c) + hold * (c - moved)
        H = eta / tau**2 * rows.gram(bend) + stiffness * rough + np.diag(hold)
        step = cho_solve(cho_factor(H), slope)
        size = float(np.abs(step).max())
        c = c - step * min(1.0, LONGEST_STEP_DECAYS * tau / max(size, 1e-12))
        if size < CONVERGED_DECAYS * tau:
            break
    x = stage.depth_mm - rows.times(c)
    psi = moment(x, tau)
    beyond = np.where(psi < np.exp(CAP), 0.0, np.exp(CAP) * (-x / tau - CAP))
    cost = eta * (float((psi + beyond).sum()) - float(wanted @ c)) + 0.5 * float(hold @ (c - moved) ** 2)
    cost += 0.5 * stiffness * float(c @ rough @ c)
    return _Solution(c, H, stiffness, cost)
