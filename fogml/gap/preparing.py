"""Runs made ready for a diagnosis: checked, observed, noise fitted, constants recalibrated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.errors import InputError
from fogml.gap.dictionary import unknown_groups
from fogml.gap.fitting import Fit, fit_model
from fogml.gap.group import Group
from fogml.gap.model import GyroModel
from fogml.gap.noise import FROM_RUNS_ALONE, Noise, noise_of, prior_of
from fogml.gap.observation import Observation, Unusable, observe
from fogml.gap.run_whitener import RunWhitener
from fogml.runs.epochs import with_epoch
from fogml.runs.run import FloatArray, Run
from fogml.signals.noise_fit import NoisePrior

LEAST_MOTION_DEGC = 2.0
KEPT_BACK = 0.25
"""Share of the last run that is held out where no run is."""
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Prepared:
    """Everything that does not depend on which effects are looked for."""

    model: GyroModel
    fit: tuple[Observation, ...]
    held_out: tuple[Observation, ...]
    noise: Noise
    noise_prior: NoisePrior
    groups: tuple[Group, ...]
    recalibrated: Fit
    whiteners: tuple[RunWhitener, ...]
    noise_run: str | None
    held_out_is_part: bool
    unusable: tuple[tuple[str, str], ...]


def prepare(
    model: GyroModel,
    fit: Sequence[Run],
    held_out: Sequence[Run],
    noise: Run | None,
    tell: Progress = lambda what: None,
) -> Prepared:
    """Runs made ready, noise fitted, constants recalibrated."""
    check_runs(fit, held_out, noise)
    # The unit ages from its first run on, whichever it is.
    fit, held_out, _ = with_epoch(fit, held_out, [noise] if noise else [])
    part = not held_out
    if part:
        fit, held_out = keep_back(fit)
    tell("reading inputs")
    fit_rows, unusable = _observed(fit, model)
    held_rows, more = _observed(held_out, model)
    unusable += more
    if not fit_rows:
        raise InputError("; ".join(reason for _, reason in unusable))
    moved = max(float(np.ptp(o.temperature)) for o in fit_rows)
    if moved < LEAST_MOTION_DEGC and not any(np.any(o.run.rate) for o in fit_rows):
        raise InputError(
            f"{', '.join(o.run.name for o in fit_rows)}: temperature moves by {moved:.2g} degC in all; "
            f"a diagnosis needs a run in which it moves by {LEAST_MOTION_DEGC:g} degC or more"
        )
    groups = tuple(unknown_groups(fit_rows))
    tell("fitting the noise")
    prior, source = prior_of(model, noise)
    fitted_noise = noise_of(fit_rows, model.constants, groups, prior, source)
    whiteners, recalibrated = recalibrated_constants(model, fit_rows, fitted_noise)
    return Prepared(
        model,
        tuple(fit_rows),
        tuple(held_rows),
        fitted_noise,
        prior,
        groups,
        recalibrated,
        whiteners,
        noise.name if noise else None,
        part,
        tuple(unusable),
    )


def recalibrated_constants(
    model: GyroModel, observations: Sequence[Observation], noise: Noise
) -> tuple[tuple[RunWhitener, ...], Fit]:
    """Constants fitted, and whiteners whose weights know them."""
    values: Mapping[str, float] = {c.name: c.mean for c in model.constants}
    for _ in range(2):
        whiteners = tuple(RunWhitener(noise.model, o, values) for o in observations)
        fit = fit_model(observations, whiteners, model.constants)
        values = fit.constants
    return whiteners, fit


def with_noise_beside(
    p: Prepared, explained: Sequence[FloatArray] | None, *, alone: bool = False
) -> Prepared:
    """The same with the noise fitted again beside what effects that were found can do, shape (m_r, k).

    Beside it `alone`, whatever else moves is noise; otherwise smooth unknowns are kept out of it.
    """
    groups, source = p.groups, p.noise.source
    if alone:
        groups, source = (), source if p.noise_run else FROM_RUNS_ALONE
    noise = noise_of(p.fit, p.model.constants, groups, p.noise_prior, source, explained)
    whiteners, recalibrated = recalibrated_constants(p.model, p.fit, noise)
    return replace(p, noise=noise, whiteners=whiteners, recalibrated=recalibrated)


def check_runs(fit: Sequence[Run], held_out: Sequence[Run], noise: Run | None) -> None:
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


def _observed(runs: Sequence[Run], model: GyroModel) -> tuple[list[Observation], list[tuple[str, str]]]:
    rows, unusable = [], []
    for run in runs:
        try:
            rows.append(observe(run, model))
        except Unusable as error:
            unusable.append((run.name, str(error)))
    return rows, unusable
