"""Sinusoids in a series: coefficients of its cosine transform that stand out of the noise about them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IntArray
from fogml.signals.distributions import chi2_isf, chi2_ppf, variances_isf


@dataclass(frozen=True)
class SpectralLine:
    """A sinusoid in the data: frequency [Hz] and amplitude, in the unit of the data."""

    frequency_hz: float
    amplitude: float


def lines_of(
    square: FloatArray,
    edges: IntArray,
    sample_s: float,
    n: int,
    offset: int,
    chance: float,
    *,
    fewest: int,
    near: int,
) -> tuple[BoolArray | None, list[SpectralLine]]:
    """Coefficients of sinusoids that stand out of their bins' noise, and what they are.

    Parameters
    ----------
    square
        Squared coefficients of a stretch of n samples, from number `offset` on, as a one-sided density.
    edges
        Of the bins, as places in them.
    sample_s
        Sample interval [s].
    n, offset
        Samples of the stretch, and the number of the first coefficient.
    chance
        Of taking a coefficient of noise for a line.
    fewest, near
        As `line_fewest` and `line_near` of `fogml.signals.noise_spectrum.Resolution`.

    Returns
    -------
    masked, lines
        Which coefficients are a line's, None where there are none, and the lines.
    """
    # Median and limit of a squared normal value.
    typical, limit = float(chi2_ppf(0.5, 1)), float(chi2_isf(chance, 1))
    freedom = median_freedom()
    masked: BoolArray | None = None
    lines: list[SpectralLine] = []
    for low, high in _wide(edges.tolist(), fewest):
        part = square[low:high]
        peak = float(part.max())
        if peak <= limit * float(part.mean()) * 0.1:
            continue
        level = float(np.median(part)) / typical
        if level <= 0.0 or peak <= limit * level:
            continue
        if masked is None:
            masked = np.zeros(len(square), dtype=np.bool_)
        for place in low + np.flatnonzero(part > limit * level):
            # A density that is steep or has zeros is no line: its neighbours are as large.
            beside = square[max(place - near, 0) : place + near + 1]
            least = variances_isf(chance, 1, freedom * len(beside)) * float(np.median(beside)) / typical
            if masked[place] or square[place] <= least:
                continue
            a = b = int(place)
            # Every other coefficient of a line may be small: two quiet ones end it.
            while a > 0 and max(square[a - 1], square[max(a - 2, 0)]) > 4.0 * level:
                a -= 1
            while (
                b < len(square) - 1 and max(square[b + 1], square[min(b + 2, len(square) - 1)]) > 4.0 * level
            ):
                b += 1
            masked[a : b + 1] = True
            energy = square[a : b + 1] - level
            weight = np.maximum(energy, 0.0)
            middle = float(np.average(np.arange(a, b + 1), weights=weight))
            frequency = (offset + middle) / (2.0 * n * sample_s)
            lines.append(SpectralLine(frequency, float(np.sqrt(max(energy.sum(), 0.0) / (sample_s * n)))))
    return masked, lines


def _wide(edges: Sequence[int], fewest: int) -> Iterator[tuple[int, int]]:
    """Bins, joined where they are of too few coefficients: a median of few says nothing."""
    low = edges[0]
    for high in edges[1:]:
        if high - low >= fewest:
            yield low, high
            low = high
    if low < edges[-1]:
        yield max(edges[-1] - fewest, edges[0]), edges[-1]


def median_freedom() -> float:
    """Degrees of freedom of a median of squares of normal values, per square.

    A chi-square of as many has the relative variance ``1 / (4 n (m f(m))**2)`` of the median m of n squares
    of density f, chi-square of 1.
    """
    middle = float(chi2_ppf(0.5, 1))
    return float(4.0 / np.pi * middle * np.exp(-middle))


def one_of_each(
    found: Sequence[tuple[int, Sequence[SpectralLine]]], sample_s: float
) -> tuple[SpectralLine, ...]:
    """Lines of stretches of so many samples, each once, the largest first.

    A stretch tells a frequency to one over its length: the nearest within is the same line. It has the mean
    frequency, and the mean power, of the stretches that show it, by their lengths.
    """
    lines: list[list[tuple[int, SpectralLine]]] = []
    for n, of_one in sorted(found, key=lambda stretch: -stretch[0]):
        known = lines[:]
        for line in of_one:
            off = [abs(seen[0][1].frequency_hz - line.frequency_hz) * n * sample_s for seen in known]
            if off and min(off) <= 1.0:
                known[int(np.argmin(off))].append((n, line))
            else:
                lines.append([(n, line)])
    merged = []
    for seen in lines:
        lengths = [n for n, _ in seen]
        frequency = np.average([line.frequency_hz for _, line in seen], weights=lengths)
        power = np.average([line.amplitude**2 for _, line in seen], weights=lengths)
        merged.append(SpectralLine(float(frequency), float(np.sqrt(power))))
    return tuple(sorted(merged, key=lambda line: -line.amplitude))
