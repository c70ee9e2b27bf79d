"""A run's error before and after a model, and the rows that count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.intervals import LEVEL
from fogml.models.table import usable_rows
from fogml.runs.run import Run
from fogml.signals.averages import AVERAGING_S

if TYPE_CHECKING:
    from fogml.models.base import DriftModel


@dataclass(frozen=True)
class RunErrors:
    """One run's error before and after a model; every array has shape (n,).

    Attributes
    ----------
    run
        The run.
    before
        Output less reference rate [deg/h].
    drift
        What the model takes away [deg/h].
    half_width
        Half-width of the model's 90 % prediction interval [deg/h].
    flag
        0 good, 1 outside what the model was trained on, 2 window not full.
    outside
        Rows outside what the model was trained on, whatever their flag: one that has not settled is 2.
    full
        Rows whose windows are full.
    used
        Rows that count for all but the scale factor: windows full, transitions of the table cut,
        at rest where the run both stands and turns; as models are fitted to.
    notes
        What was left out, and on the model's use on this run.
    interval_averaging_s
        Time that the prediction interval is of averages over [s].
    """

    run: Run
    before: FloatArray
    drift: FloatArray
    half_width: FloatArray
    flag: NDArray[np.int8]
    outside: BoolArray
    full: BoolArray
    used: BoolArray
    notes: tuple[str, ...]
    interval_averaging_s: float = AVERAGING_S

    @property
    def after(self) -> FloatArray:
        """Error after compensation [deg/h]."""
        return self.before - self.drift

    def within(self, full: BoolArray) -> RunErrors:
        """The same, counting only rows that are full in a mask of shape (n,) as well."""
        return replace(self, full=self.full & full, used=self.used & full)


def run_errors(model: DriftModel, run: Run, *, any_unit: bool = False) -> RunErrors:
    """The errors of a run before and after a fitted model.

    Raises
    ------
    InputError
        If the run is of another unit or axis than the model's and `any_unit` is not set.
    """
    notes = model.check_applies(run, any_unit=any_unit)
    evaluation = model.evaluate(run)
    used, left_out = usable_rows(run, evaluation.full)
    return RunErrors(
        run=run,
        before=run.error_deg_h,
        drift=evaluation.drift,
        half_width=model.intervals_.half_width(LEVEL, evaluation.excess),
        flag=evaluation.flag,
        outside=evaluation.outside,
        full=evaluation.full,
        used=used,
        notes=(*notes, *left_out),
        interval_averaging_s=model.intervals_.averaging_s,
    )


def training_means(errors: Sequence[RunErrors]) -> tuple[float, float]:
    """Mean error before and after over the rows that count of all training runs [deg/h]."""
    rows = sum(int(e.used.sum()) for e in errors)
    if rows == 0:
        names = ", ".join(e.run.name for e in errors)
        raise InputError(f"{names}: no usable row; the windows of the features are longer than the runs")
    before = sum(float(e.before[e.used].sum()) for e in errors) / rows
    after = sum(float(e.after[e.used].sum()) for e in errors) / rows
    return before, after
