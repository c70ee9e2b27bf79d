"""The drift model: the one interface that every model has."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.features.atoms import AtomValues
from fogml.features.features import Features
from fogml.intervals import LEVEL
from fogml.models.card import TrainingCard, check_unit_and_axis, refuse_targets
from fogml.models.compact import Compact
from fogml.models.intervals import Intervals
from fogml.models.scikit_learn import BaseEstimator, NotFittedError
from fogml.runs.exchange import one_run, runs_of
from fogml.runs.plausible import refuse_twice
from fogml.runs.run import Run
from fogml.signals.averages import block_averages

GOOD, OUTSIDE, NOT_FULL = 0, 1, 2
"""Flags of a compensated sample."""


@dataclass(frozen=True)
class Evaluation:
    """A model evaluated on a run of n samples.

    Attributes
    ----------
    drift
        What is to be subtracted from the output [deg/h], shape (n,).
    full
        Whether every feature window held enough to count, shape (n,); before, the drift is little more than
        the static part.
    settled
        Whether every window was full and every memory settled, shape (n,); elsewhere the drift starts from
        what the run tells.
    outside
        Whether the sample lies outside the trained box, shape (n,).
    measure
        Computes `excess`; called when that is asked for, which compensation does not.
    """

    drift: FloatArray
    full: BoolArray
    settled: BoolArray
    outside: BoolArray
    measure: Callable[[], FloatArray]

    @cached_property
    def excess(self) -> FloatArray:
        """How far outside, as a share of the box's span in the atom that is furthest out, shape (n,).

        0 inside.
        """
        return self.measure()

    @property
    def flag(self) -> NDArray[np.int8]:
        """0 good, 1 outside what the model was trained on, 2 a window or memory not settled; (n,)."""
        flag = np.where(self.outside, np.int8(OUTSIDE), np.int8(GOOD))
        flag[~(self.full & self.settled)] = NOT_FULL
        return flag


@dataclass(frozen=True)
class Compensation:
    """A compensated run: drift and compensated output [deg/h] and flags, each of shape (n,)."""

    drift: FloatArray
    compensated: FloatArray
    flag: NDArray[np.int8]

    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns that ``fogml compensate`` writes, by their header cells."""
        return {"drift [deg/h]": self.drift, "gyro_compensated [deg/h]": self.compensated, "flag": self.flag}


def compensation_of(run: Run, evaluation: Evaluation) -> Compensation:
    """What an evaluation makes of a run's output.

    Raises
    ------
    InputError
        If the output is compensated already, or what comes out is not finite at some sample.
    """
    refuse_twice(run)
    with np.errstate(over="ignore"):
        compensated = run.gyro_deg_h - evaluation.drift
    _check_finite(run, compensated, "compensated output")
    return Compensation(evaluation.drift, compensated, evaluation.flag)


def _check_finite(run: Run, values: FloatArray, what: str) -> None:
    """Hold that there is a number at every sample of a run."""
    finite = np.isfinite(values)
    if not finite.all():
        place = int(np.argmin(finite))
        raise InputError(
            f"{run.name}: at time {run.time[place]:.10g} s the {what} is {values[place]}: "
            "the model's numbers and the run's are too large for each other; train it again on such runs"
        )


class DriftModel(BaseEstimator, ABC):
    """A model of a gyro's temperature drift.

    ``compensated = gyro_deg_h - drift``. Parameters are those of the constructor, as in
    scikit-learn (``get_params``, ``set_params``, ``clone``); what a fit learns ends in an
    underscore.

    Attributes
    ----------
    kind
        The name by which the model was asked for, e.g. ``M2``.
    form
        Key of the class in saved models.
    card_
        Where the fitted model comes from.
    intervals_
        Half-widths of the prediction interval.
    features_
        The features that the model evaluates, their box learned; None where it has none.
    """

    form: ClassVar[str]
    kind: str
    card_: TrainingCard
    intervals_: Intervals
    features_: Features | None = None

    @abstractmethod
    def fit(self, runs: Run | Sequence[Run], y: None = None) -> Self:
        """Fit to training runs of one unit and axis; `y` is None, there for scikit-learn's pipelines.

        Raises
        ------
        InputError
            If the runs don't belong together or don't hold what the model needs.
        """

    def evaluate(self, run: Run) -> Evaluation:
        """Drift with window fullness and distance from the trained box, at every sample.

        Raises
        ------
        InputError
            If the run lacks what the features need, or the drift is not finite at some sample.
        """
        self._check_fitted()
        run = one_run(run)
        if self.features_ is None:
            everywhere = np.ones(len(run), dtype=np.bool_)
            return self.evaluate_from(run, AtomValues(np.empty((len(run), 0)), everywhere, everywhere))
        return self.evaluate_from(run, self.features_.atom_values(run))

    def evaluate_from(self, run: Run, atoms: AtomValues) -> Evaluation:
        """As `evaluate_atoms`, a drift at every sample being held.

        Raises
        ------
        InputError
            If the drift is not finite at some sample.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            evaluation = self.evaluate_atoms(run, atoms)
        _check_finite(run, evaluation.drift, "model's drift")
        return evaluation

    def evaluate_atoms(self, run: Run, atoms: AtomValues) -> Evaluation:
        """As `evaluate`, from the values of the features' atoms, unchecked.

        The run may be a block of one; the atoms are those of ``features_`` at its n samples.
        """
        raise NotImplementedError(f"{type(self).__name__} does not evaluate atoms")

    def compact(self) -> Compact:
        """The fitted model as plain numbers: what every export writes.

        Raises
        ------
        InputError
            If the model is made of something that has no such form.
        """
        raise InputError(f"a model of kind '{self.kind}' has no compact form")

    def weights(self) -> dict[str, NDArray[Any]]:
        """The arrays that the fitted model consists of, by name."""
        return self.to_saved()[1]

    def weight_bytes(self) -> int:
        """Bytes of what the model predicts from."""
        return sum(array.nbytes for array in self.weights().values())

    @abstractmethod
    def parameter_count(self) -> int:
        """Number of fitted parameters."""

    @abstractmethod
    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """The fitted model as JSON-ready values and arrays; card and intervals apart."""

    @classmethod
    @abstractmethod
    def from_saved(
        cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]], card: TrainingCard
    ) -> DriftModel:
        """The model that `to_saved` gave; whoever calls sets ``card_`` and ``intervals_``."""

    @property
    def feature_names(self) -> list[str]:
        """Names of the model's inputs."""
        return []

    @property
    def window_s(self) -> float:
        """Longest look-back until every feature window is full [s]."""
        return 0.0 if self.features_ is None else float(self.features_.window_s)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Temperatures and other columns that the model needs, by their names in formulas."""
        return () if self.features_ is None else tuple(self.features_.sensors)

    def predict(self, run: Run) -> FloatArray:
        """Drift [deg/h] at every sample, shape (n,)."""
        return self.evaluate(run).drift

    def predict_interval(self, run: Run, level: float = LEVEL) -> tuple[FloatArray, FloatArray]:
        """Interval of the drift [deg/h], lower and upper, each of shape (n,).

        It covers a share `level` of the drift's averages over ``intervals_.averaging_s``, noise of
        the averages included, on runs like the training runs; see `fogml.models.intervals`.
        Outside the trained box it widens in proportion to the distance.

        Raises
        ------
        InputError
            If the level is not above 0, or above 0.995, the highest of whose width anything is known.
        """
        evaluation = self.evaluate(run)
        half = self.intervals_.half_width(level, evaluation.excess)
        return evaluation.drift - half, evaluation.drift + half

    def compensate(self, run: Run, any_unit: bool = False) -> Compensation:
        """Subtract the drift where `check_applies`; flag what is outside the trained box or not settled."""
        self.check_applies(run, any_unit)
        return compensation_of(run, self.evaluate(run))

    def score(self, runs: Run | Sequence[Run], y: None = None, *, averaging_s: float = 100.0) -> float:
        """R² of the drift on averages: the share of the error's variance that the model tells; 1 is all.

        The error's mean is part of what is to be told, so that another offset lowers it. Greater is better,
        as `GridSearchCV` and `cross_validate` expect; the noise of the averages keeps it below 1.

        Parameters
        ----------
        runs
            Runs the model was not fitted to.
        y
            None, as of `fit`.
        averaging_s
            Length of the averages [s].

        Raises
        ------
        InputError
            If a run lacks what the model needs, or no run fills one average.
        """
        pairs = []
        refuse_targets(y)
        for run in runs_of(runs):
            means = block_averages(run.time, run.error_deg_h, self.predict(run), window_s=averaging_s)
            pairs.append(np.array(means.values))
        error, drift = np.concatenate(pairs, axis=1) if pairs else np.empty((2, 0))
        if not len(error):
            raise InputError(f"score: no run fills one average of {averaging_s:g} s")
        spread = np.sum((error - error.mean()) ** 2)
        return float(1.0 - np.sum((error - drift) ** 2) / spread) if spread > 0.0 else float("nan")

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.estimator_type = "regressor"
        tags.target_tags.required = False
        return tags

    def check_applies(self, run: Run, any_unit: bool = False) -> tuple[str, ...]:
        """Notes on using the model on a run.

        Raises
        ------
        InputError
            If the run is of another unit or axis than the training runs and `any_unit` is not set.
        """
        self._check_fitted()
        return check_unit_and_axis(self.card_, one_run(run), any_unit)

    def describe(self) -> dict[str, Any]:
        """What reports say of the model: kind, features, parameters, bytes, training, intervals."""
        self._check_fitted()
        return {
            "kind": self.kind,
            "features": self.feature_names,
            "parameters": self.parameter_count(),
            "bytes": self.weight_bytes(),
            "unit": self.card_.unit,
            "axis": self.card_.axis,
            "window_s": self.window_s,
            "rows": self.card_.rows,
            "box": {name: list(span) for name, span in self.card_.box.items()},
            "interval": self.intervals_.summary(),
            "notes": list(self.card_.notes),
        }

    def _check_fitted(self) -> None:
        if not hasattr(self, "card_"):
            raise NotFittedError(f"this {type(self).__name__} is not fitted yet; call fit first")
