"""Curves over the arc length of a contour: error before and after, the stated uncertainty, and what was corrected."""

from __future__ import annotations

from collections.abc import Callable

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Patch

from sicp_cam.model import FloatArray
from sicp_cam.registration.result import RegisteredContour
from sicp_cam.report.lettering import STYLE, png
from sicp_cam.report.result_tables import FIT, METHODS
from sicp_cam.report.statistics import BAND, both
from sicp_cam.report.stretches import clipped, marked

__all__ = [
    "BAND_MEANS",
    "SEGMENT_STEPS",
    "correction_along_contour",
    "error_along_contour",
    "uncertainty_along_contour",
]

BAND_MEANS = (
    f"Band: {BAND} stated standard uncertainties to either side of the corrected contour (zero line), in gaps too: "
    "95 % of the true edge should lie in it."
)
"""What the band is. It lies about the contour, not about the residual, which is taken from few points and scatters."""

SEGMENT_STEPS = (
    "Each segment moves as one rigid body and goes over to the next at their border: steps or a sawtooth with the "
    "spacing of the ticks are these changes."
)
"""What the steps of the correction are; true for a contour without segments too, which has neither."""

BEFORE, AFTER, GAP, SURE = "#c8782c", "#1f4fa3", "#f3d9dc", "#a9c3ea"
INTO, OUT, TURN = "#2f7d4f", "#7a3f98", "#444444"
NORMAL, OUT_OF = "normal (across the edge)", "out (of the surface)"
_BAND_KEY = ("95 % band of the corrected contour", SURE)


def error_along_contour(contour: RegisteredContour, method: str, tolerance_mm: float | None = None) -> bytes:
    """Return the PNG of the residuals over arc length, rigid against the method (the paper's figure 10).

    Three panels: the distance across the contour, then its parts across the edge and out of the surface. Stretches that
    the scan does not show are shaded and have no curve; subdivision points are ticks at the top. The two parts have the
    95 % band of the corrected contour, if it states its uncertainty.

    Parameters
    ----------
    contour
        The registered contour.
    method
        Name of the method that `contour.after` belongs to; with `rigid` there is one curve only.
    tolerance_mm
        Drawn as a dashed line, if given.
    """
    titles = (
        "both = sqrt(normal² + out²)\n/ mm",
        f"{NORMAL}\n+ into the material / mm",
        f"{OUT_OF}\n+ outward / mm",
    )
    before = (both(contour.before), contour.before.normal_mm, contour.before.out_mm)
    after = (both(contour.after), contour.after.normal_mm, contour.after.out_mm)

    def draw(axes: list[Axes]) -> None:
        for index, (panel, title) in enumerate(zip(axes, titles, strict=True)):
            _curve(panel, contour, np.where(contour.covered, before[index], np.nan), BEFORE)
            if method != "rigid":
                _curve(panel, contour, np.where(contour.covered, after[index], np.nan), AFTER)
            _tolerance(panel, tolerance_mm, both_signs=index > 0)
            panel.set_ylabel(title)
        _band(axes[1], contour, contour.normal_u_mm)
        _band(axes[2], contour, contour.out_u_mm)
        axes[0].set_ylim(bottom=0.0)

    keys = [("rigid ICP", BEFORE)] + ([(METHODS.get(method, method), AFTER)] if method != "rigid" else [])
    keys += [_BAND_KEY] if contour.normal_u_mm is not None else []
    return _figure(f"Contour {contour.number}: distance to the scan along the contour", contour, 3, draw, keys, FIT)


def uncertainty_along_contour(contour: RegisteredContour, method: str) -> bytes:
    """Return the PNG of the method's residuals with the 95 % band of the contour, on the scale of the band.

    Two panels: across the edge and out of the surface. The band is drawn through the stretches that the scan does not
    show too; they are shaded and have no curve.

    Parameters
    ----------
    contour
        A registered contour that states its uncertainty.
    method
        Name of the method that `contour.after` belongs to.
    """
    parts = (
        (f"{NORMAL}\n+ into the material / mm", contour.after.normal_mm, contour.normal_u_mm),
        (f"{OUT_OF}\n+ outward / mm", contour.after.out_mm, contour.out_u_mm),
    )

    def draw(axes: list[Axes]) -> None:
        for panel, (title, residual, u_mm) in zip(axes, parts, strict=True):
            _band(panel, contour, u_mm)
            _curve(panel, contour, np.where(contour.covered, residual, np.nan), AFTER)
            panel.axhline(0.0, color="#808080", lw=0.8)
            panel.set_ylabel(title)

    keys = [(METHODS.get(method, method), AFTER), _BAND_KEY]
    return _figure(f"Contour {contour.number}: how sure the corrected contour is", contour, 2, draw, keys, BAND_MEANS)


def correction_along_contour(contour: RegisteredContour) -> bytes:
    """Return the PNG of the correction beyond the rigid pose over arc length: shift along normal and out, and turn."""
    shift = contour.corrected.points_mm - contour.rigid.points_mm
    into = np.sum(shift * contour.rigid.inward, axis=1)
    out = np.sum(shift * contour.rigid.outward, axis=1)
    sine = np.linalg.norm(np.cross(contour.rigid.outward, contour.corrected.outward), axis=1)
    turn = np.degrees(np.arctan2(sine, np.sum(contour.rigid.outward * contour.corrected.outward, axis=1)))

    def draw(axes: list[Axes]) -> None:
        _curve(axes[0], contour, into, INTO)
        _curve(axes[0], contour, out, OUT)
        axes[0].set_ylabel("shift / mm")
        _curve(axes[1], contour, turn, TURN)
        axes[1].set_ylabel("turn of the direction out / deg")
        axes[1].set_ylim(bottom=0.0)

    keys = [
        (f"{NORMAL}, + into the material", INTO),
        (f"{OUT_OF}, + outward", OUT),
        ("turn of the direction out", TURN),
    ]
    title = f"Contour {contour.number}: correction of the path beyond the rigid pose"
    return _figure(title, contour, 2, draw, keys, SEGMENT_STEPS if len(contour.split_s_mm) else "")


def _figure(
    title: str,
    contour: RegisteredContour,
    panels: int,
    draw: Callable[[list[Axes]], None],
    keys: list[tuple[str, str]],
    note: str,
) -> bytes:
    with matplotlib.style.context(list(STYLE)):
        figure = Figure(
            figsize=(16, 2.9 + 2.8 * panels),
            dpi=100,
            facecolor="white",
            layout=ConstrainedLayoutEngine(w_pad=0.15, h_pad=0.08),
        )
        canvas = FigureCanvasAgg(figure)
        axes = list(figure.subplots(panels, 1, sharex=True))
        draw(axes)
        gaps = _shade(axes, contour)
        _splits(axes[0], contour)
        axes[-1].set_xlabel("arc length on the nominal contour / mm")
        axes[-1].set_xlim(0.0, contour.nominal.length_mm)
        figure.suptitle(title, fontsize=18, weight="bold", x=0.02, ha="left", parse_math=False)
        handles = [Patch(color=colour, label=text) for text, colour in keys]
        if gaps:
            handles.append(Patch(color=GAP, label="not seen by the scan"))
        figure.legend(
            handles=handles,
            loc="outside lower left",
            ncols=4,
            frameon=False,
            fontsize=13,
            title=note,
            title_fontsize=12,
            alignment="left",
        )
        return png(canvas)


def _curve(panel: Axes, contour: RegisteredContour, values: FloatArray, colour: str) -> None:
    """Draw a value per station, with a break where it is NaN, and a loop closed over its seam."""
    panel.plot(*_round_the_seam(contour, values), color=colour, lw=1.4)


def _band(panel: Axes, contour: RegisteredContour, u_mm: FloatArray | None) -> None:
    """Fill what lies within 95 % of the zero line, above the shade of the gaps and below the curves."""
    if u_mm is not None:
        s, half = _round_the_seam(contour, BAND * u_mm)
        panel.fill_between(s, -half, half, color=SURE, lw=0, zorder=0.8)


def _round_the_seam(contour: RegisteredContour, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return arc lengths and values of the stations; those of a loop end where they began."""
    s = contour.nominal.s_mm
    if not contour.nominal.closed:
        return s, values
    return np.append(s, contour.nominal.length_mm), np.append(values, values[0])


def _tolerance(panel: Axes, tolerance_mm: float | None, *, both_signs: bool) -> None:
    """Draw the tolerance where it lies within the curves' range: it must not squeeze them flat."""
    if both_signs:
        panel.axhline(0.0, color="#808080", lw=0.8)
    if tolerance_mm is None:
        return
    for value in (tolerance_mm, -tolerance_mm) if both_signs else (tolerance_mm,):
        low, high = panel.get_ylim()
        if low <= value <= high:
            panel.axhline(value, color="#606060", lw=1.0, ls="--")
            panel.annotate(
                f"tolerance {value:g}",
                (1.0, value),
                xycoords=("axes fraction", "data"),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
                fontsize=10,
                color="#606060",
            )


def _shade(axes: list[Axes], contour: RegisteredContour) -> bool:
    gaps = marked(contour.nominal, ~contour.covered)
    for gap in gaps:
        for start, end in clipped(gap, contour.nominal.length_mm):
            for panel in axes:
                panel.axvspan(start, end, color=GAP, lw=0, zorder=0.5)
    return bool(gaps)


def _splits(panel: Axes, contour: RegisteredContour) -> None:
    if len(contour.split_s_mm) == 0:
        return
    top = panel.secondary_xaxis("top")
    top.set_zorder(3)
    top.set_xticks(contour.split_s_mm.tolist(), labels=["" for _ in contour.split_s_mm])
    top.tick_params(length=9, width=1.5, direction="in")
    top.set_xlabel("ticks: borders of the segments", fontsize=11)
