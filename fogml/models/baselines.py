"""Baselines: no compensation, and the training runs' mean error."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.features.atoms import AtomValues
from fogml.models.base import DriftModel, Evaluation
from fogml.models.card import TrainingCard, checked_runs, hash_ahead, training_card
from fogml.models.compact import Compact, affine
from fogml.models.intervals import interval_table, out_of_fold_intervals
from fogml.models.parameters import expect_arrays
from fogml.models.table import RunRows, TrainingTable, row_count, usable_rows
from fogml.runs.run import Run
from fogml.strict import Strict, strictly


class _Saved(Strict):
    kind: str


class _ConstantModel(DriftModel):
    """Drift that is one number, which may be learned."""

    is_learned: ClassVar[bool]
    bias_: float

    def fit(self, runs: Run | Sequence[Run], y: None = None) -> Self:
        """Fit to training runs."""
        group = checked_runs(runs, y)
        hashes = hash_ahead(group)
        rows = []
        for run in group:
            used, notes = usable_rows(run, np.ones(len(run), dtype=bool))
            errors = run.error_deg_h[used]
            rows.append(RunRows(np.empty((len(errors), 0)), errors, run.time[used], notes))
        count = row_count(rows)
        self.bias_ = self._bias(np.concatenate([part.y for part in rows]))
        self.card_ = training_card(
            group, hashes=hashes, rows=count, notes=[note for part in rows for note in part.notes]
        )
        self.intervals_ = out_of_fold_intervals(interval_table(rows), self._out_of_fold)
        return self

    def evaluate_atoms(self, run: Run, atoms: AtomValues) -> Evaluation:
        """The constant at every sample; it has no windows and no box."""
        count = len(run)
        inside = np.zeros(count, dtype=np.bool_)
        drift = np.full(count, self.bias_)
        return Evaluation(drift, atoms.full, atoms.settled, inside, partial(np.zeros, count))

    def compact(self) -> Compact:
        """The constant."""
        self._check_fitted()
        return Compact(self.kind, affine((), self.bias_))

    def parameter_count(self) -> int:
        """1 where it is learned, else 0."""
        return int(self.is_learned)

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """The number [deg/h], where it is learned."""
        self._check_fitted()
        return {}, {"bias": np.array([self.bias_])} if self.is_learned else {}

    @classmethod
    def from_saved(
        cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]], card: TrainingCard
    ) -> _ConstantModel:
        """The model that `to_saved` gave."""
        strictly(_Saved, values, "model")
        expect_arrays(arrays, {"bias": (np.float64, (1,))} if cls.is_learned else {})
        model = cls()
        model.bias_ = float(arrays["bias"][0]) if cls.is_learned else 0.0
        return model

    def _bias(self, error: FloatArray) -> float:
        return float(error.mean()) if self.is_learned else 0.0

    def _out_of_fold(self, fitted: TrainingTable, held: TrainingTable) -> FloatArray:
        return np.full(len(held), self._bias(fitted.y))


class NoCompensation(_ConstantModel):
    """The output as it is: the drift is 0."""

    form: ClassVar[str] = "none"
    kind = "none"
    is_learned = False


class MeanModel(_ConstantModel):
    """The drift is the mean error of the training rows [deg/h]."""

    form: ClassVar[str] = "mean"
    kind = "mean"
    is_learned = True
