"""The one compact form of a fitted model, what every export writes; and its operations at each sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.atoms import Atom
from fogml.features.operators import ring_of
from fogml.features.terms import Step
from fogml.models.others_code import compact_by
from fogml.models.regressors import goes_on_linearly, own_regressors

if TYPE_CHECKING:
    from fogml.models.rbf.network import Network


@dataclass(frozen=True, eq=False)
class Compact:
    """A linear part, Gaussians, and a scale factor over temperature, each of which may be empty.

    ``drift = network(f)`` of the feature columns f; with a scale factor, instead
    ``rate = (scale0 + scale1 T + scale2 T^2) output + network(f)``, T being the first column.

    Attributes
    ----------
    kind
        Name of the model, e.g. ``rbf``.
    network
        Constant, linear part and Gaussians [deg/h]; a linear model has no Gaussians, a constant no columns.
    scale
        Shape (3,), or (0,) for none [deg/h per unit of the output, and per degC, degC^2].
    linear_beyond
        Whether it goes on linearly beyond its training rows, so that rates are limited further out.
    """

    kind: str
    network: Network
    scale: FloatArray = field(default_factory=lambda: np.empty(0))
    linear_beyond: bool = False


def affine(linear: ArrayLike, constant: float) -> Network:
    """A network without Gaussians: ``constant + linear . x``."""
    from fogml.models.rbf.network import Network

    none, slopes = np.empty((0, 0)), np.asarray(linear, dtype=np.float64).reshape(-1)
    return Network(np.empty(0, dtype=np.intp), none, none, np.empty(0), slopes, float(constant))


def network_of(regressor: Any) -> Network | None:
    """A fitted regressor in the compact form, exactly; None where it has none, as trees have."""
    if hasattr(regressor, "compact"):
        return compact_by(regressor)
    from fogml.models.sklearn_compact import network_of_sklearn

    return network_of_sklearn(regressor)


def compact_regressor(kind: str, regressor: Any) -> Compact:
    """A fitted regressor of a model of some kind, in the compact form.

    Raises
    ------
    InputError
        If a linear part and Gaussians can't hold it.
    """
    network = network_of(regressor)
    if network is None:
        remedy = "export it --to onnx, which takes its features"
        if kind in own_regressors():
            remedy = "its package gives one by a method 'compact' (fogml.models.compact.network_of)"
        raise InputError(
            f"a model of kind '{kind}' has no compact form: it is no linear part and Gaussians, as linear "
            f"models, rbf, and SVR, KernelRidge and Gaussian processes of Gaussian kernel are; {remedy}"
        )
    return Compact(kind, network, linear_beyond=goes_on_linearly(regressor))


WINDOW_OPERATIONS = {"block": 8, "slope": 10, "exp": 6, "first": 4}
"""Additions, multiplications and divisions of a window's value at a sample."""
HELD_OPERATIONS = {"block": 14, "slope": 26}
"""Those for each sample, or bin of samples, that a window holds; of one's own as many as a slope's."""
EXPONENTIAL_OPERATIONS = 20


def operations_of_features(atoms: Sequence[Atom], steps: Sequence[Step], sample_s: float) -> int:
    """Additions, multiplications and divisions from a sample to feature columns, windows full.

    Operators of one's own count for what they state.
    """
    count = 0
    windows = {(atom.signal, atom.window, atom.operator == "diff") for atom in atoms if atom.window}
    for _, window, _ in windows:
        assert window is not None
        alike = "slope" if window.own is not None else window.method
        count += WINDOW_OPERATIONS[alike]
        count += HELD_OPERATIONS.get(alike, 0) * ring_of([window], sample_s)[0]
    count += sum(declared.operations for atom in atoms if (declared := atom.declared))
    count += sum(2 * len(atom.signal.parts) - 1 for atom in atoms)
    count += 4 * len(atoms)
    return count + sum(len(step.atoms) - (step.column is None) for step in steps)


def operations_of_compact(compact: Compact) -> int:
    """The same from feature columns to drift, inside the trained box."""
    network = compact.network
    count = 2 * len(network.linear) + 1 + 2 * len(compact.scale)
    centres, inputs = network.centres.shape
    if centres:
        edges = len(network.edge.columns)
        along = 4 * inputs + 2 if edges else 0
        count += centres * (4 * inputs + along + EXPONENTIAL_OPERATIONS + 2) + 2 * edges + inputs
    return count
