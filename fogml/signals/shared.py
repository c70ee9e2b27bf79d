"""Whether one recording holds samples of another."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray


def shared_samples(values: FloatArray, others: FloatArray, length: int = 64, places: int = 16) -> float:
    """Share of values, shape (n,), that stand in others, shape (m,), in the same order.

    Told at so many places, by as many values in a row as `length`. Where fewer than an eighth of them change,
    as of an output that stands still, they tell nothing.
    """
    length = min(length, len(values), len(others))
    told, found = 0, 0
    for start in np.linspace(0, len(values) - length, places).astype(int).tolist():
        row = values[start : start + length]
        if np.count_nonzero(np.diff(row)) < length / 8:
            continue
        at = np.flatnonzero(others[: len(others) - length + 1] == row[0])
        for step in range(1, length):
            at = at[others[at + step] == row[step]]
            if not len(at):
                break
        told, found = told + 1, found + bool(len(at))
    return found / told if told else 0.0
