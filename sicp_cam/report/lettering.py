"""Words on a rendered picture: title, legend, colour bar, scale bar and numbered labels."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib.style
import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sicp_cam.model import FloatArray
from sicp_cam.report.camera import Camera, pixels
from sicp_cam.report.typeface import literal

__all__ = ["STYLE", "ColourBar", "Key", "Label", "Lettering", "lettered", "png"]

STYLE = ("default", {"font.size": 11.0, "font.family": "DejaVu Sans", "axes.grid": True, "grid.color": "#e4e4e4"})
"""Drawn in this style, whatever the user's own matplotlib settings are: same input, same picture."""

_DPI = 100
_HEAD_PX = 108
_FOOT_PX = 112


@dataclass(frozen=True, slots=True)
class Key:
    """An entry of the legend: a line (marker "-"), a dotted line (":") or a matplotlib marker in a colour."""

    text: str
    colour: str
    marker: str = "-"


@dataclass(frozen=True, slots=True)
class ColourBar:
    """Steps of colour: n + 1 rising limits, n colours between them, and the two beyond the ends."""

    limits: tuple[float, ...]
    colours: tuple[str, ...]
    below: str
    above: str
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class Label:
    """A short text at one of several possible (c, 3) places, the first free one of which is taken."""

    text: str
    places_mm: FloatArray
    colour: str = "#1a1a1a"


@dataclass(frozen=True, slots=True)
class Lettering:
    """All words of one picture; an empty text or sequence leaves its part out."""

    title: str = ""
    subtitle: str = ""
    keys: tuple[Key, ...] = ()
    colour_bar: ColourBar | None = None
    labels: tuple[Label, ...] = ()


def lettered(picture: npt.NDArray[np.uint8], camera: Camera, words: Lettering) -> bytes:
    """Return the (height, width, 3) picture as a PNG file with a head and a foot for the words.

    Texts are drawn literally: no markup or formula is read from them.
    """
    height, width = picture.shape[:2]
    with matplotlib.style.context(list(STYLE)):
        figure = Figure(figsize=(width / _DPI, (height + _HEAD_PX + _FOOT_PX) / _DPI), dpi=_DPI, facecolor="white")
        canvas = FigureCanvasAgg(figure)
        figure.figimage(np.flipud(picture), xo=0, yo=_FOOT_PX, origin="lower")
        tall = height + _HEAD_PX + _FOOT_PX
        title, subtitle = literal(words.title, 90), literal(words.subtitle, 160)
        left = 40 / width
        figure.text(left, 1 - 42 / tall, title, fontsize=19, weight="bold", va="center", parse_math=False)
        figure.text(left, 1 - 82 / tall, subtitle, fontsize=13, va="center", color="#404040", parse_math=False)
        _scale_bar(figure, camera, tall)
        if words.colour_bar is not None:
            _colour_bar(figure, words.colour_bar, width, tall)
        _legend(figure, words.keys, words.colour_bar is not None)
        _labels(figure, camera, words.labels, tall)
        return png(canvas)


def png(canvas: FigureCanvasAgg) -> bytes:
    """Return the figure of a canvas as a PNG file that names neither program nor date."""
    file = io.BytesIO()
    canvas.figure.savefig(file, format="png", dpi="figure", metadata={"Software": None})
    return file.getvalue()


def _legend(figure: Figure, keys: Sequence[Key], beside_colour_bar: bool) -> None:
    if not keys:
        return
    handles = [
        Line2D([], [], color=k.colour, lw=5, ls=k.marker, label=literal(k.text, 60))
        if k.marker in ("-", ":")
        else Line2D([], [], color=k.colour, marker=k.marker, ms=12, ls="none", label=literal(k.text, 60))
        for k in keys
    ]
    legend = figure.legend(
        handles=handles,
        loc="lower right" if beside_colour_bar else "lower left",
        bbox_to_anchor=(0.985 if beside_colour_bar else 0.2, 0.015),
        ncols=1 if beside_colour_bar else min(len(keys), 3),
        fontsize=13,
        frameon=False,
        columnspacing=2.0,
        borderaxespad=0.0,
    )
    for text in legend.get_texts():
        text.set_parse_math(False)


def _colour_bar(figure: Figure, bar: ColourBar, width: int, tall: int) -> None:
    axes = figure.add_axes((320 / width, 66 / tall, 760 / width, 24 / tall))
    colours = ListedColormap(list(bar.colours)).with_extremes(under=bar.below, over=bar.above)
    drawn = figure.colorbar(
        ScalarMappable(BoundaryNorm(list(bar.limits), len(bar.colours)), colours),
        cax=axes,
        orientation="horizontal",
        extend="both",
        ticks=list(bar.limits),
        format="%g",
    )
    drawn.ax.tick_params(labelsize=12)
    drawn.set_label(bar.text, fontsize=13)


def _scale_bar(figure: Figure, camera: Camera, tall: int) -> None:
    """Draw a bar of a round length that is about an eighth of the picture wide."""
    wanted = camera.mm_per_px * camera.width_px / 8
    power = 10.0 ** np.floor(np.log10(wanted))
    length = max(step * power for step in (1, 2, 5) if step * power <= wanted)
    left, right = 40, 40 + length / camera.mm_per_px
    y = 66 / tall
    figure.add_artist(Line2D([left / camera.width_px, right / camera.width_px], [y, y], color="#1a1a1a", lw=3))
    figure.text(left / camera.width_px, 38 / tall, f"{length:g} mm", fontsize=13, va="center")


def _labels(figure: Figure, camera: Camera, labels: Sequence[Label], tall: int) -> None:
    taken: list[FloatArray] = []
    for label in labels:
        places = pixels(camera, label.places_mm)
        half = np.array([14.0 + 6.0 * len(label.text), 18.0])
        limits = np.array([camera.width_px, camera.height_px])
        places = np.clip(places, half, limits - half)
        free = [p for p in places if all((np.abs(p - other[:2]) > half + other[2:]).any() for other in taken)]
        x, y = free[0] if free else places[0]
        taken.append(np.concatenate([[x, y], half]))
        figure.text(
            x / camera.width_px,
            (y + _FOOT_PX) / tall,
            literal(label.text, 20),
            fontsize=15,
            weight="bold",
            ha="center",
            va="center",
            color="white",
            bbox={"boxstyle": "round,pad=0.25", "facecolor": label.colour, "edgecolor": "white"},
            parse_math=False,
        )
