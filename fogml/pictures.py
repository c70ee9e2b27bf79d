"""A result at a glance: small figures as plain SVG, as Braille for terminals, and as a plotly figure.

Lines of SVG are for notebooks and for pages that must stay light.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from fogml.arrays import FloatArray
from fogml.escaping import figure_text, markup
from fogml.numerals import power_of_ten
from fogml.signals.drawn import drawn

_LEFT, _RIGHT, _TOP, _BOTTOM = 58.0, 8.0, 8.0, 34.0
_TITLE = 25.0
"""Width of the title of the upright axis with what is free about it."""
_WIDTHS = {"−": 8.8, "+": 8.8, ".": 3.4}
_DIGIT = 6.7
"""Widths of characters of a label of 10.5 px in DejaVu Sans, the widest of the fonts of pages."""
_LEGEND, _LEGEND_COLUMNS = 15.0, 3


@dataclass(frozen=True)
class Curve:
    """A curve, a NaN in every gap.

    ``x`` and ``y`` of shape (n,), the colour, and the SVG dash pattern (empty: solid). With a
    ``label`` it stands in the legend; ``dots`` marks its points.
    """

    x: FloatArray
    y: FloatArray
    colour: str
    dash: str = ""
    width: float = 1.1
    label: str = ""
    dots: bool = False


def ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Round numbers, steps of 1, 2 or 5 times a power of ten, within [low, high]."""
    if not high > low:
        return [low]
    raw = (high - low) / about
    power = 10.0 ** np.floor(np.log10(raw))
    step = float(power * next(m for m in (1, 2, 5, 10) if m * power >= raw * (1 - 1e-9)))
    first = np.ceil(low / step - 1e-9)
    if first + 1 > np.floor(high / step + 1e-9):
        # A single one tells no size.
        return ticks(low, high, 2 * about)
    return [float(f"{k * step:.12g}") + 0.0 for k in np.arange(first, np.floor(high / step + 1e-9) + 1)]


def line_figure(
    curves: Sequence[Curve],
    x_title: str,
    y_title: str,
    alt: str,
    width: int = 640,
    height: int = 190,
    log: str = "",
) -> Markup:
    """Curves on axes with ticks and titles, and a legend where curves have labels, as an ``svg`` element.

    Parameters
    ----------
    curves
        At least one, with finite values in at least one place.
    x_title, y_title
        Titles with their units.
    alt
        What the figure shows.
    width, height
        Size of the view box; the element takes the width it is given.
    log
        Axes that are logarithmic: ``""``, ``"x"``, ``"y"`` or ``"xy"``.
    """
    scale_x, scale_y = (np.log10 if axis in log else np.asarray for axis in "xy")
    x_span = _span([scale_x(c.x) for c in curves], 0.02 if any(c.dots for c in curves) else 0.0)
    y_span = _span([scale_y(c.y) for c in curves], 0.06)
    if "y" in log:
        # Less than a decade might have no tick, and a flat curve would not look flat.
        room = max(0.0, 0.5 * (1.0 - (y_span[1] - y_span[0])))
        y_span = y_span[0] - room, y_span[1] + room
    y_ticks = _labelled(_ticks_of(y_span, "y" in log, about=4))
    left = max(_LEFT, _TITLE + max(map(_width, y_ticks.values()), default=0.0))
    top = _TOP + _LEGEND * (1 + (sum(bool(c.label) for c in curves) - 1) // _LEGEND_COLUMNS)

    def across(x: FloatArray | float) -> FloatArray:
        return left + (scale_x(x) - x_span[0]) / (x_span[1] - x_span[0]) * (width - left - _RIGHT)

    def up(y: FloatArray | float) -> FloatArray:
        return (
            height - _BOTTOM - (scale_y(y) - y_span[0]) / (y_span[1] - y_span[0]) * (height - _BOTTOM - top)
        )

    parts = [_legend([c for c in curves if c.label], width)]
    for value, label in _labelled(_ticks_of(x_span, "x" in log, about=8)).items():
        x = f"{float(across(value)):.1f}"
        parts.append(f'<path d="M{x},{top}V{height - _BOTTOM}" stroke="#E4E7EB"/>')
        # A long label at the right edge would reach out of the picture.
        anchor = "end" if float(x) + 0.5 * _width(label) > width else "middle"
        at = f'x="{width if anchor == "end" else x}" y="{height - _BOTTOM + 13}" text-anchor="{anchor}"'
        parts.append(f"<text {at}>{label}</text>")
    for value, label in y_ticks.items():
        y = float(up(value))
        parts.append(f'<path d="M{left:.1f},{y:.1f}H{width - _RIGHT}" stroke="#E4E7EB"/>')
        parts.append(f'<text x="{left - 6:.1f}" y="{y + 3.5:.1f}" text-anchor="end">{label}</text>')
    for curve in curves:
        dash = f' stroke-dasharray="{curve.dash}"' if curve.dash else ""
        outline = _outline(across(curve.x), up(curve.y))
        parts.append(
            f'<path d="{outline}" fill="none" stroke="{curve.colour}" stroke-width="{curve.width}"{dash} '
            'stroke-linejoin="round"/>'
        )
        if curve.dots:
            parts += [
                f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.4" fill="{curve.colour}"/>'
                for x, y in zip(across(curve.x).tolist(), up(curve.y).tolist(), strict=True)
                if x == x and y == y
            ]
    frame_width, frame_height = width - left - _RIGHT, height - top - _BOTTOM
    middle = top + frame_height / 2
    return Markup(
        f'<svg role="img" aria-label="{markup(alt)}" viewBox="0 0 {width} {height}" '
        'xmlns="http://www.w3.org/2000/svg" font-size="10.5" fill="#1F2328">'
        + "".join(parts)
        + f'<rect x="{left:.1f}" y="{top}" width="{frame_width:.1f}" height="{frame_height}" '
        'fill="none" stroke="#9AA1AA"/>'
        + f'<text x="{left + frame_width / 2:.1f}" y="{height - 5}" text-anchor="middle">'
        + f"{markup(x_title)}</text>"
        + f'<text transform="translate(12,{middle}) rotate(-90)" text-anchor="middle">'
        + f"{markup(y_title)}</text>"
        + "</svg>"
    )


def _ticks_of(span: tuple[float, float], logarithmic: bool, about: int) -> list[float]:
    """Ticks in the axis's own values: of a logarithmic one 1, 2 and 5 of each decade, decades where many."""
    if not logarithmic:
        return ticks(*span, about=about)
    decades = range(int(np.floor(span[0])), int(np.ceil(span[1])) + 1)
    steps = (1, 2, 5) if span[1] - span[0] < 2.5 else (1,)
    values = [float(f"{step}e{decade}") for decade in decades for step in steps]
    return [value for value in values if span[0] - 1e-9 <= np.log10(value) <= span[1] + 1e-9]


def _legend(curves: Sequence[Curve], width: int) -> str:
    """A stroke and the label of each curve, in rows above the frame."""
    column = (width - _LEFT - _RIGHT) / _LEGEND_COLUMNS
    parts = []
    for place, curve in enumerate(curves):
        x = _LEFT + place % _LEGEND_COLUMNS * column
        y = _TOP + _LEGEND * (place // _LEGEND_COLUMNS) + 4.0
        dash = f' stroke-dasharray="{curve.dash}"' if curve.dash else ""
        parts.append(f'<path d="M{x:.1f},{y}h22" stroke="{curve.colour}" stroke-width="1.6"{dash}/>')
        parts.append(f'<text x="{x + 27:.1f}" y="{y + 3.5}">{markup(curve.label)}</text>')
    return "".join(parts)


def _span(arrays: Sequence[FloatArray], margin: float) -> tuple[float, float]:
    low = min(float(np.nanmin(a)) for a in arrays)
    high = max(float(np.nanmax(a)) for a in arrays)
    room = margin * (high - low) or (0.0 if margin == 0.0 and high > low else 0.5 * abs(high) or 1.0)
    return low - room, high + room


def _outline(x: FloatArray, y: FloatArray) -> str:
    """Path data; a NaN lifts the pen."""
    pieces, pen_down = [], False
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        if b != b or a != a:
            pen_down = False
            continue
        pieces.append(f"{'L' if pen_down else 'M'}{a:.1f},{b:.1f}")
        pen_down = True
    return "".join(pieces)


def _width(label: str) -> float:
    """Width of a label of a tick."""
    return sum(_WIDTHS.get(character, _DIGIT) for character in label)


def _labelled(values: Sequence[float]) -> dict[float, str]:
    """Ticks with their labels, of as many digits as tell them apart, six at least."""
    digits = next((d for d in range(6, 12) if len({f"{v:.{d}g}" for v in values}) == len(values)), 12)
    return {value: _in_powers(f"{value + 0.0:.{digits}g}").replace("-", "−") for value in values}


def _in_powers(label: str) -> str:
    """A label with its power of ten as pages write it."""
    mantissa, _, power = label.partition("e")
    return f"{mantissa} × {power_of_ten(int(power))}".removeprefix("1 × ") if power else label


_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_BLANK = 0x2800


def braille(values: FloatArray, width: int, height: int = 3) -> list[str]:
    """A curve as lines of text, highest values first, on a scale that holds zero.

    Each column of dots spans from the least to the greatest value of its part of the curve.

    Parameters
    ----------
    values
        Shape (n,), finite.
    width, height
        In characters, of 2 by 4 dots each.
    """
    columns, rows = 2 * width, 4 * height
    low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
    scale = (rows - 1) / (high - low) if high > low else 0.0
    cells = np.full((height, width), _BLANK, dtype=np.int64)
    if len(values) == 0:
        return ["".join(map(chr, row)) for row in cells]
    edges = np.linspace(0, len(values), columns + 1)
    for column in range(columns):
        start = min(int(edges[column]), len(values) - 1)
        part = values[start : max(start + 1, int(np.ceil(edges[column + 1])))]
        top = round((high - float(part.max())) * scale)
        bottom = round((high - float(part.min())) * scale)
        for row in range(top, bottom + 1):
            cells[row // 4, column // 2] |= _DOTS[row % 4, column % 2]
    return ["".join(map(chr, row)) for row in cells.tolist()]


if TYPE_CHECKING:
    import plotly.graph_objects as go

BEFORE, AFTER, OTHERS = "#3B4048", "#009E73", ("#0072B2", "#D55E00", "#CC79A7", "#E69F00")
_POINTS = 1000
"""Points of a curve in a notebook's picture, which is some 640 px wide."""
_MOST_PANELS = 6


@dataclass(frozen=True)
class Panel:
    """Curves over one axis; titles carry their units."""

    curves: Sequence[Curve]
    x_title: str
    y_title: str


class Pictured:
    """What shows itself: ``plot()`` gives a figure, and a notebook shows its heading and pictures."""

    def _heading(self) -> Sequence[str]:
        """A headline and further lines."""
        raise NotImplementedError

    def _panels(self) -> Sequence[Panel]:
        """What is drawn, from the top."""
        raise NotImplementedError

    def __str__(self) -> str:
        return "\n".join(str(line) for line in self._heading() if line)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {'; '.join(str(self).splitlines())}>"

    def _repr_html_(self) -> str:
        head, *lines = self._heading()
        panels = self._panels()
        parts = [Markup("<strong>") + markup(head) + Markup("</strong>")]
        parts += [Markup("<br>") + markup(line) for line in lines]
        for panel in panels[:_MOST_PANELS]:
            alt = f"{panel.y_title} over {panel.x_title}: {', '.join(c.label for c in panel.curves)}"
            picture = line_figure(list(panel.curves), panel.x_title, panel.y_title, alt)
            parts.append(Markup('<div style="max-width: 720px">') + picture + Markup("</div>"))
        if len(panels) > _MOST_PANELS:
            parts.append(markup(f"{len(panels) - _MOST_PANELS} more; plot() draws all."))
        return Markup("<div>") + Markup("").join(parts) + Markup("</div>")

    def plot(self) -> go.Figure:
        """The pictures as one plotly figure, a panel below the other."""
        from plotly.subplots import make_subplots

        panels = self._panels()
        shared = len({panel.x_title for panel in panels}) == 1
        figure = make_subplots(rows=max(len(panels), 1), cols=1, shared_xaxes=shared)
        dashes = {"": "solid", "4 3": "dash"}
        shown: set[str] = set()
        for row, panel in enumerate(panels, 1):
            for curve in panel.curves:
                figure.add_scatter(
                    x=curve.x,
                    y=curve.y,
                    name=figure_text(curve.label),
                    mode="lines+markers" if curve.dots else "lines",
                    line={"color": curve.colour, "dash": dashes.get(curve.dash, curve.dash)},
                    showlegend=curve.label not in shown,
                    legendgroup=figure_text(curve.label),
                    row=row,
                    col=1,
                )
                shown.add(curve.label)
            figure.update_yaxes(title_text=figure_text(panel.y_title), row=row, col=1)
            if not shared or row == len(panels):
                figure.update_xaxes(title_text=figure_text(panel.x_title), row=row, col=1)
        head = self._heading()[0]
        figure.update_layout(
            title_text=figure_text(head), height=140 + 220 * max(len(panels), 1), template="simple_white"
        )
        return figure


def in_time(time_s: object, values: object, label: str, colour: str) -> Curve:
    """A curve over time [h], with as many points as a picture shows."""
    time, shown = drawn(time_s, values, _POINTS)  # type: ignore[arg-type]
    return Curve(time / 3600.0, shown, colour, label=label)
