"""What a diagnosis reports beside its verdict: candidates, noise, and series for drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from fogml.gap.causes import energy
from fogml.gap.fitted_model import Fit
from fogml.gap.frame import whitener_of
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.posterior import Cause, Judgement
from fogml.gap.result import CandidateEvidence, NoiseReport
from fogml.gap.result_parts import Course, RunSeries
from fogml.gap.where import averages
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


def stage_energies(found: Inference, every: Foretold, recalibrated: Foretold) -> dict[str, float]:
    """Energy of what acts by stage: that of each cause's card, the unknown's own guess."""
    total: dict[str, float] = {}
    for member in every.members:
        family = found.columns.families[member.family]
        known = family.kind == "known"
        stage = found.scene.candidates[family.id].stage if known else STAGES.get(family.id, UNKNOWN_STAGE)
        total[stage] = total.get(stage, 0.0) + energy(found, every, recalibrated, member)
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


NOT_LINEAR = ("line", "power_cycles", "sensor_steps")
"""Families that no size moves alone: of a phase of their own, or not in proportion to their size."""


def series_of(
    found: Inference, recalibrated: Foretold, fit: Fit, named: Sequence[Cause], courses: bool
) -> tuple[RunSeries, ...]:
    """Averages of every run for drawing; with courses of effects where asked for."""
    scene, model, settings = found.scene, found.field.whitening.noise, found.setting.priors.reported
    out = []
    for i, rows in enumerate(scene.runs):
        windows = averages(rows, settings.averaging_s)
        temperature = windows.of(rows.temperature)
        recorded, gap_before = windows.of(rows.recorded), windows.of(rows.gap)
        gap_recalibrated, gap_after = (windows.of(told.left_on(i)) for told in (recalibrated, fit.foretold))
        floor = float(floor_square(model, windows.time, windows.window_s)) ** 0.5
        finite = (c for c in _courses(found, fit, named, i) if np.isfinite(c.values).all()) if courses else ()
        averaged = [replace(c, values=windows.of(c.values)) for c in finite]
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
                floor=floor,
                gyro=rows.run.facts.unit,
                axis=rows.run.facts.axis,
                note=rows.run.facts.notes or "",
                courses=tuple(
                    c for c in averaged if c.acts or float(np.std(c.values)) > settings.shown_share * floor
                ),
            )
        )
    return tuple(out)


def _courses(found: Inference, fit: Fit, named: Sequence[Cause], run: int) -> list[Course]:
    """What is named, what the twin has, and others at their usual size make of a run [deg/h], shape (m,)."""
    scene, values = found.scene, found.setting.values
    rows = scene.runs[run]
    on = {declared.id: setting for declared, setting in found.plant.on}
    by_id = {cause.ids[0]: cause for cause in named}
    sizes = {effect.id: effect.amplitude for effect in fit.effects}
    courses = []
    for id, declared in scene.candidates.items():
        acts = id in by_id or id in on
        # A size that acts out of proportion moves no course of its own: it stays in what is replayed.
        if declared.amplitudes or not (acts or _linear(declared)):
            continue
        if id in by_id:
            size, course = sizes[id], fit.foretold.of_cause(run, by_id[id])
        elif id in on:
            size = on[id].amplitude
            course = rows.made(declared, size, on[id].shape, values)
        else:
            size = declared.amplitude.typical(scene.grade)
            course = rows.made(declared, size, declared.default_shape(scene.grade), values)
        courses.append(Course(id, size, declared.amplitude.unit, acts, declared.amplitude.signed, course))
    return courses


def _linear(declared: Effect) -> bool:
    """Whether an effect of the catalogue is in proportion to its size and the same on each run."""
    random = isinstance(declared, NoiseEffect) and not declared.steady
    return not (random or declared.drawn_per_run or declared.family in NOT_LINEAR or declared.amplitudes)
