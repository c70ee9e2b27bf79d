"""Bias and scale factor of a model at rest over one temperature: what a table can hold of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.export.plan import Plan
from fogml.features.atoms import Atom
from fogml.features.own import Function, Recursion
from fogml.runs.columns import is_temperature

GRID = 401
"""Temperatures at which the curve is taken: a quarter of a degree over 100 degC."""


@dataclass(frozen=True)
class StaticCurve:
    """What a model says where all temperatures stand still, over its trained box.

    Compensated is ``scale gyro - bias``.

    Attributes
    ----------
    thermometer
        Name of the column that it is over.
    temperature
        Temperatures [degC], shape (m,), rising.
    bias
        Bias [deg/h], shape (m,).
    scale
        Factor of the output [deg/h per its unit], shape (m,); ones where the model has none.
    gyro_unit
        Unit of the output that the factor is for.
    leaves_out
        Features that a curve over one temperature can't hold, by their names.
    """

    thermometer: str
    temperature: FloatArray
    bias: FloatArray
    scale: FloatArray
    gyro_unit: str
    leaves_out: tuple[str, ...]

    @classmethod
    def of(cls, plan: Plan, count: int = GRID) -> StaticCurve:
        """The curve of a plan.

        Rates and differences are 0, lags and plays are what they follow, power-on is long ago. Other
        thermometers are as far from the first one as the middles of their trained ranges are, other columns
        at the middle of theirs.

        Parameters
        ----------
        plan
            The model's plain form.
        count
            Number of temperatures.

        Raises
        ------
        InputError
            If the model is of no temperature.
        """
        thermometers = [sensor for sensor in plan.sensors if is_temperature(sensor)]
        if not thermometers:
            raise InputError("export: the model is of no temperature; a table over one has nothing to hold")
        first = thermometers[0]
        middles = {sensor: _range(plan, sensor) for sensor in plan.sensors}
        low, high = middles[first] or (np.nan, np.nan)
        if not low < high:
            raise InputError(
                f"export: the model tells no range of {first}, over which a table would be. Train with "
                f"{first} itself among the features, or export it --to c"
            )
        temperature = np.linspace(low, high, count)
        held = {}
        for sensor in plan.sensors:
            ends = middles[sensor]
            if is_temperature(sensor):
                apart = 0.0 if ends is None else 0.5 * (sum(ends) - low - high)
                held[sensor] = temperature + apart
            else:
                held[sensor] = np.full(count, 0.0 if ends is None else 0.5 * sum(ends))
        atoms = np.column_stack([at_rest(atom, held) for atom in plan.atoms])
        columns = plan.full_columns(atoms)
        none = plan.value(columns, np.zeros(count))
        joint = plan.gives_rate
        scale = plan.value(columns, np.ones(count)) - none if joint else np.ones(count)
        moving = [
            name
            for name, step in zip(plan.names, plan.steps, strict=True)
            if not _static(plan, step.column, step.atoms)
        ]
        return cls(first, temperature, -none if joint else none, scale, plan.gyro_unit, tuple(moving))


def _static(plan: Plan, column: int | None, atoms: tuple[int, ...]) -> bool:
    """Whether a column is of values of one thermometer alone."""
    first = next(sensor for sensor in plan.sensors if is_temperature(sensor))
    own = all(plan.atoms[i].instant and plan.atoms[i].signal.sensors == (first,) for i in atoms)
    return own and (column is None or _static(plan, plan.steps[column].column, plan.steps[column].atoms))


def _range(plan: Plan, sensor: str) -> tuple[float, float] | None:
    """Trained range of a column's own value, else of what follows it; None where the box tells none."""
    following = [i for i, atom in enumerate(plan.atoms) if atom.follows and atom.signal.sensors == (sensor,)]
    for i in sorted(following, key=lambda i: plan.atoms[i].operator != "value"):
        if plan.atoms[i].signal.is_sensor:
            return float(plan.limits.box_low[i]), float(plan.limits.box_high[i])
    return None


def at_rest(atom: Atom, held: dict[str, FloatArray]) -> FloatArray:
    """An atom's values (n,) where nothing moves, from those of the columns that it is of, each (n,)."""
    count = len(next(iter(held.values())))
    declared = atom.declared
    if isinstance(declared, Recursion) and not atom.follows:
        raise InputError(
            f"export: the model takes {atom.text}, of which it is not known what it is where nothing moves; "
            "export it --to onnx or json"
        )
    if atom.window is not None:
        return np.zeros(count)
    if isinstance(declared, Function) and declared.rest is not None:
        return np.full(count, declared.rest)
    value = np.sum([weight * held[name] for name, weight in atom.signal.parts], axis=0)
    if isinstance(declared, Function):
        value, _ = declared.operator(atom.given, 1.0).push(np.arange(float(count)), value)
    return np.asarray(value)
