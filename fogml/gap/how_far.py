"""How far the gap closes on a held-out run once the effects found are added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from fogml.gap.fitting import Fit
from fogml.gap.how_far_result import HowFar
from fogml.gap.model import Constant, EffectValue
from fogml.gap.noise import Noise
from fogml.gap.observation import Observation
from fogml.intervals import Z90
from fogml.runs.run import FloatArray
from fogml.signals.noise_expectation import expected_mean_square, floor_square, mean_square_draws

AVERAGING_S = 100.0
DRAWS, NOISES, CHOICES = 40, 200, 4000
LEAST_GAP = 0.2
"""A floor that is uncertain leaves this share of the gap above it, at least, in an interval."""
FORM_LEFT = 0.02
"""What of a closing may be missing because no form is known exactly, as a share of it.

With twice as much, 0.93 of 635 intervals of spent blind cases held what the true form closes, where nine in
ten should.
"""


class InRows(Protocol):
    """A run as rows of equal averaging time."""

    def __len__(self) -> int: ...

    @property
    def row_s(self) -> float:
        """Averaging time of a row [s]."""

    @property
    def time(self) -> FloatArray:
        """Mean time of each row [s], shape (m,)."""


@dataclass(frozen=True, eq=False)
class Averages:
    """Rows of a run averaged over windows of `window_s` [s]; windows don't reach over gaps."""

    starts: np.ndarray
    window_s: float
    time: FloatArray

    def of(self, rows: FloatArray) -> FloatArray:
        """Averages of a series of rows, shape (m,) to (k,)."""
        counts = np.diff(self.starts, append=len(rows))
        return np.asarray((np.add.reduceat(rows, self.starts) / counts)[self.full])

    full: np.ndarray


def averages(o: InRows, averaging_s: float = AVERAGING_S) -> Averages:
    """Windows of about `averaging_s` over a run's rows; one row each where rows are longer."""
    width = max(1, round(averaging_s / o.row_s))
    breaks = np.flatnonzero(np.diff(o.time) > 2.5 * o.row_s) + 1
    edges = [0, *breaks.tolist(), len(o)]
    starts = np.concatenate([np.arange(a, b, width) for a, b in pairwise(edges)])
    counts = np.diff(starts, append=len(o))
    full = counts == width
    if not full.any():
        full = counts > 0
    time = np.add.reduceat(o.time, starts) / counts
    return Averages(starts, width * o.row_s, time[full], full)


def how_far(
    o: Observation,
    constants: Sequence[Constant],
    recalibrated: Fit,
    after: Fit,
    noise: Noise,
    rng: np.random.Generator,
) -> HowFar:
    """Before, recalibrated, after and floor of a held-out run, and what is closed.

    The interval of what is closed is that of what the effects' true constants would close, the floor being
    that of the true noise. A floor that is uncertain by a factor makes it lopsided, and so do errors of
    parameters: what such errors add to the mean square after, the true ones close besides.

    Parameters
    ----------
    o
        The held-out run.
    constants
        With their priors' means: the twin before.
    recalibrated, after
        Fits without and with the effects, from the fit runs.
    noise
        The noise model.
    rng
        Draws parameters and noises for the interval.
    """
    windows = averages(o)
    means = {c.name: c.mean for c in constants}

    def gap(values: dict[str, float] | Fit, effects: tuple[EffectValue, ...] = ()) -> FloatArray:
        held, on = (values.constants, values.effects) if isinstance(values, Fit) else (values, effects)
        return windows.of(o.recorded - o.averaged(o.model.output(held, on)))

    squares = {name: _mean_square(gap(f)) for name, f in (("rec", recalibrated), ("after", after))}
    before = _mean_square(gap(means))
    floor = float(floor_square(noise.fit.model, windows.time, windows.window_s))
    floors, noises = _floors(windows, noise, rng)
    closed, interval, note = None, None, ""
    denominator = squares["rec"] - floor
    # The gap keeps its mean, which noise alone moves too.
    alone = expected_mean_square(noise.fit.model, windows.time, windows.window_s)
    if squares["rec"] - alone <= Z90 * np.std(noises):
        note = "the recalibrated twin is at the floor within its noise: nothing left to close"
    else:
        closed = (squares["rec"] - squares["after"]) / denominator
        taken = np.zeros(DRAWS)
        if after.effects:
            moved = [_mean_square(gap(c, e)) for c, e in after.draws(rng, DRAWS)]
            taken = np.array(moved) - squares["after"]
        which = rng.integers(NOISES, size=CHOICES)
        # The true constants leave no less than the noise.
        room = np.maximum(squares["after"] - noises[which], 0.0)
        closing = squares["rec"] - squares["after"] + np.minimum(rng.choice(taken, CHOICES), room)
        drawn = closing / np.maximum(squares["rec"] - floors[which], LEAST_GAP * denominator)
        drawn *= 1.0 + FORM_LEFT * rng.standard_normal(CHOICES)
        low, high = np.quantile(drawn, (0.05, 0.95))
        interval = min(float(low), closed), max(float(high), closed)
    return HowFar(
        run=o.run.name,
        averaging_s=windows.window_s,
        before=before**0.5,
        recalibrated=squares["rec"] ** 0.5,
        after=squares["after"] ** 0.5,
        floor=floor**0.5,
        closed=closed,
        closed_ci90=interval,
        note=note,
    )


def _mean_square(values: FloatArray) -> float:
    return float(np.mean(values**2))


def _floors(windows: Averages, noise: Noise, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Squares of floors, as uncertain as the noise is, and mean squares of one run's noise each."""
    models = noise.fit.draw(rng, NOISES)
    expected = np.array([expected_mean_square(m, windows.time, windows.window_s) for m in models])
    floors = np.array([floor_square(m, windows.time, windows.window_s) for m in models])
    drawn = mean_square_draws(noise.fit.model, windows.time, windows.window_s, NOISES, rng)
    return floors, expected * drawn / drawn.mean()
