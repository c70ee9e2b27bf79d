"""Leave one run out: each run is judged by a model that was fitted on the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from fogml.errors import InputError
from fogml.runs.run import Run
from fogml.validation.judge import DEFAULT_AVERAGING_S, judge
from fogml.validation.limits import check_limits, outcome_of
from fogml.validation.results import Judgement, RunJudgement

if TYPE_CHECKING:
    from fogml.models.base import DriftModel


def leave_one_run_out(
    make: Callable[[], DriftModel],
    runs: Sequence[Run],
    *,
    averaging_s: float = DEFAULT_AVERAGING_S,
    design_index: float | None = None,
    limits: Mapping[str, float] | None = None,
    any_unit: bool = False,
) -> Judgement:
    """Judge a kind of model on every run, each time fitted on the others.

    Parameters
    ----------
    make
        Makes the unfitted model.
    runs
        At least two.
    averaging_s, design_index, limits, any_unit
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
    if len(runs) < 2:
        raise InputError(f"leaving one run out needs at least two runs, {len(runs)} given")
    limits = check_limits(limits or {})
    held_out: list[RunJudgement] = []
    for number, run in enumerate(runs):
        others = [*runs[:number], *runs[number + 1 :]]
        judged = judge(make().fit(others), others, run, averaging_s=averaging_s, any_unit=any_unit)
        held_out.extend(judged.test)
    whole = judge(make().fit(runs), runs, runs, averaging_s=averaging_s, any_unit=any_unit)
    return Judgement(
        model=whole.model,
        train=whole.train,
        test=tuple(held_out),
        design_index=outcome_of("rms", design_index, held_out) if design_index is not None else None,
        limits=tuple(outcome_of(name, limit, held_out) for name, limit in limits.items()),
        notes=(*whole.notes, f"Each of the {len(runs)} runs is judged by a model fitted on the others."),
    )
