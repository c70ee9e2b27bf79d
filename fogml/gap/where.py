"""Where the structural gap lies: by stage, regime, temperature, time scale and segment.

What is significant is judged against the noise model: a mean square of averages of noise has a
known expectation and scatter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.gap.result_parts import GapSegment, Share, TemperatureExcess, TimescaleExcess, Where
from fogml.gap.rows import Rows
from fogml.gap.settings import STANDARD
from fogml.gap.step_settings import Reported
from fogml.intervals import Z90
from fogml.runs.regimes import Regimes
from fogml.signals.noise_expectation import expected_mean_square
from fogml.signals.noise_model import NoiseModel


@dataclass(frozen=True, eq=False)
class Averages:
    """Rows of a run averaged over windows of `window_s` [s]; windows don't reach over gaps.

    Attributes
    ----------
    starts, window_s
        First row of each window, those cut short at a gap or the end among them; length of a full one.
    time, stretch
        Middle of each full window [s], and number of the stretch between gaps that it is in, shape (k,).
    full
        Which windows are full.
    """

    starts: IndexArray
    window_s: float
    time: FloatArray
    stretch: IndexArray
    full: BoolArray

    def of(self, rows: FloatArray) -> FloatArray:
        """Averages of series of rows, shape (m, ...) to (k, ...)."""
        counts = np.diff(self.starts, append=len(rows))
        return np.asarray((np.add.reduceat(rows, self.starts).T / counts).T[self.full])


def averages(rows: Rows, averaging_s: float = Reported.averaging_s) -> Averages:
    """Windows of about `averaging_s` over a run's rows: one row each where rows are longer, shorter ones
    where no stretch between gaps is as long.
    """
    width = max(1, round(averaging_s / rows.row_s))
    breaks = np.flatnonzero(np.diff(rows.time_s) > 2.5 * rows.row_s) + 1
    edges = [0, *breaks.tolist(), len(rows)]
    starts = np.concatenate([np.arange(a, b, width) for a, b in pairwise(edges)])
    counts = np.diff(starts, append=len(rows))
    longest = int(counts.max())
    full = counts == longest
    time = (np.add.reduceat(rows.time_s, starts) / counts)[full]
    stretch = np.searchsorted(breaks, starts[full], side="right")
    return Averages(starts, longest * rows.row_s, time, stretch, full)


@dataclass(frozen=True, eq=False)
class GapOnRun:
    """The structural gap of a fit run, and the part of it that effects found and the unknown make up.

    Both have shape (m,) [deg/h]; the gap is recorded less recalibrated replay, the part has no noise.
    """

    rows: Rows
    gap: FloatArray
    systematic: FloatArray


def where(
    gaps: Sequence[GapOnRun],
    stages: Mapping[str, float],
    noise: NoiseModel,
    settings: Reported = STANDARD.reported,
) -> Where:
    """Locate the structural gap.

    Parameters
    ----------
    gaps
        Each fit run.
    stages
        Energy of the systematic part by stage [(deg/h)^2], of any scale.
    noise
        The noise.
    settings
        From when on an excess is one.
    """
    held = [_Averaged.of(g, noise, settings) for g in gaps]
    total = sum(stages.values())
    shared = sorted(stages.items(), key=lambda x: -x[1]) if total > 0.0 else []
    return Where(
        stage=tuple(Share(name, energy / total) for name, energy in shared if energy),
        regime=_regimes(held, settings.significant),
        temperature=_temperatures(held, settings),
        timescale=_timescales(gaps, noise, settings.significant),
        segments=tuple(s for h in held for s in _segments(h, settings.segment_s)),
    )


@dataclass(frozen=True, eq=False)
class _Averaged:
    """A run's gap in windows: values, floor's mean square, labels."""

    run: str
    windows: Averages
    gap: FloatArray
    systematic: FloatArray
    floor: FloatArray
    regime: FloatArray
    temperature: FloatArray
    rising: FloatArray

    @classmethod
    def of(cls, g: GapOnRun, noise: NoiseModel, settings: Reported) -> _Averaged:
        windows = averages(g.rows, settings.averaging_s)
        temperature, gap = windows.of(g.rows.temperature), windows.of(g.gap)
        white = 3600.0 * noise.N**2 / windows.window_s
        floor = max(expected_mean_square(noise, windows.time, windows.window_s), white)
        return cls(
            g.rows.run.name,
            windows,
            gap,
            windows.of(g.systematic),
            np.full(len(gap), floor),
            g.rows.regime[windows.starts[windows.full]].astype(np.float64),
            temperature,
            _changes(temperature, windows.stretch),
        )


def _changes(values: FloatArray, stretch: IndexArray) -> FloatArray:
    """Mean change to the neighbours of the same stretch, shape (k,); 0 without one."""
    joined = np.pad(np.diff(stretch) == 0, 1)
    steps = np.where(joined, np.diff(values, prepend=values[0], append=values[-1]), 0.0)
    return np.asarray((steps[:-1] + steps[1:]) / np.maximum(joined[:-1].astype(np.float64) + joined[1:], 1.0))


def _excess(values: FloatArray, floors: FloatArray) -> tuple[float, float]:
    """Mean square over the floor's, and its standard deviation if there were noise alone."""
    level = float(np.mean(floors))
    return float(np.mean(values**2)) - level, level * _scatter(len(values))


def _scatter(count: int) -> float:
    """Relative standard deviation of a mean square of so many averages of coloured noise.

    Neighbours are not independent: half as many count.
    """
    return float(np.sqrt(2.0 / max(0.5 * count, 1.0)))


def _regimes(held: Sequence[_Averaged], significant: float) -> tuple[Share, ...]:
    rows = []
    for index, name in enumerate(Regimes.names):
        values = np.concatenate([h.gap[h.regime == index] for h in held])
        if len(values):
            floors = np.concatenate([h.floor[h.regime == index] for h in held])
            rows.append((name, len(values), *_excess(values, floors)))
    total = sum(max(e, 0.0) * n for _, n, e, _ in rows)

    def share(excess: float, count: int) -> float:
        return float(np.clip(max(excess, 0.0) * count / total, 0.0, 1.0)) if total > 0.0 else 0.0

    shares = []
    for name, count, excess, deviation in rows:
        low, high = excess - Z90 * deviation, excess + Z90 * deviation
        shares.append(
            Share(
                name,
                share(excess, count),
                (share(low, count), share(high, count)),
                _root(excess),
                (_root(low), _root(high)),
                excess > significant * deviation,
            )
        )
    return tuple(shares)


def _temperatures(held: Sequence[_Averaged], settings: Reported) -> tuple[TemperatureExcess, ...]:
    every, gap, floors, rising = (
        np.concatenate([getattr(h, name) for h in held]) for name in ("temperature", "gap", "floor", "rising")
    )
    step = settings.bin_degc
    # The last bin holds the greatest temperature, too.
    edges = step * np.arange(np.floor(every.min() / step), np.floor(every.max() / step) + 2.0)
    bins = []
    for low, high in pairwise(edges):
        inside = (every >= low) & (every < high)
        if inside.sum() < 3:
            continue
        excess, deviation = _excess(gap[inside], floors[inside])
        up, down = inside & (rising > 0.02), inside & (rising < -0.02)
        bins.append(
            TemperatureExcess(
                float(low),
                float(high),
                _root(excess),
                excess > settings.significant * deviation,
                float(gap[up].mean()) if up.sum() >= 3 else None,
                float(gap[down].mean()) if down.sum() >= 3 else None,
            )
        )
    return tuple(bins)


def _timescales(
    gaps: Sequence[GapOnRun], noise: NoiseModel, significant: float
) -> tuple[TimescaleExcess, ...]:
    first = max(g.rows.row_s for g in gaps)
    longest = max(min(float(g.rows.run.span_s) for g in gaps) / 8.0, first)
    scales = [t for t in (10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0) if first <= t <= longest]
    found = []
    for tau in scales or [first]:
        ratios, weights = [], []
        for g in gaps:
            windows = averages(g.rows, tau)
            values = windows.of(g.gap)
            floor = expected_mean_square(noise, windows.time, windows.window_s)
            ratios.append(float(np.mean(values**2)) / floor)
            weights.append(len(values))
        ratio = float(np.average(ratios, weights=weights))
        spread = _scatter(sum(weights))
        interval = (max(ratio * (1.0 - Z90 * spread), 0.0) ** 0.5, (ratio * (1.0 + Z90 * spread)) ** 0.5)
        found.append(TimescaleExcess(tau, ratio**0.5, interval, ratio - 1.0 > significant * spread))
    return tuple(found)


def _segments(h: _Averaged, shortest_s: float) -> list[GapSegment]:
    """Stretches in which the systematic part's averages exceed the floor; none reaches over a gap."""
    over, windows = np.abs(h.systematic) > h.floor**0.5, h.windows
    # A place before each stretch, at which nothing is over.
    at = np.arange(len(over)) + windows.stretch + 1
    held = np.zeros(at[-1] + 2, dtype=np.int8)
    held[at] = over
    edges = np.flatnonzero(np.diff(held)).reshape(-1, 2)
    segments = []
    for first, last in np.searchsorted(at, edges + 1).tolist():
        start = windows.time[first] - 0.5 * windows.window_s
        end = windows.time[last - 1] + 0.5 * windows.window_s
        if end - start >= shortest_s:
            excess = float(np.mean(h.gap[first:last] ** 2)) - h.floor[0]
            segments.append(GapSegment(h.run, float(start), float(end), _root(excess)))
    return segments


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))
