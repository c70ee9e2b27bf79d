"""The drift model of mixed effects: its features are chosen by what the training runs can tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, Self

import numpy as np

from fogml.arrays import FloatArray
from fogml.features.atoms import HYSTERESIS_DEGC
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.features.signal import TIME_ON, held_by
from fogml.models.box import each_moves_both_ways, moves_both_ways
from fogml.models.combination import (
    LeftOut,
    SharedMember,
    combined,
    errors_of_all,
    left_out,
    left_out_parts,
    temperatures_of,
)
from fogml.models.feature_model import FeatureModel, resolve_features
from fogml.models.intervals import Intervals, of_usual_averages
from fogml.models.linear import LinearRegressor
from fogml.models.mixed_effects import fit_mixed_effects
from fogml.models.size_priors import SizePriors
from fogml.models.table import RunRows, TrainingTable, averaged_table, averaging_of, recorded_s, row_count
from fogml.models.weights import intervals_of, shifts_apart, weights_of
from fogml.numerals import percent, short
from fogml.processes import one_thread
from fogml.runs.run import Run

AVERAGES = 240
"""Averages that the model is fitted to: enough for some twenty coefficients, a quarter of a second a fit."""
LAGS_S = (300.0, 1200.0, 3600.0)
"""Time constants of the lags offered [s]: nodes and relaxation of a coil, 5 min to 1 h."""
DECAYS_S = (200.0, 400.0, 800.0, 1600.0, 3200.0)
"""Time constants of the warm-up offered [s], in octaves."""
RATE_S = 40.0
"""Time constant of the filter that takes rates [s], or the sample interval where that is longer."""
ONE_WAY = "T^1..5"
"""What temperature that moves one way only can tell: rate, time and direction are functions of it there."""


class MixedEffectsModel(FeatureModel):
    """Drift as the part that all training runs share, features with memory among it.

    See `fogml.models.mixed_effects`. A part of each run's own takes weight, but is never subtracted. Runs,
    halves of runs and directions are left out in turn, and the shared part is shrunk to what they confirm,
    down to no compensation (`fogml.models.combination`).

    Parameters
    ----------
    features
        Features, or their text; None for powers of T up to 5 and, where the training runs move both ways,
        rates, gradients, play operators, lags and, where every run states its power-on, decays since then.
    kind
        Name by which reports call the model.

    Attributes
    ----------
    fitted_ : MixedEffects
        Coefficients, sizes, and what the runs' own parts may add.
    skill_ : float
        Share of the shared part that is kept, 0 to 1.
    """

    kind: str = "mixed-effects"
    form: ClassVar[str] = "features"

    def __init__(self, features: str | Features | None = None, kind: str = "mixed-effects") -> None:
        self.features = features
        self.regressor = None
        self.kind = kind
        self.max_rows = None

    def fit(self, runs: Run | Sequence[Run], y: None = None) -> Self:
        """As `FeatureModel.fit`, with one thread of BLAS: products of some hundred rows."""
        with one_thread("blas"):
            return super().fit(runs, y)

    def _chosen_features(self, runs: Sequence[Run]) -> Features:
        temperatures = [run.temperature("T") for run in runs]
        self._both_ways = moves_both_ways(temperatures)
        self._courses_tell = each_moves_both_ways(temperatures)
        return offered(runs) if self.features is None else resolve_features(self.features, runs)

    def _fit_rows(self, rows: Sequence[RunRows], features: Features) -> int:
        table = averages_of(rows)
        columns = composed(table, features)
        self.fitted_ = fit_mixed_effects(columns, features.terms, self._size_priors(columns))
        T = temperatures_of(table, features)
        member, shared = self._shared_part(features, columns)
        parts = left_out([member], features, table, left_out_parts(table, T))
        weights = self._kept(shifts_apart(parts) if self._courses_tell else parts)
        self.skill_ = float(weights[0])
        mean = float(table.y.mean())
        _, self.regressor_ = combined([(features, shared)], weights, mean)
        errors = errors_of_all([member], features, table)
        found = intervals_of(parts, weights, table, self._both_ways, errors)
        linear = self.regressor_
        self._found = of_usual_averages(
            found, rows, table, lambda atoms: linear.predict_unchecked(features.compose(atoms))
        )
        return len(table)

    def _size_priors(self, table: TrainingTable) -> SizePriors:
        """Priors of the sizes, of averages of features."""
        return SizePriors()

    def _shared_part(self, features: Features, table: TrainingTable) -> tuple[SharedMember, LinearRegressor]:
        """What compensates, to be refitted and as fitted to averages of features."""
        return SharedMember(features, self.fitted_), self.fitted_.regressor()

    def _kept(self, parts: Sequence[LeftOut]) -> FloatArray:
        """Share of the shared part that is kept, shape (1,)."""
        return weights_of(parts, 1, self._both_ways)

    def _interval(self, rows: Sequence[RunRows]) -> Intervals:
        return self._found

    def _fit_notes(self) -> list[str]:
        sizes = ", ".join(f"{name} {short(size, 2)}" for name, size in self.fitted_.sizes.items())
        return [
            f"{percent(self.skill_, 0)} of the shared part is kept, by what left-out parts confirm",
            f"sizes [deg/h]: {sizes}",
        ]


def averages_of(rows: Sequence[RunRows]) -> TrainingTable:
    """Averages of atoms and output, at most about `AVERAGES` of them."""
    averaging_s = averaging_of(rows, recorded_s(rows) / AVERAGES) if row_count(rows) > AVERAGES else 0.0
    return averaged_table(rows, lambda atoms: atoms, averaging_s)


def composed(table: TrainingTable, features: Features) -> TrainingTable:
    """Averages of features, of those of their atoms."""
    return replace(table, X=features.compose(table.X))


def offered(runs: Sequence[Run]) -> Features:
    """Features that training runs can tell anything of."""
    terms = [ONE_WAY, _beyond(runs)]
    if moves_both_ways([run.temperature("T") for run in runs]):
        rate_s = f"{max([RATE_S, *(run.sample_s for run in runs)]):g} s"
        terms += [f"lag(T, {rate_s})", f"T*lag(T, {rate_s})"]
        if all(held_by(run, "T_in") and held_by(run, "T_out") for run in runs):
            terms += ["T_in-T_out", f"lag(T_in-T_out, {rate_s})"]
        terms += [f"play(T, {half_width:g} degC)" for half_width in HYSTERESIS_DEGC]
        terms += [f"lag(T, {tau:g} s)" for tau in LAGS_S]
        if all(held_by(run, TIME_ON) for run in runs):
            terms += [f"since_on({tau:g} s)" for tau in DECAYS_S]
    return parse_features(", ".join(terms))


def static_features(runs: Sequence[Run]) -> Features:
    """A cubic in T, whose trend goes on beyond what the runs hold."""
    return parse_features(f"T^1..3, {_beyond(runs)}")


def _beyond(runs: Sequence[Run]) -> str:
    """How far T is beyond all that the runs hold, to a hundredth of a degree."""
    ends = [(float(T.min()), float(T.max())) for T in (run.temperature("T") for run in runs)]
    low, high = min(low for low, _ in ends), max(high for _, high in ends)
    low, high = np.floor(100.0 * low) / 100.0, np.ceil(100.0 * high + 0.5) / 100.0
    return f"beyond(T, {low:.2f} degC, {high:.2f} degC)"
