"""Networks over sequences of at most 500 bytes in float32, as drift models to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from experiments.benchmarks.gru import GRULearner, TCNLearner
from fogml.features.atoms import AtomValues
from fogml.features.parse import parse_features
from fogml.models.base import DriftModel, Evaluation
from fogml.models.box import distance_outside, learn_box
from fogml.models.card import TrainingCard, checked_runs, hash_ahead, training_card
from fogml.models.intervals import intervals_from_residuals
from fogml.models.table import run_rows, table_of_rows
from fogml.runs.run import Run

ROWS = 800
"""Averages that they are fitted to."""


class Recurrent(DriftModel):
    """A GRU of four units over T and its rate, 101 numbers; its interval is of the training residuals."""

    form: ClassVar[str] = "recurrent"
    kind: str = "recurrent"

    def learner(self) -> GRULearner:
        """What is trained."""
        return GRULearner(4, epochs=120)

    def fit(self, runs: Run | Sequence[Run]) -> Self:
        """Fit to training runs."""
        group = checked_runs(runs)
        hashes = hash_ahead(group)
        self.features_ = parse_features("T, dT")
        rows = [run_rows(run, self.features_) for run in group]
        learn_box(self.features_, [part.atoms for part in rows])
        table = table_of_rows(rows, self.features_.compose, ROWS)
        self.learner_ = self.learner()
        every = np.arange(len(table))
        self.learner_.fit(table, every)
        residuals = table.y - self.learner_.at_rows(table, every)
        self.intervals_ = intervals_from_residuals(residuals, table.averaging_s, "none")
        self.card_ = training_card(group, hashes=hashes, rows=len(table), features=self.features_)
        return self

    def evaluate_atoms(self, run: Run, atoms: AtomValues) -> Evaluation:
        """Drift, the state running from the first window that counts on."""
        values, full, settled = atoms
        assert self.features_ is not None
        limited, outside = self.features_.limit(values, full)
        drift = np.full(len(values), self.learner_.along(limited[full], run.time[full])[0])
        drift[full] = self.learner_.along(limited[full], run.time[full])
        measure = partial(distance_outside, values, outside, self.features_)
        return Evaluation(drift, full, settled, outside, measure)

    def weights(self) -> dict[str, NDArray[Any]]:
        """The network's arrays."""
        return {name: array.numpy() for name, array in self.learner_._network.state_dict().items()}

    def parameter_count(self) -> int:
        """Their numbers."""
        return sum(array.size for array in self.weights().values())

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """It is there to compare with alone."""
        raise NotImplementedError("a model to compare with is not saved")

    @classmethod
    def from_saved(cls, values: dict[str, Any], arrays: dict[str, Any], card: TrainingCard) -> DriftModel:
        """It is there to compare with alone."""
        raise NotImplementedError("a model to compare with is not saved")


class Convolutional(Recurrent):
    """As `Recurrent`, of three layers of three channels, 85 numbers."""

    form: ClassVar[str] = "convolutional"
    kind: str = "convolutional"

    def learner(self) -> TCNLearner:
        """What is trained."""
        return TCNLearner(3, epochs=120)
