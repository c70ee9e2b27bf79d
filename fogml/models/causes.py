"""The drift model of known causes: a twin's constants, and a group of features for each that acts beside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.features.features import Features
from fogml.features.grammar import parse_terms
from fogml.features.signal import check_holds
from fogml.features.suits import unsuited
from fogml.features.terms import Term
from fogml.models.feature_model import FeatureModel, resolve_features
from fogml.models.linear import LinearRegressor
from fogml.models.mixed_effects import linear_regressor
from fogml.models.row_noise import noise_of_rows
from fogml.models.sized_groups import GroupedRows
from fogml.models.table import RunRows, TrainingTable, table_of_rows
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel

MOST_ROWS = 2400
"""Rows that it is fitted to: enough for 30 s in two runs of ten hours, as no thermal effect is faster."""


class CauseModel(FeatureModel):
    """Drift as constants of a twin and as causes, each of which is a group of features with its own size.

    Linear in its features, so that whatever is written of a linear model is written of it. Sizes are what the
    training runs' evidence says (`fogml.models.sized_groups`): a cause that is not confirmed takes no part.

    Parameters
    ----------
    constants
        Text of the constants' features.
    causes
        Name of each cause to the text of its features; a feature that several have is the first one's.
    kind
        Name by which reports call the model.

    Attributes
    ----------
    lengths_ : dict
        Whitened length of each cause, from 0.1, which is nothing.
    """

    kind: str = "causes"
    form: ClassVar[str] = "features"
    tells_covariance: ClassVar[bool] = True

    def __init__(
        self,
        constants: str = "T, T^2",
        causes: Mapping[str, str] | None = None,
        kind: str = "causes",
    ) -> None:
        self.constants = constants
        self.causes = causes
        self.kind = kind
        self.features = ", ".join(term.text for term in self._grouped())
        self.regressor = None
        self.max_rows = MOST_ROWS

    def _grouped(self) -> dict[Term, int]:
        """Every term, and the group that it is of."""
        grouped: dict[Term, int] = {}
        for group, text in enumerate((self.constants, *(self.causes or {}).values())):
            for term in parse_terms(text):
                grouped.setdefault(term, group)
        return grouped

    def _chosen_features(self, runs: Sequence[Run]) -> Features:
        """All features but those of causes that the runs can tell nothing of, such as too long lags."""
        assert isinstance(self.features, str)
        grouped = self._grouped()
        for run in runs:
            check_holds(
                run, {name for t in grouped for a in t.atoms for name in a.signal.sensors}, self.features
            )
        suited = [t for t, g in grouped.items() if not g or not any(unsuited(a, runs) for a in t.atoms)]
        return resolve_features(", ".join(term.text for term in suited), runs)

    def _fit_rows(self, rows: Sequence[RunRows], features: Features) -> int:
        table = table_of_rows(rows, features.compose, self.max_rows)
        grouped = self._grouped()
        self._groups: NDArray[np.intp] = np.array([grouped[term] for term in features.terms], dtype=np.intp)
        told = noise_of_rows(table)
        if told is None:
            raise InputError(
                f"{len(table)} rows are too few for {len(features)} features of causes; train on longer runs"
            )
        self._noise: NoiseModel = told.mean
        held = GroupedRows(table, self._groups, self._noise)
        self._lengths = held.likeliest()
        self.lengths_ = dict(zip(self.causes or {}, self._lengths))
        self.regressor_ = self._solved(held, table)
        return len(table)

    def _solved(self, held: GroupedRows, table: TrainingTable) -> LinearRegressor:
        found = held.fit(self._lengths)
        left = table.y - table.X @ found.coef - found.intercept
        return linear_regressor(found.coef, found.intercept, found.covariance, float(np.std(left)))

    def _refitted(self, table: TrainingTable) -> LinearRegressor:
        """Fitted to other rows, with the sizes and the noise as they were found."""
        return self._solved(GroupedRows(table, self._groups, self._noise), table)

    def _fit_notes(self) -> list[str]:
        told = ", ".join(f"{name} {length:.3g}" for name, length in self.lengths_.items())
        return [f"whitened lengths of causes, 3 and less being little: {told}"] if told else []

    def describe(self) -> dict[str, Any]:
        """As of any model, with the causes and how long each is."""
        return {**super().describe(), "causes": dict(self.lengths_)}
