"""The diagnosis: where the gap lies, which causes make it, how far it closes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from numbers import Real
from pathlib import Path

import numpy as np

from fogml.errors import InputError, did_you_mean
from fogml.gap.causes import cause_shares, found_cause
from fogml.gap.compensation import compensation_of
from fogml.gap.fitted_model import Explained, explained
from fogml.gap.how_far import Foretold, HeldOut
from fogml.gap.inference import Inference, Progress, check_runs, infer, keep_back
from fogml.gap.model import AnyModel, TwinModel
from fogml.gap.own_simulator import candidates_of
from fogml.gap.planning.next_run import next_run
from fogml.gap.planning.programme_family import Family
from fogml.gap.planning.rehearsal import rehearse
from fogml.gap.posterior import Cause, Judgement, doubted
from fogml.gap.reports import candidate_evidence, noise_of, series_of, stage_energies
from fogml.gap.result import NAMED, Diagnosis, Unknown, Verdict
from fogml.gap.result_parts import Nearest, WhatIf
from fogml.gap.sentences import assumed, doubts, headline, looks_like
from fogml.gap.settings import STANDARD, Priors
from fogml.gap.where import GapOnRun, where
from fogml.processes import one_thread
from fogml.runs.exchange import one_run, runs_of
from fogml.runs.names import named_apart
from fogml.runs.run import Run
from fogml.settings_check import check_whole
from fogml.twin.registry import effects
from fogml.twin.twin import Twin
from fogml.twin.twin_file import as_twin


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


__all__ = ["diagnose"]


def diagnose(
    model: Twin | AnyModel | str | Path,
    fit: Run | Sequence[Run],
    held_out: Run | Sequence[Run] = (),
    *,
    noise: Run | None = None,
    without: Iterable[str] = (),
    seed: int = 0,
    priors: Priors | None = None,
    plan: bool = True,
    family: Family | None = None,
    rehearsed: bool = False,
    cost_of_false_name: float = 1.0,
    courses: bool = False,
    progress: Progress | None = None,
) -> Diagnosis:
    """Where the gap lies, which causes make it, how far it closes; on recordings.

    Parameters
    ----------
    model
        The twin, the name or file of one, or any model of a gyro in its place.
    fit
        A run or runs of one unit to fit on.
    held_out
        Runs for the final figure; if none, the last quarter of the last fit run.
    noise
        A static run of the unit.
    without
        Ids of effects that are no candidates.
    seed
        Of the draws behind intervals.
    priors
        What is taken for granted.
    plan
        Whether to look for a programme that would tell more.
    family
        What the lab can do for it, and for how long; as usual if None. Its mountings are those of the runs.
    rehearsed
        Whether to tell what these runs would name of each candidate.
    cost_of_false_name
        Of a false name over that of a missed one, above 0: a cause is named from odds of this on.
    courses
        Whether to keep what each effect makes of each run, for a page on which their sizes are moved.
    progress
        Told what is being done.

    Raises
    ------
    InputError
        If runs are of different units, a run is used twice, no temperature moves, an effect is
        unknown, or no run can be used.
    """
    tell = progress or (lambda what: None)
    check_whole("seed", seed)
    check_cost(cost_of_false_name)
    fit, held_out, noise = runs_of(fit), runs_of(held_out), None if noise is None else one_run(noise)
    found = inferred(model, fit, held_out, noise, without, priors, tell)
    tell("judging on held-out runs")
    within = (family or Family()) if plan else None
    return answered(found, noise, not held_out, seed, cost_of_false_name, within, rehearsed, courses, tell)


def check_cost(of_false_name: float) -> None:
    """Refuse a cost of a false name that is no number above 0."""
    if not (isinstance(of_false_name, Real) and 0.0 < of_false_name < math.inf):
        raise InputError(f"cost_of_false_name is {of_false_name!r}; a number above 0 is needed")


def inferred(
    model: Twin | AnyModel | str | Path,
    fit: Sequence[Run],
    held_out: Sequence[Run],
    noise: Run | None,
    without: Iterable[str],
    priors: Priors | None,
    tell: Progress,
) -> Inference:
    """The posterior of causes behind the runs of one unit, once those are checked."""
    given = as_twin(model) if isinstance(model, str | Path) else model
    model = TwinModel(given) if isinstance(given, Twin) else given
    if not hasattr(model, "constants"):
        kind = type(given).__name__
        raise InputError(f"a twin, its name or file, or a fogml.gap.model.GyroModel is needed, found {kind}")
    without = (without,) if isinstance(without, str) else tuple(without)
    for id in without:
        if id not in candidates_of(model) and id not in effects():
            hint = did_you_mean(id, effects(), most=3)
            raise InputError(f"--without {id}: there is no such effect; {hint}`fogml effects` lists them")
    check_runs(fit, held_out, noise)
    # The unit ages from its first run on, whichever it is.
    fit, held_out, _ = with_epoch(fit, held_out, [noise] if noise else [])
    fit, held_out = named_apart(fit, held_out)
    since_s = -math.inf
    if not held_out:
        # Replayed with what came before it, which the gyro remembers.
        held_out = fit[-1:]
        fit, (part,) = keep_back(fit, (priors or STANDARD).rows.kept_back)
        since_s = float(part.time[0])
    with one_thread():
        return infer(model, fit, held_out, noise, without, priors or STANDARD, tell, since_s)


def answered(
    found: Inference,
    noise: Run | None,
    part: bool,
    seed: int,
    cost_of_false_name: float,
    family: Family | None = None,
    rehearsed: bool = False,
    courses: bool = False,
    tell: Progress = lambda what: None,
) -> Diagnosis:
    """What is said of a posterior; `part` where the last stretch of the last run was held out.

    With a `family` of programmes the next run is looked for among those.
    """
    with one_thread():
        told = explained(found, cost_of_false_name)
        found, judged = told.found, told.judged
        answer = _answer(told, noise, part, seed, courses)
        if family is not None:
            open_ = answer.verdict in ("unknown", "partly_explained")
            run = next_run(found, judged, answer.found, answer.undetectable, seed, tell, open_, family)
            answer = replace(answer, separating_run=run)
        if rehearsed:
            tell("rehearsing each candidate")
            answer = replace(answer, rehearsal=rehearse(found.search, answer.found, cost_of_false_name))
        return answer


def _answer(told: Explained, noise: Run | None, part: bool, seed: int, courses: bool) -> Diagnosis:
    found, judged, cards, fit = told.found, told.judged, told.cards, told.fit
    named = judged.named
    scene, settings, likeliest = found.scene, found.setting.priors.reported, judged.best.members
    # As the model that is written replays, which has nothing but what is named.
    after = fit.foretold
    recalibrated = Foretold.of(found, ())
    every = Foretold.of(found, likeliest)
    shares = cause_shares(found, judged, every, recalibrated, seed)
    # Of causes that cancel by a little one has a little more than all.
    whole = (s for s in shares if s.run is None and s.regime is None)
    share = {s.effect: min(max(s.share, 0.0), 1.0) for s in whole}
    items = tuple(
        found_cause(found, every, c, cards[c.ids[0]], share.get(c.ids[0], 0.0))
        for c in judged.causes
        if c.probability >= settings.listed
    )
    held_out = [
        HeldOut(found, i, recalibrated, likeliest, seed) for i in range(scene.fitted, len(scene.runs))
    ]
    far = tuple(h.how_far(after) for h in held_out)
    gaps = [
        GapOnRun(r, recalibrated.left_on(i), sum((every.of_member(i, m) for m in likeliest), 0.0 * r.gap))
        for i, r in enumerate(scene.fit)
    ]
    lies = where(gaps, stage_energies(found, every, recalibrated), found.points.fit.model, settings)
    evidence = candidate_evidence(found, judged, [i for f in items if f.named for i in f.members])
    what_if = _what_if(found, named, held_out)
    nearest = _nearest(found, what_if, judged)
    unknown = doubted(Unknown(judged.unknown, looks_like(found, judged)), items)
    verdict = _verdict(named, unknown, judged.nothing < settings.surely_not_nothing)
    answer = Diagnosis(
        fit=tuple(r.run.name for r in scene.fit),
        held_out=tuple(r.run.name for r in scene.runs[scene.fitted :]),
        noise_run=noise.name if noise else None,
        held_out_is_part=part,
        verdict=verdict,
        found=() if verdict == "unknown" else items,
        suspected=() if verdict != "unknown" else tuple(f for f in items if not f.named),
        unknown=unknown,
        where=lies,
        how_far=far,
        undetectable=tuple(e.effect for e in evidence if e.status in ("undetectable", "in_constants")),
        separating_run=None,
        constants=fit.constants,
        evidence=evidence,
        noise=noise_of(found, after),
        effects=fit.effects,
        uncertainty=fit.uncertainty,
        least_suspected=settings.suspected,
        series=series_of(found, recalibrated, fit, named, courses),
        unusable=found.unusable,
        assumed=assumed(found, fit.constants),
        model=found.model.name,
        what_if=what_if,
        nearest=nearest,
        shares=shares,
        compensation=compensation_of(found, judged.causes, named),
    )
    other_plant = any(found.kind(m) == "plant" for m in likeliest)
    said = (*headline(found, answer, other_plant), *doubts(found, recalibrated, noise, part))
    return replace(answer, headline=said)


def _verdict(named: Sequence[Cause], unknown: Unknown, something: bool) -> Verdict:
    """In a word; `something` says that a gap is there, whatever makes it."""
    if named and unknown.probability >= NAMED:
        return "partly_explained"
    if named:
        return "explained" if all(len(c.ids) == 1 for c in named) else "ambiguous"
    return "unknown" if unknown.probability >= NAMED or something else "no_gap"


def _what_if(found: Inference, named: Sequence[Cause], held_out: Sequence[HeldOut]) -> tuple[WhatIf, ...]:
    """Every candidate alone, and beside what is named: what the held-out runs keep."""
    search = found.search
    beside = [m for c in named for m in c.members]
    rows = []
    for others in [[], beside] if beside else [[]]:
        ids = tuple(dict.fromkeys(found.columns.families[m.family].id for m in others))
        for f, member in search.best_members(others).items():
            family = found.columns.families[f]
            if family.kind != "known" or family.id in ids:
                continue
            both = [*others, member]
            foretold = Foretold.of(found, both)
            share = _closed_share(found, foretold)
            for run in held_out:
                told = run.how_far(foretold)
                rows.append(
                    WhatIf(family.id, ids, told.run, told.after, told.closed, told.closed_ci90, share)
                )
    return tuple(rows)


def _closed_share(found: Inference, foretold: Foretold) -> float:
    """Share of the fit runs' structural gap above the noise, whitened, that is gone with causes."""
    held = found.field
    left = held.beside(foretold.members)
    along = [float(np.sum((b.basis.T @ b.data) ** 2)) for b in (held.base, left)]
    above = float(held.base.data @ held.base.data) - along[0] - len(held.base.data)
    return float(np.clip((along[1] - along[0]) / above, 0.0, 1.0)) if above > 0.0 else 0.0


def _nearest(found: Inference, what_if: Sequence[WhatIf], judged: Judgement) -> tuple[Nearest, ...]:
    alone = {w.effect: w.share for w in what_if if not w.beside}
    families, gains = found.columns.families, found.search.alone()
    order = sorted(found.search.families_of("known"), key=lambda i: -gains[i])
    return tuple(
        Nearest(
            found.scene.candidates[families[i].id].family.replace("_", " "),
            families[i].id,
            alone.get(families[i].id, 0.0),
            judged.weight_of(i),
        )
        for i in order[: found.setting.priors.reported.nearest]
    )
