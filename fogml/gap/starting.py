"""Where the fit of effects starts: amplitudes and the shapes that a grid leaves open, by trying."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from fogml.gap.frame import constant_rows
from fogml.gap.model import Candidate, Constant, EffectValue
from fogml.gap.observation import Observation
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.shapes import AT_AMPLITUDE, Node, is_angle
from fogml.runs.run import FloatArray

MOST_TRIED = 48


def starting_values(
    observations: Sequence[Observation],
    whiteners: Sequence[RunWhitener],
    constants: Sequence[Constant],
    values: Mapping[str, float],
    chosen: Sequence[tuple[str, Node]],
    candidates: Mapping[str, Candidate],
) -> list[EffectValue]:
    """Amplitudes and shapes near which the fit begins.

    Parameters
    ----------
    observations, whiteners
        The runs.
    constants, values
        The model's constants, and where they are.
    chosen
        Ids of the effects, the most certain first, with their best node.
    candidates
        Their declarations.
    """
    fixed = _stacked(whiteners, [constant_rows(o, constants) for o in observations])
    data = _stacked(
        whiteners, [(o.recorded - o.averaged(o.model.output(values)))[:, None] for o in observations]
    )
    # The priors' rows keep constants that the runs can't show where they are.
    held = np.concatenate([fixed, np.eye(fixed.shape[1])])
    basis, _ = np.linalg.qr(held)
    left = _beside(basis, data)[:, 0]
    taken: list[FloatArray] = []
    found = []
    for id, node in chosen:
        best: tuple[float, dict[str, float], float, FloatArray] | None = None
        for tried in _shapes(candidates[id], node):
            response = _stacked(whiteners, [o.response(id, tried, values)[:, None] for o in observations])
            column = _beside(basis, response)[:, 0]
            for other in taken:
                column = column - other * (other @ column)
            size = float(column @ column)
            if size == 0.0:
                continue
            amplitude = float(column @ left) / size
            quantity = candidates[id].amplitude
            amplitude = float(np.clip(amplitude, *quantity.limits))
            gain = 2.0 * amplitude * float(column @ left) - amplitude**2 * size
            if best is None or gain > best[0]:
                best = gain, tried, amplitude, column
        if best is None:
            continue
        _, tried, amplitude, column = best
        tried = {name: value for name, value in tried.items() if name != AT_AMPLITUDE}
        left = left - amplitude * column
        taken.append(column / math.sqrt(float(column @ column)))
        found.append(EffectValue(id, amplitude if amplitude != 0.0 else _least(candidates[id]), tried))
    return found


def _shapes(candidate: Candidate, node: Node) -> list[dict[str, float]]:
    """The node's shape with angles all round, and what it is linear in low, middle and high."""
    axes = []
    for quantity in candidate.shape:
        low, high = quantity.tactical
        if is_angle(quantity):
            axes.append([(quantity.name, low + turn) for turn in np.arange(0.0, 360.0, 30.0)])
        elif len({draw.get(quantity.name) for draw in node.draws}) > 1:
            values = sorted({low, 0.5 * (low + high), high, node.shape[quantity.name]})
            axes.append([(quantity.name, value) for value in values])
    tried = [dict(node.shape) | dict(point) for point in product(*axes)]
    step = -(-len(tried) // MOST_TRIED)
    return [dict(node.shape), *tried[::step]]


def _least(candidate: Candidate) -> float:
    return 1e-3 * abs(candidate.amplitude.tactical[1])


def _stacked(whiteners: Sequence[RunWhitener], columns: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate([w.whiten(c) for w, c in zip(whiteners, columns)])


def _beside(basis: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns beside the constants, rows of the priors added."""
    rows = np.concatenate([columns, np.zeros((len(basis) - len(columns), columns.shape[1]))])
    return np.asarray(rows - basis @ (basis.T @ rows))
