"""The box that a model was trained in: how far outside a sample lies, and how far a model follows it.

Beyond the box a model must fall back smoothly, so atoms level off just outside it; a quintic left
to itself runs away within a few degrees. One kind of atom is let go on: rates and differences
between sensors that enter a linear model to the first power only. The drift that they stand for
(Shupe, Mohr) is linear in them, and a ramp twice as fast as in training needs twice the term.
They level off one whole span outside the box. The sample is flagged all the same.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fogml.features.atoms import Atom
from fogml.features.box import Box
from fogml.features.features import Features
from fogml.runs.run import BoolArray, FloatArray

REACH = 1.0
"""How far a linear model follows rates and gradients beyond the box, as a share of its span."""


def learn_box(features: Features, atoms: Iterable[FloatArray]) -> None:
    """Set the features' box around values of their atoms in the training rows, each of shape (n, a)."""
    box = Box.around((values, np.ones(len(values), dtype=np.bool_)) for values in atoms)
    names = [atom.text for atom in features.atoms]
    features.set_box(dict(zip(names, zip(box.low.tolist(), box.high.tolist()), strict=True)))


def limit_atoms(
    features: Features, atoms: FloatArray, full: BoolArray, *, linear: bool
) -> tuple[FloatArray, BoolArray]:
    """Limit atoms to where a model may be evaluated.

    Parameters
    ----------
    features
        Features whose box is learned.
    atoms
        Values of their atoms, shape (n, a).
    full
        Where every window is full, shape (n,).
    linear
        Whether the model goes on linearly beyond its training rows.

    Returns
    -------
    limited : (n, a) array
        Values to evaluate the model at; `atoms` itself where nothing is limited.
    outside : (n,) bool array
        Rows outside the trained box.
    """
    limited, outside = features.limit(atoms, full)
    if linear and limited is not atoms:
        limited, _ = _reaching(features).limit(atoms, full)
    return limited, outside


def distance_outside(atoms: FloatArray, outside: BoolArray, features: Features) -> FloatArray:
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
        box = _box(features)
        away = np.maximum(box.low - atoms[outside], atoms[outside] - box.high) / box.span
        distance[outside] = np.maximum(away.max(axis=1), 0.0)
    return distance


def _box(features: Features) -> Box:
    spans = np.array([features.box[atom.text] for atom in features.atoms])
    return Box(spans[:, 0], spans[:, 1])


def _reaching(features: Features) -> Features:
    """The features with a box widened for atoms that are followed beyond it."""
    box = _box(features)
    highest = dict.fromkeys(features.atoms, 0)
    for term in features.terms:
        for atom, power in term.factors:
            highest[atom] = max(highest[atom], power)
    followed = np.array([highest[atom] == 1 and is_rate_or_gradient(atom) for atom in features.atoms])
    further = np.where(followed, REACH * box.span, 0.0)
    low, high = (box.low - further).tolist(), (box.high + further).tolist()
    names = [atom.text for atom in features.atoms]
    return Features(features.text).set_box(dict(zip(names, zip(low, high), strict=True)))


def is_rate_or_gradient(atom: Atom) -> bool:
    """Whether an atom is a temperature's change in time, or its difference between sensors."""
    weights = [coefficient for _, coefficient in atom.signal.parts]
    between = abs(sum(weights)) <= 1e-9 * sum(abs(weight) for weight in weights)
    return atom.operator in ("d", "diff") or (atom.operator == "value" and between)
