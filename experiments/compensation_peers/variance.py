"""What explains the outcome: data set, protocol, seed, model, and the model's interplay with each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.arrays import FloatArray

NAMES = (
    "data set",
    "protocol within it",
    "seed of the unit",
    "model",
    "model × data set",
    "model × protocol",
    "model × seed, rest",
)


def shares(y: FloatArray, places: Sequence[tuple[str, str]]) -> FloatArray:
    """Shares of the sum of squares about the mean, in the order of `NAMES`.

    Every case has every model, so effects of cases, of models and of both at once are orthogonal; those of
    cases are nested: data set, protocol, seed.

    Parameters
    ----------
    y
        Outcome of each case and model, shape (cases, models).
    places
        Data set and protocol of each case.
    """
    about = y - y.mean()
    case, model = about.mean(axis=1, keepdims=True), about.mean(axis=0, keepdims=True)
    both = about - case - model
    sets = [place[0] for place in places]
    parts = []
    for values in (case, both):
        of_set, of_protocol = _means(values, sets), _means(values, list(places))
        parts += [of_set, of_protocol - of_set, values - of_protocol]
    parts.insert(3, np.broadcast_to(model, y.shape))
    squares = np.array([np.sum(np.broadcast_to(part, y.shape) ** 2) for part in parts])
    return squares / squares.sum()


def intervals(
    y: FloatArray, places: Sequence[tuple[str, str]], *, draws: int = 2000, seed: int = 0
) -> tuple[FloatArray, FloatArray]:
    """95 % intervals of the shares by drawing whole data sets, lower and upper ends."""
    rng = np.random.default_rng(seed)
    sets = np.array([place[0] for place in places])
    names = np.unique(sets)
    found = []
    for _ in range(draws):
        rows, told = [], []
        for copy, name in enumerate(rng.choice(names, len(names))):
            own = np.flatnonzero(sets == name)
            rows += own.tolist()
            # Two copies of one set are one more set each, or its effect would be counted as none.
            told += [(f"{name}-{copy}", f"{places[i][1]}-{copy}") for i in own]
        found.append(shares(y[rows], told))
    low, high = np.quantile(found, (0.025, 0.975), axis=0)
    return low, high


def _means(values: FloatArray, labels: Sequence[object]) -> FloatArray:
    """Each row's mean over the rows of its label."""
    found = np.empty_like(values)
    for label in set(labels):
        own = [i for i, other in enumerate(labels) if other == label]
        found[own] = values[own].mean(axis=0)
    return found
