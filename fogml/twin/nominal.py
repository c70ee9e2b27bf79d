"""The nominal gyro: scale factor and bias with their first temperature terms.

::

    gyro = (1 + 1e-6 (e0 + k1 u + k2 u**2)) (3600 rate + earth)
           + b0 + b1 u + b2 u**2 + g (T_in - T_out) + m DeltaT,      u = T - 25 degC

DeltaT is the mean of T over the last 64 s less that over the 64 s before [degC].
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity, limited

DELTA_WINDOW_S = 64.0
DELTA = "DeltaT"
"""Name of the slope with DeltaT."""


@dataclass(frozen=True)
class NominalConstants:
    """Constants of one unit, shared by all of its runs.

    ``e0`` ppm, ``k1`` ppm/degC, ``k2`` ppm/degC**2, ``b0`` deg/h, ``b1`` deg/h/degC,
    ``b2`` deg/h/degC**2, ``g`` deg/h/degC, ``m`` deg/h/degC.

    Raises
    ------
    InputError
        If one is not a finite number. `QUANTITIES` limits what a twin has, not the steps of a fit.
    """

    e0: float = 0.0
    k1: float = 0.0
    k2: float = 0.0
    b0: float = 0.0
    b1: float = 0.0
    b2: float = 0.0
    g: float = 0.0
    m: float = 0.0

    def __post_init__(self) -> None:
        for quantity in QUANTITIES:
            quantity.check_finite(getattr(self, quantity.name), "nominal")


UNITS = {
    "e0": "ppm",
    "k1": "ppm/degC",
    "k2": "ppm/degC2",
    "b0": "deg/h",
    "b1": "deg/h/degC",
    "b2": "deg/h/degC2",
    "g": "deg/h/degC",
    "m": "deg/h/degC",
}
QUANTITIES: tuple[Quantity, ...] = tuple(limited(name, unit, -1e9, 1e9) for name, unit in UNITS.items())
"""Limits are beyond an output of reversed sign, whose e0 is -2e6 ppm."""
PRIOR_SD = NominalConstants(e0=500.0, k1=50.0, k2=0.5, b0=5.0, b1=0.05, b2=5e-4, g=0.5, m=2.0)
"""Standard deviations of the normal priors with mean 0."""
NAMES = tuple(field.name for field in fields(NominalConstants))


def delta_temperature(inputs: Inputs) -> FloatArray:
    """DeltaT [degC], shape (n,)."""
    if DELTA not in inputs.cache:
        inputs.cache[DELTA] = delta_of(inputs, DELTA, inputs.temperature())
    return inputs.cache[DELTA]


def delta_of(inputs: Inputs, key: str, values: FloatArray) -> FloatArray:
    """Mean of a course over the last 64 s less that over the 64 s before; `key` names it in the memory."""
    return inputs.memory.difference(key, inputs.time, values, DELTA_WINDOW_S, whole=inputs.whole_windows)


def has_gradient(inputs: Inputs) -> bool:
    """Whether inner and outer face are told apart, so that `g` acts."""
    return "T_out" in inputs.temperatures and ("T_in" in inputs.temperatures or "T" in inputs.temperatures)


def scale_factor_ppm(inputs: Inputs, constants: NominalConstants) -> FloatArray:
    """Nominal scale factor error [ppm], shape (n,)."""
    u = inputs.u()
    return constants.e0 + u * (constants.k1 + constants.k2 * u)


def bias_deg_h(inputs: Inputs, constants: NominalConstants) -> FloatArray:
    """Nominal bias [deg/h], shape (n,)."""
    u = inputs.u()
    bias = constants.b0 + u * (constants.b1 + constants.b2 * u)
    if constants.g != 0.0 and has_gradient(inputs):
        bias = bias - constants.g * inputs.gradient
    if constants.m != 0.0:
        bias = bias + constants.m * delta_temperature(inputs)
    return bias


def nominal_columns(inputs: Inputs) -> dict[str, FloatArray]:
    """Response of the output [deg/h] to a unit of each constant, each of shape (n,)."""
    u, rate = inputs.u(), 1e-6 * inputs.input_rate_deg_h
    columns = {
        "e0": rate,
        "k1": rate * u,
        "k2": rate * u * u,
        "b0": np.ones(len(inputs)),
        "b1": u,
        "b2": u * u,
        "m": delta_temperature(inputs),
    }
    if has_gradient(inputs):
        columns["g"] = -inputs.gradient
    return columns


def temperature_slopes(inputs: Inputs, constants: NominalConstants) -> dict[str, FloatArray]:
    """Change of the nominal output with each temperature and with DeltaT [deg/h/degC], each of shape (n,)."""
    u, rate = inputs.u(), 1e-6 * inputs.input_rate_deg_h
    slope = constants.b1 + 2.0 * constants.b2 * u + rate * (constants.k1 + 2.0 * constants.k2 * u)
    slopes = {"T": slope, DELTA: np.full(len(inputs), constants.m)}
    if has_gradient(inputs):
        slopes["T_in"] = np.full(len(inputs), constants.g)
        slopes["T_out"] = np.full(len(inputs), -constants.g)
    return slopes
