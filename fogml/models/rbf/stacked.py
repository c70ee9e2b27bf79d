"""The tuning objectives of several networks of one form, worked out as one batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fogml.arrays import FloatArray
from fogml.models.rbf.objective import LINEAR_PRECISION, Objective, Shape, Value, inverse_squares

if TYPE_CHECKING:
    import torch


class Stack:
    """Objectives of one form, their rows stacked.

    Parameters
    ----------
    objectives
        u of them; each `Objective.form` is the same.
    """

    def __init__(self, objectives: Sequence[Objective]) -> None:
        import torch

        # Held, so that no other objective gets one's address.
        self.objectives = list(objectives)
        self.moments = torch.stack([objective._moments for objective in objectives])
        self.linear = torch.stack([objective._linear for objective in objectives])
        self.target = torch.stack([objective._target for objective in objectives])


def values_together(stack: Stack, shapes: Sequence[Shape]) -> list[Value]:
    """Values of u objectives at u shapes with one number of centres, as `Objective.value` gives each.

    One batch of every product; only sums over a network's own rows are taken, so what others are
    in the batch matters to rounding at most.
    """
    import torch

    first = stack.objectives[0]
    count, dimensions = len(shapes[0].centres), first.dimensions
    if len(shapes) == 1:
        return [first.value(shapes[0])]
    centres = np.stack([shape.centres for shape in shapes])
    inverse_square = inverse_squares(np.stack([shape.log_widths for shape in shapes]))
    exponent = np.concatenate(
        [
            -inverse_square,
            2.0 * centres * inverse_square,
            -np.sum(centres**2 * inverse_square, axis=2, keepdims=True),
        ],
        axis=2,
    )
    ridge = np.exp([shape.log_ridge for shape in shapes])
    basis = torch.bmm(stack.moments, first._tensor(exponent.transpose(0, 2, 1)))
    basis.clamp_(first._floor, 0.0).exp_()
    design = torch.cat([basis, stack.linear], dim=2)
    gram = torch.bmm(design.transpose(1, 2), design)
    precision = torch.full_like(gram[:, 0], LINEAR_PRECISION)
    precision[:, :count] = first._tensor(ridge)[:, None]
    gram.diagonal(dim1=1, dim2=2).add_(precision)
    factor, failed = torch.linalg.cholesky_ex(gram)
    projected = torch.bmm(design.transpose(1, 2), stack.target[:, :, None])
    weights = torch.cholesky_solve(projected, factor)
    alike = basis.device.type == "cpu"
    misfit = _misfits(stack.target, design, weights, alike)
    explained = _dots(projected[:, :, 0], weights[:, :, 0], alike)
    least = np.array([objective._target_square for objective in stack.objectives]) - explained
    good = (failed.cpu().numpy() == 0) & (least > 0.0)
    least = np.where(good, least, 1.0)
    rows = np.array([objective.share * objective.rows for objective in stack.objectives])
    values, by_ridge = 0.5 * rows * np.log(least), np.zeros(len(shapes))
    own = weights[:, :count, 0]
    if first._evidence:
        inverse = torch.cholesky_inverse(factor)
        log_ridge = np.array([shape.log_ridge for shape in shapes])
        determinant = _sums(factor.diagonal(dim1=1, dim2=2).log(), alike)
        values = values + (determinant - 0.5 * count * log_ridge)
        trace = _sums(inverse.diagonal(dim1=1, dim2=2)[:, :count], alike)
        by_ridge = 0.5 * (ridge * (rows / least * _dots(own, own, alike) + trace) - count)
        slope = torch.bmm(design, inverse[:, :, :count])
    else:
        slope = torch.zeros_like(basis)
    _add_products(slope, misfit, own, -rows / least, alike)
    sums = torch.bmm(slope.mul_(basis).transpose(1, 2), stack.moments).double().cpu().numpy()
    square, line, zeroth = np.split(sums, [dimensions, 2 * dimensions], axis=2)
    by_centres = 2.0 * inverse_square * (line - centres * zeroth)
    by_widths = 2.0 * inverse_square * (square - 2.0 * centres * line + centres**2 * zeroth)
    nothing = np.zeros((count, dimensions))
    return [
        Value(float(values[i]), by_centres[i], by_widths[i], float(by_ridge[i]))
        if good[i]
        else Value(float("inf"), nothing, nothing, 0.0)
        for i in range(len(shapes))
    ]


# On a CPU these small sums are taken network by network, as for one network alone: their order, and so
# the last bit, is the same. On an accelerator a call for each would take longer than all the rest.


def _misfits(target: torch.Tensor, design: torch.Tensor, weights: torch.Tensor, alike: bool) -> torch.Tensor:
    """What the networks leave, shape (u, n)."""
    import torch

    if not alike:
        return torch.baddbmm(target[:, :, None], design, weights, alpha=-1.0)[:, :, 0]
    return torch.stack(
        [torch.addmv(target[i], design[i], weights[i, :, 0], alpha=-1.0) for i in range(len(target))]
    )


def _add_products(
    slope: torch.Tensor, left: torch.Tensor, right: torch.Tensor, factors: FloatArray, alike: bool
) -> None:
    """Add ``factors_u left_u right_u'`` to each matrix."""
    if alike:
        for i, factor in enumerate(factors.tolist()):
            slope[i].addr_(left[i], right[i], alpha=factor)
        return
    import torch

    pull = torch.as_tensor(factors, dtype=slope.dtype, device=slope.device)
    slope.baddbmm_((left * pull[:, None])[:, :, None], right[:, None, :])


def _dots(left: torch.Tensor, right: torch.Tensor, alike: bool) -> FloatArray:
    if alike:
        return np.array([float(left[i] @ right[i]) for i in range(len(left))])
    return np.asarray((left * right).sum(dim=1).double().cpu().numpy())


def _sums(rows: torch.Tensor, alike: bool) -> FloatArray:
    if alike:
        return np.array([float(row.sum()) for row in rows])
    return np.asarray(rows.sum(dim=1).double().cpu().numpy())
