"""The one compact form of a fitted model: what every export writes, and what its cost is counted from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.errors import InputError
from fogml.models.regressors import goes_on_linearly

if TYPE_CHECKING:
    from fogml.models.rbf.network import Network

FloatArray = NDArray[np.float64]


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
        network: Network = regressor.compact()
        return network
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
        raise InputError(
            f"a model of kind '{kind}' has no compact form: it is no linear part and Gaussians, as linear "
            "models, rbf, and SVR, KernelRidge and Gaussian processes of Gaussian kernel are; export it "
            "--to onnx, which takes its features"
        )
    return Compact(kind, network, linear_beyond=goes_on_linearly(regressor))
