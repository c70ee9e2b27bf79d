"""How far a linear model is followed beyond the box that it was trained in.

Beyond the box a model must fall back smoothly, so atoms level off just outside it; a quintic left
to itself runs away within a few degrees. One kind of atom is let go on: rates and differences
between sensors that enter a linear model to the first power only. The drift that they stand for
(Shupe, Mohr) is linear in them, and a ramp twice as fast as in training needs twice the term.
They level off one whole span outside the box. The sample is flagged all the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.features.atoms import Atom
from fogml.features.box import Box
from fogml.features.terms import Term

REACH = 1.0
"""How far a linear model follows rates and gradients beyond the box, as a share of its span."""


def reaching_box(box: Box, terms: Sequence[Term], atoms: Sequence[Atom]) -> Box:
    """The box widened for the atoms that a linear model follows beyond it.

    Parameters
    ----------
    box
        The trained box of the atoms.
    terms
        Terms of the model.
    atoms
        The atoms they are made of, in the order of the box.
    """
    highest = dict.fromkeys(atoms, 0)
    for term in terms:
        for atom, power in term.factors:
            highest[atom] = max(highest[atom], power)
    followed = np.array([highest[atom] == 1 and is_rate_or_gradient(atom) for atom in atoms])
    further = np.where(followed, REACH * box.span, 0.0)
    return Box(box.low - further, box.high + further)


def is_rate_or_gradient(atom: Atom) -> bool:
    """Whether an atom is a temperature's change in time, or its difference between sensors."""
    return atom.operator in ("d", "diff") or (
        atom.operator in ("value", "lag", "play") and atom.signal.is_difference
    )
