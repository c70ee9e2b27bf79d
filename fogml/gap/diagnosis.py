"""The diagnosis: recalibrate, where, which, how far."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fogml.errors import InputError
from fogml.gap.basis import Basis, build_basis
from fogml.gap.classes import Ranked, Ranking, rank
from fogml.gap.describe import describe_unknown
from fogml.gap.dictionary import Group, unknown_groups
from fogml.gap.evidence import Field
from fogml.gap.fitting import Fit, fit_model
from fogml.gap.frame import Frame
from fogml.gap.how_far import AVERAGING_S, averages, how_far
from fogml.gap.model import Candidate, EffectValue, GyroModel
from fogml.gap.noise import Noise, noise_of, prior_of
from fogml.gap.observation import Observation, Unusable, observe
from fogml.gap.reports import candidate_evidence, constant_fits, noise_report, run_series, with_run_amplitudes
from fogml.gap.result import Diagnosis, Estimate, Found, HowFar, Unknown, Verdict
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.search import Search
from fogml.gap.starting import starting_values
from fogml.gap.structure import gaps_on_runs, stage_energies
from fogml.gap.where import where
from fogml.runs.run import Run
from fogml.twin.twin import Twin

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
    groups: tuple[Group, ...]
    recalibrated: Fit
    whiteners: tuple[RunWhitener, ...]
    noise_run: str | None
    held_out_is_part: bool
    unusable: tuple[tuple[str, str], ...]


def diagnose(
    twin: Twin | GyroModel,
    fit: Sequence[Run],
    held_out: Sequence[Run] = (),
    *,
    noise: Run | None = None,
    without: Iterable[str] = (),
    seed: int = 0,
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
    progress
        Told what is being done.

    Raises
    ------
    InputError
        If runs are of different units, a run is used twice, no temperature moves, an effect is
        unknown, or no run can be used.
    """
    tell = progress or (lambda what: None)
    model = as_model(twin)
    candidates = _candidates(model, without)
    prepared = prepare(model, fit, held_out, noise, tell)
    tell("whitening candidates")
    basis = _basis(prepared, candidates, prepared.recalibrated.constants, tell)
    search = Search(Field(basis))
    tell("searching sets of effects")
    ranking = rank(search, search.run())
    return _result(prepared, candidates, basis, search, ranking, seed, tell)


def prepare(
    model: GyroModel,
    fit: Sequence[Run],
    held_out: Sequence[Run],
    noise: Run | None,
    tell: Progress = lambda what: None,
) -> Prepared:
    """Runs made ready, noise fitted, constants recalibrated."""
    _check_runs(fit, held_out, noise)
    part = not held_out
    if part:
        fit, held_out = _keep_back(fit)
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
    whiteners, recalibrated = _recalibrated(model, fit_rows, fitted_noise)
    return Prepared(
        model,
        tuple(fit_rows),
        tuple(held_rows),
        fitted_noise,
        groups,
        recalibrated,
        whiteners,
        noise.name if noise else None,
        part,
        tuple(unusable),
    )


def _recalibrated(
    model: GyroModel, observations: Sequence[Observation], noise: Noise
) -> tuple[tuple[RunWhitener, ...], Fit]:
    """Constants fitted, and whiteners whose weights know them."""
    values: Mapping[str, float] = {c.name: c.mean for c in model.constants}
    for _ in range(2):
        whiteners = tuple(RunWhitener(noise.model, o, values) for o in observations)
        fit = fit_model(observations, whiteners, model.constants)
        values = fit.constants
    return whiteners, fit


def _basis(
    p: Prepared, candidates: Mapping[str, Candidate], values: Mapping[str, float], tell: Progress
) -> Basis:
    return build_basis(
        Frame(p.fit, p.whiteners, p.model.constants, values),
        candidates,
        p.groups,
        p.model.grade,
        lambda id: tell(f"whitening candidates: {id}"),
    )


def _result(
    p: Prepared,
    candidates: Mapping[str, Candidate],
    basis: Basis,
    search: Search,
    ranking: Ranking,
    seed: int,
    tell: Progress,
) -> Diagnosis:
    tell("fitting what was found")
    found, fits = _found(p, candidates, basis, ranking)
    unknown = Unknown(
        ranking.unknown, describe_unknown(p, search, ranking) if ranking.unknown >= 0.05 else ""
    )
    verdict = _verdict(found, unknown)
    if verdict == "unknown":
        found = ()
    after = fits if any(f.named for f in found) else p.recalibrated
    gaps = gaps_on_runs(p, after, search, ranking)
    rng = np.random.default_rng(seed)
    tell("judging on held-out runs")
    far = tuple(how_far(o, p.model.constants, p.recalibrated, after, p.noise, rng) for o in p.held_out)
    evidence = candidate_evidence(search, ranking, basis, candidates, found)
    return Diagnosis(
        fit=tuple(o.run.name for o in p.fit),
        held_out=tuple(o.run.name for o in p.held_out),
        noise_run=p.noise_run,
        held_out_is_part=p.held_out_is_part,
        verdict=verdict,
        found=with_run_amplitudes(p, after, found),
        unknown=unknown,
        where=where(gaps, stage_energies(p, after, candidates, search, ranking), p.noise),
        how_far=far,
        undetectable=tuple(e.effect for e in evidence if e.status in ("undetectable", "in_constants")),
        separating_run=None,
        constants=constant_fits(p.model, after),
        evidence=evidence,
        noise=noise_report(p, after),
        effects=after.effects,
        series=run_series(p, after),
        unusable=p.unusable,
        assumed=(),
        model=p.model.name,
    )


def _found(
    p: Prepared, candidates: Mapping[str, Candidate], basis: Basis, ranking: Ranking
) -> tuple[tuple[Found, ...], Fit]:
    """Effects with numbers, and the fit with those that are named."""
    named = [r for r in ranking.effects if r.probability >= 0.5 and r.chosen.candidate in ranking.best.ids]
    starts = starting_values(
        p.fit,
        p.whiteners,
        p.model.constants,
        p.recalibrated.constants,
        [(r.chosen.candidate, basis.nodes[r.chosen.node].node.shape) for r in named],
        candidates,
    )
    fit = p.recalibrated
    if starts:
        fit = fit_model(
            p.fit, p.whiteners, p.model.constants, starts, candidates, p.model.grade, p.recalibrated.constants
        )
    fitted = {e.id: e for e in fit.effects}
    errors = fit.standard_errors
    found = []
    for r in ranking.effects:
        id, declared = r.chosen.candidate, candidates[r.chosen.candidate]
        value = fitted.get(id) or _rough(r, basis, candidates)
        se = float(errors.get(f"{id}.amplitude", abs(value.amplitude)))
        found.append(
            Found(
                effect=id,
                stage=declared.stage,
                members=r.members,
                probability=r.probability,
                amplitude=Estimate(value.amplitude, se, declared.amplitude.unit),
                parameters={
                    q.name: Estimate(value.shape[q.name], float(errors.get(f"{id}.{q.name}", 0.0)), q.unit)
                    for q in declared.shape
                    if q.name in value.shape
                },
            )
        )
    return tuple(found), fit


def _rough(ranked: Ranked, basis: Basis, candidates: Mapping[str, Candidate]) -> EffectValue:
    """An effect that is not fitted: its best node, and the size that goes with its length."""
    node = basis.nodes[ranked.chosen.node]
    declared = candidates[ranked.chosen.candidate]
    amplitude = ranked.chosen.length * node.size
    low, high = declared.amplitude.limits
    return EffectValue(declared.id, float(np.clip(amplitude, low, high)), node.node.shape)


def _verdict(found: Sequence[Found], unknown: Unknown) -> Verdict:
    named = [f for f in found if f.named]
    if named and unknown.probability >= 0.5:
        return "partly_explained"
    if named:
        return "explained" if all(len(f.members) == 1 for f in named) else "ambiguous"
    return "unknown" if unknown.probability >= 0.5 else "no_gap"


def as_model(twin: Twin | GyroModel) -> GyroModel:
    if isinstance(twin, Twin):
        from fogml.gap.twin_model import TwinModel

        return TwinModel(twin)
    return twin


def _candidates(model: GyroModel, without: Iterable[str]) -> dict[str, Candidate]:
    candidates = dict(model.candidates())
    for id in without:
        if id not in candidates:
            from fogml.twin.registry import effects

            if id not in effects():
                raise InputError(f"--without {id}: there is no such effect; `fogml effects` lists them")
            continue
        del candidates[id]
    return candidates


def _check_runs(fit: Sequence[Run], held_out: Sequence[Run], noise: Run | None) -> None:
    if not fit:
        raise InputError("no run to diagnose is given")
    hashes: dict[str, str] = {}
    for role, runs in (("fit", fit), ("held-out", held_out)):
        for run in runs:
            if run.hash in hashes:
                raise InputError(
                    f"{run.name}: given as a {role} run and as {hashes[run.hash]} too; a held-out run "
                    "must be one that the fit has not seen"
                )
            hashes[run.hash] = f"a {role} run ({run.name})"
    units = {run.facts.unit: run.name for run in (*fit, *held_out) if run.facts.unit}
    axes = {run.facts.axis: run.name for run in (*fit, *held_out) if run.facts.axis}
    for what, held in (("unit", units), ("axis", axes)):
        if len(held) > 1:
            listed = ", ".join(f"{name} is {what} {value}" for value, name in held.items())
            raise InputError(f"the runs are of different {what}s ({listed}); diagnose one {what} at a time")


def _keep_back(fit: Sequence[Run]) -> tuple[Sequence[Run], Sequence[Run]]:
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


__all__ = ["AVERAGING_S", "HowFar", "Prepared", "averages", "diagnose", "prepare"]
