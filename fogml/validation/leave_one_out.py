"""Leave one run out: each run is judged by a model that was fitted on the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from fogml.errors import InputError
from fogml.runs.run import Run
from fogml.signals.averages import AVERAGING_S
from fogml.validation.judge import judge, judgement_of
from fogml.validation.limits import check_design_index, check_limits, outcome_of
from fogml.validation.repeatability import repeatability_of
from fogml.validation.results import Judgement
from fogml.validation.run_errors import run_errors

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

Split = tuple[list[Run], list[Run]]


def leave_one_run_out(
    make: Callable[[], DriftModel],
    runs: Sequence[Run],
    *,
    averaging_s: float = AVERAGING_S,
    design_index: float | None = None,
    limits: Mapping[str, float] | None = None,
    turn_on_band: float | None = None,
    any_unit: bool = False,
) -> Judgement:
    """Judge a kind of model on every run, each time fitted on the others.

    Parameters
    ----------
    make
        Makes the unfitted model.
    runs
        At least two.
    averaging_s, design_index, limits, turn_on_band, any_unit
        As in :func:`~fogml.validation.judge.judge`.

    Returns
    -------
    Judgement
        ``test`` holds each run as judged by a model that never saw it; ``model`` and ``train``
        are of the model fitted on all of them.

    Raises
    ------
    InputError
        If there are fewer than two runs.
    """
    limits = check_limits(limits or {})
    check_design_index(design_index)
    folds = [
        judge(
            make().fit(others),
            others,
            held_out,
            averaging_s=averaging_s,
            turn_on_band=turn_on_band,
            any_unit=any_unit,
        )
        for others, held_out in splits_of(runs)
    ]
    model = make().fit(runs)
    errors = [run_errors(model, run, any_unit=True) for run in runs]
    whole = judgement_of(model, errors, [], averaging_s=averaging_s, turn_on_band=turn_on_band)
    return merged_folds(whole, folds, design_index, limits)


def splits_of(runs: Sequence[Run]) -> list[Split]:
    """The others and the run left out, for each run.

    Raises
    ------
    InputError
        If there are fewer than two runs.
    """
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
        notes=(*whole.notes, note),
        repeatability=repeatability_of(test),
    )
