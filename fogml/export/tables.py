"""Tables and cubics over one temperature, of up to three axes: what autopilots and small firmware hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, quoted
from fogml.export import segment_files
from fogml.export.cubics import write_cubics
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
    runs = dict(zip(named, runs_of_each([*named.values()], train), strict=True))
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
            axis: _loss(named[axis], plans[axis], table.thermometer, partial(_bias_of, table), own)
            for axis, table, own in zip(tables, tables.values(), runs.values(), strict=True)
        }
        found = segment_files.write(folder, tables, matrix, cards, losses, dtype)
        errors = {axis: table.largest for axis, table in tables.items()}
    else:
        if matrix is not None:
            raise InputError(f"--matrix: {settings.to} has parameters of its own for it; leave it out")
        found, errors, cubics = write_cubics(folder, settings.to, curves)
        for axis, cubic in cubics.items():
            found[axis]["accuracy"] = _loss(
                named[axis], plans[axis], curves[axis].thermometer, cubic, runs[axis]
            )
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


def _bias_of(table: Segments, temperature: FloatArray) -> FloatArray:
    return table.at(temperature)[0]


def _loss(
    model: DriftModel,
    plan: Plan,
    thermometer: str,
    bias_at: Callable[[FloatArray], FloatArray],
    own: Sequence[Run],
) -> dict[str, Any] | None:
    """What a bias over temperature and the model leave on training runs of this axis; None without runs."""
    if not own or plan.gives_rate:
        return None
    rows = training_rows(model, plan, own)
    bias = np.concatenate(
        [
            bias_at(np.interp(rows.time[rows.run == i], run.time, run.temperature(thermometer)))
            for i, run in enumerate(own)
        ]
    )
    return averaged_loss(rows, [rows.left_by(plan), rows.target - bias], model.intervals_.averaging_s)
