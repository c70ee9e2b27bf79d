"""What a diagnosis reports beside its verdict: candidates, constants, noise, series, sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from fogml.gap.field import Member
from fogml.gap.frame import whitener_of
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.posterior import Judgement
from fogml.gap.result import (
    CandidateEvidence,
    ConstantFit,
    Found,
    NoiseReport,
    Onset,
    Unknown,
    Verdict,
    in_doubt,
)
from fogml.gap.result_parts import GapSegment, HowFar, Nearest, RunSeries, beyond_noise
from fogml.gap.where import averages
from fogml.numerals import percent, probability_words, short
from fogml.runs.findings import IMPLAUSIBLE, SPOILING
from fogml.signals.bases import rate
from fogml.signals.noise_expectation import floor_square
from fogml.signals.whiteness import whiteness
from fogml.twin.effect import Effect, NoiseEffect

STAGES = {"other_plant": "thermal", "table": "rig", "readings": "sensor", "reading_times": "sensor"}
"""Stages that causes without a card act on."""
UNKNOWN_STAGE = "bias"
"""Stage that an unknown cause is booked on where its family says nothing of it."""


def candidate_evidence(
    found: Inference, judged: Judgement, named: Sequence[str]
) -> tuple[CandidateEvidence, ...]:
    """Each candidate alone, what the runs can show of it, and what became of it."""
    gains, families, priors = found.search.alone(), found.columns.families, found.setting.priors
    index = {f.id: i for i, f in enumerate(families) if f.kind == "known"}
    rows = []
    for id, declared in found.scene.candidates.items():
        i, about = index.get(id), (id, declared.title, declared.stage)
        if i is None or i not in gains:
            # A random error has no mean response; others lie in the span of the constants.
            rows.append(CandidateEvidence(*about, 0.0, 0.0, 0.0, "in_constants"))
            continue
        usual, held = usual_length(found, declared), judged.weight_of(i)
        status: Literal["named", "possible", "no_sign", "undetectable"]
        if id in named:
            status = "named"
        elif usual < priors.least_detectable:
            status = "undetectable"
        else:
            status = "possible" if held >= priors.reported.possible else "no_sign"
        rows.append(CandidateEvidence(*about, gains[i], held, usual, status))
    return tuple(sorted(rows, key=lambda r: -r.gain))


def usual_length(found: Inference, declared: Effect) -> float:
    """Whitened length beside the constants of an effect of the usual size and shape in its card."""
    if isinstance(declared, NoiseEffect) and not declared.steady:
        return float(found.setting.priors.least_detectable)
    grade = found.scene.grade
    usual = declared.amplitude.typical(grade)
    return found.field.base.length(found.field.made(declared, usual, declared.default_shape(grade)))


def stage_energies(found: Inference, energies: Mapping[Member, float]) -> dict[str, float]:
    """Energy of what acts by stage: that of each cause's card, the unknown's own guess."""
    total: dict[str, float] = {}
    for member, energy in energies.items():
        family = found.columns.families[member.family]
        known = family.kind == "known"
        stage = found.scene.candidates[family.id].stage if known else STAGES.get(family.id, UNKNOWN_STAGE)
        total[stage] = total.get(stage, 0.0) + energy
    return total


def noise_of(found: Inference, after: Foretold) -> NoiseReport:
    """The noise that the diagnosis judged by, and whether held-out runs' innovations are white by it."""
    model, errors = found.field.whitening.noise, found.points.fit.standard_errors
    told = NoiseReport(
        {"N": model.N, "B": model.B, "K": model.K},
        dict(zip("NBK", map(float, errors))),
        found.points.source,
    )
    scene, priors, parts = found.scene, found.setting.priors, []
    for i in range(scene.fitted, len(scene.runs)):
        rows = scene.runs[i]
        gap = rows.gap - after.on(i)
        parts.append(whitener_of(model, rows, priors.noise.longest_runs).whiten(gap - np.mean(gap)))
    count = sum(map(len, parts))
    if count < priors.reported.fewest_checked:
        return told
    # Lags are counted in rows, whose length is a run's own.
    rows_s = [scene.runs[i].row_s for i in range(scene.fitted, len(scene.runs))]
    step = float(np.average(rows_s, weights=[len(part) for part in parts]))
    check = whiteness(parts, sample_s=step)
    return replace(
        told,
        white=bool(check.white),
        p_value=float(check.p_value),
        failed=tuple(check.failed),
        lags_s=tuple(float(x) * step for x in check.lags),
        autocorrelation=tuple(map(float, check.autocorrelation)),
        scales_s=tuple(float(x) * step for x in check.scales),
        variance_ratio=tuple(map(float, check.variance_ratio)),
        samples=count,
    )


def series_of(found: Inference, recalibrated: Foretold, after: Foretold) -> tuple[RunSeries, ...]:
    """Averages of every run for drawing."""
    scene, model = found.scene, found.field.whitening.noise
    out = []
    for i, rows in enumerate(scene.runs):
        windows = averages(rows, found.setting.priors.reported.averaging_s)
        temperature = windows.of(rows.temperature)
        recorded, gap_before = windows.of(rows.recorded), windows.of(rows.gap)
        gap_recalibrated, gap_after = (windows.of(told.left_on(i)) for told in (recalibrated, after))
        out.append(
            RunSeries(
                run=rows.run.name,
                role="fit" if i < scene.fitted else "held_out",
                averaging_s=windows.window_s,
                time_s=windows.time,
                temperature_degc=temperature,
                rate_degc_min=rate(windows.time, temperature),
                regime=rows.regime[windows.starts[windows.full]],
                recorded=recorded,
                replayed_before=recorded - gap_before,
                replayed_recalibrated=recorded - gap_recalibrated,
                replayed_after=recorded - gap_after,
                gap_recalibrated=gap_recalibrated,
                gap_after=gap_after,
                floor=float(floor_square(model, windows.time, windows.window_s)) ** 0.5,
                gyro=rows.run.facts.unit,
                axis=rows.run.facts.axis,
                note=rows.run.facts.notes or "",
            )
        )
    return tuple(out)


def assumed(found: Inference, constants: Sequence[ConstantFit]) -> tuple[str, ...]:
    """What was taken for granted, in sentences, the priors among them; `constants` as they were found."""
    setting, said = found.setting, []
    for rows in found.setting.scene.runs:
        for one in rows.run.findings:
            if one.code in IMPLAUSIBLE or (one.code in SPOILING and one.column == "gyro"):
                said.append(
                    f"{rows.run.name}: {one.message}; taken as it is, and if it is wrong, so is all here."
                )
    for fit in constants:
        off = abs(fit.value - fit.prior_mean)
        if fit.name in setting.widened and off > setting.priors.noise.far_off * fit.prior_sd:
            said.append(
                f"{fit.name} = {short(fit.value, 4)} {fit.unit} is {short(off / fit.prior_sd)} standard "
                f"deviations off what was expected ({fit.prior_mean:g} ± {fit.prior_sd:g}): a unit, a sign "
                f"or the twin may be wrong. Its prior was widened {short(setting.widened[fit.name])} times "
                "for the rest."
            )
    for rows in setting.scene.runs:
        if rows.masked:
            listed = ", ".join(f"{count} {why}" for why, count in rows.masked.items())
            said.append(f"{rows.run.name}: samples left out: {listed}.")
    if any("T_electronics" not in r.readings for r in setting.scene.runs):
        said.append(
            "The temperature of the electronics is not recorded: what follows it is looked for at several "
            "places. A column T_electronics would tell."
        )
    widths = sorted({f"{r.row_s:g}" for r in setting.scene.runs})
    said.append(f"Runs were brought to means over {', '.join(widths)} s; faster effects can't be seen.")
    said.append(f"Noise: {found.points.source}; white noise is what the runs themselves show.")
    said.append("Priors: " + "; ".join(setting.priors.described()) + ".")
    return tuple(said)


def looks_like(found: Inference, judged: Judgement) -> str:
    """What the unknown looks like; empty where there is none."""
    weights: dict[str, float] = {}
    for e, w in zip(judged.explanations, judged.weights):
        for m in e.members:
            if found.kind(m) == "unknown":
                between = found.columns.nodes[m.node].shape.get("between")
                words = found.columns.families[m.family].words + (f", {between}" if between else "")
                weights[words] = weights.get(words, 0.0) + float(w)
    if judged.unknown < found.setting.priors.reported.possible or not weights:
        return ""
    return max(weights, key=weights.__getitem__)


def _since(found: Inference, onset: Onset) -> str:
    """When something began: between two runs, or within one."""
    scene, order = found.scene, found.scene.in_time
    names = [scene.runs[i].run.name for i in order]
    at = names.index(onset.run)
    if at and onset.time_s <= float(scene.runs[order[at]].time_s[0]):
        return f"began between {names[at - 1]} and {onset.run}"
    return f"acts from {onset.run} on, {onset.time_s:.0f} s into it"


def _in_time(found: Inference) -> set[str]:
    """What unknown causes look like that go in time alone, as slow noise does."""
    return {f.words for f in found.columns.families if f.id == "steps" or f.id.startswith("time_")}


def _slow_noise(found: Inference) -> str:
    """A sentence where no static run was given and slow noise is beyond what the prior's grid holds."""
    points, offsets = found.points, found.setting.priors.slow_noise
    flicker, walk = points.steps[points.best]
    if points.static is not None or (flicker <= offsets[-2] and walk <= offsets[-1]):
        return ""
    _, most_flicker, most_walk = points.prior.deviations
    times = math.exp(max(flicker * most_flicker, walk * most_walk))
    return (
        f"Slow noise is taken as {short(times, 2)} times what the model states, which may hide a gap: give "
        "a static run (--noise)."
    )


def headline(
    found: Inference,
    unknown: Unknown,
    verdict: Verdict,
    shown: Sequence[Found],
    nearest: Sequence[Nearest],
    far: Sequence[HowFar],
    segments: Sequence[GapSegment],
    other_plant: bool,
) -> tuple[str, ...]:
    """Sentences: the verdict, each cause with its size, share and place, the nearest where none is sure.

    `other_plant` says that the likeliest set holds another flow of heat.
    """
    said, titles = [], found.scene.candidates
    out = beyond_noise(far)
    could = f"the fitted runs could show; {out}." if out else "these runs could show."
    if verdict == "no_gap" and other_plant:
        said.append(
            "Heat flows a little otherwise than the model's plant says, or a sensor lags: fit its time "
            f"constants. Nothing beyond that is missing that {could}"
        )
    elif verdict == "no_gap" and (doubt := in_doubt(verdict, shown, unknown)) is not None:
        said.append(
            f"Nothing is sure enough to be named, and that nothing is missing is not sure: "
            f"{titles[doubt.effect].title} is {probability_words(doubt.probability)} probable, something "
            f"unknown {probability_words(unknown.probability)}{f'; {out}' if out else ''}."
        )
    elif verdict == "no_gap":
        said.append(f"Nothing is missing that {could}")
    for f in (f for f in shown if f.named):
        title = titles[f.effect].title
        others = f" (or {', '.join(f.others)})" if f.others else ""
        size = f"{short(f.amplitude.value)} {f.amplitude.unit}"
        usual = f", {short(f.times_usual, 2)} times the usual most" if (f.times_usual or 0.0) > 1.0 else ""
        share = f", {percent(f.share, 0)} of the gap" if f.share is not None else ""
        look = f"; look at the {f.place}" if f.place else ""
        said.append(
            f"{title}{others}: {probability_words(f.probability)} probable, {size}{usual}{share}{look}."
        )
        if f.onset is not None:
            since = f"{short(f.onset.amplitude.value)} {f.amplitude.unit} since then"
            said.append(f"{title} {_since(found, f.onset)}, and not before: {since}.")
        if f.grows is not None:
            way = "grows" if f.grows * f.amplitude.value > 0.0 else "fades"
            said.append(
                f"{title} {way} from run to run, by {short(abs(f.grows), 2)} {f.amplitude.unit} a day."
            )
        elif not f.consistent and len(f.by_run) > 1:
            said.append(f"{title}: the runs do not agree in its size.")
    for f in (f for f in shown if f.left_out):
        said.append(
            f"{titles[f.effect].title} may as well be {', '.join(f.left_out)}, left out of the candidates."
        )
    if verdict in ("unknown", "partly_explained"):
        like = unknown.looks_like
        said.append(f"Something acts that is not known{': it ' + like if like else ''}.")
        if found.points.static is None and like in _in_time(found) and not _slow_noise(found):
            said.append("Slow noise of the gyro itself looks like that: give a static run (--noise).")
        for n in [n for n in nearest if n.effect not in {f.effect for f in shown if f.named}][:2]:
            if n.share >= found.setting.priors.reported.near_share:
                said.append(
                    f"Nearest known cause: {titles[n.effect].title}, in whatever form, holds "
                    f"{percent(n.share, 0)} of the gap."
                )
    if said_of_noise := _slow_noise(found):
        said.append(said_of_noise)
    runs = [found.scene.runs[i].run.name for i in found.scene.in_time]
    first = min((runs.index(s.run) for s in segments), default=0)
    if first > 0:
        begun = min(s.from_s for s in segments if s.run == runs[first])
        part = f", without {runs[first]} if it began within," if first + 1 < len(runs) else ""
        said.append(
            f"The gap shows from {runs[first]}, {begun:.0f} s, on, and in no run before: a diagnosis of the "
            f"runs from there on{part} may name more."
        )
    for h in far:
        if h.closed is None:
            said.append(f"{h.run}: {h.note}.")
        elif any(f.named for f in shown):
            said.append(
                f"{h.run}: {percent(h.closed, 0)} of the gap closes{' — ' + h.note if h.note else ''}."
            )
        elif h.note:
            said.append(f"{h.run}: {h.note}.")
    return tuple(said)
