"""Regimes of a run as pale bands behind its curves, named where there is room."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike, NDArray

from fogml.report.style import REGIME_TINTS, REGIME_WORDS
from fogml.signals.drawn import gap_starts

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


def shade(figure: go.Figure, segments: Sequence[Segment], xref: str = "x") -> list[str]:
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
    for name, start, stop in seen:
        tint = REGIME_TINTS.get(name, "rgba(0, 0, 0, 0.08)")
        figure.add_shape(
            type="rect",
            layer="below",
            line_width=0,
            fillcolor=tint,
            xref=xref,
            yref="paper",
            x0=start,
            x1=stop,
            y0=0,
            y1=1,
        )
        if stop - start >= _LEAST_SHARE_NAMED * whole:
            figure.add_annotation(
                text=regime_word(name),
                showarrow=False,
                xref=xref,
                yref="paper",
                x=0.5 * (start + stop),
                y=1.0,
                yanchor="bottom",
                font={"size": 11, "color": "#57606A"},
            )
    return in_order(name for name, _, _ in seen)


def regime_word(name: str) -> str:
    """The name of a regime in words."""
    return REGIME_WORDS.get(name, name.replace("_", " "))


def in_order(names: Iterable[str]) -> list[str]:
    """Regimes without repeats, in the order in which pages list them."""
    given = set(names)
    return [name for name in REGIME_WORDS if name in given] + sorted(given - set(REGIME_WORDS))
