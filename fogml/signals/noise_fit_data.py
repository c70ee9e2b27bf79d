"""What a noise fit needs of its series: averages, columns without redundancy, differences by level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.signals.averages import block_averages
from fogml.signals.clock import Clock, check_interval
from fogml.signals.noise_model import ADJOINING, NoiseModel, flicker_ladder
from fogml.signals.whitening import Whitener

_ANY = NoiseModel(1.0)
_FEWEST = 16
_INDEPENDENT = 1e-9
"""Columns whose singular value is below this share of the largest hold nothing new."""


@dataclass(frozen=True)
class Level:
    """Differences of neighbouring means over one time, columns taken out.

    Attributes
    ----------
    averaging_s
        What the means are over [s].
    squares
        Sum of squared differences over two [(deg/h)^2], whose mean is the Allan variance.
    freedom
        Differences less the rank of the columns.
    """

    averaging_s: float
    squares: float
    freedom: int


@dataclass(frozen=True)
class Part:
    """One series, averaged where long: columns and, last, values, shape (m, p + 1), and what whitens them."""

    table: FloatArray
    whitener: Whitener


@dataclass(frozen=True)
class FitData:
    """All series of a fit.

    Attributes
    ----------
    parts
        Their averages.
    levels
        Differences inside the averages, of all series.
    glance
        Differences at every level, for a first look.
    log_det
        Logarithm of the volume that the given columns span in the frame of the present ones.
    """

    parts: tuple[Part, ...]
    levels: tuple[Level, ...]
    glance: tuple[Level, ...]
    log_det: float = 0.0


def fit_data(
    time: Sequence[ArrayLike],
    series: Sequence[ArrayLike],
    columns: Sequence[ArrayLike] | None,
    averaging_s: float | None,
    most: int,
) -> FitData:
    """Check and reduce the series of a fit; parameters as in `fogml.signals.noise_fit.fit_noise`."""
    times, values, tables = _checked(time, series, columns)
    if averaging_s is not None:
        check_interval(averaging_s, "noise fit")
    sample_s = float(averaging_s if averaging_s is not None else Clock(times[0]).sample_s)
    levels: list[Level] = []
    glance: list[Level] = []
    averages = []
    for t, y, x in zip(times, values, tables):
        octaves = max(int(np.ceil(np.log2(len(t) / most))), 0)
        found = _differences(t, y, x, sample_s)
        levels += found[:octaves]
        glance += found
        if octaves == 0:
            averages.append((t, np.full(len(t), sample_s), x, y))
            continue
        blocks = block_averages(t, x, y, window_s=sample_s * 2**octaves)
        x, y = blocks.values
        averages.append((t[blocks.stops - 1], blocks.counts * sample_s, x, y))
    shared = _columns([x for _, _, x, _ in averages])
    parts = []
    edges = np.cumsum([0] + [len(t) for t, _, _, _ in averages])
    for (t, a, _, y), low, high in zip(averages, edges[:-1], edges[1:]):
        length = float(t[-1] - t[0]) + float(a[0])
        # One for all coefficients, so that the likelihood is smooth in them.
        ladder = flicker_ladder(float(np.median(a)), length)
        table = np.column_stack((shared[low:high], y - y.mean()))
        parts.append(Part(table, Whitener(_ANY, t, a, ladder)))
    return FitData(tuple(parts), tuple(levels), _merged(glance))


def _checked(
    time: Sequence[ArrayLike], series: Sequence[ArrayLike], columns: Sequence[ArrayLike] | None
) -> tuple[list[FloatArray], list[FloatArray], list[FloatArray]]:
    if len(time) != len(series) or (columns is not None and len(columns) != len(series)):
        raise InputError("noise fit: as many times, and columns where given, as series were expected")
    times = [np.asarray(t, dtype=np.float64) for t in time]
    values = [np.asarray(y, dtype=np.float64) for y in series]
    if columns is None:
        tables = [np.empty((len(y), 0)) for y in values]
    else:
        tables = [np.asarray(x, dtype=np.float64).reshape(len(np.asarray(x)), -1) for x in columns]
    for i, (t, y, x) in enumerate(zip(times, values, tables)):
        if y.ndim != 1 or t.shape != y.shape or len(x) != len(y) or x.shape[1] != tables[0].shape[1]:
            raise InputError(
                f"noise fit: series {i + 1} has times {t.shape}, values {y.shape} and columns {x.shape}"
            )
        if not (np.all(np.isfinite(t)) and np.all(np.isfinite(y)) and np.all(np.isfinite(x))):
            raise InputError(f"noise fit: series {i + 1} holds values that are not finite; leave them out")
    kept = [i for i, y in enumerate(values) if len(y) >= _FEWEST]
    if not kept:
        raise InputError(f"noise fit: no series has {_FEWEST} samples")
    return [times[i] for i in kept], [values[i] for i in kept], [tables[i] for i in kept]


def _columns(tables: list[FloatArray]) -> FloatArray:
    """Columns of all series on top of each other, beside a constant of each, as an orthonormal basis."""
    which = np.repeat(np.arange(len(tables)), [len(x) for x in tables])
    own = (which[:, None] == np.arange(len(tables))).astype(np.float64)
    free = np.column_stack((own, np.vstack(tables)))
    sizes = np.sqrt(np.sum(free**2, axis=0))
    left, strength, _ = np.linalg.svd(free / np.where(sizes > 0.0, sizes, 1.0), full_matrices=False)
    return np.asarray(left[:, strength > _INDEPENDENT * strength[0]])


def _differences(time: FloatArray, values: FloatArray, columns: FloatArray, sample_s: float) -> list[Level]:
    """Differences of neighbouring means, one level for each octave, stretches apart."""
    cuts = np.flatnonzero(np.diff(time) > ADJOINING * sample_s) + 1
    means = np.split(np.column_stack((columns - columns.mean(axis=0), values - values.mean())), cuts)
    found: list[Level] = []
    averaging_s = sample_s
    while True:
        means = [m[: len(m) // 2 * 2] for m in means if len(m) >= 2]
        if not means:
            return found
        pairs = np.concatenate([m[1::2] - m[::2] for m in means]) * np.sqrt(0.5)
        rank, squares = _residual(pairs)
        if len(pairs) - rank < 4:
            return found
        found.append(Level(averaging_s, squares, len(pairs) - rank))
        means = [0.5 * (m[1::2] + m[::2]) for m in means]
        averaging_s *= 2.0


def _residual(table: FloatArray) -> tuple[int, float]:
    """Rank of all columns but the last, and the last one's sum of squares without them."""
    x, y = table[:, :-1], table[:, -1]
    sizes = np.sqrt(np.sum(x**2, axis=0))
    x = x[:, sizes > 0.0] / sizes[sizes > 0.0]
    if x.shape[1] == 0:
        return 0, float(y @ y)
    values, vectors = np.linalg.eigh(x.T @ x)
    kept = values > _INDEPENDENT * values[-1]
    along = (vectors[:, kept].T @ (x.T @ y)) / np.sqrt(values[kept])
    return int(kept.sum()), max(float(y @ y - along @ along), 0.0)


def _merged(levels: list[Level]) -> tuple[Level, ...]:
    """Levels of all series at each averaging time together, in order of time."""
    merged = []
    for averaging_s in sorted({level.averaging_s for level in levels}):
        same = [level for level in levels if level.averaging_s == averaging_s]
        merged.append(Level(averaging_s, sum(s.squares for s in same), sum(s.freedom for s in same)))
    return tuple(merged)
