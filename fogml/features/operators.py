"""Operators that ship: lag, play, decay since power-on, the way beyond; waves, a glass transition.

Declared as one's own are (`fogml.features.own`): one declaration gives values of whole recordings, block by
block and sample by sample, and C in floating and fixed point. The lag and the play have a quicker way through
recordings besides. Curves of a temperature that known causes follow:

- ``sine(x, 8 degC)``, ``cosine(x, 8 degC)``: waves over x of that period, from x = 0 on.
- ``late_sine(x, 8 degC, 600 s)``, ``late_cosine(...)``: the same of x behind a first-order lag, for optics
  whose temperature no sensor tells.
- ``transition(x, 40 degC, 5 degC)``: tanh((x - 40)/5), the step at a glass transition.

Windows: how a difference or a rate is taken of a signal, over what, and how their samples are held.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from typing import Any

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError, known_are
from fogml.features.own import METHODS, Function, Recursion, State, declare, own_window
from fogml.features.traced import decayed, forgotten, larger, smaller, where
from fogml.numerals import number_text
from fogml.signals import windows
from fogml.signals.clock import EDGE_TOLERANCE, EXPONENTIAL_SPAN, Clock
from fogml.signals.kernel_windows import Kernel, kernel_rate
from fogml.signals.memory import Lag, Play

EXPONENTIAL_MEMORY = 40.0
"""Time constants after which an exponential window has forgotten to below float64 (e**-40)."""


@dataclass(frozen=True)
class Window:
    """How a difference or a rate is taken.

    Attributes
    ----------
    method
        ``block``: newest window's mean less the mean of the window before. ``slope``: least-squares
        line over one window. ``exp``: exponential memory. ``first``: neighbouring samples. Or one of
        one's own by its name (`fogml.features.own`).
    length_s
        Length of each window, or time constant of ``exp`` [s]; 0 for ``first``.
    """

    method: str = "block"
    length_s: float = 64.0

    def __post_init__(self) -> None:
        if self.method not in METHODS and self.own is None:
            raise InputError(f"window: no method '{self.method}'; {known_are(self.method, METHODS)}")
        if self.method == "first":
            object.__setattr__(self, "length_s", 0.0)
        elif not (np.isfinite(self.length_s) and self.length_s > 0.0):
            raise InputError(f"window: a length of {self.length_s} s; a positive number was expected")
        else:
            object.__setattr__(self, "length_s", float(self.length_s))

    @property
    def text(self) -> str:
        """The option in brackets, empty for the default."""
        if self == DEFAULT_WINDOW:
            return ""
        return "[first]" if self.method == "first" else f"[{self.method}, {number_text(self.length_s)} s]"

    @property
    def own(self) -> Kernel | None:
        """Its weights, of a window of one's own; None for the others."""
        return None if self.method in METHODS else own_window(self.method)

    @property
    def held(self) -> bool:
        """Whether it holds the samples within its span, and not what is left of them."""
        return self.method not in ("exp", "first")

    @property
    def span_s(self) -> float:
        """Time from the start until it is full [s], to within a sample interval."""
        spans = {"block": 2.0, "exp": EXPONENTIAL_SPAN, "first": 0.0}
        return spans.get(self.method, 1.0) * self.length_s

    @property
    def memory_s(self) -> float:
        """How far back samples still change its value, at float64 [s]."""
        return EXPONENTIAL_MEMORY * self.length_s if self.method == "exp" else self.span_s


DEFAULT_WINDOW = Window()


def windowed_values(
    signal: FloatArray, clock: Clock, window: Window, unit_s: float | None, out: FloatArray | None = None
) -> windows.Windowed:
    """A signal's difference (``unit_s=None``) or rate per `unit_s` seconds, and where it is full."""
    if window.method == "first":
        return windows.first_difference(clock, signal, unit_s=unit_s, out=out)
    if (own := window.own) is not None:
        unit_s = window.length_s if unit_s is None else unit_s
        return kernel_rate(clock, signal, window.length_s, own, unit_s, out)
    operator = {"block": windows.block_difference, "slope": windows.slope, "exp": windows.exponential}
    return operator[window.method](clock, signal, window.length_s, unit_s=unit_s, out=out)


_HEADROOM = 8
MOST_SINGLE = 132
"""Samples up to which the windows keep each one; more are kept in bins."""
BINS = 64
"""Bins that the longest window, both of a block's, is parted into: 2 s for a block of 64 s."""
_SHORTEST_BINS = 8
"""Bins in the shortest window at least: its edge parts one along a line, beside which it must be long."""
MOST_IN_BIN = 8191
"""Samples that a bin holds at most: its sums then fit 63 bits."""
GAP_BINS = 4
"""Bins more, as lost samples end one early: within a bin they would be taken to be evenly apart."""
LOST = 1.5
"""Sample intervals beyond which samples were lost."""
_LONGEST_RING = 1 << 12
"""Bins at most; windows whose lengths are further apart are refused."""


def ring_of(windows: Sequence[Window], sample_s: float) -> tuple[int, int]:
    """Samples or bins that the rings hold, and samples to a bin.

    Temperature has no content within a second: where the longest window holds more than `MOST_SINGLE`
    samples, they are kept in bins, so that memory does not grow with the rate.

    Raises
    ------
    InputError
        If the windows' lengths are too far apart.
    """
    held = [window for window in windows if window.held]
    if not held:
        return 0, 1
    most = max(math.ceil(window.span_s / sample_s - EDGE_TOLERANCE) + 1 for window in held)
    single = most + most // _HEADROOM + 4, 1
    if most <= MOST_SINGLE:
        return single
    longest = max(window.span_s for window in held)
    bin_s = min(longest / BINS, min(window.length_s for window in held) / _SHORTEST_BINS)
    if bin_s < (2.0 - EDGE_TOLERANCE) * sample_s:
        return single
    # A bin goes on until half an interval before its last sample would be due: not shorter than it then.
    count = min(math.ceil(bin_s / sample_s + 0.5 - EDGE_TOLERANCE), MOST_IN_BIN)
    ring = math.ceil(longest / ((count - 0.5) * sample_s)) + 2 + GAP_BINS
    if ring > _LONGEST_RING:
        raise InputError(
            f"export: windows of {min(w.length_s for w in held):g} s and {longest:g} s at a sample every "
            f"{sample_s:g} s need {ring} bins, C code holds at most {_LONGEST_RING}; train with windows "
            "nearer to each other or [exp, ...], or run the model at a longer --sample-s"
        )
    return ring, count


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


_QUARTER = (
    1.5707963266218774,
    -0.6459640926526784,
    0.07969258733490203,
    -0.004681620350456384,
    0.000160217245958022,
    -3.418212898537165e-06,
)
# sin(pi w / 2) = w (c0 + c1 w^2 + ...) for |w| <= 1 to 1.4e-11, all of which 2**-32 holds.
_MOST_TURNS = 8
# Turns up to 2**8 either way are brought back to one: 1.5 degC over 300 degC.


def sine_of_turns(u: Any) -> Any:
    """sin(2 pi u) for u up to 383 turns either way."""
    for k in range(_MOST_TURNS, -1, -1):
        turn, half = 2.0**k, 2.0 ** (k - 1)
        u = where(u > half, u - turn, where(u < -half, u + turn, u))
    w = 4.0 * where(u > 0.25, 0.5 - u, where(u < -0.25, -0.5 - u, u))
    square = w * w
    total: Any = _QUARTER[-1]
    for coefficient in _QUARTER[-2::-1]:
        total = total * square + coefficient
    return total * w


def sine(x: Any, period: float) -> Any:
    """A wave over x, 0 and rising at 0."""
    return sine_of_turns(x * (1.0 / period))


def cosine(x: Any, period: float) -> Any:
    """A wave over x, 1 at 0."""
    return sine_of_turns(x * (1.0 / period) + 0.25)


def transition(x: Any, centre: float, width: float) -> Any:
    """tanh((x - centre) / width)."""
    y = (x - centre) * (1.0 / width)
    gone = decayed(where(y < 0.0, -2.0 * y, 2.0 * y))
    size = (1.0 - gone) / (1.0 + gone)
    return where(y < 0.0, -size, size)


class LateWave:
    """A wave over a signal behind a first-order lag, for whole recordings."""

    def __init__(self, wave: Any, period: float, time_constant_s: float, sample_s: float) -> None:
        self._wave, self._period, self._lag = wave, period, Lag(time_constant_s, sample_s)

    def push(self, time: FloatArray, x: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Values at the next samples, and where they are settled; both of shape (n,)."""
        late, settled = self._lag.push(time, x)
        return np.asarray(self._wave(late, self._period)), settled


def _late(name: str, wave: Any) -> Recursion:
    def step(s: State, x: float, last: float, dt: float, period: float, tau: float) -> State:
        return LAG.step(s, x, last, dt, tau)

    return Recursion(
        name=name,
        parameters=("x", "s"),
        unit="",
        start=lambda x, period, tau: (0.0,),
        step=step,
        value=lambda s, x, period, tau: wave(x - s[0], period),
        time_constant=1,
        operations=72,
        quicker=lambda period, tau, sample_s: LateWave(wave, period, tau, sample_s),
    )


CURVES = (
    Function(name="sine", parameters=("x",), unit="", function=sine, operations=66),
    Function(name="cosine", parameters=("x",), unit="", function=cosine, operations=67),
    Function(name="transition", parameters=("x", "x"), unit="", function=transition, operations=30),
    _late("late_sine", sine),
    _late("late_cosine", cosine),
)
"""The curves that ship."""
for _curve in CURVES:
    declare(_curve)
