"""North seeking from positions of one gyro with a horizontal input axis, and what a drift does to it.

With theta the azimuth clockwise from north, turned by angles a_j, s = +1 clockwise, s = -1 else::

    G_j = H cos(theta + s a_j) + D(t_j),      H = 15.041067 deg/h cos(latitude)

Azimuth and offset are a least-squares solution; for 0, 90, 180, 270 deg clockwise it is
theta = atan2(G4 - G2, G1 - G3). A drift adds p_c to H cos(theta) and p_s to H sin(theta), whatever theta,
so::

    tan(error) = (p_s cos(theta) - p_c sin(theta)) / (H + p_c cos(theta) + p_s sin(theta))

It is nothing at theta = atan2(p_s, p_c) and 180 deg further, and largest, asin(p / H), +-acos(-p / H) from
there. For a linear drift and four positions clockwise it is
tan(error) = delta (A + B) / (R^2 + delta (A - B)) of the patent, whose quiet azimuths are 135 and 315 deg.

Source: the patent on north seeking at start-up, its formula worked out for any sense, order and drift.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.runs.facts import EARTH_RATE_DEG_H

SENSES = {"cw": 1.0, "ccw": -1.0}
DEFAULT_ORDER = (0.0, 90.0, 180.0, 270.0)
PALINDROME = (0.0, 90.0, 180.0, 270.0, 270.0, 180.0, 90.0, 0.0)


@dataclass(frozen=True)
class Drift:
    """A drift of the bias over the time from power-on, in deg/h.

    Attributes
    ----------
    linear_deg_h_h
        Rate of a linear drift [deg/h per h].
    transients
        Amplitude at power-on [deg/h] and time constant [s] of each exponential.

    Raises
    ------
    InputError
        If a number is not finite or a time constant is not above zero.
    """

    linear_deg_h_h: float = 0.0
    transients: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        if not np.isfinite(self.linear_deg_h_h):
            raise InputError(f"drift {self.linear_deg_h_h:g} deg/h per h: a finite number is needed")
        for amplitude, constant in self.transients:
            if not (np.isfinite(amplitude) and np.isfinite(constant) and constant > 0.0):
                raise InputError(
                    f"transient of {amplitude:g} deg/h with {constant:g} s: finite numbers and a time "
                    "constant above 0 are needed"
                )

    def mean(self, start_s: FloatArray, stop_s: FloatArray) -> FloatArray:
        """Means over spans of time [deg/h], shape of the inputs; exact."""
        start, stop = np.asarray(start_s, dtype=np.float64), np.asarray(stop_s, dtype=np.float64)
        total = self.linear_deg_h_h / 3600.0 * (start + stop) / 2.0
        for amplitude, constant in self.transients:
            share = -np.expm1(-(stop - start) / constant) * constant / (stop - start)
            total = total + amplitude * np.exp(-start / constant) * share
        return np.asarray(total)


@dataclass(frozen=True)
class Scheme:
    """Where and for how long the gyro stands.

    Attributes
    ----------
    order_deg
        Angles of the positions in the order taken, from the first azimuth [deg].
    sense
        ``cw`` where they are counted clockwise seen from above, else ``ccw``.
    dwell_s, transfer_s
        Time in a position, and on the way to the next; none where two that follow are the same [s].
    observes_drift
        Whether a linear drift is solved for as well.
    start_s
        Time from power-on at which the first position begins [s].

    Raises
    ------
    InputError
        If the sense is unknown, a time is not physical or the positions do not tell an azimuth.
    """

    order_deg: tuple[float, ...] = DEFAULT_ORDER
    sense: str = "cw"
    dwell_s: float = 60.0
    transfer_s: float = 0.0
    observes_drift: bool = False
    start_s: float = 0.0

    def __post_init__(self) -> None:
        check_sense(self.sense)
        _check_angles(self.order_deg)
        if not (np.isfinite(self.dwell_s) and self.dwell_s > 0.0):
            raise InputError(f"dwell {self.dwell_s:g} s: a time above 0 is needed")
        if not (np.isfinite(self.transfer_s) and self.transfer_s >= 0.0):
            raise InputError(f"transfer {self.transfer_s:g} s: a time that is not negative is needed")
        if not (np.isfinite(self.start_s) and self.start_s >= 0.0):
            raise InputError(f"start {self.start_s:g} s: a time that is not negative is needed")
        check_design(self.design, self.observes_drift)

    @cached_property
    def spans_s(self) -> tuple[FloatArray, FloatArray]:
        """Begin and end of each position from power-on [s], each of shape (m,)."""
        moved = np.diff(np.asarray(self.order_deg)) % 360.0 != 0.0
        gaps = np.concatenate([[0.0], np.where(moved, self.transfer_s, 0.0)])
        begin = self.start_s + np.cumsum(gaps) + self.dwell_s * np.arange(len(self.order_deg))
        return begin, begin + self.dwell_s

    @property
    def duration_s(self) -> float:
        """From the first position's begin to the last one's end [s]."""
        begin, end = self.spans_s
        return float(end[-1] - begin[0])

    @cached_property
    def design(self) -> FloatArray:
        """Columns of H cos(theta), H sin(theta), offset and, if observed, drift, shape (m, 3 or 4)."""
        begin, end = self.spans_s
        return design_matrix(self.order_deg, self.sense, (begin + end) / 2.0 if self.observes_drift else None)

    @cached_property
    def solver(self) -> FloatArray:
        """What the positions' means are multiplied with, shape (3 or 4, m)."""
        return np.asarray(np.linalg.pinv(self.design))

    def outputs(self, azimuth_deg: float | FloatArray, horizontal_deg_h: float) -> FloatArray:
        """Outputs without drift [deg/h], shape (..., m)."""
        angles = np.asarray(azimuth_deg)[..., None] + SENSES[self.sense] * np.asarray(self.order_deg)
        return np.asarray(horizontal_deg_h * np.cos(np.radians(angles)))

    def azimuth(self, means_deg_h: FloatArray) -> FloatArray:
        """Azimuths [deg in 0 to 360] from the positions' means, shape (..., m) to (...)."""
        found = np.asarray(means_deg_h) @ self.solver[:2].T
        return np.asarray(np.degrees(np.arctan2(found[..., 1], found[..., 0])) % 360.0)

    def variance_factor(self, azimuth_deg: float | FloatArray) -> FloatArray:
        """Variance of the azimuth [rad^2] times (H / sd of a position's mean)^2."""
        theta = np.radians(np.asarray(azimuth_deg))
        across = -np.sin(theta)[..., None] * self.solver[0] + np.cos(theta)[..., None] * self.solver[1]
        return np.asarray(np.sum(across**2, axis=-1))


@dataclass(frozen=True)
class DriftError:
    """What a drift does to the azimuth of a scheme: closed form.

    ``cosine`` and ``sine`` are p_c and p_s, ``horizontal`` H [deg/h].
    """

    cosine: float
    sine: float
    horizontal: float

    @property
    def size(self) -> float:
        """p [deg/h]."""
        return float(np.hypot(self.cosine, self.sine))

    def at(self, azimuth_deg: float | FloatArray) -> FloatArray:
        """Error of the azimuth [deg] at azimuths, same shape."""
        theta = np.radians(np.asarray(azimuth_deg, dtype=np.float64))
        across = self.sine * np.cos(theta) - self.cosine * np.sin(theta)
        along = self.horizontal + self.cosine * np.cos(theta) + self.sine * np.sin(theta)
        return np.asarray(np.degrees(np.arctan2(across, along)))

    @property
    def seen(self) -> bool:
        """Whether the drift does anything beyond round-off."""
        return self.size > 1e-13 * self.horizontal

    @property
    def quiet_deg(self) -> tuple[float, ...]:
        """The two azimuths without error, ascending [deg]; none where there is no error anywhere."""
        if not self.seen:
            return ()
        first = float(np.degrees(np.arctan2(self.sine, self.cosine)))
        return tuple(sorted(((first) % 360.0, (first + 180.0) % 360.0)))

    @property
    def worst_deg(self) -> tuple[float, ...]:
        """The two azimuths of the greatest error, ascending [deg]; none where there is no error anywhere."""
        if not self.seen:
            return ()
        first = float(np.degrees(np.arctan2(self.sine, self.cosine)))
        share = self.size / self.horizontal if self.size < self.horizontal else 1.0
        away = float(np.degrees(np.arccos(-share)))
        return tuple(sorted(((first - away) % 360.0, (first + away) % 360.0)))

    @property
    def greatest(self) -> float:
        """Greatest error over the circle [deg]; 180 where the drift outdoes the Earth rate."""
        if self.size >= self.horizontal:
            return 180.0
        return float(np.degrees(np.arcsin(self.size / self.horizontal)))

    @property
    def rms(self) -> float:
        """Root mean square over the circle [deg]."""
        azimuths = np.arange(0.0, 360.0, 0.5)
        return float(np.sqrt(np.mean(self.at(azimuths) ** 2)))


def drift_error(scheme: Scheme, drift: Drift, latitude_deg: float) -> DriftError:
    """The closed-form error of a scheme under a drift.

    Raises
    ------
    InputError
        If the latitude is none, or a pole.
    """
    p = scheme.solver[:2] @ drift.mean(*scheme.spans_s)
    return DriftError(float(p[0]), float(p[1]), horizontal_rate(latitude_deg))


def horizontal_rate(latitude_deg: float) -> float:
    """Horizontal part of the Earth rate [deg/h].

    Raises
    ------
    InputError
        If the latitude is none, or a pole, where there is no north.
    """
    if not (np.isfinite(latitude_deg) and abs(latitude_deg) <= 90.0):
        raise InputError(f"latitude {latitude_deg:g} deg: a number from -90 to 90 is needed")
    if abs(latitude_deg) > 89.9:
        raise InputError(
            f"latitude {latitude_deg:g} deg: at a pole the Earth rate has no horizontal part to seek"
        )
    return EARTH_RATE_DEG_H * float(np.cos(np.radians(latitude_deg)))


def check_sense(sense: str) -> None:
    """Hold that a sense is ``cw`` or ``ccw``."""
    if sense not in SENSES:
        raise InputError(f"sense '{sense}': cw (clockwise seen from above) or ccw was expected")


def design_matrix(
    angles_deg: Sequence[float] | FloatArray, sense: str, times_s: FloatArray | None
) -> FloatArray:
    """Columns cos(a), -s sin(a), 1 and, where times are given, hours from their mean, shape (m, 3 or 4)."""
    check_sense(sense)
    _check_angles(angles_deg)
    angles = np.radians(np.asarray(angles_deg, dtype=np.float64))
    columns = [np.cos(angles), -SENSES[sense] * np.sin(angles), np.ones_like(angles)]
    if times_s is not None:
        columns.append((times_s - np.mean(times_s)) / 3600.0)
    return np.column_stack(columns)


def _check_angles(angles_deg: Sequence[float] | FloatArray) -> None:
    if not np.all(np.isfinite(angles_deg)):
        raise InputError(f"order {tuple(angles_deg)}: finite angles in deg are needed")


def check_design(design: FloatArray, observes_drift: bool) -> None:
    """Hold that positions tell an azimuth, and a linear drift if asked."""
    scaled = design / np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    if np.linalg.matrix_rank(scaled[:, :3], tol=1e-6) < 3:
        raise InputError("the positions do not tell an azimuth: at least three different angles are needed")
    if observes_drift and np.linalg.matrix_rank(scaled, tol=1e-6) < 4:
        raise InputError(
            "the positions do not tell a linear drift apart: take four or more at different times"
        )
