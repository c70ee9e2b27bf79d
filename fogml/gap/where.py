"""Averages of a run's rows, at the averaging time that figures are told at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fogml.gap.noise import Noise
from fogml.gap.result_parts import GapSegment, Share, TemperatureExcess, TimescaleExcess, Where
from fogml.intervals import Z90
from fogml.runs.regimes import Regimes
from fogml.runs.run import FloatArray, Run
from fogml.signals.noise_expectation import expected_mean_square

AVERAGING_S = 100.0


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


SHORTEST_SEGMENT_S = 600.0
BIN_DEGC = 10.0
_Z_SIGNIFICANT = 2.6


class RunInRows(InRows, Protocol):
    """A run as rows, with what tells them apart."""

    @property
    def run(self) -> Run:
        """As recorded."""

    @property
    def temperature(self) -> FloatArray:
        """T of each row [degC], shape (m,)."""

    @property
    def regime(self) -> NDArray[np.int8]:
        """Regime of each row."""


@dataclass(frozen=True, eq=False)
class GapOnRun:
    """The structural gap of a fit run.

    Attributes
    ----------
    observation
        The run.
    gap
        Recorded less recalibrated replay, shape (m,) [deg/h].
    systematic
        The part of it that effects found and the unknown make up, noise-free, shape (m,).
    taken
        Mean square of what the fitted constants take up of the noise [(deg/h)^2].
    """

    observation: RunInRows
    gap: FloatArray
    systematic: FloatArray
    taken: float = 0.0


def where(gaps: Sequence[GapOnRun], stages: Mapping[str, float], noise: Noise) -> Where:
    """Locate the structural gap.

    Parameters
    ----------
    gaps
        Each fit run.
    stages
        Energy of the systematic part by stage [(deg/h)^2], of any scale.
    noise
        The noise.
    """
    held = [_Averaged.of(g, noise) for g in gaps]
    total = sum(stages.values())
    by_stage = (
        tuple(
            Share(name, energy / total)
            for name, energy in sorted(stages.items(), key=lambda x: -x[1])
            if energy
        )
        if total > 0.0
        else ()
    )
    return Where(
        stage=by_stage,
        regime=_regimes(held),
        temperature=_temperatures(held),
        timescale=_timescales(gaps, noise),
        segments=tuple(s for h in held for s in _segments(h)),
    )


@dataclass(frozen=True, eq=False)
class _Averaged:
    """A run's gap in windows: values, floor's mean square, labels."""

    run: str
    windows: Averages
    gap: FloatArray
    systematic: FloatArray
    floor: float
    regime: FloatArray
    temperature: FloatArray
    rising: FloatArray

    @classmethod
    def of(cls, g: GapOnRun, noise: Noise) -> _Averaged:
        o = g.observation
        windows = averages(o)
        temperature = windows.of(o.temperature)
        white = 3600.0 * noise.fit.model.N**2 / windows.window_s
        floor = expected_mean_square(noise.fit.model, windows.time, windows.window_s) - g.taken
        return cls(
            o.run.name,
            windows,
            windows.of(g.gap),
            windows.of(g.systematic),
            max(floor, white),
            o.regime[windows.starts[windows.full]].astype(np.float64),
            temperature,
            np.gradient(temperature) if len(temperature) > 1 else np.zeros(len(temperature)),
        )


def _excess(values: FloatArray, floors: FloatArray) -> tuple[float, float]:
    """Mean square over the floor's, and its standard deviation if there were noise alone."""
    count = max(len(values), 1)
    level = float(np.mean(floors)) if len(floors) else 0.0
    # Neighbouring averages of coloured noise are not independent: half as many count.
    return float(np.mean(values**2)) - level, level * float(np.sqrt(2.0 / max(0.5 * count, 1.0)))


def _regimes(held: Sequence[_Averaged]) -> tuple[Share, ...]:
    names, rows = Regimes.names, []
    for index, name in enumerate(names):
        picked = [(h.gap[h.regime == index], h.floor) for h in held]
        values = np.concatenate([v for v, _ in picked])
        if len(values) == 0:
            continue
        floors = np.concatenate([np.full(len(v), f) for v, f in picked])
        excess, deviation = _excess(values, floors)
        rows.append((name, len(values), excess, deviation))
    total = sum(max(e, 0.0) * n for _, n, e, _ in rows)
    shares = []
    for name, count, excess, deviation in rows:
        low, high = excess - Z90 * deviation, excess + Z90 * deviation
        part = lambda e, n=count: float(np.clip(max(e, 0.0) * n / total, 0.0, 1.0)) if total > 0.0 else 0.0  # noqa: E731
        shares.append(
            Share(
                name,
                part(excess),
                (part(low), part(high)),
                _root(excess),
                (_root(low), _root(high)),
                excess > _Z_SIGNIFICANT * deviation,
            )
        )
    return tuple(shares)


def _temperatures(held: Sequence[_Averaged]) -> tuple[TemperatureExcess, ...]:
    every = np.concatenate([h.temperature for h in held])
    edges = np.arange(BIN_DEGC * np.floor(every.min() / BIN_DEGC), every.max() + BIN_DEGC, BIN_DEGC)
    gap = np.concatenate([h.gap for h in held])
    floors = np.concatenate([np.full(len(h.gap), h.floor) for h in held])
    rising = np.concatenate([h.rising for h in held])
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
                excess > _Z_SIGNIFICANT * deviation,
                float(gap[up].mean()) if up.sum() >= 3 else None,
                float(gap[down].mean()) if down.sum() >= 3 else None,
            )
        )
    return tuple(bins)


def _timescales(gaps: Sequence[GapOnRun], noise: Noise) -> tuple[TimescaleExcess, ...]:
    first = max(g.observation.row_s for g in gaps)
    longest = min(float(g.observation.run.span_s) for g in gaps) / 8.0
    scales = [
        t for t in (10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0) if first <= t <= max(longest, first)
    ]
    found = []
    for tau in scales or [first]:
        ratios, weights, counts = [], [], 0
        for g in gaps:
            windows = averages(g.observation, tau)
            values = windows.of(g.gap)
            floor = expected_mean_square(noise.fit.model, windows.time, windows.window_s)
            ratios.append(float(np.mean(values**2)) / floor)
            weights.append(len(values))
            counts += len(values)
        ratio = float(np.average(ratios, weights=weights))
        spread = float(np.sqrt(2.0 / max(0.5 * counts, 1.0)))
        interval = (max(ratio * (1.0 - Z90 * spread), 0.0) ** 0.5, (ratio * (1.0 + Z90 * spread)) ** 0.5)
        found.append(TimescaleExcess(tau, ratio**0.5, interval, ratio - 1.0 > _Z_SIGNIFICANT * spread))
    return tuple(found)


def _segments(h: _Averaged) -> list[GapSegment]:
    """Stretches in which the systematic part's averages exceed the floor."""
    over = np.abs(h.systematic) > h.floor**0.5
    if not over.any():
        return []
    step = h.windows.window_s
    edges = np.flatnonzero(np.diff(np.concatenate([[0], over.astype(np.int8), [0]])))
    segments = []
    for first, last in zip(edges[::2], edges[1::2]):
        start, end = h.windows.time[first] - 0.5 * step, h.windows.time[last - 1] + 0.5 * step
        if end - start >= SHORTEST_SEGMENT_S:
            excess = float(np.mean(h.gap[first:last] ** 2)) - h.floor
            segments.append(GapSegment(h.run, float(start), float(end), _root(excess)))
    return segments


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))
