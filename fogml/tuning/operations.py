"""Arithmetic operations that a model takes per sample, counted from its form."""

from __future__ import annotations

from typing import Any

from fogml.features.atoms import Atom
from fogml.features.features import Features
from fogml.features.terms import composition_plan
from fogml.models.regressors import parameter_count

_WINDOWS = {"block": 6, "slope": 10, "exp": 4, "first": 1}
_MEMORIES = {"lag": 5, "play": 4, "since_on": 2}
# Block: four running sums, a difference, a scale. Slope: two moments kept up. Exp: one recursion.


def operations_per_sample(features: Features, regressor: Any) -> int:
    """Additions, multiplications and exponentials of one sample, each counted as one.

    Features are counted as they run sample by sample, with running sums. Of an RBF network each
    centre takes three operations per input, an exponential, and two to weigh it. Of a
    scikit-learn regressor each fitted number is taken to be used in one multiplication and one
    addition, which holds for linear, kernel and network models.

    Parameters
    ----------
    features
        What the regressor's columns are.
    regressor
        Fitted.
    """
    count = sum(_of_atom(atom) for atom in features.atoms)
    for step in composition_plan(features.terms, features.atoms):
        count += 1 if step.column is not None else len(step.atoms) - 1
    network = getattr(regressor, "network_", None)
    if network is not None:
        centres, inputs = network.centres.shape
        return count + centres * (3 * inputs + 3) + 2 * len(network.linear)
    return count + 2 * (parameter_count(regressor) - 1)


def _of_atom(atom: Atom) -> int:
    signal = 2 * (len(atom.signal.sensors) - 1)
    if atom.window is None:
        return signal + _MEMORIES.get(atom.operator, 0)
    return signal + _WINDOWS[atom.window.method] + (2 if atom.operator == "sign" else 0)
