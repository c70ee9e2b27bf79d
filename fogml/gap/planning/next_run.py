"""The run to record next: one that tells a class apart, what something unknown goes with, or shows more.

For what is not known it is a repeat: whether it goes with temperature, with power-on, or comes anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.cards import card_of
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.model import EffectValue, TwinModel
from fogml.gap.planning.fisher import stated_or_usual
from fogml.gap.planning.programme_family import Design, Family
from fogml.gap.planning.programme_search import finely, search
from fogml.gap.planning.rehearsal import COARSE_S, FINE_S, Rehearsal, Stage, stage
from fogml.gap.planning.separating import LEAST_DISTANCE, run_of, separating_run
from fogml.gap.posterior import Judgement
from fogml.gap.result import Found, SeparatingRun
from fogml.gap.rows import Rows, at_amplitude
from fogml.numerals import ascii_number
from fogml.runs.columns import of_a_sensor
from fogml.settings_check import check_numbers
from fogml.signals.bases import corners
from fogml.twin.effect import Effect, NoiseEffect
from fogml.twin.programme import Programme, programme_from
from fogml.twin.registry import effect


@dataclass(frozen=True)
class RepeatSettings:
    """How a repeat run is made.

    Attributes
    ----------
    later_h
        How much later than the power the chamber's programme may begin [h].
    settled_degc
        A course of temperature is straight between corners to this.
    off_h
        How long the power is off before, so that the unit is cold [h].
    most_steps
        Steps of the programme at most: more are straightened.
    most_members
        Members of a class that a programme is looked for: more are hardly ever told apart by one.
    """

    later_h: tuple[float, ...] = (1.0, 2.0, 4.0)
    settled_degc: float = 1.0
    off_h: float = 1.0
    most_steps: int = 60
    most_members: int = 4

    def __post_init__(self) -> None:
        check_numbers(self, may_be_0=("later_h", "off_h"))


REPEAT = RepeatSettings()
MOST_PROGRAMMES = 80
"""Of 240, three draws of 18 effects gained 1 to 3 % of the lengths over 80, in twice the time and more."""
HARDLY = 0.3
"""Length from which getting longer counts in a search."""
PLENTY = 2.0 * LEAST_DISTANCE
"""Length from which getting longer does not count any more."""


def repeat_run(found: Inference, every: Foretold, power_steps: bool = True) -> SeparatingRun | None:
    """The run in which the unknown shows most, again, with the power on some hours before the chamber moves.

    What goes with temperature comes that much later after power-on than it did, what goes with power-on does
    not, and what comes anew each time does neither. None where the unknown is too short for that in all runs,
    or the power may not be switched.
    """
    scene = found.scene
    unknown = [m for m in every.members if found.kind(m) == "unknown"]
    if not (unknown and power_steps):
        return None
    courses = [np.sum([every.of_member(i, m) for m in unknown], axis=0) for i in range(scene.fitted)]
    lengths = [_length(found, i, course) for i, course in enumerate(courses)]
    run = int(np.argmax(lengths))
    rows, course = scene.runs[run], courses[run]
    distances = []
    for hours in REPEAT.later_h:
        late = np.interp(rows.time_s - 3600.0 * hours, rows.time_s, course)
        distances.append(min(_length(found, run, late - course), _length(found, run, late), lengths[run]))
    distance, hours = max(distances), REPEAT.later_h[int(np.argmax(distances))]
    if distance < LEAST_DISTANCE:
        return None
    start = _start(rows)
    soak = f"soak at {start:g} degC for"
    course_again, fastest = _steps_again(rows)
    values: dict[str, Any] = {
        "schema": "fogml.programme/1",
        "name": "repeat-run",
        "start_temperature": f"{start:g} degC",
        "power": "off",
        "steps": [f"{soak} {REPEAT.off_h:g} h", {f"{soak} {hours:g} h": ["power on"]}, *course_again],
    }
    if fastest > Programme.fastest_rate:
        values["fastest_rate"] = f"{ascii_number(fastest)} degC/min"
    programme = replace(programme_from(values, "repeat-run"), input_axis=rows.run.facts.input_axis)
    total = REPEAT.off_h + hours + float(rows.run.span_s) / 3600.0
    told = (f"{soak} {REPEAT.off_h:g} h, power off", f"{soak} {hours:g} h, power on", *course_again)
    separates = ("temperature", "power-on", "time")
    return SeparatingRun(separates, programme.as_yaml(), float(distance), total, told)


def _length(found: Inference, run: int, course: FloatArray) -> float:
    """Whitened length beside the constants of a course on one run."""
    parts = [course if i == run else np.zeros(len(rows)) for i, rows in enumerate(found.scene.fit)]
    return found.field.base.length(found.field.whitening.stacked(parts))


def _course(rows: Rows) -> tuple[FloatArray, FloatArray]:
    """Time and temperature of what the chamber did, as far as it is recorded."""
    name = "T_chamber" if "T_chamber" in rows.readings else "T"
    return rows.even.time, rows.even.temperature(name)


def _start(rows: Rows) -> float:
    return float(round(float(_course(rows)[1][0]), 1))


def _steps_again(rows: Rows) -> tuple[list[str], float]:
    """The recorded course in sentences: soaks, and ramps from corner to corner; its fastest [degC/min]."""
    time, x = _course(rows)
    wider = REPEAT.settled_degc
    turns = corners(time, x, wider)
    while len(turns) > REPEAT.most_steps:
        wider *= 1.5
        turns = corners(time, x, wider)
    said: list[str] = []
    at, soaked, fastest = _start(rows), 0.0, 0.0
    for one, other in pairwise(turns):
        minutes, to = float(time[other] - time[one]) / 60.0, float(round(float(x[other]), 1))
        if abs(to - at) < wider:
            soaked += minutes
            continue
        if soaked:
            said.append(f"soak at {at:g} degC for {max(soaked, 1.0):.0f} min")
        speed = float(ascii_number(abs(to - at) / minutes))
        fastest = max(fastest, speed)
        said.append(f"ramp to {to:g} degC at {speed:g} degC/min")
        at, soaked = to, 0.0
    return [*said, f"soak at {at:g} degC for {max(soaked, 1.0):.0f} min"], fastest


def next_run(
    found: Inference,
    judged: Judgement,
    items: Sequence[Found],
    undetectable: Sequence[str],
    seed: int,
    tell: Callable[[str], None],
    unknown: bool = False,
    family: Family | None = None,
) -> SeparatingRun | None:
    """The programme that tells the members of the most probable class of several apart.

    Where each named effect stands alone and something `unknown` acts, the one that tells what that goes with;
    else the one that shows what these runs could not. None where there is nothing to tell, no programme does,
    or the model can't simulate one. The unit is mounted and recorded as in the first of these runs.

    Parameters
    ----------
    found, judged, items, undetectable
        The posterior, what it names, what that is told as, and what these runs could not show.
    seed
        Of the search.
    tell
        Told what is being done.
    unknown
        Whether something unknown acts.
    family
        What the lab can do, and for how long; as usual if None. A repeat takes as long as what it repeats.
    """
    family = replace(family or Family(), mountings=(None,))
    several = any(f.named and len(f.members) > 1 for f in items)
    if unknown and not several:
        repeat = repeat_run(found, Foretold.of(found, judged.best.members), family.power_steps)
        if repeat is not None:
            return repeat
    if not isinstance(found.model, TwinModel):
        return None
    twin, noise = found.model.twin, found.field.whitening.noise
    first, values = found.scene.runs[0].run, found.setting.values
    on = stage(
        twin, noise, values, facts=first.facts, columns=[name for name in first.columns if of_a_sensor(name)]
    )
    open_ = next((f for f in items if f.named and len(f.members) > 1), None)
    if open_ is None:
        if not undetectable:
            return None
        return showing_run(on, family, undetectable, seed=seed, progress=tell)
    members = _members(found, judged, open_)
    if len(members) < 2:
        return None
    return separating_run(on, family, members, seed=seed, progress=tell, most=MOST_PROGRAMMES)


def _members(found: Inference, judged: Judgement, item: Found) -> list[EffectValue]:
    """Members of a class as each would be in the other's place."""
    cause = next(c for c in judged.causes if c.ids[0] == item.effect)
    others = [m for m in judged.best.members if m not in cause.members]
    beside = found.field.beside(others)
    best = {found.columns.families[f].id: m for f, m in found.search.best_members(others).items()}
    values = []
    for id in item.members[: REPEAT.most_members]:
        if id in best:
            shape = found.columns.nodes[best[id].node].shape
            values.append(card_of(id, found.field, beside, shape).value)
    return [v for v in values if v.amplitude != 0.0]


def showing_run(
    on: Stage,
    family: Family,
    ids: Sequence[str],
    *,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
    most: int = MOST_PROGRAMMES,
) -> SeparatingRun | None:
    """The programme that shows as many effects as it can at their usual size.

    Parameters
    ----------
    on, family, seed, progress, most
        As in `fogml.gap.planning.separating.separating_run`.
    ids
        The effects. Those that a record itself tells, such as the steps of its sensors, no programme shows
        any better: they are left out.

    Returns
    -------
    SeparatingRun or None
        ``separates`` are the effects that reach a whitened length of `LEAST_DISTANCE` beside the constants,
        ``distance`` is the least of theirs. None where no effect does.
    """
    usual = [stated_or_usual(on, effect(id)) for id in ids if _may_show(effect(id))]
    if not usual:
        return None

    def merit(design: Design, sample_s: float = COARSE_S) -> float:
        held = lengths(Rehearsal(on, family, design, sample_s), usual)
        return float(np.mean(np.log(np.clip(held, HARDLY, PLENTY))))

    tried = search(family, merit, seed=seed, most=most, progress=progress)
    finals = finely(tried, lambda design: merit(design, FINE_S))
    reached = lengths(Rehearsal(on, family, finals[0].design, FINE_S), usual)
    shown = [(value.id, length) for value, length in zip(usual, reached) if length >= LEAST_DISTANCE]
    if not shown:
        return None
    least = float(min(length for _, length in shown))
    run = run_of(on, family, finals[:1], [id for id, _ in shown], least, "showing-run")
    return replace(run, aim="show")


def _may_show(declared: Effect) -> bool:
    """Whether a programme may show it: not the steps of a record, nor a random error."""
    if isinstance(declared, NoiseEffect):
        return declared.steady
    return not declared.digitises


def lengths(rehearsal: Rehearsal, values: Sequence[EffectValue]) -> FloatArray:
    """Whitened length of each effect beside the constants, shape (k,)."""
    shapes = [at_amplitude(effect(v.id), v.amplitude, v.shape) for v in values]
    made = [v.amplitude * rehearsal.white(v.id, [shape]) for v, shape in zip(values, shapes)]
    columns = np.concatenate(made, axis=1)
    return np.asarray(np.sqrt(np.maximum(np.diagonal(rehearsal.beside(columns)), 0.0)))
