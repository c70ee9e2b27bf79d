"""scikit-learn's regressors as constant, linear part and Gaussians: what is linear, and Gaussian kernels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fogml.arrays import FloatArray
from fogml.models.compact import affine
from fogml.models.rbf.network import Network

_PROBES = 64
_AFFINE = 1e-9
"""Departure from a straight line up to which a regressor counts as linear, as a share of its values."""


class _Machine(NamedTuple):
    """A kernel machine over standardised columns: ``constant + linear . u + sum_j weights_j exp(...)``."""

    centres: FloatArray
    widths: FloatArray
    weights: FloatArray
    linear: FloatArray
    constant: float


def network_of_sklearn(regressor: Any) -> Network | None:
    """The network that computes what a scaled regressor of `SklearnModel` computes; None if there is none.

    Linear regressors are told by their values, whatever they are called; of kernel machines those with a
    Gaussian kernel are taken: SVR, NuSVR, KernelRidge, and Gaussian processes whose kernel is a sum of
    Gaussians, linear parts, constants and white noise.
    """
    pipeline: Any = getattr(regressor, "regressor_", None)
    if not hasattr(pipeline, "steps"):
        return None
    inputs, fitted, output = pipeline[0], pipeline[-1], regressor.transformer_
    machine = _kernel_machine(fitted) or _linear(fitted, len(inputs.mean_))
    if machine is None:
        return None
    shift, scale = inputs.mean_, inputs.scale_
    size, level = float(output.scale_[0]), float(output.mean_[0])
    linear = size * machine.linear / scale
    constant = level + size * machine.constant - float(linear @ shift)
    if not len(machine.weights):
        return affine(linear, constant)
    columns = np.arange(len(shift))
    centres, widths = shift + scale * machine.centres, scale * machine.widths
    return Network(columns, centres, widths, size * machine.weights, linear, constant)


def _linear(fitted: Any, width: int) -> _Machine | None:
    points = np.vstack([np.zeros(width), np.eye(width)])
    values = np.asarray(fitted.predict(points), dtype=np.float64).reshape(-1)
    linear, constant = values[1:] - values[0], float(values[0])
    probes = 4.0 * np.random.default_rng(0).standard_normal((_PROBES, width))
    off = np.asarray(fitted.predict(probes)).reshape(-1) - probes @ linear - constant
    if not np.abs(off).max() <= _AFFINE * (1.0 + np.abs(values).max()):
        return None
    none = np.empty((0, width))
    return _Machine(none, none, np.empty(0), linear, constant)


def _kernel_machine(fitted: Any) -> _Machine | None:
    name = type(fitted).__name__
    if name in ("SVR", "NuSVR") and fitted.kernel == "rbf":
        # What `gamma` came to is told by no public attribute; the columns are standardised.
        gamma = float(fitted._gamma)
        return _gaussians(
            fitted.support_vectors_, gamma, fitted.dual_coef_.reshape(-1), float(fitted.intercept_[0])
        )
    if name == "KernelRidge" and fitted.kernel == "rbf":
        gamma = 1.0 / fitted.X_fit_.shape[1] if fitted.gamma is None else float(fitted.gamma)
        return _gaussians(fitted.X_fit_, gamma, fitted.dual_coef_.reshape(-1), 0.0)
    if name == "GaussianProcessRegressor":
        return _process(fitted)
    return None


def _gaussians(centres: FloatArray, gamma: float, weights: FloatArray, constant: float) -> _Machine:
    widths = np.full(centres.shape, gamma**-0.5)
    return _Machine(np.asarray(centres), widths, weights, np.zeros(centres.shape[1]), constant)


def _process(fitted: Any) -> _Machine | None:
    """Mean of a Gaussian process: its kernel's parts, each times the weights of the training rows."""
    rows, alpha = fitted.X_train_, np.asarray(fitted.alpha_).reshape(-1)
    parts = _parts(fitted.kernel_, 1.0)
    if parts is None:
        return None
    centres, widths, weights = [np.empty((0, rows.shape[1]))], [np.empty((0, rows.shape[1]))], [np.empty(0)]
    linear, constant = np.zeros(rows.shape[1]), 0.0
    for kernel, factor in parts:
        name = type(kernel).__name__
        if name == "RBF":
            centres.append(rows)
            lengths = np.broadcast_to(np.sqrt(2.0) * np.asarray(kernel.length_scale), rows.shape)
            widths.append(lengths)
            weights.append(factor * alpha)
        elif name == "DotProduct":
            linear = linear + factor * (alpha @ rows)
            constant += factor * float(kernel.sigma_0) ** 2 * float(alpha.sum())
        else:
            constant += factor * float(kernel.constant_value) * float(alpha.sum())
    level, size = np.reshape(fitted._y_train_mean, -1)[0], np.reshape(fitted._y_train_std, -1)[0]
    return _Machine(
        np.concatenate(centres),
        np.concatenate(widths),
        size * np.concatenate(weights),
        size * linear,
        float(level + size * constant),
    )


def _parts(kernel: Any, factor: float) -> list[tuple[Any, float]] | None:
    """A kernel as a sum of its parts with their factors; None where it is no such sum."""
    name = type(kernel).__name__
    if name in ("RBF", "DotProduct", "ConstantKernel"):
        return [(kernel, factor)]
    if name == "WhiteKernel":
        return []  # of other rows it says nothing
    if name == "Sum":
        both = [_parts(part, factor) for part in (kernel.k1, kernel.k2)]
        return None if None in both else [part for parts in both for part in parts or ()]
    if name == "Product":
        for one, other in ((kernel.k1, kernel.k2), (kernel.k2, kernel.k1)):
            if type(one).__name__ == "ConstantKernel":
                return _parts(other, factor * float(one.constant_value))
    return None
