"""Noise that is not the same everywhere: what an unknown in the noise looks like.

Whitened residuals have unit variance. Where their squares grow with temperature, its rate, time or the
table's rate, something that no mean response shows makes noise there. Where they fall, nothing does:
what is fitted may follow noise of the readings, which turns with a rate show most.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, logsumexp

from fogml.gap.explanation import Explanation
from fogml.gap.frame import Frame
from fogml.gap.observation import Observation
from fogml.gap.priors import LENGTH_WEIGHTS, LENGTHS
from fogml.gap.search import Search
from fogml.runs.run import FloatArray
from fogml.twin.memory import Memory

LARGEST_SQUARE = 16.0
"""Squares are cut here: single outliers are no trend."""
BLOCK_ROWS = 16


@dataclass(frozen=True)
class UnevenNoise:
    """Evidence that the noise is uneven [nats], and what it goes with."""

    gain: float
    looks_like: str


def uneven_noise(search: Search, best: Explanation) -> UnevenNoise:
    """How the squares of the residuals of an explanation follow the runs."""
    frame = search.field_.basis.frame
    squares = np.minimum(_residual(search, best) ** 2, LARGEST_SQUARE)
    expected = float(
        np.mean(np.minimum(np.random.default_rng(0).standard_normal(100_000) ** 2, LARGEST_SQUARE))
    )
    data: list[FloatArray] = []
    kinds: dict[str, list[tuple[FloatArray, FloatArray]]] = {}
    for o, run in zip(frame.observations, frame.runs):
        starts = np.arange(0, len(o), BLOCK_ROWS)
        counts = np.diff(starts, append=len(o))
        means = np.add.reduceat(squares[run], starts) / counts
        data.append((means - expected) * np.sqrt(0.5 * counts))
        for name, column in _causes(o).items():
            rows = np.add.reduceat(column, starts) / counts
            kinds.setdefault(name, []).append((rows, np.sqrt(counts)))
    y = np.concatenate(data)
    y = y - y.mean()
    gains = {}
    for name, parts in kinds.items():
        column = np.concatenate([rows for rows, _ in parts])
        weight = np.concatenate([w for _, w in parts])
        column = (column - np.average(column, weights=weight**2)) * weight
        size = float(column @ column)
        if size > 0.0:
            along = float(column @ y) / math.sqrt(size)
            wider = 1.0 + LENGTHS**2
            terms = 0.5 * (LENGTHS**2 * along**2 / wider - np.log(wider)) + np.log(LENGTH_WEIGHTS)
            # The half of the prior of less noise is cut away.
            terms += log_ndtr(LENGTHS * along / np.sqrt(wider)) + math.log(2.0)
            gains[name] = float(logsumexp(terms))
    if not gains:
        return UnevenNoise(-math.inf, "")
    name = max(gains, key=gains.__getitem__)
    return UnevenNoise(float(logsumexp(list(gains.values()))) - math.log(len(gains)), f"noise {name}")


def _causes(o: Observation) -> dict[str, FloatArray]:
    """What noise may do, and columns that grow where it then is larger."""
    t = o.temperature
    rate = 60.0 * (t - Memory().lag("rate", o.time, t, 100.0)) / 100.0
    middle = 0.5 * (float(t.max()) + float(t.min()))
    causes: dict[str, FloatArray] = {
        "grows with high temperature": np.maximum(t - middle, 0.0),
        "grows with low temperature": np.maximum(middle - t, 0.0),
        "grows with the rate of temperature": np.abs(rate),
        "grows with time": o.time - o.time[0],
        "falls with time": o.time[-1] - o.time,
    }
    return causes | {"grows with the table's rate": np.abs(o.averaged(o.run.rate))}


def _residual(search: Search, best: Explanation) -> FloatArray:
    """Whitened residuals of an explanation, constants included, shape (n,)."""
    basis = search.field_.basis
    frame: Frame = basis.frame
    held = search.field_.condition(search.terms(best))
    left = frame.residual[:, 0].copy()
    if held.terms:
        mean, _ = held.coefficients()
        left -= search.field_.columns([c for t in held.terms for c in t.columns]) @ mean
    return frame.without_constants(left)
