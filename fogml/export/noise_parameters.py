"""Noise terms as others read them: kalibr's IMU file, MATLAB's ``gyroparams``, and a Kalman filter's Q."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fogml import __version__
from fogml.errors import InputError, known_are
from fogml.escaping import visible
from fogml.json_files import json_text

KALMAN_SCHEMA = "fogml.kalman/1"
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
    bounds
        Terms of which the upper end of the interval is given, as the run does not tell them from nothing.
    """

    white: float
    walk: float
    instability: float | None
    interval_s: float
    run: str
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
        white, walk, instability, float(noise["sample_s"]), str(noise["run"]), tuple(bounds)
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
        f"update_rate: {1.0 / found.interval_s:.9g}  # [Hz]\n"
    )


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
        "R": found.white**2 / found.interval_s,
        "R_unit": "rad^2/s^2, of one sample of the rate",
        "N": {"value": found.white, "unit": "rad/s/sqrt(Hz)"},
        "K": {"value": found.walk, "unit": "rad/s^2/sqrt(Hz)"},
        "upper_ends": list(found.bounds),
        "fogml_version": __version__,
    }
    return json_text(values, "kalman", indent=1) + "\n"


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
