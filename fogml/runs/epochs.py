"""Since when a unit is in use, told by when its runs started."""

from __future__ import annotations

from collections.abc import Sequence

from fogml.errors import InputError
from fogml.runs.run import Run


def with_epoch(*groups: Sequence[Run]) -> tuple[list[Run], ...]:
    """The groups of a unit's runs, each run with the fact `in_use_since`: the first start among all of them.

    A run that states the fact keeps it; one that does not say when it started stays as it is.

    Raises
    ------
    InputError
        If only some of the starts have a time zone.
    """
    starts = [run.facts.started for group in groups for run in group if run.facts.started is not None]
    if not starts:
        return tuple(list(group) for group in groups)
    try:
        first = min(starts)
    except TypeError:
        raise InputError("'started' has a time zone in some of the runs only; add it") from None

    def told(run: Run) -> Run:
        if run.facts.started is None or run.facts.in_use_since is not None:
            return run
        return run.with_facts(run.facts.model_copy(update={"in_use_since": first}))

    return tuple([told(run) for run in group] for group in groups)
