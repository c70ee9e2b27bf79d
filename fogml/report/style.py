"""Colours, markers, axes and regimes of every figure: told apart without colour as well."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike, NDArray
from plotly.subplots import make_subplots

from fogml.numerals import power_of_ten, short
from fogml.signals.drawn import gap_starts

# Okabe and Ito's palette, distinct under the common colour deficiencies
# (M. Okabe and K. Ito, "Color Universal Design", 2008).
BLACK = "#000000"
ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#8A9099"

# What a thing is drawn in, the same on every page.
BEFORE = "#3B4048"
AFTER = GREEN
MODEL = VERMILION
FLOOR = BLACK
TRAINING = "#9AA1AA"
WARMING = VERMILION
COOLING = BLUE
STEADY = GREY

SERIES = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY_BLUE, BLACK)
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot", "solid")
MARKERS = ("circle", "diamond-open", "triangle-up", "square-open", "cross", "x", "star-open")

# Pale tints for bands behind curves; each band also bears its name where it is wide enough.
REGIME_TINTS = {
    "start_up": "rgba(240, 228, 66, 0.28)",
    "ramp_up": "rgba(213, 94, 0, 0.13)",
    "ramp_down": "rgba(0, 114, 178, 0.13)",
    "soak": "rgba(0, 0, 0, 0.00)",
    "after_ramp": "rgba(0, 158, 115, 0.13)",
    "turning": "rgba(204, 121, 167, 0.30)",
}
REGIME_WORDS = {
    "start_up": "start-up",
    "ramp_up": "ramp up",
    "ramp_down": "ramp down",
    "soak": "soak",
    "after_ramp": "after a ramp",
    "turning": "turning",
}

FLOOR_LINE = {"color": FLOOR, "width": 1.2, "dash": "dash"}
SILENT: dict[str, Any] = {"showlegend": False, "hoverinfo": "skip"}
"""Of a trace that neither the legend nor the pointer names."""

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', Arial, sans-serif"
_GRID = "#E4E7EB"
_AXIS_LINE = "#9AA1AA"


def _axis() -> dict[str, Any]:
    return {
        "showgrid": True,
        "gridcolor": _GRID,
        "linecolor": _AXIS_LINE,
        "showline": True,
        "mirror": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": _AXIS_LINE,
        "zeroline": False,
        "automargin": True,
        "title": {"standoff": 8},
        "exponentformat": "power",  # plotly's own prefixes (k, B for 10⁹, µ) read as part of the unit
        "minexponent": 5,
    }


TEMPLATE = go.layout.Template(
    layout={
        "font": {"family": FONT, "size": 13, "color": "#1F2328"},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "colorway": list(SERIES),
        "xaxis": _axis(),
        "yaxis": _axis(),
        "margin": {"l": 64, "r": 16, "t": 34, "b": 48},
        "legend": {
            "orientation": "h",
            "x": 0.0,
            "xanchor": "left",
            "y": 1.02,
            "yanchor": "bottom",
            "traceorder": "normal",
            "itemwidth": 40,
        },
        "hoverlabel": {"font": {"family": FONT, "size": 12}},
        "separators": ".\u202f",
    }
)


def floor_in_legend() -> go.Scatter:
    """A trace without points that gives the floor's line a place in the legend."""
    return go.Scatter(x=[None], y=[None], mode="lines", name="noise floor", line=FLOOR_LINE)


def line(
    x: Any, y: Any, name: str | None, colour: str, width: float, dash: str | None = None, **more: Any
) -> go.Scatter:
    """A curve of so many px; `more` properties of a trace as plotly has them."""
    looks = {"color": colour, "width": width, "dash": dash}
    return go.Scatter(x=x, y=y, name=name, line=looks, **{"mode": "lines", **more})


def band(x: Any, y: Any, name: str, tint: str) -> go.Scatter:
    """What lies within an outline, tinted."""
    return line(x, y, name, tint, 0, fill="toself", fillcolor=tint, hoverinfo="skip")


def points(
    x: Any,
    y: Any,
    name: str | None,
    colour: str,
    symbol: str = "circle",
    size: float = 9,
    edge: float | None = None,
    **more: Any,
) -> go.Scatter:
    """Markers of so many px, with an edge of so many; `more` properties of a trace as plotly has them."""
    looks = {"color": colour, "symbol": symbol, "size": size, "line": edge and {"width": edge}}
    return go.Scatter(x=x, y=y, name=name, marker=looks, **{"mode": "markers", **more})


def grouped(name: str, shown: bool) -> dict[str, Any]:
    """Of a trace in several panels: it stands in the legend once, where it is shown there."""
    return {"legendgroup": name, "showlegend": shown}


def floor_lines(figure: go.Figure, floor: float, row: int, column: int = 1) -> None:
    """Draw the noise floor on either side of zero into a panel."""
    for value in (floor, -floor):
        figure.add_hline(y=value, row=row, col=column, line=FLOOR_LINE)


def ring(x: Any, y: Any, name: str | None, size: int, **more: Any) -> go.Scatter:
    """What sets points off from others, of so many px."""
    return points(x, y, name, VERMILION, "circle-open", size, 2.5, **more)


def error_bars(
    middle: Sequence[float | None], ends: Sequence[Sequence[float | None]], **looks: Any
) -> dict[str, Any]:
    """Bars from the lower to the upper end of each interval about its middle; `looks` as plotly has them."""

    def arm(low: float | None, high: float | None) -> float:
        return 0.0 if low is None or high is None else max(high - low, 0.0)

    below = [arm(low, value) for value, (low, _) in zip(middle, ends, strict=True)]
    above = [arm(value, high) for value, (_, high) in zip(middle, ends, strict=True)]
    return {"type": "data", "symmetric": False, "array": above, "arrayminus": below, **looks}


def stacked(panels: Mapping[str, float], across: str, spacing: float, **looks: Any) -> go.Figure:
    """A figure of panels one below the other over the same axis.

    Panels by their titles, with their heights to each other; `looks` of the titles' axes as plotly has them.
    """
    heights = list(panels.values())
    figure = make_subplots(len(panels), 1, shared_xaxes=True, vertical_spacing=spacing, row_heights=heights)
    for row, title in enumerate(panels, start=1):
        figure.update_yaxes(title_text=title, row=row, col=1, **looks)
    return figure.update_xaxes(title_text=across, row=len(panels), col=1)


def styled(figure: go.Figure, height: int, **layout: Any) -> go.Figure:
    """Put the house style on a figure, with its height in px and further layout settings.

    A legend that reaches below the tools at the figure's upper right stands lower than these.
    """
    figure.update_layout(template=TEMPLATE, height=height, **layout)
    figure.update_traces(name="", selector={"name": None})  # else it is called "trace 0"
    shown = [trace.name for trace in figure.data if trace.name and trace.showlegend is not False]
    if "margin" not in layout and sum(_LEGEND_ITEM + len(name) for name in shown) > _BESIDE_TOOLS:
        figure.update_layout(margin={"t": 68}, height=height + 34)
    return figure


_LEGEND_ITEM = 8  # what an item of a legend takes beside its name [characters]
_BESIDE_TOOLS = 115
"""Characters of a legend beside the tools, in a figure as wide as a page."""


_LEAST_TICKS = 3
_MULTIPLES: tuple[tuple[float, ...], ...] = (
    (1,),
    (1, 2, 5),
    (1, 1.5, 2, 3, 4, 5, 6, 8),
    (1, 1.2, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6, 6.5, 7, 7.5, 8, 8.5, 9, 9.5),
    tuple(tenth / 10 for tenth in range(10, 100)),
)


def time_unit(span_s: float) -> tuple[float, str]:
    """Seconds per unit, and the unit, in which a time axis of this span [s] reads best."""
    if span_s > 6.0 * 86400.0:
        return 86400.0, "d"
    if span_s > 3.0 * 3600.0:
        return 3600.0, "h"
    if span_s > 300.0:
        return 60.0, "min"
    return 1.0, "s"


def rounded_up(value: float) -> float:
    """The next of 1, 2 and 5 times a power of ten at or above a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    steps = (m * power for m in (1, 2, 5, 10))
    return float(f"{next(s for s in steps if s >= value * (1 - 1e-9)):.6g}")


def log_axis(*values: float, room: float = 0.06) -> dict[str, Any]:
    """Settings of a logarithmic axis that holds all positive values.

    Ticks are plain round numbers, as few as tell the scale: powers of ten, or 1, 2 and 5 times
    these, or finer. ``room`` is left on either side, as a share of the axis.
    """
    positive = [value for value in values if 0.0 < value < math.inf] or [1.0]
    ends = math.log10(min(positive)), math.log10(max(positive))
    margin = room * max(ends[1] - ends[0], 0.5)
    # No tick is beyond what a number can be.
    start, stop = max(ends[0] - margin, -307.0), min(ends[1] + margin, 307.0)
    for multiples in _MULTIPLES:
        ticks = [
            float(f"{m}e{power}")
            for power in range(math.floor(start), math.ceil(stop) + 1)
            for m in multiples
            if start <= math.log10(m) + power <= stop
        ]
        if len(ticks) >= _LEAST_TICKS:
            break
    return {
        "type": "log",
        "range": [start, stop],
        "tickmode": "array",
        "tickvals": ticks,
        "ticktext": [_plain(value) for value in ticks],
        "minor": {"showgrid": multiples == (1,), "gridcolor": "#F1F3F5", "dtick": "D1"},
    }


def _plain(value: float) -> str:
    power = math.floor(math.log10(value) + 1e-9)
    if -4 <= power <= 4:
        return np.format_float_positional(value, trim="-")
    mantissa = f"{short(value / 10.0**power, 2)}·"
    return f"{'' if mantissa == '1·' else mantissa}{power_of_ten(power)}"


Segment = tuple[str, float, float]
"""Name of the regime, and where it starts and stops on the time axis."""

_LEAST_SHARE = 0.002
_LEAST_SHARE_NAMED = 0.075
_MOST_BANDS = 200


def segments_of(time: ArrayLike, regime: NDArray[np.str_]) -> list[Segment]:
    """Stretches of one regime from times and names of shape (n,), which must not be empty.

    Bands meet halfway between the samples on either side of a change, and stop at gaps.
    """
    time = np.asarray(time, dtype=np.float64)
    gaps = gap_starts(time)
    starts = np.union1d(np.flatnonzero(regime[1:] != regime[:-1]) + 1, gaps).astype(np.intp)
    broken = np.isin(starts, gaps)
    halfway = 0.5 * (time[starts - 1] + time[starts])
    begins = np.concatenate([time[:1], np.where(broken, time[starts], halfway)])
    ends = np.concatenate([np.where(broken, time[starts - 1], halfway), time[-1:]])
    names = regime[np.concatenate([[0], starts]).astype(np.intp)]
    return [(str(name), float(a), float(b)) for name, a, b in zip(names, begins, ends, strict=True)]


def shade(figure: go.Figure, segments: Sequence[Segment]) -> list[str]:
    """Draw bands over the whole height of a figure; the names of the regimes that were drawn.

    Bands too narrow to be seen are left out, and of very many only the widest are drawn, so
    that the figure stays quick.
    """
    if not segments:
        return []
    whole = segments[-1][2] - segments[0][1]
    seen = [s for s in segments if s[2] - s[1] >= _LEAST_SHARE * whole]
    if len(seen) > _MOST_BANDS:
        widest = sorted(seen, key=lambda s: s[1] - s[2])[:_MOST_BANDS]
        seen = sorted(widest, key=lambda s: s[1])
    shapes: list[Any] = [*figure.layout.shapes]
    words: list[Any] = [*figure.layout.annotations]
    for name, start, stop in seen:
        band = {"type": "rect", "layer": "below", "line": {"width": 0}, "xref": "x", "yref": "paper"}
        tint = REGIME_TINTS.get(name, "rgba(0, 0, 0, 0.08)")
        shapes.append({**band, "fillcolor": tint, "x0": start, "x1": stop, "y0": 0, "y1": 1})
        if stop - start >= _LEAST_SHARE_NAMED * whole:
            place = {"xref": "x", "yref": "paper", "x": 0.5 * (start + stop), "y": 1.0, "yanchor": "bottom"}
            font = {"size": 11, "color": "#57606A"}
            words.append({"text": regime_word(name), "showarrow": False, "font": font, **place})
    # All at once: plotly checks all that is there again with each one added.
    figure.update_layout(shapes=shapes, annotations=words)
    return in_order(name for name, _, _ in seen)


def regime_word(name: str) -> str:
    """The name of a regime in words."""
    return REGIME_WORDS.get(name, name.replace("_", " "))


def in_order(names: Iterable[str]) -> list[str]:
    """Regimes without repeats, in the order in which pages list them."""
    given = set(names)
    return [name for name in REGIME_WORDS if name in given] + sorted(given - set(REGIME_WORDS))
