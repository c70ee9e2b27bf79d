"""Tables and cubics over one temperature, of up to three axes: what autopilots and small firmware hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from fogml.arrays import FloatArray
from fogml.errors import InputError, quoted
from fogml.export import segment_files
from fogml.export.documentation import export_card
from fogml.export.losses import averaged_loss, runs_of_each, training_rows
from fogml.export.plan import Plan
from fogml.export.segments import Segments, segments
from fogml.export.settings import SCHEMA, report_tail
from fogml.export.static_curve import StaticCurve
from fogml.intervals import LEVEL
from fogml.models.base import DriftModel
from fogml.numerals import against, stated
from fogml.runs.run import Run
from fogml.yaml_text import read_yaml

AXES = ("x", "y", "z")
TOLERANCE_SHARE = 0.05
"""Error of a table allowed unless stated, as a share of the model's 90 % half-width: 0.1 % more rms."""


@dataclass(frozen=True)
class TableSettings:
    """What is wanted.

    Attributes
    ----------
    to
        ``segments``, ``px4`` or ``ardupilot``.
    dtype
        Number format of generated C: ``float32`` or ``float64``.
    breakpoints
        Of segments; None: as few as the tolerance allows.
    tolerance
        Largest error of a table from the model at rest [deg/h]; None: a share of the model's interval.
    matrix
        File with a 3 x 3 matrix that takes compensated outputs to the body's axes; None for none.
    """

    to: str
    dtype: str | None = None
    breakpoints: int | None = None
    tolerance: float | None = None
    matrix: Path | None = None


def export_tables(
    models: Sequence[DriftModel], folder: Path, settings: TableSettings, train: Sequence[Run] = ()
) -> dict[str, Any]:
    """Write the models' tables or polynomials over temperature into a folder.

    Parameters
    ----------
    models
        One model, or those of two or three axes of one unit.
    folder
        An existing folder.
    settings
        What is wanted.
    train
        Training runs of the models, for what a table loses on them; may be left out.

    Returns
    -------
    dict
        The content of ``export.json``.

    Raises
    ------
    InputError
        If the models are not of different axes, or a form can't hold one within the tolerance.
    """
    if settings.dtype not in (None, "float32", "float64"):
        raise InputError(f"--dtype {settings.dtype}: --to {settings.to} takes float32 and float64")
    named = by_axis(models)
    matrix = None if settings.matrix is None else read_matrix(settings.matrix, len(named))
    plans = {axis: Plan.of(model) for axis, model in named.items()}
    curves = {axis: StaticCurve.of(plan) for axis, plan in plans.items()}
    cards = {axis: export_card(named[axis], plan, None) for axis, plan in plans.items()}
    dtype = settings.dtype or "float32"
    if settings.to == "segments":
        tables = {
            axis: segments(
                curve,
                breakpoints=settings.breakpoints,
                tolerance=_tolerance(settings, named[axis]),
            )
            for axis, curve in curves.items()
        }
        losses = {
            axis: _loss(named[axis], plans[axis], tables[axis], own)
            for axis, own in zip(named, runs_of_each([*named.values()], train), strict=True)
        }
        found = segment_files.write(folder, tables, matrix, cards, losses, dtype)
        errors = {axis: table.largest for axis, table in tables.items()}
    else:
        if matrix is not None:
            raise InputError(f"--matrix: {settings.to} has parameters of its own for it; leave it out")
        found, errors = write_cubics(folder, settings.to, curves, cards)
    for axis, error in errors.items():
        if settings.tolerance is not None and error > settings.tolerance:
            raise InputError(
                f"export: axis {axis}: what is written is off by {against(error, settings.tolerance)} deg/h "
                f"from the model at rest, more than the tolerance of {stated(settings.tolerance)} deg/h. "
                "Nothing was written"
            )
    return {
        "schema": SCHEMA,
        "to": settings.to,
        "dtype": dtype if settings.to == "segments" else "float32",
        "unit": "deg/h",
        "axes": {
            axis: {
                "model": {"kind": plans[axis].kind, "features": list(plans[axis].names)},
                "thermometer": curve.thermometer,
                "range_degc": [float(curve.temperature[0]), float(curve.temperature[-1])],
                "leaves_out": list(curve.leaves_out),
                **found[axis],
            }
            for axis, curve in curves.items()
        },
        **report_tail(folder),
    }


def read_matrix(path: Path, axes: int = 3) -> FloatArray:
    """A 3 x 3 matrix of a YAML or JSON file: three rows, alone or under the key ``matrix``."""
    held = read_yaml(path)
    rows = held.get("matrix") if isinstance(held, Mapping) else held
    numbers = (
        isinstance(rows, list)
        and len(rows) == 3
        and all(isinstance(row, list) and len(row) == 3 for row in rows)
        and all(
            isinstance(value, int | float) and not isinstance(value, bool) for row in rows for value in row
        )
    )
    if not numbers:
        raise InputError(
            f"{path.name}: a matrix of three rows of three numbers was expected, e.g. "
            "matrix: [[1, 0.001, 0], [0, 1, 0], [0, 0, 1]]"
        )
    if axes != 3:
        raise InputError(f"--matrix: it takes the models of three axes; {axes} were given")
    return np.array(rows, dtype=np.float64)


def by_axis(models: Sequence[DriftModel]) -> dict[str, DriftModel]:
    """Models by their axis, in its order; one alone is x where it states none.

    Raises
    ------
    InputError
        If they are not of different axes of one unit.
    """
    if len(models) == 1:
        return {models[0].card_.axis or "x": models[0]}
    found: dict[str, DriftModel] = {}
    for model in models:
        axis = model.card_.axis
        if axis not in AXES or axis in found:
            raise InputError(
                "export: models of several axes are told apart by their axis, x, y or z; one states "
                f"{'none' if axis is None else quoted(axis)}{' again' if axis in found else ''}; the "
                "side files of its runs state it, as 'axis: x', before they are trained on"
            )
        found[axis] = model
    units = sorted({str(model.card_.unit) for model in models})
    if len(units) > 1:
        raise InputError(f"export: the models are of several units ({', '.join(units)}); one unit a file")
    return {axis: found[axis] for axis in AXES if axis in found}


def _tolerance(settings: TableSettings, model: DriftModel) -> float:
    if settings.tolerance is not None:
        return settings.tolerance
    return TOLERANCE_SHARE * float(model.intervals_.half_width(LEVEL))


def _loss(model: DriftModel, plan: Plan, table: Segments, own: Sequence[Run]) -> dict[str, Any] | None:
    """What table and model leave on training runs of this axis; None where none was given."""
    if not own or plan.gives_rate:
        return None
    rows = training_rows(model, plan, own)
    bias = np.concatenate(
        [
            table.at(np.interp(rows.time[rows.run == i], run.time, run.temperature(table.thermometer)))[0]
            for i, run in enumerate(own)
        ]
    )
    left = rows.target - plan.value(plan.full_columns(rows.atoms)), rows.target - bias
    return averaged_loss(rows, left, model.intervals_.averaging_s)


PX4_FILE, ARDUPILOT_FILE = "fogml_px4.params", "fogml_ardupilot.param"
ARDUPILOT_REFERENCE_DEGC = 35.0
"""TEMP_REFERENCE of ArduPilot: where its polynomials have their zero."""
ARDUPILOT_SHARE = 1e-6
"""What ArduPilot multiplies the coefficients of its parameters by (INV_SCALE_FACTOR)."""
RAD_S_PER_DEG_H = np.pi / 180.0 / 3600.0
_MAV_FLOAT, _MAV_INT = 9, 6
_NUMBERS = {"x": 0, "y": 1, "z": 2}


def write_cubics(
    folder: Path, to: str, curves: Mapping[str, StaticCurve], cards: Mapping[str, Mapping[str, Any]]
) -> tuple[dict[str, dict[str, Any]], dict[str, float]]:
    """Write a parameter file, and tell of each axis its coefficients and errors.

    Parameters
    ----------
    folder
        An existing folder.
    to
        ``px4`` or ``ardupilot``.
    curves
        By axis: the model at rest.
    cards
        By axis: what the model is.

    Returns
    -------
    told, largest
        By axis: what ``export.json`` says, and the largest error at rest [deg/h].

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
        value = np.polynomial.polynomial.polyval(temperature - reference, share * held)
        off = (value - bias) / RAD_S_PER_DEG_H
        told[axis] = {
            "coefficients": [float(number) for number in held],
            "reference_degc": reference,
            "rms_difference_at_rest": float(np.sqrt(np.mean(off**2))),
            "largest_difference_at_rest": float(np.max(np.abs(off))),
        }
    text = _px4 if to == "px4" else _ardupilot
    name = PX4_FILE if to == "px4" else ARDUPILOT_FILE
    (folder / name).write_text(text(coefficients, low, high, reference), encoding="ascii")
    return told, {axis: values["largest_difference_at_rest"] for axis, values in told.items()}


def _px4(coefficients: Mapping[int, FloatArray], low: float, high: float, reference: float) -> str:
    """The format of QGroundControl: vehicle, component, name, value and type, with tabs."""
    floats = {"TC_G0_TMIN": low, "TC_G0_TMAX": high, "TC_G0_TREF": reference}
    for axis, held in coefficients.items():
        floats |= {f"TC_G0_X{power}_{axis}": float(value) for power, value in enumerate(held)}
    lines = [
        "# Gyro rate offsets over temperature, written by fogml.",
        "# Set TC_G0_ID to the device id of the sensor (CAL_GYRO0_ID) before TC_G_ENABLE takes effect.",
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
