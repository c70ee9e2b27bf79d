"""The answer of a diagnosis: verdict, causes with numbers, where, how far, what if, nearest, words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fogml.errors import InputError
from fogml.gap.families.card import Card, card_of
from fogml.gap.families.closing import Foretold, HeldOut
from fogml.gap.families.inference import Inference, Progress, infer
from fogml.gap.families.posterior import Cause, Judgement, judge
from fogml.gap.families.priors import Priors
from fogml.gap.families.reports import (
    assumed,
    candidate_evidence,
    constants_of,
    noise_of,
    series_of,
    stage_energies,
)
from fogml.gap.families.search import Member
from fogml.gap.families.words import headline, looks_like
from fogml.gap.how_far_result import Nearest, WhatIf
from fogml.gap.preparing import LEAST_MOTION_DEGC, check_runs, keep_back
from fogml.gap.result import (
    Diagnosis,
    Estimate,
    Found,
    RunAmplitude,
    Unknown,
    Verdict,
)
from fogml.gap.twin_model import TwinModel
from fogml.gap.where import GapOnRun, where
from fogml.runs.epochs import with_epoch
from fogml.runs.run import FloatArray, Run
from fogml.twin.registry import effect

SURELY_NOT_NOTHING = 0.02
"""Probability that nothing acts under which there is a gap, whatever makes it."""
LISTED = 0.02
"""Causes are listed from this probability on."""
NEAREST = 5


def diagnose(
    model: TwinModel,
    fit: Sequence[Run],
    held_out: Sequence[Run] = (),
    *,
    noise: Run | None = None,
    without: Iterable[str] = (),
    seed: int = 0,
    priors: Priors | None = None,
    cost_of_false_name: float = 1.0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Where the gap lies, which causes make it, how far it closes; as `fogml.gap.diagnosis.diagnose`.

    Parameters
    ----------
    priors
        What is taken for granted.
    cost_of_false_name
        Of a false name over that of a missed one: a cause is named from odds of this on.
    """
    from threadpoolctl import threadpool_limits

    tell = progress or (lambda what: None)
    check_runs(fit, held_out, noise)
    # The unit ages from its first run on, whichever it is.
    fit, held_out, _ = with_epoch(fit, held_out, [noise] if noise else [])
    part = not held_out
    if part:
        fit, held_out = keep_back(fit)
    with threadpool_limits(1):
        found = infer(model, fit, held_out, noise, without, priors or Priors(), tell)
        moved = max(float(np.ptp(r.temperature)) for r in found.setting.scene.runs[: len(fit)])
        if moved < LEAST_MOTION_DEGC and not any(np.any(r.run.rate) for r in found.setting.scene.runs):
            raise InputError(
                f"temperature moves by {moved:.2g} degC in all; a diagnosis needs a run in which it moves by "
                f"{LEAST_MOTION_DEGC:g} degC or more"
            )
        tell("judging on held-out runs")
        return _answer(found, judge(found), noise, part, seed, cost_of_false_name)


def _answer(
    found: Inference, judged: Judgement, noise: Run | None, part: bool, seed: int, cost: float
) -> Diagnosis:
    scene = found.setting.scene
    # Named from odds of the cost on, said as a half or more.
    shifted = [_shifted(c.probability, cost) for c in judged.causes]
    named = [c for c, p in zip(judged.causes, shifted) if p >= 0.5]
    verdict = _verdict(named, judged)
    recalibrated = Foretold.of(found, (), ())
    every = Foretold.of(found, judged.best.members, judged.best.members)
    counted = [m for c in named for m in c.members]
    # Beside what is unknown, but not beside causes that nobody would add: two that cancel foretell nothing.
    beside = [m for m in judged.best.members if found.columns.families[m.family].kind != "known"]
    after = Foretold.of(found, [*counted, *beside], counted) if named else recalibrated
    structural = [r.gap - recalibrated.on(i) for i, r in enumerate(scene.runs)]
    energies = {m: _energy(found, every, m) for m in judged.best.members}
    shares = _shares(energies)
    cards = {c.member: _card(found, judged, c) for c in judged.causes}
    items = tuple(
        _found(found, c, p, cards[c.member], sum(shares.get(m, 0.0) for m in c.members))
        for c, p in zip(judged.causes, shifted)
        if p >= LISTED
    )
    held_out = [HeldOut(found, i, recalibrated, seed) for i in range(scene.fitted, len(scene.runs))]
    far = tuple(h.how_far(after) for h in held_out)
    gaps = [
        GapOnRun(r, structural[i], every.on(i) - _constants_alone(every, i), 0.0)
        for i, r in enumerate(scene.runs[: scene.fitted])
    ]
    evidence = candidate_evidence(found, judged, [i for f in items if f.named for i in f.members])
    what_if = _what_if(found, named, held_out)
    nearest = _nearest(found, what_if, judged)
    unknown = Unknown(judged.unknown, looks_like(found, judged), 0.0)
    shown = () if verdict == "unknown" else tuple(f for f in items)
    from fogml.gap.noise import Noise

    return Diagnosis(
        fit=tuple(r.run.name for r in scene.runs[: scene.fitted]),
        held_out=tuple(r.run.name for r in scene.runs[scene.fitted :]),
        noise_run=noise.name if noise else None,
        held_out_is_part=part,
        verdict=verdict,
        found=shown,
        suspected=() if verdict != "unknown" else tuple(f for f in items if not f.named),
        unknown=unknown,
        where=where(
            gaps,
            stage_energies(found, energies),
            Noise(found.field.whitening.noise, found.points.fit, found.points.source),
        ),
        how_far=far,
        undetectable=tuple(e.effect for e in evidence if e.status in ("undetectable", "in_constants")),
        separating_run=None,
        constants=constants_of(found, after),
        evidence=evidence,
        noise=noise_of(found),
        effects=tuple(cards[c.member].value for c in named),
        series=series_of(found, recalibrated, after),
        unusable=found.unusable,
        assumed=assumed(found),
        model=found.model.name,
        what_if=what_if,
        nearest=nearest,
        headline=headline(found, judged, verdict, shown, nearest, far),
    )


def _constants_alone(every: Foretold, run: int) -> FloatArray:
    """What the fixed block makes of a run [deg/h], shape (m,)."""
    count = every.found.field.fixed.shape[1]
    return np.asarray(every.design(run)[:, :count] @ every.posterior.mean[:count])


def _shifted(probability: float, cost: float) -> float:
    odds = probability / max(1.0 - probability, 1e-12) / cost
    return odds / (1.0 + odds)


def _verdict(named: Sequence[Cause], judged: Judgement) -> Verdict:
    if named and judged.unknown >= 0.5:
        return "partly_explained"
    if named:
        return "explained" if all(len(c.ids) == 1 for c in named) else "ambiguous"
    return "unknown" if judged.unknown >= 0.5 or judged.nothing < SURELY_NOT_NOTHING else "no_gap"


def _energy(found: Inference, every: Foretold, member: Member) -> float:
    """Squares of what a cause makes on the fit runs [(deg/h)^2]."""
    runs = found.setting.scene.runs[: found.setting.scene.fitted]
    parts = [every.of_member(i, member) for i in range(len(runs))]
    return float(sum(np.sum((p - p.mean()) ** 2) for p in parts))


def _shares(energies: dict[Member, float]) -> dict[Member, float]:
    total = sum(energies.values())
    return {m: e / total for m, e in energies.items()} if total > 0.0 else {}


def _card(found: Inference, judged: Judgement, cause: Cause) -> Card:
    others = [(m.node, m.size) for m in judged.best.members if m not in cause.members]
    shape = found.columns.nodes[cause.member.node].shape
    return card_of(cause.ids[0], found.setting, found.field, found.field.beside(others), shape)


def _found(found: Inference, cause: Cause, probability: float, card: Card, share: float) -> Found:
    declared = effect(cause.ids[0])
    _, high = declared.amplitude.range(found.setting.scene.grade)  # type: ignore[arg-type]
    return Found(
        effect=cause.ids[0],
        stage=declared.stage,
        members=cause.ids,
        probability=probability,
        amplitude=Estimate(card.value.amplitude, card.amplitude_se, declared.amplitude.unit),
        parameters={
            q.name: Estimate(card.value.shape[q.name], card.shape_se.get(q.name, 0.0), q.unit)
            for q in declared.shape
            if q.name in card.value.shape
        },
        by_run=_by_run(found, cause),
        share=share,
        place=declared.place,
        times_usual=abs(card.value.amplitude) / high,
    )


def _by_run(found: Inference, cause: Cause) -> tuple[RunAmplitude, ...]:
    """Scale of the cause that each run asks for, constants free, the rest as found; 1 is what all ask for."""
    held = found.field
    own = [(m.node, m.size) for m in cause.members]
    design = held.design(own)
    from fogml.gap.families.linear_gaussian import Posterior

    first = held.fixed.shape[1]
    mean = Posterior.of(design, held.base.data).mean[first:]
    course = design[:, first:] @ mean
    rows = []
    for r, span in zip(found.setting.scene.runs, found.setting.spans):
        fixed, part, data = held.fixed[span], course[span], held.base.data[span]
        basis, _ = np.linalg.qr(fixed + 1e-12)
        beside = part - basis @ (basis.T @ part)
        size = float(beside @ beside)
        if size > 9.0:
            rows.append(RunAmplitude(r.run.name, float(beside @ data) / size, size**-0.5))
    return tuple(rows)


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
            foretold = Foretold.of(found, both, both)
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
    left = held.beside([(m.node, m.size) for m in foretold.members])
    along = [float(np.sum((b.basis.T @ b.data) ** 2)) for b in (held.base, left)]
    above = float(held.base.data @ held.base.data) - along[0] - len(held.base.data)
    return float(np.clip((along[1] - along[0]) / above, 0.0, 1.0)) if above > 0.0 else 0.0


def _nearest(found: Inference, what_if: Sequence[WhatIf], judged: Judgement) -> tuple[Nearest, ...]:
    alone = {w.effect: w.share for w in what_if if not w.beside}
    families = found.columns.families
    probability = {
        f.id: float(sum(w for e, w in zip(judged.explanations, judged.weights) if i in e.key))
        for i, f in enumerate(families)
        if f.kind == "known"
    }
    gains = found.search.alone()
    order = sorted((i for i in gains if families[i].kind == "known"), key=lambda i: -gains[i])[:NEAREST]
    return tuple(
        Nearest(
            effect(families[i].id).family.replace("_", " "),
            families[i].id,
            alone.get(families[i].id, 0.0),
            probability[families[i].id],
        )
        for i in order
    )
