"""The drift model made of features and a regressor that maps their columns to drift."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import nullcontext
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.atoms import AtomValues, temperatures_among
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.features.signal import check_holds
from fogml.features.stream import FeatureStream
from fogml.models.base import DriftModel, Evaluation
from fogml.models.box import check_suits, distance_outside, learn_box
from fogml.models.card import TrainingCard, checked_runs, hash_ahead, training_card
from fogml.models.compact import Compact, compact_regressor
from fogml.models.folds import dealt_folds
from fogml.models.intervals import Intervals, interval_table, out_of_fold_intervals, widened_to_use
from fogml.models.linear import LinearRegressor
from fogml.models.regressors import (
    fit_regressor,
    for_features,
    goes_on_linearly,
    own_regressors,
    parameter_count,
    predict_rows,
    refit,
    regressor_from_saved,
    regressor_to_saved,
    weight_bytes,
)
from fogml.models.row_noise import noise_covariance
from fogml.models.scikit_learn import clone
from fogml.models.table import RunRows, TrainingTable, row_count, run_rows, table_of_rows
from fogml.models.tall_least_squares import Part
from fogml.processes import one_thread
from fogml.runs.columns import coil_sensor_number
from fogml.runs.run import Run
from fogml.signals import large
from fogml.strict import Strict, strictly

_EACH_SENSOR = "{sensor}"
_PREDICTED_VALUES = 1 << 19  # feature values composed at once: 4 MiB, which stays in the cache


class SavedFeatures(Strict):
    """What `FeatureModel.to_saved` writes beside the arrays."""

    kind: str
    features: str
    asked_features: str
    max_rows: Annotated[int, Field(ge=2)] | None
    regressor: dict[str, Any]


class FeatureModel(DriftModel):
    """Drift as a regressor's value of features of the temperatures.

    Parameters
    ----------
    features
        Features, or their text. A term with ``{sensor}`` in its text stands for one such term for
        each coil sensor that every training run holds (T1, T2, ...; else T_in and T_out; else T).
    regressor
        Any regressor with scikit-learn's ``fit`` and ``predict``; by default `LinearRegressor`.
    kind
        Name by which reports call the model.
    max_rows
        Training rows are averaged over blocks of time down to this number; None uses all.

    Attributes
    ----------
    features_ : Features
        The features, their box learned.
    regressor_
        The fitted regressor.
    """

    form: ClassVar[str] = "features"
    tells_covariance: ClassVar[bool] = False  # a fit does so by itself
    features_: Features

    def __init__(
        self,
        features: str | Features | None = "T, dT, T*dT",
        regressor: Any = None,
        kind: str = "features",
        max_rows: int | None = None,
    ) -> None:
        self.features = features
        self.regressor = regressor
        self.kind = kind
        self.max_rows = max_rows

    def fit(self, runs: Run | Sequence[Run], y: None = None) -> Self:
        """Fit to training runs.

        Raises
        ------
        InputError
            If the runs don't belong together, lack a temperature, or are too short.
        """
        group = checked_runs(runs, y)
        hashes = hash_ahead(group)
        features = self._chosen_features(group)
        rows = [run_rows(run, features) for run in group]
        row_count(rows)
        learn_box(features, [part.atoms for part in rows])
        self.features_ = features
        count = self._fit_rows(rows, features)
        if type(self.regressor_) is LinearRegressor and not self.tells_covariance:
            covariance = noise_covariance(rows, features.compose, self.regressor_)
            if covariance is not None:
                self.regressor_.covariance_ = covariance
        notes = [*(note for part in rows for note in part.notes), *self._fit_notes()]
        self.card_ = training_card(group, hashes=hashes, rows=count, features=features, notes=notes)
        self.intervals_ = self._interval(rows)
        return self

    def _chosen_features(self, runs: Sequence[Run]) -> Features:
        """Features for the training runs, no box learned yet."""
        return resolve_features(self.features, runs)

    def _fit_rows(self, rows: Sequence[RunRows], features: Features) -> int:
        """Fit the regressor to the training rows; how many rows it was fitted to."""
        regressor = for_features(self.unfitted_regressor(len(features)), features, [r.atoms for r in rows])
        if isinstance(regressor, LinearRegressor) and self.max_rows is None:
            self.regressor_ = regressor.fit_parts([_part(part, features) for part in rows])
            return row_count(rows)
        table = table_of_rows(rows, features.compose, self.max_rows)
        self.regressor_ = self._fit_regressor(regressor, table)
        return len(table)

    def _interval(self, rows: Sequence[RunRows]) -> Intervals:
        """Half-widths of the prediction interval, from parts of the training rows left out."""
        table, own = interval_table(rows), self.features_
        found = out_of_fold_intervals(table, self._out_of_fold, own.window_s, temperatures_among(own.atoms))
        is_linear = isinstance(self.regressor_, LinearRegressor)
        return found if is_linear else widened_to_use(found, rows, self._drift_at)

    def unfitted_regressor(self, width: int) -> Any:
        """An unfitted regressor for `width` columns."""
        return LinearRegressor() if self.regressor is None else clone(self.regressor)

    def _fit_regressor(self, regressor: Any, table: TrainingTable) -> Any:
        return fit_regressor(regressor, table)

    def _refitted(self, table: TrainingTable) -> Any:
        """The regressor fitted to other rows, what was tuned being kept."""
        return refit(self.regressor_, table)

    def _out_of_fold(self, fitted: TrainingTable, held: TrainingTable) -> FloatArray:
        """Drift at rows of atoms, of the model fitted to others and limited to their box."""
        features = copy(self.features_)
        learn_box(features, [fitted.X])
        regressor = self._refitted(replace(fitted, X=features.compose(fitted.X)))
        full = np.ones(len(held), dtype=np.bool_)
        limited, _ = features.limit(held.X, full, linear=goes_on_linearly(regressor))
        return predict_rows(regressor, features.compose(limited))

    def _fit_notes(self) -> list[str]:
        """What the regressor tells of its fit, for the card."""
        return list(getattr(self.regressor_, "notes_", ()))

    def evaluate_atoms(self, run: Run, atoms: AtomValues) -> Evaluation:
        """The regressor's value of the features, atoms limited to the trained box."""
        values, full, settled = atoms
        drift, outside = np.empty(len(values)), np.empty(len(values), dtype=np.bool_)
        linear = goes_on_linearly(self.regressor_)
        for part in large.pieces(values, least=max(1, _PREDICTED_VALUES // len(self.features_))):
            limited, outside[part] = self.features_.limit(values[part], full[part], linear=linear)
            drift[part] = self._drift_at(limited)
        measure = partial(distance_outside, values, outside, self.features_)
        return Evaluation(drift, full, settled, outside, measure)

    def _drift_at(self, atoms: FloatArray) -> FloatArray:
        """The regressor's value [deg/h] at rows of atoms, shape (n, a); a part of them at a time."""
        drift, step = np.empty(len(atoms)), max(1, _PREDICTED_VALUES // len(self.features_))
        # Products of a matrix this narrow with a vector gain nothing from threads, but wait for them.
        with one_thread("blas") if isinstance(self.regressor_, LinearRegressor) else nullcontext():
            for piece in (slice(start, start + step) for start in range(0, len(atoms), step)):
                drift[piece] = predict_rows(self.regressor_, self.features_.compose(atoms[piece]))
        return drift

    def stream(self, sample_s: float) -> FeatureStream:
        """The features sample by sample, limited as `evaluate` limits them.

        The regressor's value of a step's features is the drift at that sample.

        Parameters
        ----------
        sample_s
            Nominal sample interval [s].
        """
        self._check_fitted()
        return self.features_.stream(sample_s, limited=True, linear=goes_on_linearly(self.regressor_))

    @property
    def feature_names(self) -> list[str]:
        """Names of the features, those of the text before a fit."""
        if hasattr(self, "features_"):
            return list(self.features_.names())
        if self.features is None:
            return []
        return [self.features] if isinstance(self.features, str) else list(self.features.names())

    def compact(self) -> Compact:
        """The regressor as plain numbers."""
        self._check_fitted()
        return compact_regressor(self.kind, self.regressor_)

    def parameter_count(self) -> int:
        """Number of the regressor's fitted parameters."""
        self._check_fitted()
        return parameter_count(self.regressor_)

    def weight_bytes(self) -> int:
        """Bytes of what the regressor predicts from."""
        self._check_fitted()
        return weight_bytes(self.regressor_)

    def describe(self) -> dict[str, Any]:
        """What reports say of the model; for linear models with coefficients and standard errors."""
        description, regressor = super().describe(), self.regressor_
        description["regressor"] = type(regressor).__name__
        if isinstance(regressor, LinearRegressor):
            description["ridge"] = regressor.ridge_
            description["coefficients"] = regressor.coefficient_table(self.feature_names)
        elif hasattr(regressor, "describe"):
            description["regressor_details"] = regressor.describe()
        return description

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """The fitted model as JSON-ready values and arrays."""
        self._check_fitted()
        values, arrays = regressor_to_saved(self.regressor_)
        asked = self.features_ if self.features is None else self.features
        return {
            "features": self.features_.text,
            "asked_features": asked if isinstance(asked, str) else asked.text,
            "max_rows": self.max_rows,
            "regressor": values,
        }, arrays

    @classmethod
    def from_saved(
        cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]], card: TrainingCard
    ) -> FeatureModel:
        """The model that `to_saved` gave."""
        saved = strictly(SavedFeatures, values, "model")
        model = cls(saved.asked_features, None, saved.kind, saved.max_rows)
        model._restore(saved, arrays, card)
        model.regressor = clone(model.regressor_)
        return model

    def _restore(self, saved: SavedFeatures, arrays: dict[str, NDArray[Any]], card: TrainingCard) -> None:
        """Set what a fit learned."""
        check_feature_text(saved.asked_features)
        self.features_ = parse_features(saved.features)
        self.features_.set_box(card.box, card.slices, card.thermometer)
        self.regressor_ = regressor_from_saved(saved.regressor, arrays)
        columns = getattr(self.regressor_, "n_features_in_", None)
        if columns is None and saved.kind in own_regressors():
            columns = self.regressor_.n_features_in_ = len(self.features_)
        if columns != len(self.features_):
            raise InputError(f"the regressor takes {columns} features, {len(self.features_)} are stated")


def check_feature_text(text: str) -> None:
    """Hold that text of features is understood, ``{sensor}`` standing for any sensor."""
    parse_features(text.replace(_EACH_SENSOR, "T1") if isinstance(text, str) else text)


def resolve_features(features: str | Features | None, runs: Sequence[Run]) -> Features:
    """Features of one's own from their text, terms with ``{sensor}`` written out for the runs' sensors."""
    text: Any = getattr(features, "text", features)
    resolved = parse_features(written_out(text, runs) if isinstance(text, str) else text)
    for run in runs:
        check_holds(run, resolved.sensors, resolved.text)
    check_suits(resolved, runs)
    return resolved


def shared_sensors(runs: Sequence[Run]) -> list[str]:
    """The coil sensors that every run holds: T1, T2, ..., else T_in and T_out, else T.

    Raises
    ------
    InputError
        If the runs share no temperature of the coil.
    """
    held = set.intersection(*[set(run.temperature_columns) for run in runs])
    numbered = sorted(number for name in held if (number := coil_sensor_number(name)) is not None)
    faces: list[str] = [name for name in ("T_in", "T_out") if name in held]
    if found := [f"T{number}" for number in numbered] or faces or sorted({"T"} & held):
        return found
    raise InputError(
        f"{runs[0].name}: the training runs share no coil temperature (T1 ..., T_in, T_out or T)"
    )


def written_out(text: str, runs: Sequence[Run]) -> str:
    """Text of features with terms of ``{sensor}`` written for each coil sensor that the runs share."""
    if _EACH_SENSOR not in text:
        return text
    # Commas within parentheses and brackets part no terms.
    terms = [term.strip() for term in re.split(r",(?![^()\[\]]*[)\]])", text)]
    fixed = [term for term in terms if _EACH_SENSOR not in term]
    each = [term for term in terms if _EACH_SENSOR in term]
    return ", ".join(fixed + [t.replace(_EACH_SENSOR, name) for name in shared_sensors(runs) for t in each])


def _part(rows: RunRows, features: Features) -> Part:
    return Part(rows.y, lambda piece: features.compose(rows.atoms[piece]), dealt_folds(len(rows.y)))
