"""The drift model of mixed effects: its features are chosen by what the training runs can tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from fogml.features.atoms import HYSTERESIS_DEGC
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.features.signal import TIME_ON, held_by
from fogml.models.box import learn_box
from fogml.models.feature_model import FeatureModel, resolve_features
from fogml.models.folds import IndexArray, run_folds
from fogml.models.intervals import Intervals
from fogml.models.mixed_effects import fit_mixed_effects, skill_of
from fogml.models.table import RunRows, TrainingTable, averaged_table, recorded_s, row_count
from fogml.runs.run import FloatArray, Run

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
TURNS = 0.2
"""Share of the span that temperature has to move each way for its direction to tell anything."""


class MixedEffectsModel(FeatureModel):
    """Drift as the part that all training runs share, features with memory among it.

    See `fogml.models.mixed_effects`. A part of each run's own takes weight and widens the interval, but is
    never subtracted; with several runs, each is left out in turn, and the shared part is shrunk to what they
    confirm, down to no compensation.

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

    def _chosen_features(self, runs: Sequence[Run]) -> Features:
        return offered(runs) if self.features is None else resolve_features(self.features, runs)

    def _fit_rows(self, rows: Sequence[RunRows], features: Features) -> int:
        table = _averages(rows)
        whole = fit_mixed_effects(_composed(table, features), features.terms)
        left_out = run_folds(table) if len(rows) > 1 else []
        pairs, alike = [], True
        for fitted, held in left_out:
            own = self._features_of(table.take(fitted), features)
            alike = alike and own == features
            pairs.append(_told(table, features, own, fitted, held))
        self.skill_, left_std = skill_of(pairs)
        # What a fit of one direction leaves on the other says little of a fit of both.
        left_std = left_std if alike else 0.0
        self.fitted_ = whole
        self.regressor_ = whole.shrunk(float(table.y.mean()), self.skill_)
        self._found = whole.intervals(self.skill_, left_std, table.averaging_s, len(table))
        return len(table)

    def _features_of(self, rest: TrainingTable, features: Features) -> Features:
        """What runs alone would be fitted with, of the features of all of them."""
        if self.features is None and not moves_both_ways(_temperatures(rest, features)):
            return parse_features(ONE_WAY)
        return parse_features(features.text)

    def _interval(self, rows: Sequence[RunRows]) -> Intervals:
        return self._found

    def _fit_notes(self) -> list[str]:
        sizes = ", ".join(f"{name} {size:.2g}" for name, size in self.fitted_.sizes.items())
        return [
            f"{100.0 * self.skill_:.0f} % of the shared part is kept, by what left-out runs confirm",
            f"sizes [deg/h]: {sizes}",
        ]


def _averages(rows: Sequence[RunRows]) -> TrainingTable:
    """Averages of atoms and output, at most about `AVERAGES` of them."""
    averaging_s = recorded_s(rows) / AVERAGES if row_count(rows) > AVERAGES else 0.0
    return averaged_table(rows, lambda atoms: atoms, averaging_s)


def _told(
    table: TrainingTable, features: Features, own: Features, fitted: IndexArray, held: IndexArray
) -> tuple[FloatArray, FloatArray]:
    """Prediction and output of runs left out, less the mean of the others; within the others' box.

    Parameters
    ----------
    table
        Averages of the features' atoms.
    features
        Whose atoms they are.
    own
        What the others are fitted with.
    fitted, held
        Rows of the others, and of those left out.
    """
    places = [features.atoms.index(atom) for atom in own.atoms]
    table = replace(table, X=table.X[:, places])
    rest, part = table.take(fitted), table.take(held)
    learn_box(own, [rest.X])
    found = fit_mixed_effects(_composed(rest, own), own.terms)
    limited, _ = own.limit(part.X, np.ones(len(part), dtype=np.bool_), linear=True)
    mean = float(rest.y.mean())
    return own.compose(limited) @ found.coef + found.intercept - mean, part.y - mean


def _temperatures(table: TrainingTable, features: Features) -> list[FloatArray]:
    """T [degC] of each run's averages."""
    T = table.X[:, features.atoms.index(parse_features("T").atoms[0])]
    return [T[table.run_index == run] for run in np.unique(table.run_index)]


def _composed(table: TrainingTable, features: Features) -> TrainingTable:
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


def _beyond(runs: Sequence[Run]) -> str:
    """How far T is beyond all that the runs hold, to a hundredth of a degree."""
    ends = [(float(T.min()), float(T.max())) for T in (run.temperature("T") for run in runs)]
    low, high = min(low for low, _ in ends), max(high for _, high in ends)
    low, high = np.floor(100.0 * low) / 100.0, np.ceil(100.0 * high + 0.5) / 100.0
    return f"beyond(T, {low:.2f} degC, {high:.2f} degC)"


def moves_both_ways(temperatures: Sequence[FloatArray]) -> bool:
    """Whether temperature rises and falls by a fifth of its span or more, in all runs together.

    Parameters
    ----------
    temperatures
        T [degC] of each run, shapes (n,).
    """
    up = down = 0.0
    low, high = np.inf, -np.inf
    for T in temperatures:
        low, high = min(low, float(T.min())), max(high, float(T.max()))
        # Averages over a hundredth of the run keep the sensor's noise from adding up as motion.
        parts = np.array([part.mean() for part in np.array_split(T, min(100, len(T)))])
        steps = np.diff(parts)
        up, down = up + float(steps[steps > 0].sum()), down - float(steps[steps < 0].sum())
    return min(up, down) > TURNS * (high - low)
