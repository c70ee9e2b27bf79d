"""A fleet's RBF networks trained in batches: many units' descents in one tensor program."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from fogml.errors import InputError
from fogml.fleet.tasks import Task, finished, run_task
from fogml.models.rbf.together import fit_together


def run_batched(
    tasks: Sequence[Task], batch: int, progress: Callable[[dict[str, Any]], None] | None = None
) -> list[dict[str, Any]]:
    """Run every task that is not done yet, `batch` of them beside each other; outcomes in order.

    Each job runs in a thread; wherever networks are tuned, the threads' objectives are worked out
    together. Results are those of running the tasks one by one, but for what rounding in a batch does to
    where a search ends: far below the noise.

    Parameters
    ----------
    tasks
        What to do.
    batch
        Units beside each other.
    progress
        Called with each outcome, a batch at a time.

    Raises
    ------
    InputError
        If the batch is empty, or the disk is full; finished units are kept.
    """
    if batch < 1:
        raise InputError(f"batch {batch}: at least 1 unit is needed")
    told = progress or (lambda outcome: None)
    outcomes = {task.unit.folder: finished(task) for task in tasks}
    for outcome in outcomes.values():
        if outcome is not None:
            told(outcome)
    todo = [task for task in tasks if outcomes[task.unit.folder] is None]
    for start in range(0, len(todo), batch):
        part = todo[start : start + batch]
        for task, outcome in zip(part, fit_together([partial(run_task, task) for task in part]), strict=True):
            outcomes[task.unit.folder] = outcome
            told(outcome)
    return [outcome for task in tasks if (outcome := outcomes[task.unit.folder]) is not None]
