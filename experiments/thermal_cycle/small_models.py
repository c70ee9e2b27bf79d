"""Models of at most 500 bytes in float32 to compare with: autopilots' cubics and small networks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from experiments.benchmarks.autopilots import RisingCubic
from experiments.benchmarks.gru import GRULearner, TCNLearner
from experiments.benchmarks.kan import KANLearner
from fogml.features.atoms import AtomValues
from fogml.features.parse import parse_features
from fogml.models.base import DriftModel, Evaluation
from fogml.models.box import distance_outside, learn_box
from fogml.models.card import TrainingCard, checked_runs, hash_ahead, training_card
from fogml.models.intervals import LEVELS, Intervals, intervals_from_residuals
from fogml.models.table import run_rows, table_of_rows
from fogml.runs.run import Run

ROWS = 800
"""Averages that networks are fitted to."""
MOST_BYTES = 500


@dataclass(frozen=True)
class Small:
    """How a small model is made: its learner of a seed, features, rows at most; cubics take every sample."""

    make: Callable[[int], Any]
    features: str = "T, dT"
    rows: int | None = ROWS


SMALL = {
    "PX4's cubic": Small(lambda seed: RisingCubic(24.0), "T", None),
    "ArduPilot's cubic": Small(lambda seed: RisingCubic(10.0, 0.5), "T", None),
    "GRU": Small(lambda seed: GRULearner(4, epochs=120, seed=seed)),
    "TCN": Small(lambda seed: TCNLearner(3, epochs=120, seed=seed)),
    "KAN": Small(lambda seed: KANLearner(seed=seed)),
}
"""Name of each to how it is made: four units, three layers of three channels, three nodes."""


class SmallModel(DriftModel):
    """One of `SMALL`; a network's interval is of its training residuals, an autopilot's cubic states none."""

    form: ClassVar[str] = "small"

    def __init__(self, name: str, seed: int = 0) -> None:
        self.name, self.seed = name, seed

    @property
    def kind(self) -> str:  # type: ignore[override]
        """Its name."""
        return self.name

    def fit(self, runs: Run | Sequence[Run]) -> Self:
        """Fit to training runs."""
        how = SMALL[self.name]
        group = checked_runs(runs)
        hashes = hash_ahead(group)
        self.features_ = parse_features(how.features)
        rows = [run_rows(run, self.features_) for run in group]
        learn_box(self.features_, [part.atoms for part in rows])
        table = table_of_rows(rows, self.features_.compose, how.rows)
        self.learner_ = how.make(self.seed)
        every = np.arange(len(table))
        self.learner_.fit(table, every)
        if how.rows is None:
            self.intervals_ = Intervals(0.0, (0.0,) * len(LEVELS), 0, "none")
        else:
            residuals = table.y - self.learner_.at_rows(table, every)
            self.intervals_ = intervals_from_residuals(residuals, table.averaging_s, "none")
        self.card_ = training_card(group, hashes=hashes, rows=len(table), features=self.features_)
        return self

    def evaluate_atoms(self, run: Run, atoms: AtomValues) -> Evaluation:
        """Drift; a network's state runs from the first window that counts on."""
        values, full, settled = atoms
        assert self.features_ is not None
        limited, outside = self.features_.limit(values, full)
        found = self.learner_.along(limited[full], run.time[full])
        drift = np.full(len(values), found[0])
        drift[full] = found
        measure = partial(distance_outside, values, outside, self.features_)
        return Evaluation(drift, full, settled, outside, measure)

    def weights(self) -> dict[str, NDArray[Any]]:
        """What it predicts from."""
        return dict(self.learner_.arrays())

    def parameter_count(self) -> int:
        """Their numbers."""
        return sum(array.size for array in self.weights().values())

    def operations(self) -> int:
        """Additions, multiplications and the like from features to drift."""
        return int(self.learner_.operations())

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """It is there to compare with alone."""
        raise NotImplementedError("a model to compare with is not saved")

    @classmethod
    def from_saved(cls, values: dict[str, Any], arrays: dict[str, Any], card: TrainingCard) -> DriftModel:
        """It is there to compare with alone."""
        raise NotImplementedError("a model to compare with is not saved")
