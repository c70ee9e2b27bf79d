"""Several models on the same split: who helps, who harms, and who could not be fitted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fogml.errors import FogmlError, InputError
from fogml.runs.run import Run
from fogml.validation.judge import DEFAULT_AVERAGING_S, judge
from fogml.validation.leave_one_out import leave_one_run_out
from fogml.validation.limits import check_limits
from fogml.validation.results import Judgement

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

ModelMaker = Callable[[], "DriftModel"]


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
    averaging_s: float = DEFAULT_AVERAGING_S,
    design_index: float | None = None,
    limits: Mapping[str, float] | None = None,
    any_unit: bool = False,
    step: Callable[[str], None] | None = None,
) -> Comparison:
    """Fit and judge each model on the same runs.

    Parameters
    ----------
    makers
        Name to a function that makes the unfitted model.
    train_runs
        What each is fitted on.
    test_runs
        What each is judged on; None: each training run in turn is left out and judged.
    averaging_s, design_index, limits, any_unit
        As in :func:`~fogml.validation.judge.judge`.
    step
        Called with a model's name before its turn.

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
    judgements: dict[str, Judgement] = {}
    failed: dict[str, str] = {}
    for name, make in makers.items():
        if step is not None:
            step(name)
        try:
            if test_runs is None:
                judgements[name] = leave_one_run_out(
                    make,
                    train_runs,
                    averaging_s=averaging_s,
                    design_index=design_index,
                    limits=limits,
                    any_unit=any_unit,
                )
            else:
                judgements[name] = judge(
                    make().fit(train_runs),
                    train_runs,
                    test_runs,
                    averaging_s=averaging_s,
                    design_index=design_index,
                    limits=limits,
                    any_unit=any_unit,
                )
        except FogmlError as error:
            failed[name] = str(error)
        except (ValueError, ArithmeticError, MemoryError) as error:
            # A regressor from outside may refuse the data in its own words.
            failed[name] = f"{type(error).__name__}: {error}"
    if not judgements:
        name, reason = next(iter(failed.items()), ("", "no model was named"))
        raise InputError(f"no model could be fitted and judged; {name}: {reason}")
    return Comparison(judgements, failed)
