"""Covariates of production: what is known of a unit before it is measured, and what that tells of it.

Coil lot, optical power or half-wave voltage, as numbers or as labels. A fleet's constants are regressed on
them while the fleet is put together (`fogml.fleet.constants`): a unit of which they are known is drawn to
what the fleet says of such units, with the spread that is left about it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from pydantic import with_config

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.models.prior import Matrix, Prior, Vector
from fogml.strict import CONTENT, as_written, strictly

Covariates = Mapping[str, str]
"""Values by name, as a manifest states them: numbers or labels; what is not known is left out."""


@with_config(CONTENT)
@dataclass(frozen=True)
class CovariateColumns:
    """Covariates as c columns: a number in its spread, a label as a column of its own that is 0 or 1.

    Attributes
    ----------
    names
        ``half_wave_voltage`` of a number, ``coil_lot=7A`` of a label.
    centre, scale
        A column is its value less the centre, over the scale, shapes (c,).
    """

    names: tuple[str, ...]
    centre: Vector
    scale: Vector

    @classmethod
    def of(cls, units: Sequence[Covariates]) -> CovariateColumns:
        """The columns of a fleet's units; numbers where every value is one."""
        names: list[str] = []
        for name in sorted({name for unit in units for name in unit}):
            values = [unit[name] for unit in units if name in unit]
            if all(_number(value) is not None for value in values):
                names += [name] if len(set(map(float, values))) > 1 else []
            else:
                labels = sorted(set(values))
                names += [f"{name}={label}" for label in labels] if len(labels) > 1 else []
        raw = cls(tuple(names), np.zeros(len(names)), np.ones(len(names)))
        rows = np.array([np.where(known, row, np.nan) for row, known in map(raw.row, units)])
        centre, scale = np.nanmean(rows, axis=0), np.nanstd(rows, axis=0)
        return cls(raw.names, centre, np.where(["=" in name for name in names], 1.0, scale))

    def row(self, unit: Covariates) -> tuple[FloatArray, BoolArray]:
        """A unit's columns, 0 where nothing is known, and where something is; shapes (c,)."""
        values, known = np.zeros(len(self.names)), np.zeros(len(self.names), dtype=np.bool_)
        for i, column in enumerate(self.names):
            name, labelled, label = column.partition("=")
            stated = unit.get(name)
            if stated is None:
                continue
            number = float(stated == label) if labelled else _number(stated)
            seen = not labelled or any(f"{name}={stated}" == other for other in self.names)
            if number is not None and seen:
                values[i], known[i] = (number - self.centre[i]) / self.scale[i], True
        return values, known


@with_config(CONTENT)
@dataclass(frozen=True)
class CovariateEffects:
    """How a fleet's k + 1 constants go with c covariates.

    Attributes
    ----------
    columns
        The covariates.
    slopes
        Change of the constants per unit of a column [deg/h], shape (c, k + 1).
    spread
        Covariance of the columns over the fleet, shape (c, c).
    inverse
        Of the information on mean and slopes, in units' worth, shape (c + 1, c + 1).
    within
        Constants of units at the columns' centres.
    """

    columns: CovariateColumns
    slopes: Matrix
    spread: Matrix
    inverse: Matrix
    within: Prior

    def prior(self, unit: Covariates) -> Prior:
        """The fleet's prior for a unit of which some covariates, or none, are known."""
        row, known = self.columns.row(unit)
        design = np.append(1.0, row)
        unknown = self.slopes[~known]
        covariance = self.within.covariance * (1.0 + design @ self.inverse @ design - self.inverse[0, 0])
        covariance = covariance + unknown.T @ self.spread[np.ix_(~known, ~known)] @ unknown
        return replace(self.within, mean=self.within.mean + row @ self.slopes, covariance=covariance)

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values."""
        values = as_written(self)
        return {**values.pop("columns"), **values, "within": self.within.as_dict()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> CovariateEffects:
        """The effects that `as_dict` wrote."""
        names = [field.name for field in fields(CovariateColumns)]
        columns = {name: value for name, value in values.items() if name in names}
        others = {name: value for name, value in values.items() if name not in names}
        saved = strictly(cls, {"columns": columns, **others}, "covariates")
        count, width = len(saved.columns.names), len(saved.within.checked().mean)
        held = (saved.columns.centre, saved.columns.scale, saved.slopes, saved.spread, saved.inverse)
        wanted = ((count,), (count,), (count, width), (count, count), (count + 1, count + 1))
        if any(a.size != math.prod(shape) for a, shape in zip(held, wanted)):
            raise InputError("the fleet's covariates are not understood: sizes don't belong together")
        slopes, spread = saved.slopes.reshape(count, width), saved.spread.reshape(count, count)
        return replace(saved, slopes=slopes, spread=spread)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
