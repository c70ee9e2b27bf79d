"""A peer as a drift model: tuned on folds of time, judged as fogml's own models are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from experiments.benchmarks.peers import Learner, Peer, Setting
from fogml.features.atoms import AtomValues
from fogml.features.parse import parse_features
from fogml.models.base import DriftModel, Evaluation
from fogml.models.box import distance_outside, learn_box
from fogml.models.card import TrainingCard, checked_runs, hash_ahead, training_card
from fogml.models.folds import time_folds
from fogml.models.intervals import LEVELS, Intervals
from fogml.models.table import TrainingTable, run_rows, table_of_rows
from fogml.runs.run import Run


@dataclass(frozen=True)
class Budget:
    """What each peer may spend on its tuning.

    Attributes
    ----------
    settings
        Settings tried.
    folds
        Folds of time that each is scored on, rows dealt to them in blocks.
    most_rows
        Training rows are averaged down to this many for every peer; None leaves its own number.
    """

    settings: int = 4
    folds: int = 3
    most_rows: int | None = None

    def rows(self, peer: Peer) -> int | None:
        """Training rows of a peer at most."""
        numbers = [number for number in (self.most_rows, peer.most_rows) if number is not None]
        return min(numbers) if numbers else None


def tuned(peer: Peer, table: TrainingTable, budget: Budget, seed: int = 0) -> tuple[Learner, Setting]:
    """A peer fitted to all rows at the setting with the least error on the folds, and that setting."""
    settings = peer.settings(budget.settings)
    best = settings[0]
    if len(settings) > 1:
        folds = time_folds(table, budget.folds)
        scores = []
        for setting in settings:
            squares = 0.0
            for fitted, held in folds:
                learner = peer.make(setting, seed)
                learner.fit(table, fitted)
                squares += float(np.sum((learner.at_rows(table, held) - table.y[held]) ** 2))
            scores.append(squares if np.isfinite(squares) else np.inf)
        best = settings[int(np.argmin(scores))]
    learner = peer.make(best, seed)
    learner.fit(table, np.arange(len(table)))
    return learner, best


class PeerModel(DriftModel):
    """A peer behind the interface of drift models; atoms are limited to the trained box, as fogml's are.

    Parameters
    ----------
    peer
        The peer.
    budget
        What it may spend.
    seed
        Of what is random in it.
    """

    form: ClassVar[str] = "peer"

    def __init__(self, peer: Peer, budget: Budget, seed: int = 0) -> None:
        self.peer, self.budget, self.seed = peer, budget, seed

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The peer's name."""
        return self.peer.name

    def fit(self, runs: Run | Sequence[Run]) -> Self:
        """Tune and fit."""
        group = checked_runs(runs)
        features = parse_features(self.peer.features)
        rows = [run_rows(run, features) for run in group]
        learn_box(features, [part.atoms for part in rows])
        table = table_of_rows(rows, features.compose, self.budget.rows(self.peer))
        self.learner_, self.setting_ = tuned(self.peer, table, self.budget, self.seed)
        self.features_ = features
        self.rows_ = len(table)
        self.card_ = training_card(group, hashes=hash_ahead(group), rows=len(table), features=features)
        # The tables show errors, not intervals; none are worked out.
        self.intervals_ = Intervals(0.0, (0.0,) * len(LEVELS), 0, "none")
        return self

    def evaluate_atoms(self, run: Run, atoms: AtomValues) -> Evaluation:
        """The peer's value of the features, atoms limited to the trained box."""
        features = self.features_
        assert features is not None
        values, full, settled = atoms
        limited, outside = features.limit(values, full)
        drift = self.learner_.along(features.compose(limited), run.time)
        measure = partial(distance_outside, values, outside, features)
        return Evaluation(drift, full, settled, outside, measure)

    @property
    def feature_names(self) -> list[str]:
        """Names of the inputs."""
        return list(parse_features(self.peer.features).names())

    def weights(self) -> dict[str, NDArray[Any]]:
        """None: a peer is not saved."""
        return {}

    def parameter_count(self) -> int:
        """Not counted."""
        return 0

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """A peer is not saved."""
        raise NotImplementedError(f"{self.peer.name}: a peer of the benchmarks is not saved")

    @classmethod
    def from_saved(
        cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]], card: TrainingCard
    ) -> PeerModel:
        """A peer is not saved."""
        raise NotImplementedError("a peer of the benchmarks is not saved")
