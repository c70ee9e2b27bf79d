"""Scale factor and bias over temperature from one run with turns.

The output D, as recorded, and temperatures give the rate in one linear model (patent
CN105333888A), here with an intercept and with Earth rate in the reference y [deg/h]::

    y = (a0 + a1 T + a2 T^2) D + b0 + b1 T + b2 (T_in - T_out) + b3 dT (+ b4 T dT) (+ further features)

It is solved by QR on centred, scaled columns. The patent's own form has six columns, neither
intercept nor Earth rate, and the difference of block means ``diff(T)`` in place of the rate dT;
without an intercept a static residual of some 0.1 to 0.7 deg/h stays, and Earth rate is lost.

The noisy output stands among the regressors, which pulls the scale factor towards zero by
var(noise)/var(D). With 1 deg/h of noise at a sample and 24 minutes of 10 h at 10 deg/s that is
2e-8: far below 1 ppm. Without turns var(D) is the noise itself and the model would only fit the
gyro to its own output; such runs are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.atoms import AtomValues, temperatures_among
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.models.base import DriftModel, Evaluation
from fogml.models.box import distance_outside, learn_box
from fogml.models.card import TrainingCard, checked_runs, hash_ahead, training_card
from fogml.models.compact import Compact, affine
from fogml.models.feature_model import resolve_features, written_out
from fogml.models.folds import dealt_folds
from fogml.models.intervals import out_of_fold_intervals
from fogml.models.joint_rows import averages_with_turns, check_turns
from fogml.models.linear import LinearRegressor
from fogml.models.row_noise import noise_covariance
from fogml.models.table import RunRows, TrainingTable, row_count, without_refilling
from fogml.models.tall_least_squares import PIECE_ROWS, Part
from fogml.numerals import number_text
from fogml.runs.run import Run
from fogml.runs.transitions import transition_mask
from fogml.strict import Strict, strictly


class _Saved(Strict):
    """What `JointModel.to_saved` writes beside the arrays."""

    kind: str
    patent: bool
    product: bool
    rate_window_s: float = Field(gt=0.0)
    gradient: bool
    features: str | None = None
    regressor: dict[str, Any]


class JointModel(DriftModel):
    """Scale factor and bias over temperature, fitted together to runs with turns.

    ``compensated`` is the rate that the model makes of the output [deg/h]; the drift is the
    output as rate less that, so it holds the scale factor's error too.

    Parameters
    ----------
    patent
        The patent's own six columns, without intercept and Earth rate.
    product
        With a column T*dT; not in the patent's form.
    rate_window_s
        Window of the temperature's rate or difference [s]; the patent's 2**n samples.
    features
        Text of further features that the bias depends on, such as ``lag(T, 1200 s), play(T, 4 degC)``;
        not in the patent's form.

    Attributes
    ----------
    regressor_ : LinearRegressor
        The solution; `column_names` tells its columns.
    gradient_ : bool
        Whether there is a column T_in-T_out: whether every training run holds T_out.
    """

    form: ClassVar[str] = "joint"
    features_: Features

    def __init__(
        self,
        patent: bool = False,
        product: bool = False,
        rate_window_s: float = 64.0,
        features: str | None = None,
    ) -> None:
        self.features = features
        self.patent = patent
        self.product = product
        self.rate_window_s = rate_window_s

    @property
    def kind(self) -> str:  # type: ignore[override]
        """``joint`` or ``joint-patent``."""
        return "joint-patent" if self.patent else "joint"

    def fit(self, runs: Run | Sequence[Run], y: None = None) -> Self:
        """Fit to training runs with turns.

        Raises
        ------
        InputError
            If no training run turns, the runs don't belong together, or lack a temperature.
        """
        if not self.rate_window_s > 0.0:
            raise InputError(f"joint: the rate's window is {self.rate_window_s:g} s; it must be positive")
        if self.patent and self.product:
            raise InputError("joint-patent: the patent's form has six columns and none of T*dT; use joint")
        group = checked_runs(runs, y)
        if len({run.gyro_unit for run in group}) > 1:
            raise InputError(
                "joint: the training runs' outputs are partly in counts and partly in deg/h, "
                "and the model works on the output as recorded; give runs of one kind"
            )
        hashes = hash_ahead(group)
        self.gradient_ = all(_has_gradient(run) for run in group)
        notes = (
            [] if self.gradient_ else ["no T_out in every training run: the column T_in-T_out is left out"]
        )
        if not group[0].earth_known and not self.patent:
            notes.append("Earth rate is not known: the intercept holds that of the training attitude")
        self._bias_text = None if self.features is None else written_out(self.features, group)
        self.features_ = self._own_features(self._bias_text)
        if self._bias_text is not None:
            resolve_features(self._bias_text, group)
        rows = [self._rows(run) for run in group]
        check_turns([run.name for run in group], rows)
        learn_box(self.features_, [part.atoms[:, 1:] for part in rows])
        parts = [self._part(part) for part in rows]
        self.regressor_ = LinearRegressor(fit_intercept=not self.patent).fit_parts(parts)
        covariance = noise_covariance(
            [self._without_noise(part) for part in rows], self._columns, self.regressor_
        )
        if covariance is not None:
            self.regressor_.covariance_ = covariance
        notes += [note for part in rows for note in part.notes]
        self.card_ = training_card(
            group, hashes=hashes, rows=row_count(rows), features=self.features_, notes=notes
        )
        table = averages_with_turns(rows, lambda part: np.column_stack((self._columns(part), part)))
        first = self.regressor_.n_features_in_ + 1
        values = [first + place for place in temperatures_among(self.features_.atoms)]
        self.intervals_ = out_of_fold_intervals(table, self._out_of_fold, self.features_.window_s, values)
        return self

    def evaluate_atoms(self, run: Run, atoms: AtomValues) -> Evaluation:
        """Drift: output as rate less the model's rate; with distance from the trained box.

        Raises
        ------
        InputError
            If the output is not in the unit of training, counts or deg/h.
        """
        if run.gyro_unit != self.card_.gyro_unit:
            raise InputError(
                f"{run.name}: column 'gyro' is in {run.gyro_unit}, the joint model was trained on "
                f"{self.card_.gyro_unit} and works on the output as recorded; give the run in that unit"
            )
        values, full, settled = atoms
        limited, outside = self.features_.limit(values, full, linear=True)
        rate = self.regressor_.predict_unchecked(self._columns(np.column_stack((run.gyro, limited))))
        measure = partial(distance_outside, values, outside, self.features_)
        return Evaluation(run.gyro_deg_h - rate, full, settled, outside, measure)

    @property
    def column_names(self) -> list[str]:
        """Names of the columns that the coefficients belong to; D is the output as recorded."""
        self._check_fitted()
        return ["D", "T*D", "T^2*D", *self.features_.names()]

    @property
    def feature_names(self) -> list[str]:
        """The columns' names; none before a fit."""
        return self.column_names if hasattr(self, "features_") else []

    def compact(self) -> Compact:
        """Scale factor over temperature, and a linear part of the features."""
        self._check_fitted()
        scale, linear = np.split(self.regressor_.coef_, [3])
        return Compact(self.kind, affine(linear, self.regressor_.intercept_), scale, linear_beyond=True)

    def parameter_count(self) -> int:
        """Number of coefficients, the intercept included."""
        self._check_fitted()
        return self.regressor_.parameter_count

    def describe(self) -> dict[str, Any]:
        """What reports say of the model, with coefficients and standard errors."""
        description = super().describe()
        description["coefficients"] = self.regressor_.coefficient_table(self.column_names)
        return description

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """The fitted model as JSON-ready values and arrays."""
        self._check_fitted()
        values, arrays = self.regressor_.to_saved()
        own = {
            "patent": self.patent,
            "product": self.product,
            "rate_window_s": float(self.rate_window_s),
            "gradient": self.gradient_,
            "features": self._bias_text,
        }
        return {**own, "regressor": values}, arrays

    @classmethod
    def from_saved(
        cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]], card: TrainingCard
    ) -> JointModel:
        """The model that `to_saved` gave."""
        saved = strictly(_Saved, values, "model")
        model = cls(saved.patent, saved.product, saved.rate_window_s, saved.features)
        model.gradient_ = saved.gradient
        model._bias_text = saved.features
        model.features_ = model._own_features(saved.features)
        model.features_.set_box(card.box, card.slices, card.thermometer)
        model.regressor_ = LinearRegressor.from_saved(saved.regressor, arrays)
        if model.regressor_.n_features_in_ != 3 + len(model.features_.names()):
            raise InputError("coefficients and columns differ in number")
        return model

    def _own_features(self, bias_text: str | None) -> Features:
        terms = ["T"]
        if self.gradient_:
            terms.append("T_in-T_out")
        window = f"[block, {number_text(self.rate_window_s)} s]"
        terms.append(("diff(T)" if self.patent else "dT") + window)
        if self.product:
            terms.append(f"T*dT{window}")
        own = parse_features(", ".join(terms))
        return own if bias_text is None else own + parse_features(bias_text)

    def _rows(self, run: Run) -> RunRows:
        atoms, full, _ = self.features_.atom_values(run)
        used, notes = without_refilling(run, self.features_, full)
        if "rate" in run.columns:
            cut = transition_mask(run)
            used = used & ~cut
            notes += (f"{run.name}: {int(cut.sum())} rows about changes of the table's rate left out",)
        y = 3600.0 * run.rate if self.patent else run.reference_deg_h
        return RunRows(np.column_stack((run.gyro, atoms))[used], y[used], run.time[used], notes)

    def _out_of_fold(self, fitted: TrainingTable, held: TrainingTable) -> FloatArray:
        """Rate at averages of columns, and of output and atoms, of the model fitted to others.

        Averages of products, as the output turns while the temperature moves; what limiting atoms to the
        others' box changes is that of averages.
        """
        features, width = copy(self.features_), self.regressor_.n_features_in_
        learn_box(features, [fitted.X[:, width + 1 :]])
        full, held_rows = np.ones(len(held), dtype=np.bool_), held.X[:, width:]
        limited, _ = features.limit(held_rows[:, 1:], full, linear=True)
        regressor = self.regressor_.refitted(fitted.X[:, :width], fitted.y)
        moved = self._columns(np.column_stack((held_rows[:, 0], limited))) - self._columns(held_rows)
        return regressor.predict(held.X[:, :width] + moved)

    def _part(self, rows: RunRows) -> Part:
        return Part(rows.y, lambda piece: self._columns(rows.atoms[piece]), dealt_folds(len(rows.y)))

    def _without_noise(self, rows: RunRows) -> RunRows:
        """Rows whose output is the one that the model expects, and what the noise adds to the rate as y.

        The noisy output is a column: within a stretch of one rate it would explain the noise by itself.
        """
        atoms, off = rows.atoms.copy(), np.empty(len(rows.y))
        bend = self.regressor_.coef_[:3]
        for start in range(0, len(off), PIECE_ROWS):
            piece = slice(start, start + PIECE_ROWS)
            columns = self._columns(atoms[piece])
            off[piece] = self.regressor_.predict_unchecked(columns) - rows.y[piece]
            temperature = columns[:, 3]
            atoms[piece, 0] -= off[piece] / (bend[0] + bend[1] * temperature + bend[2] * temperature**2)
        return RunRows(atoms, off, rows.time_s)

    def _columns(self, rows: FloatArray) -> FloatArray:
        """The model's columns from rows of [output, atoms...]."""
        features = self.features_.compose(rows[:, 1:])
        columns = np.empty((len(rows), 3 + features.shape[1]), order="F")
        columns[:, 0] = rows[:, 0]
        np.multiply(rows[:, 0], features[:, 0], out=columns[:, 1])
        np.multiply(columns[:, 1], features[:, 0], out=columns[:, 2])
        columns[:, 3:] = features
        return columns


def _has_gradient(run: Run) -> bool:
    try:
        run.temperature("T_in"), run.temperature("T_out")
    except InputError:
        return False
    return True
