"""The tuning objective of the RBF network, with output weights solved exactly at every step.

Both objectives are functions of the centres, the widths and the ridge alone (variable
projection, Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413); gradients are analytic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fogml.arrays import FloatArray, IndexArray

if TYPE_CHECKING:
    import torch


# A step of the search may try a width of next to nothing.
_NARROWEST = 300.0  # logarithm of one over its square
LINEAR_PRECISION = 1e-6
"""Ridge of the linear part, in units of the noise variance: as good as none on standardised columns."""


@dataclass(frozen=True)
class Shape:
    """Where the network is curved: centres and log widths, each of shape (j, d), and log ridge.

    Lengths are in standard deviations of the inputs; the ridge is the ratio of noise variance
    to the variance of an output weight.
    """

    centres: FloatArray
    log_widths: FloatArray
    log_ridge: float


@dataclass(frozen=True)
class Value:
    """Objective and its gradient with respect to the fields of `Shape`."""

    value: float
    centres: FloatArray
    log_widths: FloatArray
    log_ridge: float


def inverse_squares(log_widths: FloatArray) -> FloatArray:
    """One over the squares of widths."""
    return np.asarray(np.exp(np.minimum(-2.0 * log_widths, _NARROWEST)))


class Objective:
    """Minus the log evidence of a network with noise variance profiled out, or its misfit alone.

    With design matrix Phi (network and linear columns), prior precision L (ridge for the
    network's weights, nearly none for the linear part) and A = Phi'Phi + L::

        -log p = n/2 log(S) + 1/2 log det A - j/2 log ridge,   S = min_w |y - Phi w|^2 + w'Lw

    up to constants (MacKay, Neural Computation 4 (1992) 415). n is the number of rows that count as
    independent, `share` of all: what is left of neighbouring rows is often alike. Without evidence
    only the first term is left, plain variable projection, and the ridge is not to be learned.

    Parameters
    ----------
    inputs
        Network inputs, standardised, shape (n, d).
    linear
        Columns of the linear part, with the constant, shape (n, p).
    target
        Standardised target, shape (n,).
    device, dtype
        Where torch computes, and in ``float64`` or ``float32``.
    evidence
        Whether the value is the evidence, rather than the misfit.

    Attributes
    ----------
    share
        Share of the rows that count as independent, 1 unless set.
    """

    def __init__(
        self,
        inputs: FloatArray,
        linear: FloatArray,
        target: FloatArray,
        *,
        device: str = "cpu",
        dtype: str = "float64",
        evidence: bool = True,
    ) -> None:
        import torch

        self._torch = torch
        kind = {"float64": torch.float64, "float32": torch.float32}[dtype]
        place = torch.device(device)

        def tensor(values: FloatArray) -> torch.Tensor:
            return torch.as_tensor(np.ascontiguousarray(values), dtype=kind, device=place)

        self._tensor = tensor
        self._evidence = evidence
        self.share = 1.0
        # Beyond this the exponential is as good as zero; further down it would turn denormal.
        self._floor = -60.0 if dtype == "float64" else -40.0
        self.rows, self.dimensions = inputs.shape
        self._linear_columns = linear.shape[1]
        # Exponents and all gradients by widths and centres are products with [x^2, x, 1].
        self._moments = tensor(np.hstack([inputs**2, inputs, np.ones((self.rows, 1))]))
        self._linear = tensor(linear)
        self._target = tensor(target)
        self._target_square = float(target @ target)
        self._buffers: dict[int, torch.Tensor] = {}

    def _design(self, shape: Shape) -> torch.Tensor:
        """Network columns and linear columns side by side, shape (n, j + p); reuses its memory."""
        torch = self._torch
        count = len(shape.centres)
        if count not in self._buffers:
            empty = torch.empty(
                (self.rows, count + self._linear_columns),
                dtype=self._linear.dtype,
                device=self._linear.device,
            )
            empty[:, count:] = self._linear
            self._buffers[count] = empty
        design = self._buffers[count]
        inverse_square = inverse_squares(shape.log_widths)
        exponent = np.hstack(
            [
                -inverse_square,
                2.0 * shape.centres * inverse_square,
                -np.sum(shape.centres**2 * inverse_square, axis=1, keepdims=True),
            ]
        )
        design[:, :count] = torch.mm(self._moments, self._tensor(exponent.T)).clamp_(self._floor, 0.0).exp_()
        return design

    def __call__(self, shape: Shape) -> Value:
        """Objective and gradient at a shape; infinite where the normal equations break down."""
        torch = self._torch
        count = len(shape.centres)
        ridge = float(np.exp(shape.log_ridge))
        solved = self._solve(shape)
        if solved is None:
            nothing = np.zeros_like(shape.centres)
            return Value(float("inf"), nothing, nothing, 0.0)
        design, factor, weights, least = solved
        own = weights[:count]
        misfit = torch.addmv(self._target, design, weights, alpha=-1.0)
        rows = self.share * self.rows
        value = 0.5 * rows * np.log(least)
        by_ridge = 0.0
        # d value / d design = design A^-1 - (n / S) misfit weights', network columns only.
        if self._evidence:
            inverse = torch.cholesky_inverse(factor)
            value += float(factor.diagonal().log().sum()) - 0.5 * count * shape.log_ridge
            trace = float(inverse.diagonal()[:count].sum())
            by_ridge = 0.5 * (ridge * (rows / least * float(own @ own) + trace) - count)
            slope = torch.mm(design, inverse[:, :count])
            slope.addr_(misfit, own, alpha=-rows / least)
        else:
            slope = torch.outer(misfit, own).mul_(-rows / least)
        slope.mul_(design[:, :count])
        sums = torch.mm(slope.T, self._moments).double().cpu().numpy()
        square, first, zeroth = np.split(sums, [self.dimensions, 2 * self.dimensions], axis=1)
        inverse_square = inverse_squares(shape.log_widths)
        by_centres = 2.0 * inverse_square * (first - shape.centres * zeroth)
        by_widths = 2.0 * inverse_square * (square - 2.0 * shape.centres * first + shape.centres**2 * zeroth)
        return Value(float(value), by_centres, by_widths, by_ridge)

    def fewest_centres(self, shape: Shape, worth: float) -> IndexArray:
        """The smallest network that is as good by its evidence, leaving out one centre after the other.

        Each time the one goes whose loss costs least, the output weights being solved again. A centre with
        no weight costs nothing: with ``C = A^-1``, leaving out centre j raises S by ``w_j^2 / C_jj`` and
        divides det A by ``1 / C_jj``.

        Parameters
        ----------
        shape
            The network.
        worth
            By how much minus the log evidence may exceed the least on the way [nat].

        Returns
        -------
        Indices of the centres that stay, in order.
        """
        count = len(shape.centres)
        solved = self._solve(shape)
        if solved is None or not self._evidence:
            return np.arange(count, dtype=np.intp)
        inverse = self._torch.cholesky_inverse(solved[1]).double().cpu().numpy()
        weights, least = solved[2].double().cpu().numpy(), solved[3]
        left, gone, values = np.arange(count), [], [0.0]
        while len(left):
            own, spread = weights[left], inverse[left, left]
            costs = 0.5 * self.share * self.rows * np.log1p(own**2 / (spread * least))
            costs += 0.5 * (np.log(spread) + shape.log_ridge)
            place = int(np.argmin(costs))
            values.append(values[-1] + float(costs[place]))
            j = left[place]
            gone.append(int(j))
            left = np.delete(left, place)
            least += weights[j] ** 2 / inverse[j, j]
            column = inverse[:, j] / inverse[j, j]
            weights = weights - column * weights[j]
            inverse = inverse - np.outer(column, inverse[j])
        good = np.flatnonzero(np.array(values) <= min(values) + worth)
        return np.setdiff1d(np.arange(count, dtype=np.intp), gone[: good[-1]])

    def weights(self, shape: Shape) -> FloatArray:
        """Output weights of network and linear columns, shape (j + p,); zeros where there are none."""
        solved = self._solve(shape)
        if solved is None:
            return np.zeros(len(shape.centres) + self._linear_columns)
        return np.asarray(solved[2].double().cpu().numpy())

    def residuals(self, shape: Shape) -> FloatArray:
        """What the solved network leaves of the target, shape (n,)."""
        torch = self._torch
        weights = self._tensor(self.weights(shape))
        left = torch.addmv(self._target, self._design(shape), weights, alpha=-1.0)
        return np.asarray(left.double().cpu().numpy())

    def mean_square(self, shape: Shape, weights: FloatArray) -> float:
        """Mean squared misfit for output weights of one's own, shape (j + p,)."""
        torch = self._torch
        misfit = torch.addmv(self._target, self._design(shape), self._tensor(weights), alpha=-1.0)
        return float(misfit @ misfit) / self.rows

    def _solve(self, shape: Shape) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, float] | None:
        """Design matrix, Cholesky factor of A, weights and S."""
        torch = self._torch
        count = len(shape.centres)
        design = self._design(shape)
        gram = torch.mm(design.T, design)
        precision = torch.full_like(gram[0], LINEAR_PRECISION)
        precision[:count] = float(np.exp(shape.log_ridge))
        gram.diagonal().add_(precision)
        factor, failed = torch.linalg.cholesky_ex(gram)
        if int(failed):
            return None
        projected = torch.mv(design.T, self._target)
        weights = torch.cholesky_solve(projected[:, None], factor)[:, 0]
        least = self._target_square - float(projected @ weights)
        return (design, factor, weights, least) if least > 0.0 else None
