"""The runs of a diagnosis: which may go together, and what is held out where no run is."""

from __future__ import annotations

from collections.abc import Sequence

from fogml.errors import InputError
from fogml.runs.run import Run

LEAST_MOTION_DEGC = 2.0
KEPT_BACK = 0.25
"""Share of the last run that is held out where no run is."""


def check_runs(fit: Sequence[Run], held_out: Sequence[Run], noise: Run | None) -> None:
    """Refuse runs that can't be diagnosed together.

    Raises
    ------
    InputError
        If there is no fit run, a run is used twice, or runs are of different units or axes.
    """
    if not fit:
        raise InputError("no run to diagnose is given")
    held: dict[str, tuple[str, str]] = {}
    for role, runs in (("fit", fit), ("held-out", held_out)):
        for run in runs:
            if run.hash in held:
                other, name = held[run.hash]
                if other == role:
                    raise InputError(f"{run.name}: the same samples as {name}; give each run once")
                raise InputError(
                    f"{run.name}: given as a {role} run and as a {other} run ({name}) too; a held-out run "
                    "must be one that the fit has not seen"
                )
            held[run.hash] = role, run.name
    units = {run.facts.unit: run.name for run in (*fit, *held_out) if run.facts.unit}
    axes = {run.facts.axis: run.name for run in (*fit, *held_out) if run.facts.axis}
    for what, stated in (("unit", units), ("axis", axes)):
        if len(stated) > 1:
            listed = ", ".join(f"{name} is {what} {value}" for value, name in stated.items())
            raise InputError(f"the runs are of different {what}s ({listed}); diagnose one {what} at a time")


def keep_back(fit: Sequence[Run]) -> tuple[Sequence[Run], Sequence[Run]]:
    """Fit runs less the last stretch of the last one, and that."""
    last = fit[-1]
    cut = int(len(last) * (1.0 - KEPT_BACK))
    return [*fit[:-1], last[:cut]], [last[cut:]]
