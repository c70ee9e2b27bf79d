"""Rehearsals: what a run of a programme would show of effects, and what a diagnosis of runs would name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from fogml.arrays import FloatArray
from fogml.gap.frame import Setting, fixed_columns, whitener_of
from fogml.gap.linear_gaussian import LinearGaussian
from fogml.gap.model import TwinModel
from fogml.gap.planning.programme_family import Design, Family
from fogml.gap.posterior import at_cost
from fogml.gap.reading import rows_of
from fogml.gap.result import NAMED, Found
from fogml.gap.result_parts import Rehearsed
from fogml.gap.rows import Rows, slopes
from fogml.gap.scene import Scene
from fogml.gap.search import Search
from fogml.gap.settings import STANDARD
from fogml.runs.facts import Facts
from fogml.signals.noise_model import NoiseModel
from fogml.twin.effect import NoiseEffect
from fogml.twin.noise import NoiseConstants
from fogml.twin.plant.heat import SelfHeating
from fogml.twin.programme import Programme
from fogml.twin.registry import effect
from fogml.twin.set_up import Sensors
from fogml.twin.simulate import DEFAULT_FACTS
from fogml.twin.twin import Twin

COARSE_S, FINE_S = 60.0, 10.0
"""Sample interval of a search and of the figures that are told [s]."""
LEAST_ROWS = 256
"""A short programme is sampled finer, down to about as many rows."""
USUAL_POWER_W = {"tactical": 3.0, "navigation": 8.0}
"""Heat of the electronics where the twin states none."""
FORMS = ("usual", "low", "high")
"""Shapes in the middle of their ranges, all at the low ends, all at the high ones."""


@dataclass(frozen=True)
class Stage:
    """Who rehearses: the twin made ready, its noise and constants.

    Attributes
    ----------
    model
        The twin with exact sensors, as a model that can be diagnosed.
    acting
        What a planned run would be of: the twin with its sensors and the heat that is assumed, without noise.
    noise
        Of the gyro.
    values
        Constants at which effects that act on inputs are taken.
    facts
        Of the set-up; the mounting is the design's where that states one.
    columns
        What a run records; what `fogml simulate` does if None.
    assumed
        What was assumed of the twin, in words.
    """

    model: TwinModel
    acting: Twin
    noise: NoiseModel
    values: Mapping[str, float]
    facts: Facts
    columns: tuple[str, ...] | None
    assumed: tuple[str, ...]


def stage(
    twin: Twin,
    noise: NoiseModel,
    values: Mapping[str, float],
    *,
    facts: Facts | None = None,
    columns: Sequence[str] | None = None,
) -> Stage:
    """The twin made ready.

    Responses are those to exact sensors: their noise must not make responses look unlike each other; and the
    gyro's own is stated, so that none is drawn. A twin
    that states no heat of its electronics gets the usual one, or power steps would warm nothing.
    """
    assumed = []
    plant, heating = twin.plant, twin.plant.heating
    if heating.steady_w == 0.0 and heating.initial_w == 0.0:
        watts = USUAL_POWER_W[twin.grade]
        plant = replace(plant, heating=SelfHeating(watts, watts, heating.time_constant_s, heating.node))
        assumed.append(
            f"the electronics turn {watts:g} W into heat while on; twin {twin.name} states no heat of its own"
        )
    acting = replace(twin, plant=plant, noise=NoiseConstants())
    return Stage(
        TwinModel(replace(acting, sensors=Sensors())),
        acting,
        noise,
        dict(values),
        DEFAULT_FACTS if facts is None else facts,
        None if columns is None else tuple(columns),
        tuple(assumed),
    )


class ExpectedRuns:
    """Whitened columns of one run or of several together.

    Attributes
    ----------
    stage
        Who rehearses.
    constants
        Whitened responses to one prior standard deviation of each constant, shape (m, c).
    nuisances
        Those to what a diagnosis takes to be always a little off, shape (m, k).
    """

    def __init__(self, on: Stage, constants: FloatArray, nuisances: FloatArray) -> None:
        self.stage, self.constants, self.nuisances = on, constants, nuisances
        nothing = LinearGaussian.of(np.zeros(len(constants)))
        self.beside_nuisances = nothing.beside(nuisances)
        self.beside_all = self.beside_nuisances.beside(constants)

    def white(self, id: str, shapes: Sequence[Mapping[str, float]]) -> FloatArray:
        """Whitened responses of an effect to a unit of its amplitude, shape (m, shapes)."""
        raise NotImplementedError

    def beside(self, columns: FloatArray) -> FloatArray:
        """Inner products of whitened columns beside constants and nuisances with priors, shape (k, k)."""
        return self.beside_all.gram(columns)


class Rehearsal(ExpectedRuns):
    """A run of a design as a diagnosis would see it.

    Parameters
    ----------
    on
        Who rehearses.
    family, design
        What is rehearsed.
    sample_s
        Sample interval [s]; less where the programme is short.

    Attributes
    ----------
    rows
        The run.
    """

    def __init__(self, on: Stage, family: Family, design: Design, sample_s: float = COARSE_S) -> None:
        programme = family.programme(design)
        sample_s = min(sample_s, max(math.floor(programme.total_s / LEAST_ROWS), 1.0))
        model, facts = on.model, mounted(on.facts, design)
        run = model.twin.simulate(programme, sample_s=sample_s, facts=facts, columns=on.columns).run
        # What a run of it would give is no matter, and without noise might pass for a stuck output.
        run = run.with_columns(gyro=np.where(np.isfinite(run.gyro), 0.0, np.nan))
        self.rows = rows = rows_of(run, model.twin, round(run.span_s / sample_s) + 1, exact=True)
        self._values = on.values
        self._whitener = whitener_of(on.noise, rows)
        reading = _reading_noise(rows, on.acting.sensors, on.values)
        self._weights = 1.0 / np.sqrt(1.0 + (reading / self._whitener.deviation) ** 2)
        scene = Scene((rows,), 1, on.model.grade, constants=on.values)
        setting = Setting(scene, model.constants, STANDARD, ())
        # How late the unit's sensors are is as little known to a fit of the run as it is to a diagnosis.
        fixed = fixed_columns(setting, 0, on.acting)
        white, count = self._whiten(fixed), len(model.constants)
        super().__init__(on, white[:, :count], white[:, count:])

    def _whiten(self, columns: FloatArray) -> FloatArray:
        return np.asarray(self._weights[:, None] * self._whitener.whiten(np.ascontiguousarray(columns)))

    def white(self, id: str, shapes: Sequence[Mapping[str, float]]) -> FloatArray:
        """Whitened responses of an effect to a unit of its amplitude, shape (m, shapes)."""
        return self._whiten(np.column_stack([self.response(id, shape) for shape in shapes]))

    def response(self, id: str, shape: Mapping[str, float]) -> FloatArray:
        """An effect's response to a unit of its amplitude [deg/h], shape (m,)."""
        return self.rows.response(effect(id), shape, None, self._values)


class Together(ExpectedRuns):
    """Several runs of one unit, whose constants and effects are the same in all."""

    def __init__(self, runs: Sequence[ExpectedRuns]) -> None:
        self._runs = runs
        constants = np.concatenate([run.constants for run in runs])
        super().__init__(runs[0].stage, constants, block_diag(*(run.nuisances for run in runs)))

    def white(self, id: str, shapes: Sequence[Mapping[str, float]]) -> FloatArray:
        """Whitened responses of an effect to a unit of its amplitude, shape (m, shapes)."""
        return np.concatenate([run.white(id, shapes) for run in self._runs])


def _reading_noise(rows: Rows, sensors: Sensors, values: Mapping[str, float]) -> FloatArray:
    """Standard deviation that noise and last digit of the sensors make of the replay [deg/h], shape (m,)."""
    variance = np.zeros(len(rows.kept))
    for name, slope in slopes(rows, values).items():
        place = rows.even.place(name)
        if place is not None:
            errors = sensors.of(place)
            variance += (slope * math.hypot(errors.noise, errors.resolution / math.sqrt(12.0))) ** 2
    return rows.of(np.sqrt(variance))


def mounted(facts: Facts, design: Design) -> Facts:
    """The facts with the design's mounting, where it states one."""
    return facts.model_copy(update={"input_axis": design.mounting or facts.input_axis})


def planned(on: Stage, family: Family, design: Design, name: str) -> Programme:
    """The programme of a design with the mounting that is planned with, which `fogml simulate` then takes."""
    return replace(family.programme(design, name), input_axis=mounted(on.facts, design).input_axis)


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
        ends = ({q.name: q.range(grade)[i] for q in declared.shape} for i in (0, 1))
        for form, shape in zip(FORMS, (declared.default_shape(grade), *ends)):
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
