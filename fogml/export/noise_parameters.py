"""Noise terms as others read them: kalibr's IMU file, MATLAB's ``gyroparams``, and a Kalman filter's Q."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fogml import __version__
from fogml.arrays import FloatArray
from fogml.errors import InputError, known_are
from fogml.escaping import visible
from fogml.json_files import json_text

KALMAN_SCHEMA = "fogml.kalman/1"
TOGETHER = (
    "held or filtered samples go together: each varies by less than R, by which they count as white ones"
)
_RADIAN = math.pi / 180.0
_HOUR_S = 3600.0


@dataclass(frozen=True)
class NoiseParameters:
    """Noise terms of a gyro in SI units, densities of two-sided spectra.

    Attributes
    ----------
    white
        Angle random walk N [rad/s/sqrt(Hz)], which is rad/sqrt(s).
    walk
        Rate random walk K [rad/s^2/sqrt(Hz)], which is (rad/s)*sqrt(Hz).
    instability
        Bias instability B [rad/s]; None where the run does not tell it.
    interval_s
        Sample interval of the run [s].
    run
        Its name.
    span_s
        How long it is [s].
    quantisation
        Quantisation noise Q of the angle [rad]; 0 where the run does not tell it.
    together
        Whether the output is held or filtered, so that its samples go together.
    bounds
        Terms of which the upper end of the interval is given, as the run does not tell them from nothing.
    """

    white: float
    walk: float
    instability: float | None
    interval_s: float
    run: str
    span_s: float
    quantisation: float = 0.0
    together: bool = False
    bounds: tuple[str, ...] = ()


def noise_parameters(noise: Mapping[str, Any]) -> NoiseParameters:
    """The parameters of a ``noise.json``.

    A term that the run does not tell from nothing stands with the upper end of its interval.

    Raises
    ------
    InputError
        If the run tells no angle random walk or no rate random walk at all.
    """
    bounds: list[str] = []

    def term(name: str, what: str) -> float:
        told = noise["terms"][name]
        if told["value"]:
            return float(told["value"])
        high = (told.get("ci") or [None, None])[1]
        if not high:
            reason = f" ({told['reason']})" if told.get("reason") else ""
            raise InputError(
                f"{noise['run']}: tells no {what}{reason}, which the file has to state; give a longer run at "
                "constant temperature"
            )
        bounds.append(name)
        return float(high)

    white = term("N", "angle random walk") * _RADIAN / math.sqrt(_HOUR_S)
    walk = term("K", "rate random walk") * _RADIAN / _HOUR_S / math.sqrt(_HOUR_S)
    flat = noise["terms"]["B"]["value"]
    instability = float(flat) * _RADIAN / _HOUR_S if flat else None
    return NoiseParameters(
        white=white,
        walk=walk,
        instability=instability,
        interval_s=float(noise["sample_s"]),
        run=str(noise["run"]),
        span_s=float(noise["span_s"]),
        quantisation=1e-6 * float(noise["terms"]["Q"]["value"] or 0.0),
        together=bool(noise.get("hold") or noise.get("filter")),
        bounds=tuple(bounds),
    )


def process_noise(white: float, walk: float, interval_s: float) -> list[list[float]]:
    """Q of the state (angle, bias) over an interval [rad^2, rad^2/s; rad^2/s, rad^2/s^2].

    For ``d angle/dt = bias + w``, ``d bias/dt = u`` with white w of density N and u of density K, the
    integral of ``exp(F s) diag(N^2, K^2) exp(F s)'`` from 0 to T is
    ``[[N^2 T + K^2 T^3/3, K^2 T^2/2], [K^2 T^2/2, K^2 T]]``.

    Parameters
    ----------
    white, walk
        N [rad/s/sqrt(Hz)] and K [rad/s^2/sqrt(Hz)].
    interval_s
        T [s].
    """
    n, k, t = white * white, walk * walk, interval_s
    cross = 0.5 * k * t * t
    return [[n * t + k * t**3 / 3.0, cross], [cross, k * t]]


def sample_variance(found: NoiseParameters) -> float:
    """Variance of one sample of the rate [rad^2/s^2]: ``N^2/T``, and ``2 Q^2/T^2`` of an angle read twice."""
    return found.white**2 / found.interval_s + 2.0 * (found.quantisation / found.interval_s) ** 2


@dataclass(frozen=True)
class Instability:
    """Flicker as a sum of independent first-order Gauss-Markov processes that add to the bias.

    With one time constant a decade, each of variance ``B^2 ln 10 / pi``, the densities add to the
    ``B^2/(2 pi f)`` of IEEE Std 952 (two-sided).

    Attributes
    ----------
    time_s
        Time constants [s], shape (m,).
    variance
        Of each, at the start too [rad^2/s^2].
    transition, noise
        Of the state (angle, bias, the processes) over an interval, each of shape (2 + m, 2 + m).
    """

    time_s: FloatArray
    variance: float
    transition: FloatArray
    noise: FloatArray


def with_instability(found: NoiseParameters, per_decade: float = 1.0, nodes: int = 64) -> Instability:
    """Transition and Q over an interval with bias instability as states of its own.

    Time constants go from the run's span, beyond which a run does not tell flicker from a constant, down to
    a third of the interval, or of the averaging time at which white noise is as large.

    Parameters
    ----------
    found
        With ``instability`` told.
    per_decade
        Time constants in a factor of ten: one keeps the Allan deviation within 4 % (up to half the span).
    nodes
        Of the Gauss-Legendre quadrature of ``integral of exp(F s) G exp(F s)'``.
    """
    assert found.instability
    instability = found.instability
    crossing_s = (found.white / instability) ** 2 * math.pi / (2.0 * math.log(2.0))
    shortest_s = max(found.interval_s, crossing_s) / 3.0
    count = max(1, 1 + math.ceil(per_decade * math.log10(found.span_s / shortest_s)))
    times = found.span_s * 10.0 ** (-np.arange(count) / per_decade)
    variance = instability**2 * math.log(10.0) / (math.pi * per_decade)

    def transition(after_s: float) -> FloatArray:
        phi = np.eye(2 + count)
        phi[0, 1:] = after_s, *(-times * np.expm1(-after_s / times))
        phi[2:, 2:] = np.diag(np.exp(-after_s / times))
        return phi

    driven = np.diag([found.white**2, found.walk**2, *(2.0 * variance / times)])
    places, weights = np.polynomial.legendre.leggauss(nodes)
    half = 0.5 * found.interval_s
    parts = [
        w * phi @ driven @ phi.T
        for x, w in zip(places, weights, strict=True)
        for phi in [transition(half * (1.0 + x))]
    ]
    return Instability(times, variance, transition(found.interval_s), half * np.sum(parts, axis=0))


def _head(found: NoiseParameters, mark: str) -> str:
    lines = [f"{mark} fogml {__version__}: noise of {visible(found.run)}"]
    if found.bounds:
        lines.append(
            f"{mark} {' and '.join(found.bounds)}: upper end of the 90 % interval, as the run tells no value"
        )
    return "\n".join(lines) + "\n"


def _kalibr(found: NoiseParameters) -> str:
    return _head(found, "#") + (
        "# The gyroscope's part of an imu.yaml; those of the accelerometer come from a test of its own.\n"
        f"gyroscope_noise_density: {found.white:.9e}  # [rad/s/sqrt(Hz)], angle random walk N\n"
        f"gyroscope_random_walk: {found.walk:.9e}  # [rad/s^2/sqrt(Hz)], rate random walk K\n"
        + _no_place(found)
        + f"update_rate: {1.0 / found.interval_s:.9g}  # [Hz]\n"
    )


def _no_place(found: NoiseParameters) -> str:
    if found.instability is None:
        return ""
    return f"# Neither holds the bias instability B, {found.instability:.9e} rad/s; noise.kalman.json does.\n"


def _matlab(found: NoiseParameters) -> str:
    pairs = [f"'NoiseDensity', {found.white:.9e}, ...  % [(rad/s)/sqrt(Hz)] N"]
    if found.instability is not None:
        pairs.append(f"'BiasInstability', {found.instability:.9e}, ...  % [rad/s] B")
    pairs.append(f"'RandomWalk', {found.walk:.9e}, ...  % [(rad/s)*sqrt(Hz)] K")
    pairs.append("'NoiseType', 'double-sided');  % releases without NoiseType: leave this pair out")
    return _head(found, "%") + "params = gyroparams( ...\n    " + "\n    ".join(pairs) + "\n"


def _kalman(found: NoiseParameters) -> str:
    values = {
        "schema": KALMAN_SCHEMA,
        "run": found.run,
        "interval_s": found.interval_s,
        "state": ["angle [rad]", "bias [rad/s]"],
        "F": [[0.0, 1.0], [0.0, 0.0]],
        "transition": [[1.0, found.interval_s], [0.0, 1.0]],
        "Q": process_noise(found.white, found.walk, found.interval_s),
        "Q_units": [["rad^2", "rad^2/s"], ["rad^2/s", "rad^2/s^2"]],
        "R": sample_variance(found),
        "R_unit": "rad^2/s^2, of one sample of the rate",
        **({"R_note": TOGETHER} if found.together else {}),
        "N": {"value": found.white, "unit": "rad/s/sqrt(Hz)"},
        "K": {"value": found.walk, "unit": "rad/s^2/sqrt(Hz)"},
        "upper_ends": list(found.bounds),
        **_instability_json(found),
        "fogml_version": __version__,
    }
    text = json_text(values, "kalman", indent=1)
    # A row of a matrix on a line.
    return re.sub(r"\[\n([^][]*?)\n *\]", lambda row: f"[{' '.join(row[1].split())}]", text) + "\n"


def _instability_json(found: NoiseParameters) -> dict[str, Any]:
    if found.instability is None:
        return {}
    model = with_instability(found)
    names = [f"flicker {time_s:.3g} s [rad/s]" for time_s in model.time_s]
    return {
        "B": {"value": found.instability, "unit": "rad/s"},
        "with_B": {
            "note": "Q above is of N and K alone; here the rate's bias is the sum of bias and flickers",
            "state": ["angle [rad]", "bias [rad/s]", *names],
            "time_constants_s": model.time_s.tolist(),
            "variance_at_start": [model.variance] * len(names),
            "transition": model.transition.tolist(),
            "Q": model.noise.tolist(),
        },
    }


TARGETS: dict[str, tuple[str, Callable[[NoiseParameters], str]]] = {
    "kalibr": ("noise.kalibr.yaml", _kalibr),
    "matlab": ("noise_gyroparams.m", _matlab),
    "kalman": ("noise.kalman.json", _kalman),
}
"""Name of what reads it: the file's name, and its writer."""


def check_target(to: str) -> None:
    """Check that something reads the terms under this name."""
    if to not in TARGETS:
        raise InputError(f"--to '{to}' is not known; {known_are(to, TARGETS)}")


def noise_text(noise: Mapping[str, Any], to: str) -> tuple[str, str]:
    """File name and text of a ``noise.json`` for another program.

    Raises
    ------
    InputError
        For an unknown target, and as `noise_parameters`.
    """
    check_target(to)
    name, write = TARGETS[to]
    return name, write(noise_parameters(noise))
