"""The box that a model was trained in: learned from training rows, and how far outside it samples lie."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from fogml.features.box import Box
from fogml.features.features import Features
from fogml.features.memories import most_beyond
from fogml.runs.run import BoolArray, FloatArray


def learn_box(features: Features, atoms: Iterable[FloatArray]) -> None:
    """Set the features' box around values of their atoms in the training rows, each of shape (n, a).

    What lies beyond bounds is 0 in training rows and levels off by itself: its box is all that it can be.
    """
    features.learn([(values, np.ones(len(values), dtype=np.bool_)) for values in atoms])
    spans = dict(features.box)
    for atom in features.atoms:
        if atom.bounds is not None:
            most = most_beyond(*atom.bounds)
            spans[atom.text] = (-most, most)
    features.set_box(spans, slices_of(features))


def slices_of(features: Features) -> dict[str, Any] | None:
    """The features' slices, JSON-ready; None if they have none."""
    return None if features.slices is None else features.slices.as_dict(features.atoms)


def distance_outside(atoms: FloatArray, outside: BoolArray, features: Features) -> FloatArray:
    """Distance from the box, or a slice of it, as a share of its span, of what is furthest out; shape (n,).

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
        box = _box(features)
        away = np.maximum(box.low - atoms[outside], atoms[outside] - box.high) / box.span
        distance[outside] = np.maximum(away.max(axis=1), 0.0)
        if features.slices is not None:
            jointly = features.slices.excess(atoms[outside]).max(axis=1)
            distance[outside] = np.maximum(distance[outside], jointly)
    return distance


def _box(features: Features) -> Box:
    spans = np.array([features.box[atom.text] for atom in features.atoms])
    return Box(spans[:, 0], spans[:, 1])
