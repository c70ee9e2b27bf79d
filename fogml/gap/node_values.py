"""Amplitude and shape that a node's coefficients stand for, with standard errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.shapes import GridNode, is_angle
from fogml.twin.effect import Effect


@dataclass(frozen=True)
class NodeValue:
    """What a node says: amplitude, shape, their standard errors by name, and what they miss of the data.

    ``misfit`` is the squared whitened length that coefficients without bounds would explain beyond these;
    ``count`` how many numbers were fitted.
    """

    amplitude: float
    amplitude_se: float
    shape: Mapping[str, float]
    shape_se: Mapping[str, float]
    misfit: float
    count: int


def node_value(declared: Effect, node: GridNode, weights: FloatArray, information: FloatArray) -> NodeValue:
    """The amplitude and shape that explain the responses to a node's draws best.

    Parameters
    ----------
    declared
        The effect.
    node
        The node, of d draws.
    weights
        Least-squares weights of the responses to its draws, shape (d,).
    information
        On them, shape (d, d): the inverse of their covariance.

    Notes
    -----
    Draws are directions within steps of linear parameters, d = (1 + k) m. With a response that is linear in
    these, A times the response at angle phi and at t_i standard deviations of each parameter has the weights

        w = A (1 - sum t, t) x c(phi),    c = 1, (cos phi, sin phi) or 1/4 + cos(phi - phi_j) / 2

    by m = 1, 2 or 4 directions, ``x`` the Kronecker product. As many numbers as weights are solved for;
    fewer, where a direction comes with a part that stays as it is, by least squares, t being 0 +- 1 by the
    ranges.
    """
    angles = [q for q in declared.shape if is_angle(q)]
    told = {k: float(v) for k, v in node.shape.items()}
    middle = node.draws[0]
    # One linear parameter after the other is a standard deviation from its middle.
    steps = [(q, _step(node, q.name)) for q in declared.shape if q not in angles]
    linear = [(q, step) for q, step in steps if step]
    first, misfit = min(node.turns, 2), 0.0
    if node.turns == 1:
        found = np.concatenate([[weights.sum()], weights[1:] / (weights.sum() or 1.0)])
    elif len(angles) == 1:
        found, misfit = _turned(weights, information, node.turns)
    else:
        raise ValueError(f"effect '{declared.id}' has {len(angles)} angles; one of them can be told")
    jacobian = _jacobian(found, node.turns)
    gram = jacobian.T @ information @ jacobian
    if node.turns > 1:
        gram[first:, first:] += np.eye(len(gram) - first)
    scale = np.sqrt(np.maximum(np.diagonal(gram), 1e-300))
    errors = np.sqrt(np.maximum(np.diagonal(np.linalg.pinv(gram / np.outer(scale, scale))), 0.0)) / scale
    shape_se = {}
    if node.turns > 1:
        told[angles[0].name] = float((angles[0].tactical[0] + np.degrees(found[1])) % 360.0)
        shape_se[angles[0].name] = float(min(np.degrees(errors[1]), 180.0))
    for (quantity, step), t, se in zip(linear, found[first:], errors[first:]):
        low, high = quantity.range("tactical")
        value = middle[quantity.name] + step * t
        told[quantity.name] = float(np.clip(value, low - (high - low), high + (high - low)))
        shape_se[quantity.name] = float(min(abs(step) * se, high - low))
    return NodeValue(float(found[0]), float(errors[0]), told, shape_se, misfit, len(found))


def _step(node: GridNode, name: str) -> float:
    """How far a draw moves a parameter from the middle, 0 if none does."""
    moved = (float(draw.get(name, 0.0)) - float(node.draws[0].get(name, 0.0)) for draw in node.draws)
    return next((step for step in moved if step), 0.0)


def _weights(found: FloatArray, turns: int) -> FloatArray:
    """Weights of the draws at amplitude, angle [rad] where there is one, and steps of linear parameters."""
    t = found[min(turns, 2) :]
    ways = np.ones(1)
    if turns == 2:
        ways = np.array([np.cos(found[1]), np.sin(found[1])])
    elif turns > 2:
        ways = 0.25 + 0.5 * np.cos(found[1] - 0.5 * np.pi * np.arange(4.0))
    return np.asarray(found[0] * np.kron(np.concatenate([[1.0 - t.sum()], t]), ways))


def _jacobian(found: FloatArray, turns: int) -> FloatArray:
    """Of the weights, shape (d, p), by central differences, exact to rounding in so smooth a form."""
    moves = 1e-5 * np.diag(np.where(np.arange(len(found)) == 0, max(abs(found[0]), 1e-12), 1.0))
    spans = 2.0 * np.diagonal(moves)
    return np.column_stack([_weights(found + m, turns) - _weights(found - m, turns) for m in moves]) / spans


def _turned(weights: FloatArray, information: FloatArray, turns: int) -> tuple[FloatArray, float]:
    """Amplitude, angle and steps of least squares, and the squared whitened length that they miss."""
    from scipy.optimize import least_squares

    values, vectors = np.linalg.eigh(information)
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    steps = len(weights) // turns - 1
    ways = 0.5 * np.pi * np.arange(float(turns))
    each = weights.reshape(-1, turns).sum(axis=0)
    along, across = float(each @ np.cos(ways)), float(each @ np.sin(ways))
    size, angle = np.hypot(along, across) or 1e-12, np.arctan2(across, along)
    if turns == 2 and not steps:
        return np.array([size, angle]), 0.0

    def missed(scaled: FloatArray) -> FloatArray:
        found = np.concatenate([[size * scaled[0]], scaled[1:]])
        return np.concatenate([root @ (weights - _weights(found, turns)), scaled[2:]])

    # The opposite direction of the opposite sign is another answer where a part does not turn.
    starts = [np.array([sign, angle + turn, *np.zeros(steps)]) for sign, turn in ((1.0, 0.0), (-1.0, np.pi))]
    tries = [least_squares(missed, start, method="trf", x_scale="jac", max_nfev=100) for start in starts]
    best = min(tries, key=lambda tried: float(tried.cost))
    return np.concatenate([[size * best.x[0]], best.x[1:]]), 2.0 * float(best.cost)
