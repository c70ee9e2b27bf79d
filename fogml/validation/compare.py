"""Several models on the same split: who helps, who harms, who could not be fitted; each run left out once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fogml.arrays import BoolArray
from fogml.errors import FogmlError, InputError, in_one_line
from fogml.runs.run import Run
from fogml.signals.averages import AVERAGING_S
from fogml.validation.judge import index_notes, judgement_of
from fogml.validation.limits import check_design_index, check_limits, outcome_of
from fogml.validation.metrics import check_turn_on_band, repeatability_of
from fogml.validation.results import Judgement
from fogml.validation.run_errors import RunErrors, run_errors

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

Split = tuple[list[Run], list[Run]]


def _splits_of(runs: Sequence[Run]) -> list[Split]:
    """The others and the run left out, for each run."""
    if len(runs) < 2:
        raise InputError(f"leaving one run out needs at least two runs, {len(runs)} given")
    return [([*runs[:i], *runs[i + 1 :]], [run]) for i, run in enumerate(runs)]


def merged_folds(
    whole: Judgement, folds: Sequence[Judgement], design_index: float | None, limits: Mapping[str, float]
) -> Judgement:
    """The judgement whose test runs are those of the folds, model and training those of the whole."""
    test = tuple(run for fold in folds for run in fold.test)
    note = f"Each of the {len(test)} runs is judged by a model fitted on the others."
    return Judgement(
        model=whole.model,
        train=whole.train,
        test=test,
        design_index=outcome_of("rms", design_index, test) if design_index is not None else None,
        limits=tuple(outcome_of(name, limit, test) for name, limit in limits.items()),
        notes=(*whole.notes, *index_notes(test, design_index), note),
        repeatability=repeatability_of(test),
    )


ModelMaker = Callable[[], "DriftModel"]
# A regressor from outside may refuse the data in its own words.
_REFUSALS = (FogmlError, ValueError, ArithmeticError, MemoryError)


@dataclass(frozen=True)
class Comparison:
    """Judgements by model name, in the order asked for, and the reason of each that failed."""

    judgements: Mapping[str, Judgement]
    failed: Mapping[str, str]


def compare(
    makers: Mapping[str, ModelMaker],
    train_runs: Sequence[Run],
    test_runs: Sequence[Run] | None,
    *,
    averaging_s: float = AVERAGING_S,
    design_index: float | None = None,
    limits: Mapping[str, float] | None = None,
    turn_on_band: float | None = None,
    any_unit: bool = False,
    noise: Run | None = None,
    step: Callable[[str], None] | None = None,
) -> Comparison:
    """Fit and judge each model on the same runs, and on the same rows of them.

    Rows count where the windows of every fitted model are full, so that a model without windows
    is not judged on rows that the others leave out.

    Parameters
    ----------
    makers
        Name to a function that makes the unfitted model.
    train_runs
        What each is fitted on.
    test_runs
        What each is judged on; None: each training run in turn is left out and judged.
    averaging_s, design_index, limits, turn_on_band, any_unit, noise
        As in :func:`~fogml.validation.judge.judge`.
    step
        Called with a model's name before each of its fits.

    Returns
    -------
    Comparison
        A model that can't be fitted to these runs is in ``failed`` with its reason.

    Raises
    ------
    InputError
        If no model could be fitted and judged, or a limit is unknown.
    """
    limits = check_limits(limits or {})
    check_design_index(design_index)
    check_turn_on_band(turn_on_band, (*train_runs, *(test_runs or ())))
    contest = _Contest(dict(makers), averaging_s, turn_on_band, any_unit, noise, step or (lambda name: None))
    if test_runs is not None:
        judgements = contest.judged(train_runs, test_runs, design_index, limits)
    else:
        folds = [contest.judged(others, held_out) for others, held_out in _splits_of(train_runs)]
        whole = contest.judged(train_runs, [])
        judgements = {}
        for name in whole:
            try:
                judgements[name] = merged_folds(
                    whole[name], [fold[name] for fold in folds], design_index, limits
                )
            except InputError as error:
                contest.failed[name] = in_one_line(str(error))
    if not judgements:
        name, reason = next(iter(contest.failed.items()), ("", "no model was named"))
        raise InputError(f"no model could be fitted and judged; {name}: {reason}")
    return Comparison(judgements, contest.failed)


class _Contest:
    """Models still in the contest, and why the others are not."""

    def __init__(
        self,
        makers: dict[str, ModelMaker],
        averaging_s: float,
        turn_on_band: float | None,
        any_unit: bool,
        noise: Run | None,
        step: Callable[[str], None],
    ) -> None:
        self.makers = makers
        self.failed: dict[str, str] = {}
        self._averaging_s = averaging_s
        self._turn_on_band = turn_on_band
        self._any_unit = any_unit
        self._noise = noise
        self._step = step

    def judged(
        self,
        train: Sequence[Run],
        test: Sequence[Run],
        design_index: float | None = None,
        limits: Mapping[str, float] | None = None,
    ) -> dict[str, Judgement]:
        """Judgements of the models that can be fitted to a split; the others leave the contest."""
        fitted: dict[str, DriftModel] = {}
        rows: list[BoolArray] = []
        for name in list(self.makers):
            self._step(name)
            try:
                model = self.makers[name]().fit(train)
                full = [errors.full for errors in self._errors(model, train, test)]
                # Those of each run whose windows are full for every model.
                rows = [one & other for one, other in zip(rows, full, strict=True)] if rows else full
                fitted[name] = model
            except _REFUSALS as error:
                self._drop(name, error)
        judgements = {}
        for name, model in fitted.items():
            try:
                # Evaluated once more: errors of all models at once take more memory than their runs.
                every = zip(self._errors(model, train, test), rows, strict=True)
                shared = [errors.within(common) for errors, common in every]
                judgements[name] = judgement_of(
                    model,
                    shared[: len(train)],
                    shared[len(train) :],
                    averaging_s=self._averaging_s,
                    design_index=design_index,
                    limits=limits,
                    turn_on_band=self._turn_on_band,
                    noise=self._noise,
                )
            except _REFUSALS as error:
                self._drop(name, error)
        return judgements

    def _errors(self, model: DriftModel, train: Sequence[Run], test: Sequence[Run]) -> Iterator[RunErrors]:
        for run in train:
            yield run_errors(model, run, any_unit=True)
        for run in test:
            yield run_errors(model, run, any_unit=self._any_unit)

    def _drop(self, name: str, error: BaseException) -> None:
        del self.makers[name]
        known = isinstance(error, FogmlError)
        self.failed[name] = in_one_line(str(error)) if known else f"{type(error).__name__}: {error}"
