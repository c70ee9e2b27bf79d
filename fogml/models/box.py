"""The box that a model was trained in, and how far outside it a sample lies."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from fogml.features.box import Box
from fogml.features.features import Features
from fogml.runs.run import FloatArray


def learn_box(features: Features, atoms: Iterable[FloatArray]) -> None:
    """Set the features' box around values of their atoms in the training rows, each of shape (n, a)."""
    box = Box.around((values, np.ones(len(values), dtype=np.bool_)) for values in atoms)
    names = [atom.text for atom in features.atoms]
    features.set_box(dict(zip(names, zip(box.low.tolist(), box.high.tolist()), strict=True)))


def distance_outside(atoms: FloatArray, outside: NDArray[np.bool_], features: Features) -> FloatArray:
    """Distance from the box as a share of its span, of the atom that is furthest out; shape (n,).

    Parameters
    ----------
    atoms
        Values of the features' atoms, shape (n, a).
    outside
        Which samples lie outside, shape (n,); the others get 0.
    features
        Features whose box is learned.
    """
    distance = np.zeros(len(atoms))
    if outside.any():
        spans = np.array([features.box[atom.text] for atom in features.atoms])
        low, high = spans[:, 0], spans[:, 1]
        width = np.where(high > low, high - low, 1.0)
        away = np.maximum(low - atoms[outside], atoms[outside] - high) / width
        distance[outside] = np.maximum(away.max(axis=1), 0.0)
    return distance
