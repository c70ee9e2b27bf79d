"""Pages of ``fogml diagnose``: where the gap lies, which effect causes it, how far it closes; and what if.

On the second the sizes of effects are moved: recorded against replayed, offline, by anyone.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fogml.blind.folders import CaseFiles
from fogml.blind.methods import diagnosis
from fogml.escaping import script_data
from fogml.gap.result import Diagnosis
from fogml.gap.result_parts import RunSeries
from fogml.numerals import averages, duration, listed, number, plural, unit_words
from fogml.report import (
    figures_gap,
    figures_gap_evidence,
    figures_gap_where,
    gap_tables,
    gap_tables_ahead,
    style,
)
from fogml.report.gap_tiles import error_sentences, headline_tiles, warnings
from fogml.report.gap_words import (
    headline,
    held_out_words,
    subject_of,
    suspected_words,
    title_of,
    titles,
    verdict_words,
)
from fogml.report.page import Drawing, render, template_text

MOST_RUNS_DRAWN = 8


def gap_page(found: Diagnosis) -> str:
    """The self-contained HTML page of a diagnosis."""
    names = titles(found)
    where = found.where
    drawn = _drawn(found)
    fitted_on = any(s.role == "fit" and len(s.time_s) for s in found.series)
    return render(
        "gap.html",
        title=f"{subject_of(found)} – {verdict_words(found).lower()}",
        found=found,
        headline=headline(found),
        kicker=_kicker(found),
        said=[*found.headline, *suspected_words(found)],
        tiles=headline_tiles(found, names),
        strip=figures_gap.how_far_strip(found.how_far, bool(found.named)) if found.how_far else None,
        warnings=warnings(found, names),
        error_rates=error_sentences(found),
        causes=gap_tables.causes_table(found, names),
        classes=gap_tables.classes_table(found.found, names),
        how_far=gap_tables.how_far_table(found) if found.how_far else None,
        nearest=gap_tables_ahead.nearest_table(found, names),
        what_if=gap_tables_ahead.what_if_table(found, names),
        compensation=gap_tables_ahead.compensation_table(found, names),
        not_compensated=[
            f"{title_of(c.effect, names)}: {c.reason}."
            for c in (found.compensation.causes if found.compensation else ())
            if c.counted and not c.features
        ],
        rehearsal=gap_tables_ahead.rehearsal_table(found.rehearsal, names),
        how_far_notes=[f"{item.run}: {item.note}." for item in found.how_far if item.note],
        runs=drawn,
        not_drawn=[s.run for s in found.series if s.run not in {name for name, *_ in drawn}],
        against_temperature=figures_gap.against_temperature(found) if fitted_on else None,
        by_regime=figures_gap_where.by_regime(where.regime) if where.regime else None,
        by_timescale=figures_gap_where.by_timescale(where.timescale) if where.timescale else None,
        by_temperature=figures_gap_where.by_temperature(where.temperature) if where.temperature else None,
        by_stage=figures_gap_where.by_stage(where.stage, bool(found.named)) if where.stage else None,
        regimes=gap_tables.regimes_table(found) if where.regime else None,
        segments=gap_tables.segments_table(found),
        shares=gap_tables_ahead.shares_table(found, names),
        evidence=(
            figures_gap_evidence.evidence_bars(found.evidence)
            if figures_gap_evidence.shown_evidence(found.evidence)
            else None
        ),
        candidates=gap_tables.evidence_table(found),
        undetectable=[title_of(id, names) for id in found.undetectable],
        by_run=[figures_gap_evidence.amplitude_by_run(f, names) for f in found.found if f.by_run],
        agreement=_agreement(found, names),
        separating=_separating(found, names),
        constants=figures_gap_evidence.constants_moved(found.constants) if found.constants else None,
        constants_table=gap_tables.constants_table(found),
        noise_table=gap_tables.noise_table(found),
        noise_words=_noise_words(found),
        noise_figures=(
            [
                figures_gap_evidence.variance_ratios(found.noise),
                figures_gap_evidence.autocorrelations(found.noise),
            ]
            if found.noise.scales_s and found.noise.lags_s
            else []
        ),
        about=_about(found),
        notes=_notes(found),
    )


def _kicker(found: Diagnosis) -> str:
    held = (
        "the last stretch of the last run kept back"
        if found.held_out_is_part
        else (f"{plural(len(found.held_out), 'run')} held out" if found.held_out else "nothing held out")
    )
    return (
        f"Gap between the twin “{found.model}” and {subject_of(found)}: "
        f"fitted on {plural(len(found.fit), 'run')}, {held}"
    )


def _drawn(found: Diagnosis) -> list[tuple[str, str, Drawing]]:
    """Name, role and figure: held-out runs first, then fit runs, those with most of the gap of many."""
    named = bool(found.named)
    energy = {s.run: float((s.gap_recalibrated**2).sum()) for s in found.series}
    held = [s for s in found.series if s.role == "held_out"]
    fit = [s for s in found.series if s.role == "fit"]
    kept = sorted(fit, key=lambda s: -energy[s.run])[: max(MOST_RUNS_DRAWN - len(held), 2)]
    held_words = "its last stretch, kept back" if found.held_out_is_part else "held out"
    shown = [*held[:MOST_RUNS_DRAWN], *(s for s in fit if s in kept)]
    drawn = []
    for s in (s for s in shown if len(s.time_s)):
        is_fit = s.role == "fit"
        segments = [g for g in found.where.segments if is_fit and g.run == s.run]
        role = "fitted on" if is_fit else held_words
        drawn.append((s.run, role, figures_gap.run_in_time(s, segments, named)))
    return drawn


def _agreement(found: Diagnosis, names: dict[str, str]) -> str:
    """Whether the amplitudes of single runs agree."""
    doubted = [title_of(f.effect, names) for f in found.found if not f.consistent]
    if doubted:
        return f"An effect of the gyro has one sign and size on every run. {listed(doubted)}: not so."
    if any(len(f.by_run) > 1 for f in found.found):
        begun = ", from where it began on" if any(f.onset is not None for f in found.found) else ""
        return (
            "An effect of the gyro has one sign and size on every run that can show it, and so it is here"
            f"{begun}."
        )
    return "Only one run shows it by itself, so runs can't be compared."


def _separating(found: Diagnosis, names: dict[str, str]) -> dict[str, Any] | None:
    """The separating run as the page shows it."""
    run = found.separating_run
    if run is None:
        return None
    told = [title_of(id, names) for id in run.separates]
    if run.aim == "show" or len(told) == 1:
        aim = f"These runs could not show them at their usual size, this programme would: {listed(told, 12)}."
        name = "expected length of the least"
    else:
        aim, name = f"To tell apart: {listed(told, 6)}.", "expected distance"
    facts = [
        ("lasts", duration(3600.0 * run.hours)),
        (name, f"{number(run.distance, 2)} standard deviations of the noise"),
    ]
    others = gap_tables.alternatives_table(run.alternatives) if run.alternatives else None
    shown = {"steps": run.steps, "programme": run.programme, "alternatives": others}
    return {"aim": aim, "facts": facts, **shown}


def _noise_words(found: Diagnosis) -> str:
    noise = found.noise
    if noise.white is None:
        return f"Fitted on: {noise.source}. There was too little held-out data to check it."
    p = f"p = {number(noise.p_value, 2)}" if noise.p_value is not None else ""
    if noise.white:
        return (
            f"Fitted on: {noise.source}. Checked on {plural(noise.samples, 'held-out sample')}: white ({p})."
        )
    return (
        f"Fitted on: {noise.source}. Checked on {plural(noise.samples, 'held-out sample')}: not white ({p}): "
        + "; ".join(noise.failed)
        + "."
    )


def _about(found: Diagnosis) -> list[tuple[str, str]]:
    held = listed(list(found.held_out), 12) or "none"
    if found.held_out_is_part and found.held_out:
        held = held_out_words(found, found.held_out[0])
    rows = [
        ("twin", found.model),
        ("fitted on", listed(list(found.fit), 12)),
        ("held out", held),
        ("noise run", found.noise_run or "none: the noise was fitted on the fit runs' quiet stretches"),
    ]
    spans = [s for s in found.series if len(s.time_s)]
    if spans:
        hours = sum(float(s.time_s[-1] - s.time_s[0]) + s.averaging_s for s in spans)
        rows.append(("recorded in all", duration(hours)))
    rows += [("not used", f"{run}: {reason.removeprefix(f'{run}: ')}") for run, reason in found.unusable]
    return rows


def _notes(found: Diagnosis) -> list[str]:
    """What the runs' facts say of them, each once."""
    by_note: dict[str, list[str]] = {}
    for s in found.series:
        if s.note:
            by_note.setdefault(s.note, []).append(s.run)
    return [f"{listed(list(dict.fromkeys(runs)))}: {note}" for note, runs in by_note.items()]


def diagnosis_with_page(case: CaseFiles, out: Path) -> None:
    """Answer a case again, which gives the same numbers, and draw its report ``gap.html``."""
    found = diagnosis(case, out)
    (out / "gap.html").write_text(gap_page(found), encoding="utf-8")


MOST_FACTOR = 3.0
"""Sliders go up to this many times the size found, or usual."""
STEP = 0.05


def counterfactual_page(found: Diagnosis) -> str:
    """The self-contained HTML page of a diagnosis that kept its courses (``courses=True``)."""
    runs = sorted(found.counterfactuals, key=lambda run: run.role == "fit")
    sliders = _sliders(found, runs)
    data = {"runs": [_packed(run) for run in runs]}
    return render(
        "counterfactual.html",
        title=f"{subject_of(found)} – what if?",
        name=subject_of(found),
        kicker=f"The twin “{found.model}” against recordings, with effects of any size",
        runs=[f"{run.run} ({'held out' if run.role == 'held_out' else 'fitted on'})" for run in runs],
        acting=[s for s in sliders if s["start"]],
        others=[s for s in sliders if not s["start"]],
        drawing=_drawing(runs[0]),
        data=script_data(json.dumps(data)),
        averages=averages(runs[0].averaging_s).capitalize(),
        sliders=template_text("counterfactual.js"),
    )


def _sliders(found: Diagnosis, runs: Sequence[RunSeries]) -> list[dict[str, Any]]:
    """Of every effect that some run shows: those that act first, then those that hold most of the gap.

    Each with its name, the size that 1 stands for, where it begins and ends.
    """
    names, gain = titles(found), {row.effect: -row.gain for row in found.evidence}
    courses = {course.effect: course for run in runs for course in run.courses}
    order = sorted(courses.values(), key=lambda c: (not c.acts, gain.get(c.effect, 0.0)))
    return [
        {
            "number": number,
            "effect": course.effect,
            "title": title_of(course.effect, names),
            "size": course.size,
            "unit": unit_words(course.unit),
            "start": float(course.acts),
            "low": -MOST_FACTOR if course.signed else 0.0,
            "high": MOST_FACTOR,
            "step": STEP,
        }
        for number, course in enumerate(order)
    ]


def _packed(run: RunSeries) -> dict[str, Any]:
    """A run's courses as base64 of float32, which holds seven digits."""

    def packed(values: np.ndarray) -> str:
        return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")

    return {
        "floor": run.floor,
        "time": packed((run.time_s - run.time_s[0]) / 3600.0),
        "temperature": packed(run.temperature_degc),
        "recorded": packed(run.recorded),
        "replayed": packed(run.replayed_bare),
        "courses": {course.effect: packed(course.values) for course in run.courses},
    }


def _drawing(run: RunSeries) -> Drawing:
    """Temperature, recorded with replayed, and the gap, as the sliders begin."""
    hours = (run.time_s - run.time_s[0]) / 3600.0
    panels = {"T [°C]": 0.7, "error [deg/h]": 1.4, "gap [deg/h]": 1.2}
    figure = style.stacked(panels, "time [h]", 0.05, title_font_size=12)
    for row, values, name, colour, width, dash in (
        (1, run.temperature_degc, "temperature", style.BLUE, 1.6, None),
        (2, run.recorded, "recorded", style.BEFORE, 1.3, None),
        (2, run.replayed_after, "replayed", style.MODEL, 2.0, "dash"),
        (3, run.gap_after, "gap", style.AFTER, 1.3, None),
    ):
        figure.add_trace(style.line(hours, values, name, colour, width, dash), row=row, col=1)
    style.styled(figure, 560, legend={"y": 1.06}, hovermode="x")
    return Drawing(
        figure,
        alt="Temperature, recorded and replayed output, and the gap between them, in time; they follow the "
        "sliders below.",
        caption="Recorded stays; replayed and the gap follow the sliders.",
    )
