"""Small line figures as plain SVG, for pages that are printed and must stay light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
_LEFT, _RIGHT, _TOP, _BOTTOM = 58.0, 8.0, 8.0, 34.0


@dataclass(frozen=True)
class Curve:
    """A curve, a NaN in every gap.

    ``x`` and ``y`` of shape (n,), the colour, and the SVG dash pattern (empty: solid).
    """

    x: FloatArray
    y: FloatArray
    colour: str
    dash: str = ""
    width: float = 1.1


def ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Round numbers, steps of 1, 2 or 5 times a power of ten, within [low, high]."""
    if not high > low:
        return [low]
    raw = (high - low) / about
    power = 10.0 ** np.floor(np.log10(raw))
    step = float(power * next(m for m in (1, 2, 5, 10) if m * power >= raw * (1 - 1e-9)))
    first = np.ceil(low / step - 1e-9)
    return [float(round(k * step, 12)) + 0.0 for k in np.arange(first, np.floor(high / step + 1e-9) + 1)]


def line_figure(
    curves: Sequence[Curve], x_title: str, y_title: str, alt: str, width: int = 640, height: int = 190
) -> Markup:
    """Curves on linear axes with ticks and titles, as an ``svg`` element.

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
    """
    x_span, y_span = _span([c.x for c in curves], 0.0), _span([c.y for c in curves], 0.06)

    def across(x: FloatArray | float) -> FloatArray:
        return _LEFT + (np.asarray(x) - x_span[0]) / (x_span[1] - x_span[0]) * (width - _LEFT - _RIGHT)

    def up(y: FloatArray | float) -> FloatArray:
        return (
            height
            - _BOTTOM
            - (np.asarray(y) - y_span[0]) / (y_span[1] - y_span[0]) * (height - _TOP - _BOTTOM)
        )

    parts = []
    for value in ticks(*x_span, about=8):
        x = f"{float(across(value)):.1f}"
        parts.append(f'<path d="M{x},{_TOP}V{height - _BOTTOM}" stroke="#E4E7EB"/>')
        parts.append(f'<text x="{x}" y="{height - _BOTTOM + 13}" text-anchor="middle">{_tick(value)}</text>')
    for value in ticks(*y_span, about=4):
        y = float(up(value))
        parts.append(f'<path d="M{_LEFT},{y:.1f}H{width - _RIGHT}" stroke="#E4E7EB"/>')
        parts.append(f'<text x="{_LEFT - 6}" y="{y + 3.5:.1f}" text-anchor="end">{_tick(value)}</text>')
    for curve in curves:
        dash = f' stroke-dasharray="{curve.dash}"' if curve.dash else ""
        outline = _outline(across(curve.x), up(curve.y))
        parts.append(
            f'<path d="{outline}" fill="none" stroke="{curve.colour}" stroke-width="{curve.width}"{dash} '
            'stroke-linejoin="round"/>'
        )
    frame_width, frame_height = width - _LEFT - _RIGHT, height - _TOP - _BOTTOM
    middle = _TOP + frame_height / 2
    return Markup(
        f'<svg role="img" aria-label="{escape(alt)}" viewBox="0 0 {width} {height}" '
        'xmlns="http://www.w3.org/2000/svg" font-size="10.5" fill="#1F2328">'
        + "".join(parts)
        + f'<rect x="{_LEFT}" y="{_TOP}" width="{frame_width}" height="{frame_height}" '
        'fill="none" stroke="#9AA1AA"/>'
        + f'<text x="{_LEFT + frame_width / 2}" y="{height - 5}" text-anchor="middle">'
        + f"{escape(x_title)}</text>"
        + f'<text transform="translate(12,{middle}) rotate(-90)" text-anchor="middle">'
        + f"{escape(y_title)}</text>"
        + "</svg>"
    )


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


def _tick(value: float) -> str:
    return f"{value + 0.0:g}".replace("-", "−")
