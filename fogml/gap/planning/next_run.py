"""A repeat run for what is not known: whether it goes with temperature, with power-on, or comes anew."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.cards import card_of
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.model import EffectValue, TwinModel
from fogml.gap.planning.separating import LEAST_DISTANCE, separating_run
from fogml.gap.planning.showing import MOST_PROGRAMMES, showing_run
from fogml.gap.posterior import Judgement, at_cost
from fogml.gap.result import NAMED, Found, SeparatingRun
from fogml.gap.result_parts import Rehearsed
from fogml.gap.rows import Rows
from fogml.gap.search import Search
from fogml.gap.shapes import usual_shapes
from fogml.numerals import ascii_number
from fogml.settings_check import check_numbers
from fogml.signals.bases import corners
from fogml.twin.effect import NoiseEffect
from fogml.twin.programme import Programme, programme_from


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
FORMS = ("usual", "low", "high")
"""Shapes in the middle of their ranges, all at the low ends, all at the high ones."""


def repeat_run(found: Inference, every: Foretold) -> SeparatingRun | None:
    """The run in which the unknown shows most, again, with the power on some hours before the chamber moves.

    What goes with temperature comes that much later after power-on than it did, what goes with power-on does
    not, and what comes anew each time does neither. None where the unknown is too short for that in all runs.
    """
    scene = found.scene
    unknown = [m for m in every.members if found.kind(m) == "unknown"]
    if not unknown:
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
    programme = programme_from(values, "repeat-run")
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
) -> SeparatingRun | None:
    """The programme that tells the members of the most probable class of several apart.

    Where each named effect stands alone and something `unknown` acts, the one that tells what that goes with;
    else the one that shows what these runs could not. None where there is nothing to tell, no programme does,
    or the model can't simulate one.
    """
    several = any(f.named and len(f.members) > 1 for f in items)
    if unknown and not several:
        repeat = repeat_run(found, Foretold.of(found, judged.best.members))
        if repeat is not None:
            return repeat
    if not isinstance(found.model, TwinModel):
        return None
    twin, noise = found.model.twin, found.field.whitening.noise
    facts, values = found.scene.runs[0].run.facts, found.setting.values
    open_ = next((f for f in items if f.named and len(f.members) > 1), None)
    if open_ is None:
        if not undetectable:
            return None
        return showing_run(twin, noise, values, undetectable, seed=seed, progress=tell, facts=facts)
    members = _members(found, judged, open_)
    if len(members) < 2:
        return None
    return separating_run(
        twin,
        noise,
        values,
        members,
        seed=seed,
        progress=tell,
        facts=facts,
        most=MOST_PROGRAMMES,
    )


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


def rehearse(
    search: Search, items: Sequence[Found] = (), cost_of_false_name: float = 1.0
) -> tuple[Rehearsed, ...]:
    """What a diagnosis of the runs of a search would name, miss or mistake if one candidate acted alone.

    Each is put into replays of these very runs, at its usual size and, if it was found, at that, in several
    forms. The data are what it is expected to make, without noise (G. Cowan et al., Eur. Phys. J. C 71 (2011)
    1554), judged beside the constants by the evidence of one cause, or of two where something unknown holds
    them better than any one that is known.
    """
    setting = search.field.setting
    grade = setting.scene.grade
    sizes = {f.effect: abs(f.amplitude.value) for f in items if f.named}
    rows = []
    for f in search.families_of("known"):
        declared = setting.scene.candidates[search.families[f].id]
        if isinstance(declared, NoiseEffect) and not declared.steady:
            continue
        usual = declared.amplitude.typical(grade)
        asked = [("usual", usual)] + ([("found", sizes[declared.id])] if declared.id in sizes else [])
        for form, shape in zip(FORMS, usual_shapes(declared, grade)):
            for size, amplitude in asked:
                made = search.field.made(declared, amplitude, shape)
                rows.append(_judged(search, f, form, size, made, cost_of_false_name))
            if not declared.shape:
                break
    return tuple(rows)


def _judged(search: Search, family: int, form: str, size: str, data: FloatArray, cost: float) -> Rehearsed:
    families, length = search.families, search.field.base.length(data)
    scores = {frozenset[int](): 0.0} | {frozenset((f,)): s for f, s in search.alone_on(data).items()}
    alike, probability = _most_likely(search, scores, cost)
    if probability < NAMED and length >= search.priors.least_detectable:
        # What something unknown holds better alone may be named beside it.
        scores = {frozenset(e.key): e.score for e in search.on(data, most_causes=2).explanations()}
        alike, probability = _most_likely(search, scores, cost)
    named = probability >= NAMED
    outcome = "missed" if not named else "named" if family in alike else "mistaken"
    members = tuple(families[f].id for f in alike) if named else ()
    return Rehearsed(families[family].id, form, size, length, outcome, members, probability)


def _most_likely(
    search: Search, scores: Mapping[frozenset[int], float], cost: float
) -> tuple[list[int], float]:
    """The class of known causes that is likeliest by the scores of sets, and its probability."""
    priors, known = search.priors, set(search.families_of("known"))
    best = {f: max(s for held, s in scores.items() if f in held) for f in known & frozenset().union(*scores)}
    if not best:
        return [], 0.0
    first = max(best.values())
    alike = sorted((f for f in best if best[f] > first - priors.exchange), key=lambda f: -best[f])

    def total(kept: Callable[[frozenset[int]], bool]) -> float:
        return float(
            np.logaddexp.reduce(np.array([-np.inf, *(s for held, s in scores.items() if kept(held))]))
        )

    own = total(lambda held: bool(held & set(alike)))
    others = total(lambda held: bool(held & known) and not held & set(alike))
    unknown = total(lambda held: not held & known)
    probability = priors.believed(float(np.logaddexp(own, others)) - unknown, own - others)
    return alike, at_cost(probability, cost)
