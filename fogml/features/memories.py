"""The operators that ship, declared as one's own are: lag, play, decay since power-on, the way beyond.

One declaration gives values of whole recordings, block by block and sample by sample, and C in floating and
fixed point (`fogml.features.own`). The lag and the play have a quicker way through recordings besides.
"""

from __future__ import annotations

from math import log
from typing import Any

from fogml.features.own import Function, Recursion, State
from fogml.features.traced import decayed, forgotten, larger, smaller, where
from fogml.signals.memory import Lag, Play

_GONE = 1e-3
# What is left of a decay where it tells no more how long ago power-on was.
REACH, TAKEN = 0.5, 0.05
"""Shares of the distance of bounds within which `beyond` levels off, and what it lacks."""


def _lag_step(s: State, x: float, last: float, dt: float, time_constant: float) -> State:
    u = dt / time_constant
    gone = forgotten(u)
    return (s[0] + (gone / u * (x - last) - gone * s[0]),)


LAG = Recursion(
    name="lag",
    parameters=("s",),
    start=lambda x, tau: (0.0,),  # how far it is behind
    step=_lag_step,
    value=lambda s, x, tau: x - s[0],
    time_constant=0,
    gain=1.0,
    single_gain=lambda tau, sample_s: min(1.0, sample_s / tau),
    follows=True,
    operations=6,
    quicker=Lag,
)
"""First-order lag, exact for inputs linear between samples."""

PLAY = Recursion(
    name="play",
    parameters=("x",),
    start=lambda x, w: (x, x, x),  # its value, the lowest and the highest input
    step=lambda s, x, last, dt, w: (smaller(larger(s[0], x - w), x + w), smaller(s[1], x), larger(s[2], x)),
    value=lambda s, x, w: s[0],
    settled=lambda s, x, w: s[2] - s[1] >= 2.0 * w,
    gain=1.0,
    follows=True,
    operations=8,
    quicker=lambda w, sample_s: Play(w),
)
"""Play operator: hysteresis that knows no time."""

SINCE_ON = Function(
    name="since_on",
    parameters=("s",),
    unit="",
    function=lambda x, tau: decayed(larger(x, 0.0) / tau),
    rest=0.0,
    inverse=lambda value, tau: -tau * log(min(max(value, _GONE), 1.0)),
    operations=21,
)
"""Decay since power-on."""


def beyond(x: Any, low: float, high: float) -> Any:
    r"""How far x is beyond bounds, levelled off within half their distance s; 0 between them.

    A distance e becomes :math:`m e/(m + e) - k e/(k + e)` with m = s/2 and k = s/20: what a value that is
    levelled off within a twentieth lacks of one that is levelled off within half (`fogml.features.box`). So
    it begins without a corner, and never exceeds 0.45 s.
    """
    reach, taken = REACH * (high - low), TAKEN * (high - low)
    away = larger(larger(x - high, low - x), 0.0)
    value = reach * away / (reach + away) - taken * away / (taken + away)
    return where(x < low, -value, value)


def most_beyond(low: float, high: float) -> float:
    """What values of `beyond` stay below, either way."""
    return (REACH - TAKEN) * (high - low)


BEYOND = Function(name="beyond", parameters=("x", "x"), function=beyond, operations=9, gain=1.0)
"""How far beyond bounds."""

MEMORY_OPERATORS = {operator.name: operator for operator in (LAG, PLAY, SINCE_ON, BEYOND)}
"""The operators that ship, by name."""
