"""The certificate: one A4 page per unit with its limits, met or not, to be signed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import date as Date
from typing import Any

import numpy as np
from markupsafe import Markup

from fogml.errors import InputError
from fogml.numerals import averages, listed, number, percent, short, unit_of, unit_words
from fogml.pictures import Curve, line_figure
from fogml.report import style
from fogml.report.page import render
from fogml.report.style import time_unit
from fogml.report.tables import Table, reference_of
from fogml.report.verdict import (
    GRADES,
    advice_words,
    floor_told,
    model_card,
    own_noise,
    stated_limits,
    unseen,
    worst_run,
)
from fogml.signals.drawn import drawn
from fogml.validation.advice import advice_on
from fogml.validation.certified import held_constant, of_10_s, over_temperature
from fogml.validation.limits import outcome_of
from fogml.validation.results import Judgement, LimitOutcome, RunJudgement

_POINTS = 700
_NOT_STATED, _NOT_TOLD = "not stated", "not told"
_TERMS = {"N": "Angle random walk", "B": "Bias instability", "K": "Rate random walk"}
_MOST_RUNS = 8
_MOST_FEATURES = 3


def certificate(judgements: Judgement | Sequence[Judgement], date: Date | str | None = None) -> str:
    """The certificates of one or several judgements as one HTML page, one A4 sheet per unit.

    Parameters
    ----------
    judgements
        Judgements with a design index or limits.
    date
        Date of issue; where not given, a line to write it on.
    """
    judgements = [judgements] if isinstance(judgements, Judgement) else list(judgements)
    sheets = [_sheet(part) for judgement in judgements for part in by_unit(judgement)]
    return render(
        "certificate.html",
        title=f"Certificate – {listed([sheet['unit'] for sheet in sheets])}",
        sheets=sheets,
        date=date.isoformat() if isinstance(date, Date) else date or "",
        unit_of=unit_of,
    )


def by_unit(judgement: Judgement) -> list[Judgement]:
    """The judgement cut by the unit and axis of its test runs, limits looked at for each apart."""
    groups: dict[tuple[str | None, str | None], list[RunJudgement]] = {}
    for run in judgement.test:
        groups.setdefault((run.unit, run.axis), []).append(run)
    if len(groups) == 1:
        return [judgement]
    parts = []
    for runs in groups.values():
        index = judgement.design_index
        parts.append(
            replace(
                judgement,
                test=tuple(runs),
                design_index=_again(index, runs) if index else None,
                limits=tuple(_again(limit, runs) for limit in judgement.limits),
            )
        )
    return parts


def _again(stated: LimitOutcome, runs: Sequence[RunJudgement]) -> LimitOutcome:
    """A limit looked at for some runs only; not met, at no value, where none of them tells the quantity."""
    try:
        return outcome_of(stated.quantity, stated.limit, runs)
    except InputError:
        return replace(stated, value=math.nan, met=False)


def _sheet(judgement: Judgement) -> dict[str, Any]:
    """What one certificate shows."""
    worst = worst_run(judgement.test)
    shown = sorted(judgement.test, key=lambda run: -run.after.rms)[:_MOST_RUNS]
    figure, words = _figure(worst)
    card = dict(model_card(judgement.model, _MOST_FEATURES))
    advice = advice_on(judgement)
    kind, sign, grade = GRADES[advice.grade]
    about = [
        ("Model", f"{card['kind']}" + (f" of {card['features']}" if "features" in card else "")),
        ("Size", ", ".join(_size(card))),
        ("Verdict", advice_words(advice)["words"]),
        *([("Trained within", card["trained within"])] if "trained within" in card else []),
        ("Trained on", listed([run.run for run in judgement.train], 6)),
        ("Attitude", _attitude(worst)),
        ("Judged on" if len(judgement.test) == 1 else "Worst run", _span(worst)),
        ("Rates", _rates(worst)),
        ("Averages", f"{short(worst.averaging_s, 4)} s"),
        ("Bias relative to", reference_of(worst)),
    ]
    return {
        "unit": worst.unit or _NOT_STATED,
        "axis": worst.axis or _NOT_STATED,
        "met": judgement.met,
        # Limits that are met don't make good what else is wrong.
        "mark": None if advice.grade == "use" else {"kind": kind, "sign": sign, "words": grade},
        "unseen": unseen(judgement),
        "limits": stated_limits(judgement),
        "about": about,
        "runs": _runs(shown),
        "figures": _figures(worst),
        "worst": worst.run,
        "synthetic": any(run.facts.synthetic for run in (*judgement.train, *judgement.test)),
        "more_runs": len(judgement.test) - len(shown),
        "figure": figure,
        "figure_words": words,
        "notes": [str(note) for note in judgement.notes][:3],
    }


def _runs(runs: Sequence[RunJudgement]) -> Table:
    """The figures after per run, narrow enough for a page."""
    columns = (
        "Run | >Rms before [deg/h] | >Rms after [deg/h] | >Bias [deg/h] | "
        ">Bias stability over temperature [deg/h] | >Range [deg/h] | >Noise floor [deg/h] | >Outside training"
    )
    rows = []
    for run in runs:
        values = (run.before.rms, run.after.rms, run.after.bias, run.after.bias_stability, run.after.range)
        cells = (run.run, *(number(value) for value in (*values, run.floor)), percent(run.outside_training))
        rows.append(cells)
    return Table(columns, rows)


def _figures(run: RunJudgement) -> Table:
    """Figures of the worst run with their uncertainty."""
    rows = []

    def add(name: str, value: str, interval: str, how: str) -> None:
        rows.append((name, value, interval, how))

    few = "fewer than three averages"
    for name, found, how, without in (
        ("Bias stability over temperature", over_temperature(run), "all of the run", few),
        (
            "Bias stability at constant temperature",
            held_constant(run),
            "the longest soak",
            f"no soak, or {few}",
        ),
        ("Bias stability, 10 s averages", of_10_s(run), "all of the run", "samples too far apart"),
    ):
        if found is None:
            add(name, _NOT_TOLD, "", without)
        else:
            low, high = (number(end) for end in found.ci90)
            add(name, f"{number(found.value)} deg/h", f"{low} to {high}", f"{how}, n = {found.n}")
    error, half = run.after.scale_factor_error, run.scale_factor_half_width
    add(
        "Scale factor error",
        _NOT_TOLD if error is None else f"{number(error)} ppm",
        "" if error is None or half is None else f"{number(error - half)} to {number(error + half)}",
        "the table does not turn" if error is None else "all turns, by their scatter",
    )
    for name, term in (run.noise or {}).get("terms", {}).items():
        least, most = term.get("ci") or (None, None)
        if name in _TERMS and least is not None and most is not None and most > 0.0:
            # What is not told from nothing has no figure.
            value = number(term["value"]) if least > 0.0 else f"at most {number(most)}"
            told = f"{number(least)} to {number(most)}"
            add(_TERMS[name], f"{value} {unit_words(term['unit'])}", told, "Noise terms of the run")
    return Table("Figure | >Value | >90 % interval | Of", rows)


def _attitude(run: RunJudgement) -> str:
    axis, latitude = run.facts.input_axis, run.facts.latitude
    if axis is None:
        return _NOT_STATED
    told = axis if isinstance(axis, str) else f"level, heading {axis.heading:g} deg"
    return f"input axis {told}" + (f", latitude {latitude:g} deg" if latitude is not None else "")


def _span(run: RunJudgement) -> str:
    series, started = run.series, run.facts.started
    hours = float(np.ptp(series.time) + run.averaging_s) / 3600.0
    low, high = float(series.temperature.min()), float(series.temperature.max())
    begun = f"started {started.isoformat(sep=' ', timespec='minutes')}, " if started else "start not stated, "
    return f"{begun}{short(hours)} h, T {signed(low)} to {signed(high)} °C"


def _rates(run: RunJudgement) -> str:
    steepest = float(np.abs(run.series.rate).max(initial=0.0))
    told = f"temperature up to {short(steepest, 2)} °C/min"
    if run.table_rates is None:
        return f"{told}; table rate not recorded"
    low, high = run.table_rates
    return f"{told}; table {signed(low)} to {signed(high)} deg/s"


def signed(value: float) -> str:
    """A number in few digits with a typeset sign."""
    return short(value, 4).replace("-", "\N{MINUS SIGN}")


def _size(card: dict[str, str]) -> list[str]:
    """Parameters and weights in words, as far as the model tells them."""
    line = [f"{card['parameters']} parameters"] if "parameters" in card else []
    return line + ([f"{card['weights']} of weights"] if "weights" in card else [])


def _figure(worst: RunJudgement) -> tuple[Markup, str]:
    series = worst.series
    per_unit, unit = time_unit(float(np.ptp(series.time)))
    time = series.time / per_unit
    curves = []
    for values, colour, dash in ((series.before, style.BEFORE, "4 2.5"), (series.after, style.AFTER, "")):
        x, y = drawn(time, values, points=_POINTS)
        curves.append(Curve(x, y, colour, dash))
    words = (
        f"{worst.run}, {averages(worst.averaging_s)}: "
        f"before (dashed), rms {number(worst.before.rms)} deg/h, "
        f"and after (solid), rms {number(worst.after.rms)} deg/h; {floor_told(worst)}. {own_noise(worst)}"
    )
    return line_figure(curves, f"time [{unit}]", "drift [deg/h]", words), words
