"""The runs side by side as whitened rows: what every column of a diagnosis is brought to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from fogml.gap.model import Constant
from fogml.gap.observation import Observation
from fogml.gap.run_whitener import RunWhitener
from fogml.runs.run import FloatArray

_FLAT = 1e6


@dataclass(frozen=True, eq=False)
class Frame:
    """Runs, their whiteners and the constants' columns.

    Attributes
    ----------
    observations, whiteners
        The runs and the whitener of each.
    constants
        The model's constants with their priors.
    values
        The constants at which effects that act on inputs are linearised.
    """

    observations: Sequence[Observation]
    whiteners: Sequence[RunWhitener]
    constants: Sequence[Constant]
    values: Mapping[str, float]

    @cached_property
    def runs(self) -> list[slice]:
        """Rows of each run."""
        edges = np.cumsum([0, *(len(o) for o in self.observations)])
        return [slice(int(a), int(b)) for a, b in pairwise(edges)]

    @cached_property
    def spans(self) -> dict[str, float]:
        """Longest run [s], widest span of temperature [degC] and longest row [s]."""
        low = min(float(o.temperature.min()) for o in self.observations)
        high = max(float(o.temperature.max()) for o in self.observations)
        return {
            "s": max(o.run.span_s for o in self.observations),
            "degC": max(high - low, 1.0),
            "sample": max(max(o.row_s, o.run.sample_s) for o in self.observations),
        }

    def white(self, columns: Sequence[FloatArray]) -> FloatArray:
        """Columns of each run, shape (m_r, k), whitened and stacked, shape (n, k)."""
        out = np.empty((self.runs[-1].stop, columns[0].shape[1]))
        for part, whitener, column in zip(self.runs, self.whiteners, columns):
            out[part] = whitener.whiten(column)
        return out

    def responses(self, id: str, shapes: Sequence[Mapping[str, float]]) -> FloatArray:
        """Whitened responses of a candidate at several shapes, shape (n, shapes)."""
        return self.white([o.responses.at(id, shapes, self.values) for o in self.observations])

    @cached_property
    def residual(self) -> FloatArray:
        """Recorded less replayed at the priors' means, whitened, shape (n, 1)."""
        means = {c.name: c.mean for c in self.constants}
        return self.white(
            [(o.recorded - o.averaged(o.model.output(means)))[:, None] for o in self.observations]
        )

    @cached_property
    def fixed(self) -> FloatArray:
        """Responses to one prior standard deviation of each constant and nuisance, whitened."""
        held = [o.model.nuisances(self.values) for o in self.observations]
        names = sorted(set().union(*held))
        rows = []
        for o, late in zip(self.observations, held):
            more = [o.averaged(late[n]) if n in late else np.zeros(len(o)) for n in names]
            rows.append(np.column_stack([constant_rows(o, self.constants), *more]))
        return self.white(rows)

    def beside(self, columns: FloatArray, *, flat: bool = False) -> FloatArray:
        """Inner products of whitened columns beside the constants, shape (k, k).

        With the priors of constants and nuisances, or beside freely varying constants alone.
        """
        held = self.fixed[:, : len(self.constants)] if flat else self.fixed
        return products_beside(columns, held, self._factors[1 if flat else 0])

    def without_constants(self, rows: FloatArray) -> FloatArray:
        """What the constants and nuisances, with their priors, leave of whitened rows, shape as given."""
        return np.asarray(rows - self.fixed @ cho_solve((self._factors[0], True), self.fixed.T @ rows))

    @cached_property
    def _factors(self) -> tuple[FloatArray, FloatArray]:
        free = self.fixed[:, : len(self.constants)]
        return posterior_factor(self.fixed), posterior_factor(free, _FLAT)


def posterior_factor(held: FloatArray, variance: float = 1.0) -> FloatArray:
    """Lower Cholesky factor of the posterior precision of whitened columns' coefficients, shape (c, c).

    Parameters
    ----------
    held
        Shape (m, c).
    variance
        Prior variance of each coefficient.
    """
    precision = held.T @ held + np.eye(held.shape[1]) / variance
    return np.asarray(np.linalg.cholesky(precision), dtype=np.float64)


def products_beside(columns: FloatArray, held: FloatArray, factor: FloatArray) -> FloatArray:
    """Inner products of whitened columns beside held ones of a `posterior_factor`, shape (k, k)."""
    # By the factor, not the inverse: what is left of a column may be 1e-8 of it.
    half = solve_triangular(factor, held.T @ columns, lower=True)
    return np.asarray(columns.T @ columns - half.T @ half)


def constant_rows(o: Observation, constants: Sequence[Constant]) -> FloatArray:
    """Rows of the response to one prior standard deviation of each constant, shape (m, constants)."""
    held = o.model.columns()
    return np.column_stack(
        [c.sd * o.averaged(held[c.name]) if c.name in held else np.zeros(len(o)) for c in constants]
    )


def main_axes(gram: FloatArray, share: float) -> FloatArray:
    """What brings columns of given inner products to their main axes, a length of 1 in all; shape (k, axes).

    Axes with less than `share` of the largest are left out.
    """
    scale = np.sqrt(np.maximum(np.diag(gram), 0.0))
    used = np.flatnonzero(scale > 1e-3 * scale.max(initial=0.0))
    if len(used) == 0:
        return np.empty((len(gram), 0))
    scaled = gram[np.ix_(used, used)] / np.outer(scale[used], scale[used])
    values, vectors = np.linalg.eigh(scaled)
    keep = np.flatnonzero(values > share * values[-1])[::-1]
    axes = np.zeros((len(gram), len(keep)))
    axes[used] = vectors[:, keep] / scale[used, None] / np.sqrt(values[keep].sum())
    return axes
