"""The nominal gyro of one unit, on true or on recorded temperatures."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from fogml.arrays import FloatArray

PRIOR_SD = {"e0": 500.0, "k1": 50.0, "k2": 0.5, "b0": 5.0, "b1": 0.05, "b2": 5e-4, "g": 0.5, "m": 2.0}
"""Standard deviations of the priors about 0, units as `Constants`."""
WINDOW_S = 64.0
"""Each of the two windows of DeltaT [s]."""


@dataclass(frozen=True)
class Constants:
    """e0 ppm, k1 ppm/degC, k2 ppm/degC2, b0 deg/h, b1 deg/h/degC, b2 deg/h/degC2, g and m deg/h/degC."""

    e0: float
    k1: float
    k2: float
    b0: float
    b1: float
    b2: float
    g: float
    m: float

    def as_dict(self) -> dict[str, float]:
        """By name."""
        return asdict(self)


def draw_constants(rng: np.random.Generator, two_faces: bool) -> Constants:
    """A unit's constants from their priors; without a sensor on the outer face there is no g."""
    values = {name: float(sd * rng.standard_normal()) for name, sd in PRIOR_SD.items()}
    if not two_faces:
        values["g"] = 0.0
    return Constants(**values)


@dataclass(frozen=True, eq=False)
class Seen:
    """Temperatures that the nominal gyro acts on, true or as recorded.

    Attributes
    ----------
    inner, outer
        degC, shape (n,); `outer` None with one sensor.
    delta
        Of the inner face over two windows of 64 s [degC], shape (n,).
    rate_deg_h
        About the input axis [deg/h], shape (n,).
    """

    inner: FloatArray
    outer: FloatArray | None
    delta: FloatArray
    rate_deg_h: FloatArray


def output(constants: Constants, seen: Seen) -> FloatArray:
    """The nominal output without noise [deg/h], shape (n,)."""
    c, u = constants, seen.inner - 25.0
    y = (1.0 + 1e-6 * (c.e0 + c.k1 * u + c.k2 * u * u)) * seen.rate_deg_h
    y = y + c.b0 + c.b1 * u + c.b2 * u * u + c.m * seen.delta
    if seen.outer is not None:
        y = y + c.g * (seen.inner - seen.outer)
    return y


def temperature_slopes(constants: Constants, sample_s: float) -> tuple[float, float]:
    """What a degree of independent noise on the sensors does to a replay's output, rms [deg/h/degC].

    At rest, and by the scale factor for each deg/s that it turns at.
    """
    c = constants
    held = max(WINDOW_S / sample_s, 1.0)
    rest = float(np.sqrt(c.b1**2 + 2.0 * c.g**2 + 2.0 * c.m**2 / held))
    return rest, 3600e-6 * float(np.hypot(c.k1, 50.0 * c.k2))


def names(turning: bool, two_faces: bool) -> tuple[str, ...]:
    """Constants that show: without table rates those of the scale factor are one with the bias'."""
    bias = ("b0", "b1", "b2", "m", *(("g",) if two_faces else ()))
    return (*bias, "e0", "k1", "k2") if turning else bias


def columns(seen: Seen, wanted: tuple[str, ...]) -> FloatArray:
    """Response of the output to a unit of each wanted constant, shape (n, p)."""
    u, rate = seen.inner - 25.0, 1e-6 * seen.rate_deg_h
    parts = {"b0": np.ones_like(u), "b1": u, "b2": u * u, "m": seen.delta}
    parts |= {"e0": rate, "k1": rate * u, "k2": rate * u * u}
    if seen.outer is not None:
        parts["g"] = seen.inner - seen.outer
    return np.stack([parts[name] for name in wanted], axis=1)


def delta_of_record(time: FloatArray, inner: FloatArray, window_s: float = WINDOW_S) -> FloatArray:
    """Mean of a recorded temperature over the last 64 s less that over the 64 s before, shape (n,).

    Samples stand for the interval that ends at them; windows cut by the start take what there is.
    """
    step = np.diff(time, prepend=2.0 * time[0] - time[1])
    integral = np.concatenate([[0.0], np.cumsum(inner * step)])
    edges = np.concatenate([[time[0] - step[0]], time])

    def upto(t: FloatArray) -> FloatArray:
        return np.asarray(np.interp(t, edges, integral))

    start = edges[0]
    middle = np.maximum(time - window_s, start)
    past = np.maximum(time - 2.0 * window_s, start)
    recent = (upto(time) - upto(middle)) / (time - middle)
    full = middle - past > 0.999 * window_s
    older = (upto(middle) - upto(past)) / np.where(full, middle - past, 1.0)
    return np.where(full, recent - older, 0.0)
