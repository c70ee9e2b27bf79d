"""Ways to spend the same time on seeking north: plain, drift-observing, palindromic, coarse and fine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.lab.north import SENSES, Drift, Scheme, drift_error, horizontal_rate
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.settings_check import check_whole

Disturbance = Callable[[FloatArray, FloatArray], FloatArray]
"""Means [deg/h] of drift and noise over spans of time from power-on, shape (m,) to (..., m)."""


@dataclass(frozen=True)
class CoarseFine:
    """A short seek, a turn to a quiet azimuth, a long seek: theta = theta_2 + theta_1 - q.

    Attributes
    ----------
    coarse, fine
        Both seeks; the fine one begins after the coarse one and a transfer.
    quiet_deg
        Where the fine one is done.
    """

    coarse: Scheme
    fine: Scheme
    quiet_deg: float


Way = Scheme | CoarseFine


def ways_of_equal_time(
    plain: Scheme, *, coarse_dwell_s: float = 6.0, quiet_deg: float | None = None
) -> tuple[dict[str, Way], dict[str, str]]:
    """Every way to use the time, transfers included, that a plain seek takes.

    Parameters
    ----------
    plain
        The plain seek; sense, order, transfer and start are taken over.
    coarse_dwell_s
        Time in each position of the coarse seek [s].
    quiet_deg
        Where the fine seek is done; the quiet azimuth of a linear drift if None.

    Returns
    -------
    ways, left_out
        Each by its name: ``plain``, ``drift-observing``, ``palindrome``, ``coarse-fine``; and why one is
        left out, where the time or the positions do not suffice for it.
    """
    plain = replace(plain, observes_drift=False)
    palindrome_order = (*plain.order_deg, *plain.order_deg[::-1])
    makers: dict[str, Callable[[], Way]] = {
        "plain": lambda: plain,
        "drift-observing": lambda: replace(plain, observes_drift=True),
        "palindrome": lambda: _filling(replace(plain, order_deg=palindrome_order), plain.duration_s),
        "coarse-fine": lambda: coarse_fine(plain, plain.duration_s, coarse_dwell_s, quiet_deg),
    }
    ways: dict[str, Way] = {}
    left_out: dict[str, str] = {}
    for name, make in makers.items():
        try:
            ways[name] = make()
        except InputError as error:
            left_out[name] = str(error)
    return ways, left_out


def coarse_fine(
    plain: Scheme, time_s: float, coarse_dwell_s: float, quiet_deg: float | None = None
) -> CoarseFine:
    """Coarse and fine seek that together take a time [s], with the transfers and the turn between them."""
    coarse = replace(plain, dwell_s=coarse_dwell_s)
    start = plain.start_s + coarse.duration_s + plain.transfer_s
    spent = start - plain.start_s
    if not spent < time_s:
        raise InputError(
            f"the coarse seek and the turn after it take {spent:g} of {time_s:g} s; stay shorter in its "
            "positions, or longer in all"
        )
    fine = _filling(replace(plain, start_s=start), time_s - spent)
    if quiet_deg is None:
        quiet = quiet_azimuths(fine)
        if not quiet:
            raise InputError("a linear drift does nothing in this order: there is no azimuth to turn to")
        quiet_deg = quiet[0]
    return CoarseFine(coarse, fine, quiet_deg)


def quiet_azimuths(scheme: Scheme, drift: Drift | None = None) -> tuple[float, ...]:
    """Azimuths [deg] at which a drift, linear unless given, does nothing; none if it never does anything."""
    return drift_error(scheme, drift or Drift(1e-3), 0.0).quiet_deg


def _filling(scheme: Scheme, time_s: float) -> Scheme:
    """The scheme with the dwell that fills a time."""
    moving = scheme.duration_s - len(scheme.order_deg) * scheme.dwell_s
    dwell = (time_s - moving) / len(scheme.order_deg)
    if not dwell > 0.0:
        raise InputError(
            f"{time_s:g} s do not suffice for {len(scheme.order_deg)} positions with transfers of "
            f"{scheme.transfer_s:g} s; stay longer, or move faster"
        )
    return replace(scheme, dwell_s=dwell)


def seek(
    way: Way,
    azimuth_deg: FloatArray,
    horizontal_deg_h: float,
    disturbance: Disturbance,
    index_error_deg: tuple[FloatArray, ...] | None = None,
) -> FloatArray:
    """Azimuths found [deg in 0 to 360] at true ones, shape (n,).

    Parameters
    ----------
    way
        How it is done.
    azimuth_deg
        True azimuths, shape (n,).
    horizontal_deg_h
        Horizontal part of the Earth rate.
    disturbance
        Drift and noise.
    index_error_deg
        Errors of the angles that the turntable stands at, shape (n, m) for each seek, if any; a coarse
        and fine one has a third of shape (n,), of the turn between the two.
    """
    errors = index_error_deg or (0.0, 0.0, 0.0)
    if isinstance(way, Scheme):
        return _once(way, azimuth_deg, horizontal_deg_h, disturbance, errors[0])
    first = _once(way.coarse, azimuth_deg, horizontal_deg_h, disturbance, errors[0])
    turned = azimuth_deg + way.quiet_deg - first + errors[2]
    second = _once(way.fine, turned, horizontal_deg_h, disturbance, errors[1])
    return np.asarray((second + first - way.quiet_deg) % 360.0)


def _once(
    scheme: Scheme,
    azimuth_deg: FloatArray,
    horizontal_deg_h: float,
    disturbance: Disturbance,
    index_error_deg: FloatArray | float,
) -> FloatArray:
    angles = SENSES[scheme.sense] * (np.asarray(scheme.order_deg) + index_error_deg)
    outputs = horizontal_deg_h * np.cos(np.radians(np.asarray(azimuth_deg)[..., None] + angles))
    return scheme.azimuth(outputs + disturbance(*scheme.spans_s))


def wrapped(angle_deg: FloatArray | float) -> FloatArray:
    """Angles brought to -180 to 180 deg."""
    return np.asarray((np.asarray(angle_deg) + 180.0) % 360.0 - 180.0)


def error_of(way: Way, azimuth_deg: FloatArray | float, drift: Drift, latitude_deg: float) -> FloatArray:
    """Closed-form error [deg] of a way at true azimuths, same shape."""
    if isinstance(way, Scheme):
        return drift_error(way, drift, latitude_deg).at(azimuth_deg)
    # What is left of the coarse seek's error is how far the fine one stands from the quiet azimuth.
    off = drift_error(way.coarse, drift, latitude_deg).at(azimuth_deg)
    return drift_error(way.fine, drift, latitude_deg).at(way.quiet_deg - off)


def standard_error(
    way: Way, azimuth_deg: FloatArray | float, random_walk_deg_sqrt_h: float, horizontal_deg_h: float
) -> FloatArray:
    """Standard error of the azimuth [deg] under an angle random walk [deg/sqrt(h)], same shape."""
    scheme, at = (way, azimuth_deg) if isinstance(way, Scheme) else (way.fine, way.quiet_deg)
    sd = random_walk_deg_sqrt_h / np.sqrt(scheme.dwell_s / 3600.0)
    found = np.degrees(np.sqrt(scheme.variance_factor(at)) * sd / horizontal_deg_h)
    return np.broadcast_to(found, np.shape(azimuth_deg)).copy()


def simulated_positions(
    scheme: Scheme,
    azimuth_deg: float,
    latitude_deg: float,
    drift: Drift,
    *,
    bias_deg_h: float = 0.0,
    random_walk_deg_sqrt_h: float = 0.0,
    sample_s: float = 1.0,
    seed: int = 0,
) -> Run:
    """A synthetic run of a scheme with a column ``position``, each sample the mean over its interval.

    Samples that are not wholly in a position have position 0; the axis is not simulated on the way.

    Raises
    ------
    InputError
        If a stay is shorter than a sample, or the latitude is not accepted.
    """
    check_whole("seed", seed)
    if not (np.isfinite(sample_s) and 0.0 < sample_s <= scheme.dwell_s):
        raise InputError(f"sample interval {sample_s:g} s: above 0 and no longer than the dwell is needed")
    begin, end = scheme.spans_s
    count = int(np.ceil((end[-1] - begin[0]) / sample_s - 1e-9))
    start = begin[0] + sample_s * np.arange(count)
    stay = np.searchsorted(begin, start + 1e-9, side="right") - 1
    inside = start + sample_s <= end[stay] + 1e-9
    order = list(dict.fromkeys(scheme.order_deg))
    numbers = np.array([order.index(angle) + 1 for angle in scheme.order_deg], dtype=np.float64)
    outputs = scheme.outputs(azimuth_deg, horizontal_rate(latitude_deg))[stay]
    gyro = np.where(inside, outputs, 0.0) + bias_deg_h + drift.mean(start, start + sample_s)
    noise = random_walk_deg_sqrt_h / np.sqrt(sample_s / 3600.0)
    gyro += noise * np.random.default_rng(seed).standard_normal(count)
    facts = Facts(
        unit="synthetic", latitude=latitude_deg, powered_on=0.0, notes="synthetic: simulated positions"
    )
    columns = {"time": start, "gyro": gyro, "position": np.where(inside, numbers[stay], 0.0)}
    return Run("synthetic positions", columns, facts)
