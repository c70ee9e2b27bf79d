"""The page on which the sizes of effects are moved: recorded against replayed, offline, by anyone."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from fogml.escaping import script_data
from fogml.gap.result import Diagnosis
from fogml.gap.result_parts import Counterfactual
from fogml.numerals import averages, unit_words
from fogml.report import style
from fogml.report.gap_words import subject_of, title_of, titles
from fogml.report.page import Drawing, render, template_text

MOST_FACTOR = 3.0
"""Sliders go up to this many times the size found, or usual."""
STEP = 0.05


def counterfactual_page(found: Diagnosis) -> str:
    """The self-contained HTML page of a diagnosis that kept its courses.

    Parameters
    ----------
    found
        As :func:`fogml.gap.diagnose` gives it with ``courses=True``.
    """
    runs = sorted(found.counterfactuals, key=lambda run: not run.held_out)
    sliders = _sliders(found, runs)
    data = {"runs": [_packed(run) for run in runs]}
    return render(
        "counterfactual.html",
        title=f"{subject_of(found)} – what if?",
        name=subject_of(found),
        kicker=f"The twin “{found.model}” against recordings, with effects of any size",
        runs=[f"{run.run} ({'held out' if run.held_out else 'fitted on'})" for run in runs],
        acting=[s for s in sliders if s["start"]],
        others=[s for s in sliders if not s["start"]],
        drawing=_drawing(runs[0]),
        data=script_data(json.dumps(data)),
        averages=averages(runs[0].averaging_s).capitalize(),
        sliders=template_text("counterfactual.js"),
    )


def _sliders(found: Diagnosis, runs: Sequence[Counterfactual]) -> list[dict[str, Any]]:
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


def _packed(run: Counterfactual) -> dict[str, Any]:
    """A run's courses as base64 of float32, which holds seven digits."""

    def packed(values: np.ndarray) -> str:
        return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")

    return {
        "floor": run.floor,
        "time": packed((run.time_s - run.time_s[0]) / 3600.0),
        "temperature": packed(run.temperature_degc),
        "recorded": packed(run.recorded),
        "replayed": packed(run.replayed),
        "courses": {course.effect: packed(course.values) for course in run.courses},
    }


def _drawing(run: Counterfactual) -> Drawing:
    """Temperature, recorded with replayed, and the gap, as the sliders begin."""
    hours = (run.time_s - run.time_s[0]) / 3600.0
    replayed = run.replayed + sum(c.values for c in run.courses if c.acts)
    panels = {"T [°C]": 0.7, "error [deg/h]": 1.4, "gap [deg/h]": 1.2}
    figure = style.stacked(panels, "time [h]", 0.05, title_font_size=12)
    for row, values, name, colour, width, dash in (
        (1, run.temperature_degc, "temperature", style.BLUE, 1.6, None),
        (2, run.recorded, "recorded", style.BEFORE, 1.3, None),
        (2, replayed, "replayed", style.MODEL, 2.0, "dash"),
        (3, run.recorded - replayed, "gap", style.AFTER, 1.3, None),
    ):
        figure.add_trace(style.line(hours, values, name, colour, width, dash), row=row, col=1)
    style.styled(figure, 560, legend={"y": 1.06}, hovermode="x")
    return Drawing(
        figure,
        alt="Temperature, recorded and replayed output, and the gap between them, in time; they follow the "
        "sliders below.",
        caption="Recorded stays; replayed and the gap follow the sliders.",
    )
