"""Windows by their weights: a rate or a difference from a kernel over the age of samples.

Within a window of length L, with weights w of zero sum made of the kernel k at u = age/L,

    w_i = k(u_i) - mean k,    rate = sum w_i x_i / sum w_i t_i,

so that a steady signal gives 0 and a ramp its rate, whatever the samples' times. Gaps and fullness are those
of `fogml.signals.windows.slope`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.signals.clock import (
    EDGE_TOLERANCE,
    LEAST_SHARE,
    Clock,
    check_window,
    counting_s,
    gap_starts,
    longest_gap_s,
    needed_s,
    told_share,
)
from fogml.signals.windows import Windowed

_CHUNK = 1 << 22
LARGEST = 1e100
"""Size of a weight, above which sums of products with temperatures may overflow."""
_LEAST_MOMENT = 1e-6
_MANY, _LEAST_ROWS = 8, 4096
# Samples between two knots from which on running sums are quicker; rows that share theirs.


@dataclass(frozen=True)
class Kernel:
    """A window's weights by age.

    Attributes
    ----------
    name
        As feature text has it, ``dT[name, 60 s]``.
    weights
        At equal steps of age, from now to the window's end; straight between them.
    """

    name: str
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        if not (self.name.isidentifier() and self.name.isascii()):
            raise InputError(f"window '{self.name}': a name of letters, digits and _ was expected")
        try:
            object.__setattr__(self, "weights", tuple(float(weight) for weight in self.weights))
        except (TypeError, ValueError) as error:
            raise InputError(f"window {self.name}: its weights are no numbers: {error}") from None
        size = float(np.max(np.abs(self.weights), initial=0.0))
        told = len(self.weights) > 1 and 0.0 < size < LARGEST
        if not told or not self.moment > _LEAST_MOMENT * size:
            raise InputError(
                f"window {self.name}: weights by age were expected that fall from now to the window's end, "
                "so that they tell a rate"
            )

    def at(self, age: FloatArray) -> FloatArray:
        """Weights at ages in lengths of the window."""
        return np.interp(age, np.linspace(0.0, 1.0, len(self.weights)), self.weights)

    @property
    def moment(self) -> float:
        """How much younger than the mean a heavier sample is: mean of weight times age, centred, negated."""
        age, weight = self._sampled
        return float(-np.mean((weight - weight.mean()) * (age - age.mean())))

    @property
    def gain(self) -> float:
        """Sum of the sizes of the weights that make a rate, times the window's length."""
        _, weight = self._sampled
        return float(np.mean(np.abs(weight - weight.mean())) / self.moment)

    @property
    def _sampled(self) -> tuple[FloatArray, FloatArray]:
        age: FloatArray = np.linspace(0.5 / 1024.0, 1.0 - 0.5 / 1024.0, 1024)
        return age, self.at(age)


def kernel_rate(
    clock: Clock, x: FloatArray, window_s: float, kernel: Kernel, unit_s: float, out: FloatArray | None = None
) -> Windowed:
    """Rate per `unit_s` seconds, and where the window is full, as `fogml.signals.windows.slope` has them."""
    step, time = clock.sample_s, clock.time
    check_window(window_s, step, 2, f"a window of {kernel.name}")
    values, n = np.zeros(len(x)) if out is None else out, len(x)
    edge = window_s - EDGE_TOLERANCE * step
    starts = np.zeros(n, dtype=np.intp)
    begins = gap_starts(time, step, longest_gap_s(window_s, step))
    starts[begins] = begins
    starts = np.maximum.accumulate(starts)
    known = time - time[starts] if n else np.zeros(0)
    full, counts = known >= needed_s(window_s, step), known >= counting_s(window_s, step)
    oldest = np.maximum(np.searchsorted(time, time - edge, side="right"), starts)
    most = int(np.max(np.arange(n) - oldest, initial=0)) + 1
    back = np.arange(most)
    many = most > _MANY * len(kernel.weights)
    rows = _LEAST_ROWS + most if many else max(1, _CHUNK // most)
    for low in range(0, n, rows):
        here = np.arange(low, min(low + rows, n))
        if many:
            values[here] = unit_s * _rate_by_knots(kernel, time, x, here, oldest[here], window_s)
            continue
        place = here[:, None] - back
        inside = place >= oldest[here][:, None]
        place = np.maximum(place, 0)
        age = np.where(inside, time[here][:, None] - time[place], 0.0)
        values[here] = unit_s * _rate(kernel, age, x[place] - x[here][:, None], inside, window_s)
    pairs = np.arange(n) > oldest
    values *= np.where(full, 1.0, told_share(known / window_s, LEAST_SHARE)) * pairs
    return Windowed(values, full & pairs, counts & pairs)


def _rate_by_knots(
    kernel: Kernel,
    time: FloatArray,
    x: FloatArray,
    rows: IndexArray,
    oldest: IndexArray,
    window_s: float,
) -> FloatArray:
    """Rates [per s] at rows whose windows begin at `oldest`, from running sums between the weights' knots.

    Weights go straight with age between knots, so that each stretch takes differences of the running sums of
    1, t, t^2, x and t x, however many samples it holds.
    """
    first, here = int(oldest[0]), time[rows]
    t, moved = time[first : rows[-1] + 1] - here[0], x[first : rows[-1] + 1]
    moved = moved - moved.mean()
    columns = np.column_stack([np.ones_like(t), t, t * t, moved, t * moved])
    sums = np.vstack([np.zeros(5), np.cumsum(columns, axis=0)])
    now, knots = here - here[0], np.linspace(0.0, window_s, len(kernel.weights))
    end = sums[rows + 1 - first]
    whole = end - sums[oldest - first]
    # Of weight, weight times time, weight times x.
    weight, along, total = np.zeros((3, len(rows)))
    for i, age in enumerate(knots[1:]):
        place = np.searchsorted(time, here - age, side="left")
        begin = sums[np.maximum(place if i < len(knots) - 2 else oldest, oldest) - first]
        one, of_t, of_tt, of_x, of_tx = (end - begin).T
        slope = (kernel.weights[i + 1] - kernel.weights[i]) / (knots[1])
        level = kernel.weights[i] + slope * (now - knots[i])
        weight += level * one - slope * of_t
        along += level * of_t - slope * of_tt
        total += level * of_x - slope * of_tx
        end = begin
    mean = weight / whole[:, 0]
    spread = along - mean * whole[:, 1]
    return np.divide(total - mean * whole[:, 3], spread, out=np.zeros(len(rows)), where=spread > 0.0)


def _rate(kernel: Kernel, age: FloatArray, x: FloatArray, inside: BoolArray, window_s: float) -> FloatArray:
    """Rates [per s] of rows of samples."""
    count = inside.sum(axis=1, keepdims=True)
    weight = np.where(inside, kernel.at(age / window_s), 0.0)
    weight = np.where(inside, weight - weight.sum(axis=1, keepdims=True) / count, 0.0)
    spread = -np.sum(weight * age, axis=1)
    moved = np.sum(weight * x, axis=1)
    return np.divide(moved, spread, out=np.zeros(len(moved)), where=spread > 0.0)


class KernelStream:
    """`kernel_rate` sample by sample."""

    def __init__(self, window_s: float, sample_s: float, unit_s: float, kernel: Kernel) -> None:
        check_window(window_s, sample_s, 2, f"a window of {kernel.name}")
        self._window_s, self._unit_s, self._kernel = window_s, unit_s, kernel
        self._edge = window_s - EDGE_TOLERANCE * sample_s
        self._needed, self._counting = needed_s(window_s, sample_s), counting_s(window_s, sample_s)
        self._gap_s = longest_gap_s(window_s, sample_s)
        self._start = self._last = -float("inf")
        self._held: deque[tuple[float, float]] = deque()

    def step(self, time_s: float, x: float) -> tuple[float, bool, bool]:
        """Value after this sample, whether the window is full, and whether the value counts."""
        if time_s - self._last > self._gap_s:
            self._start = time_s
            self._held.clear()
        self._last = time_s
        self._held.append((time_s, x))
        while time_s - self._held[0][0] >= self._edge:
            self._held.popleft()
        if len(self._held) < 2:
            return 0.0, False, False
        time, values = np.array(self._held).T
        inside = np.ones((1, len(time)), dtype=np.bool_)
        rate = _rate(self._kernel, (time_s - time)[None], (values - x)[None], inside, self._window_s)
        value, known = self._unit_s * float(rate[0]), time_s - self._start
        if known >= self._needed:
            return value, True, True
        return told_share(known / self._window_s, LEAST_SHARE) * value, False, known >= self._counting
