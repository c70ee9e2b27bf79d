"""The diagnosis: recalibrate, where, which, how far."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fogml.errors import InputError
from fogml.gap.assumptions import assumptions
from fogml.gap.confidence import UNSURE, likely
from fogml.gap.describe import describe_unknown
from fogml.gap.families import answer
from fogml.gap.families.priors import Priors
from fogml.gap.found import fit_named, found_effects
from fogml.gap.how_far import AVERAGING_S, averages, how_far
from fogml.gap.how_far_result import HowFar
from fogml.gap.left_out import doubted, with_look_alikes
from fogml.gap.model import Candidate, GyroModel
from fogml.gap.next_run import next_run
from fogml.gap.preparing import Prepared, Progress, prepare
from fogml.gap.realised import lost_names, no_more_certain, realised
from fogml.gap.reports import (
    candidate_evidence,
    constant_fits,
    noise_report,
    run_series,
    weighed_by_runs,
    with_run_amplitudes,
)
from fogml.gap.result import NAMED, Diagnosis, Found, Unknown, Verdict
from fogml.gap.structure import gaps_on_runs, stage_energies, systematic_parts
from fogml.gap.trials import Trial, best_trial
from fogml.gap.twin_model import TwinModel
from fogml.gap.where import where
from fogml.runs.run import Run
from fogml.twin.twin import Twin

SURELY_NOT_NOTHING = 0.02
"""Probability that nothing acts under which there is a gap, whatever makes it."""


def diagnose(
    twin: Twin | GyroModel,
    fit: Sequence[Run],
    held_out: Sequence[Run] = (),
    *,
    noise: Run | None = None,
    without: Iterable[str] = (),
    seed: int = 0,
    plan: bool = True,
    rehearsed: bool = False,
    cost_of_false_name: float = 1.0,
    priors: Priors | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Where the gap between a model and recordings lies, which effect causes it, how far it closes.

    Parameters
    ----------
    twin
        The twin, or any `GyroModel`.
    fit
        Runs of one unit to fit on.
    held_out
        Runs for the final figure; if none, the last quarter of the last fit run.
    noise
        A static run of the unit.
    without
        Ids of effects that are no candidates.
    seed
        Of the draws behind intervals.
    plan
        Whether to look for a programme that would tell more.
    rehearsed
        Whether to tell what these runs would name of each candidate.
    cost_of_false_name
        Of a false name over that of a missed one: a cause is named from odds of this on.
    priors
        What is taken for granted.
    progress
        Told what is being done.

    Raises
    ------
    InputError
        If runs are of different units, a run is used twice, no temperature moves, an effect is
        unknown, or no run can be used.
    """
    from threadpoolctl import threadpool_limits

    model = as_model(twin)
    if isinstance(model, TwinModel):
        return answer.diagnose(
            model,
            fit,
            held_out,
            noise=noise,
            without=without,
            seed=seed,
            plan=plan,
            rehearsed=rehearsed,
            cost_of_false_name=cost_of_false_name,
            priors=priors,
            progress=progress,
        )
    # Matrices are small: more threads than one cost more than they bring.
    with threadpool_limits(1):
        return _diagnosed(model, fit, held_out, noise, without, seed, plan, progress or (lambda what: None))


def _diagnosed(
    model: GyroModel,
    fit: Sequence[Run],
    held_out: Sequence[Run],
    noise: Run | None,
    without: Iterable[str],
    seed: int,
    plan: bool,
    tell: Progress,
) -> Diagnosis:
    candidates, left_out = _candidates(model, without)
    trial = best_trial(prepare(model, fit, held_out, noise, tell), candidates, tell)
    return _result(trial, candidates, left_out, seed, plan, tell)


def _result(
    trial: Trial,
    candidates: Mapping[str, Candidate],
    left_out: Mapping[str, Candidate],
    seed: int,
    plan: bool,
    tell: Progress,
) -> Diagnosis:
    p, basis, search = trial.prepared, trial.basis, trial.search
    tell("fitting what was found")
    fit = fit_named(p, candidates, search, trial.ranking)
    ranking = realised(p, candidates, search, trial.ranking, fit)
    lost = lost_names(trial.ranking, ranking)
    if lost and ranking.named:
        ranking = no_more_certain(ranking, trial.without(lost))
    if ranking.named != trial.ranking.named:
        fit = fit_named(p, candidates, search, ranking)
    found, fits = found_effects(candidates, search, ranking, fit)
    found = weighed_by_runs(with_run_amplitudes(p, fits, found))
    found, suspected = _parted(with_look_alikes(search, ranking.best, found, left_out, p.model.grade))
    looks_like = describe_unknown(p, search, ranking) if ranking.unknown >= 0.05 else ""
    unknown = doubted(Unknown(ranking.unknown, looks_like, ranking.log_odds), found)
    verdict = _verdict(found, unknown, ranking.nothing)
    if verdict == "unknown":
        found = ()
    after = fits if any(f.named for f in found) else p.recalibrated
    systematic = systematic_parts(search, ranking)
    gaps = gaps_on_runs(p, systematic)
    rng = np.random.default_rng(seed)
    tell("judging on held-out runs")
    far = tuple(how_far(o, p.model.constants, p.recalibrated, after, p.noise, rng) for o in p.held_out)
    evidence = candidate_evidence(search, ranking, basis, candidates, (*found, *suspected))
    undetectable = tuple(e.effect for e in evidence if e.status in ("undetectable", "in_constants"))
    return Diagnosis(
        fit=tuple(o.run.name for o in p.fit),
        held_out=tuple(o.run.name for o in p.held_out),
        noise_run=p.noise_run,
        held_out_is_part=p.held_out_is_part,
        verdict=verdict,
        found=found,
        suspected=suspected,
        unknown=unknown,
        where=where(gaps, stage_energies(candidates, systematic), p.noise),
        how_far=far,
        undetectable=undetectable,
        separating_run=next_run(p, found, undetectable, candidates, search, seed, tell) if plan else None,
        constants=constant_fits(p.model, after),
        evidence=evidence,
        noise=noise_report(p, after),
        effects=after.effects,
        series=run_series(p, after),
        unusable=p.unusable,
        assumed=assumptions(p, basis),
        model=p.model.name,
    )


def _parted(found: Sequence[Found]) -> tuple[tuple[Found, ...], tuple[Found, ...]]:
    """What was found, and what is only suspected: more likely than not, and not sure enough for a name."""
    suspected = {
        f.effect: replace(f, probability=likely(f.support))
        for f in found
        if UNSURE <= f.probability < NAMED <= likely(f.support) and f.support.margin > 0.0
    }
    return tuple(f for f in found if f.effect not in suspected), tuple(suspected.values())


def _verdict(found: Sequence[Found], unknown: Unknown, nothing: float) -> Verdict:
    named = [f for f in found if f.named]
    if named and unknown.probability >= 0.5:
        return "partly_explained"
    if named:
        return "explained" if all(len(f.members) == 1 for f in named) else "ambiguous"
    # Something acts for certain where nothing can't be: then it is not known what.
    return "unknown" if unknown.probability >= 0.5 or nothing < SURELY_NOT_NOTHING else "no_gap"


def as_model(twin: Twin | GyroModel) -> GyroModel:
    return TwinModel(twin) if isinstance(twin, Twin) else twin


def _candidates(
    model: GyroModel, without: Iterable[str]
) -> tuple[dict[str, Candidate], dict[str, Candidate]]:
    """What may be named, and what the model offers besides."""
    candidates, left_out = dict(model.candidates()), {}
    for id in without:
        if id not in candidates:
            from fogml.twin.registry import effects

            if id not in effects():
                raise InputError(f"--without {id}: there is no such effect; `fogml effects` lists them")
            continue
        left_out[id] = candidates.pop(id)
    return candidates, left_out


__all__ = ["AVERAGING_S", "HowFar", "Prepared", "averages", "diagnose", "prepare"]
