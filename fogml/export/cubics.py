"""Cubics over one temperature, of up to three axes, as autopilots' parameter files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.export.static_curve import StaticCurve

PX4_FILE, ARDUPILOT_FILE = "fogml_px4.params", "fogml_ardupilot.param"
ARDUPILOT_REFERENCE_DEGC = 35.0
"""TEMP_REFERENCE of ArduPilot: where its polynomials have their zero."""
ARDUPILOT_SHARE = 1e-6
"""What ArduPilot multiplies the coefficients of its parameters by (INV_SCALE_FACTOR)."""
RAD_S_PER_DEG_H = np.pi / 180.0 / 3600.0
_MAV_FLOAT, _MAV_INT = 9, 6
_NUMBERS = {"x": 0, "y": 1, "z": 2}


def write_cubics(
    folder: Path, to: str, curves: Mapping[str, StaticCurve]
) -> tuple[dict[str, dict[str, Any]], dict[str, float], dict[str, Callable[[FloatArray], FloatArray]]]:
    """Write a parameter file, and tell of each axis its coefficients and errors.

    Parameters
    ----------
    folder
        An existing folder.
    to
        ``px4`` or ``ardupilot``.
    curves
        By axis: the model at rest.

    Returns
    -------
    told, largest, cubics
        By axis: what ``export.json`` says, the largest error at rest [deg/h], and the bias [deg/h] that is
        subtracted at temperatures [degC], beyond the range that at its end.

    Raises
    ------
    InputError
        If an axis is none of x, y and z, a model has a scale factor, or they are over several thermometers.
    """
    thermometers = dict.fromkeys("T_in" if c.thermometer == "T" else c.thermometer for c in curves.values())
    if len(thermometers) > 1:
        raise InputError(
            f"export: {to} reads one thermometer for all axes; these models are over "
            f"{' and '.join(thermometers)}: train them with the same one, or export --to segments"
        )
    low = max(float(curve.temperature[0]) for curve in curves.values())
    high = min(float(curve.temperature[-1]) for curve in curves.values())
    if not low < high:
        raise InputError("export: the axes were trained at different temperatures; they share no range")
    reference, share = 0.5 * (low + high), np.ones(4)
    if to == "ardupilot":
        reference = ARDUPILOT_REFERENCE_DEGC
        share[1:] = ARDUPILOT_SHARE
    told: dict[str, dict[str, Any]] = {}
    coefficients: dict[int, FloatArray] = {}
    cubics: dict[str, Callable[[FloatArray], FloatArray]] = {}
    for axis, curve in curves.items():
        if axis not in _NUMBERS:
            raise InputError(f"export: {to} knows the axes x, y and z; the model is of axis {axis}")
        if np.any(curve.scale != 1.0):
            raise InputError(f"export: {to} has no scale factor over temperature; export the bias model")
        within = (curve.temperature >= low) & (curve.temperature <= high)
        temperature, bias = curve.temperature[within], curve.bias[within] * RAD_S_PER_DEG_H
        fit = Polynomial.fit(temperature - reference, bias, 3).convert()
        # Of a curve that is constant the higher powers are left out.
        cubic = np.zeros(4)
        cubic[: len(fit.coef)] = fit.coef
        held = (cubic / share).astype(np.float32).astype(np.float64)
        coefficients[_NUMBERS[axis]] = held
        cubics[axis] = partial(_cubic, share * held / RAD_S_PER_DEG_H, low, high, reference)
        off = cubics[axis](temperature) - curve.bias[within]
        told[axis] = {
            "coefficients": [float(number) for number in held],
            "reference_degc": reference,
            "rms_difference_at_rest": float(np.sqrt(np.mean(off**2))),
            "largest_difference_at_rest": float(np.max(np.abs(off))),
        }
    text = _px4 if to == "px4" else _ardupilot
    name = PX4_FILE if to == "px4" else ARDUPILOT_FILE
    (folder / name).write_text(text(coefficients, low, high, reference), encoding="ascii")
    return told, {axis: values["largest_difference_at_rest"] for axis, values in told.items()}, cubics


def _cubic(
    held: FloatArray, low: float, high: float, reference: float, temperature: FloatArray
) -> FloatArray:
    return np.asarray(np.polynomial.polynomial.polyval(np.clip(temperature, low, high) - reference, held))


def _px4(coefficients: Mapping[int, FloatArray], low: float, high: float, reference: float) -> str:
    """The format of QGroundControl: vehicle, component, name, value and type, with tabs."""
    floats = {"TC_G0_TMIN": low, "TC_G0_TMAX": high, "TC_G0_TREF": reference}
    for axis, held in coefficients.items():
        floats |= {f"TC_G0_X{power}_{axis}": float(value) for power, value in enumerate(held)}
    lines = [
        "# Gyro rate offsets over temperature, written by fogml.",
        "# Set TC_G0_ID to the device id of the sensor (CAL_GYRO0_ID) before TC_G_ENABLE takes effect.",
        "# X0 is the whole offset; an offset of a calibration is taken off beside it: set "
        + ", ".join(f"CAL_GYRO0_{'XYZ'[axis]}OFF" for axis in coefficients)
        + " to 0.",
        "# Vehicle-Id Component-Id Name Value Type",
        f"1\t1\tTC_G_ENABLE\t1\t{_MAV_INT}",
        *(f"1\t1\t{name}\t{np.float32(value):.9g}\t{_MAV_FLOAT}" for name, value in floats.items()),
    ]
    return "\n".join(lines) + "\n"


def _ardupilot(coefficients: Mapping[int, FloatArray], low: float, high: float, reference: float) -> str:
    shown = min(max(reference, low), high)
    from_reference = (ARDUPILOT_SHARE ** np.array([0, 1, 1, 1])) * (shown - reference) ** np.arange(4)
    lines = [
        "# Gyro rate offsets over temperature, written by fogml.",
        "INS_TCAL1_ENABLE,1",
        f"INS_TCAL1_TMIN,{low:.9g}",
        f"INS_TCAL1_TMAX,{high:.9g}",
    ]
    for axis, held in coefficients.items():
        letter = "XYZ"[axis]
        lines += [f"INS_TCAL1_GYR{power}_{letter},{np.float32(held[power]):.9g}" for power in (1, 2, 3)]
        lines.append(f"INS_GYROFFS_{letter},{np.float32(from_reference @ held):.9g}")
    return "\n".join([*lines, f"INS_GYR1_CALTEMP,{shown:.9g}"]) + "\n"
