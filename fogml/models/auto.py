"""The automatic model: a mixed-effects model's shared part and simple forms, weighed on what is left out.

Simple candidates are scored on averages of the training runs: blocks of their time are held out, and
where there are several, each run in turn as well; `fogml.models.candidates.choose` picks one of them. It, a
cubic in temperature and the mixed-effects model with its memories are then weighed on runs left out, or
else on blocks of one run, and combined (`fogml.models.weights`); what is held out is limited to
the box of the rows fitted to, as in use. The weights' sum is the skill that left-out parts confirm, down
to no compensation. A network is no part of a sum: it is taken alone, where the runs hold enough rates of
temperature and it leaves clearly less than the others together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Self

from numpy.typing import NDArray

from fogml.errors import InputError, counted
from fogml.features.atoms import AtomValues
from fogml.models.base import DriftModel, Evaluation
from fogml.models.box import refusals
from fogml.models.card import TrainingCard, checked_runs
from fogml.models.compact import Compact
from fogml.models.feature_model import resolve_features
from fogml.models.intervals import Intervals
from fogml.models.trial import Trial
from fogml.models.weighing import weigh
from fogml.processes import one_thread
from fogml.runs.run import Run
from fogml.strict import Strict, strictly

Progress = Callable[[int, int, str], None]


class AutoModel(DriftModel):
    """The model that `auto` stands for; what it made is in ``chosen_``.

    Parameters
    ----------
    features
        Features to keep to; None leaves them open too.
    seed
        Seed of the networks.
    progress
        Called with (done, of, name) after each candidate.

    Attributes
    ----------
    chosen_ : DriftModel
        The model, fitted to all training runs.
    scores_ : list of Score
        All simple candidates, best first.
    weighed_ : Weighed
        Members and their weights, after a fit.
    """

    form: ClassVar[str] = "auto"
    kind: str = "auto"

    def __init__(self, features: str | None = None, seed: int = 0, progress: Progress | None = None) -> None:
        self.features = features
        self.seed = seed
        self.progress = progress

    def fit(self, runs: Run | Sequence[Run], y: None = None) -> Self:
        """Score the candidates on folds of the training runs, and fit the one chosen to all of them.

        Raises
        ------
        InputError
            If the runs don't belong together, lack a temperature, or are too short.
        """
        group = checked_runs(runs, y)
        features = None if self.features is None else resolve_features(self.features, group).text
        trial = Trial(group, self.seed, features)
        scores = []
        for done, candidate in enumerate(trial.candidates):
            scores.append(trial.score(candidate))
            if self.progress is not None:
                self.progress(done + 1, len(trial.candidates), candidate.name)
        self.scores_ = sorted(scores, key=lambda score: (score.mean_square, score.parameters))
        self.choice_ = trial.chosen(scores)
        with one_thread("blas"):
            self.weighed_ = weigh(group, self.choice_.candidate, features, self.seed, trial.one_rate)
        self.chosen_ = self.weighed_.model
        notes = (*refusals(group), *self.chosen_.card_.notes, *self._reasons(trial))
        self.card_ = replace(self.chosen_.card_, notes=notes)
        self.selection_ = [score.as_dict() for score in self.scores_]
        self.features_ = self.chosen_.features_
        return self

    def _reasons(self, trial: Trial) -> list[str]:
        """What is in it and why, and what the training runs could not tell; for the card."""
        notes = [self.weighed_.told()]
        weighed = self.features is None
        if weighed and trial.one_rate:
            notes.append(
                "at most temperatures the training runs hold "
                f"{counted(trial.rates, 'rate')} of temperature, too few to tell how the drift goes with it: "
                "what is weighed is linear in the rate; train at three or more rates to allow other forms"
            )
        elif weighed and trial.both_directions and not trial.direction_told:
            notes.append(
                "each training run moves temperature one way only: a shift from run to run looks like an "
                "effect of direction, so no simple form in the rate is weighed; train on runs that go up and "
                "down, or on two or more of each"
            )
        if not trial.both_directions:
            only = "so only terms in temperature are weighed, " if weighed else ""
            notes.append(
                "trained on temperature moving one way only: temperature, its rate, time and direction "
                f"can't be told apart, {only}and hysteresis is not seen: what holds on the way back is not "
                "verifiable, and the interval is as wide as the drift; train on a run that goes up and down"
            )
        return notes

    @property
    def intervals_(self) -> Intervals:
        """The chosen model's half-widths of the prediction interval."""
        return self.chosen_.intervals_

    @intervals_.setter
    def intervals_(self, intervals: Intervals) -> None:
        self.chosen_.intervals_ = intervals

    def evaluate_atoms(self, run: Run, atoms: AtomValues) -> Evaluation:
        """The chosen model's drift, fullness and distance from the trained box."""
        return self.chosen_.evaluate_atoms(run, atoms)

    @property
    def feature_names(self) -> list[str]:
        """The chosen model's features; none before a fit."""
        return self.chosen_.feature_names if hasattr(self, "chosen_") else []

    def compact(self) -> Compact:
        """The chosen model's numbers."""
        self._check_fitted()
        return self.chosen_.compact()

    def parameter_count(self) -> int:
        """Number of the chosen model's parameters."""
        self._check_fitted()
        return self.chosen_.parameter_count()

    def describe(self) -> dict[str, Any]:
        """The chosen model's description, with ``chosen_by`` and the candidates weighed."""
        self._check_fitted()
        return {
            **self.chosen_.describe(),
            "notes": list(self.card_.notes),
            "chosen_by": self.kind,
            "candidates": self.selection_,
        }

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """The chosen model as JSON-ready values and arrays, with the candidates weighed."""
        self._check_fitted()
        values, arrays = self.chosen_.to_saved()
        chosen = {"form": self.chosen_.form, "kind": self.chosen_.kind, "model": values}
        return {"chosen": chosen, "selection": self.selection_}, arrays

    @classmethod
    def from_saved(
        cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]], card: TrainingCard
    ) -> AutoModel:
        """The model that `to_saved` gave."""
        from fogml.models.saved import model_of_form

        saved = strictly(_Saved, values, "model")
        chosen = saved.chosen
        if chosen.form == cls.form:
            raise InputError("key 'model.chosen.form': an automatic choice is of no automatic choice")
        model = cls()
        model.chosen_ = model_of_form(chosen.form, chosen.kind).from_saved(
            {"kind": chosen.kind, **chosen.model}, arrays, card
        )
        model.chosen_.card_ = card
        model.features_ = model.chosen_.features_
        model.selection_ = [score.model_dump() for score in saved.selection]
        return model


class _Scored(Strict):
    """A candidate as `Score.as_dict` tells of it."""

    name: str
    parameters: int
    held_out_rms: float


class _Chosen(Strict):
    form: str
    kind: str
    model: dict[str, Any]


class _Saved(Strict):
    """What `AutoModel.to_saved` writes beside the arrays."""

    kind: str
    chosen: _Chosen
    selection: list[_Scored]
