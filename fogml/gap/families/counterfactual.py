"""Courses of every effect on the runs of a diagnosis, for a page on which their sizes are moved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.gap.counterfactual_result import Counterfactual, Course
from fogml.gap.families.card import Card
from fogml.gap.families.closing import Foretold
from fogml.gap.families.inference import Inference
from fogml.gap.families.posterior import Cause
from fogml.gap.how_far import averages
from fogml.gap.model import amplitudes_about
from fogml.runs.run import FloatArray
from fogml.signals.noise_expectation import floor_square
from fogml.twin.effect import Effect, NoiseEffect

SHOWN = 0.05
"""Share of the noise floor that an effect of its usual size has to make of some run to be shown."""
NOT_LINEAR = ("line", "power_cycles", "sensor_steps", "clock_skew")
"""Families that no size moves alone: of a phase of their own, or not in proportion to their size."""


def counterfactuals(
    found: Inference, after: Foretold, named: Sequence[Cause], cards: dict[str, Card]
) -> tuple[Counterfactual, ...]:
    """Every run with courses of what is named, of what the twin has, and of others at their usual size."""
    told = []
    for i, rows in enumerate(found.setting.scene.runs):
        windows = averages(rows)
        courses = [c for c in _courses(found, after, named, cards, i) if np.isfinite(c.values).all()]
        acting = np.sum([c.values for c in courses if c.acts], axis=0) if courses else 0.0
        # What is replayed in all, less what acts: the twin's own effects are part of its replay.
        whole = rows.recorded - rows.gap + after.on(i)
        floor = float(floor_square(found.field.whitening.noise, windows.time, windows.window_s)) ** 0.5
        kept = tuple(
            Course(c.effect, c.size, c.unit, c.acts, c.signed, windows.of(c.values))
            for c in courses
            if c.acts or float(np.std(windows.of(c.values))) > SHOWN * floor
        )
        told.append(
            Counterfactual(
                run=rows.run.name,
                held_out=i >= found.setting.scene.fitted,
                averaging_s=windows.window_s,
                time_s=windows.time,
                temperature_degc=windows.of(rows.temperature),
                recorded=windows.of(rows.recorded),
                replayed=windows.of(whole - acting),
                floor=floor,
                courses=kept,
            )
        )
    return tuple(told)


def _courses(
    found: Inference, after: Foretold, named: Sequence[Cause], cards: dict[str, Card], run: int
) -> list[Course]:
    scene, values = found.setting.scene, found.setting.values
    rows, grade = scene.runs[run], scene.grade
    on = {declared.id: setting for declared, setting in found.plant.on}
    by_id = {cause.ids[0]: cause for cause in named}
    courses = []
    for id, declared in scene.candidates.items():
        acts = id in by_id or id in on
        if not acts and not _linear(declared):
            continue
        course: FloatArray = np.zeros(len(rows))
        size = cards[id].value.amplitude if id in by_id else 0.0
        if id in by_id:
            course = course + np.sum([after.of_member(run, m) for m in by_id[id].members], axis=0)
        if id in on:
            course = course + on[id].amplitude * rows.response(declared, on[id].shape, None, values)
            size += on[id].amplitude
        if not acts:
            size = declared.amplitude.typical(grade)  # type: ignore[arg-type]
            shape = declared.default_shape(grade)  # type: ignore[arg-type]
            course = size * rows.response(declared, shape, None, values)
        courses.append(Course(id, size, declared.amplitude.unit, acts, declared.amplitude.signed, course))
    return courses


def _linear(declared: Effect) -> bool:
    """Whether an effect of the catalogue is in proportion to its size and the same on each run."""
    random = isinstance(declared, NoiseEffect) and not declared.steady
    return not (
        random or declared.drawn_per_run or declared.family in NOT_LINEAR or amplitudes_about(declared)
    )
