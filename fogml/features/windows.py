"""Windows: how a difference or a rate is taken of a signal, over what, and how their samples are held."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, known_are
from fogml.features.own import own_window
from fogml.features.signal import number_text
from fogml.signals import windows
from fogml.signals.clock import EDGE_TOLERANCE, EXPONENTIAL_SPAN, Clock
from fogml.signals.kernel_windows import Kernel, kernel_rate

Method = Literal["block", "slope", "exp", "first"]
METHODS: tuple[Method, ...] = get_args(Method)
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
