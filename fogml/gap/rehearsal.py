"""A programme rehearsed: what a run of it would show of each effect, whitened as a diagnosis would."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.gap.frame import constant_rows, posterior_factor, products_beside
from fogml.gap.model import Candidate
from fogml.gap.observation import observe
from fogml.gap.programme_design import Design
from fogml.gap.programme_family import Family
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.twin_model import TwinModel
from fogml.gap.twin_on_run import TwinOnRun
from fogml.runs.facts import Facts
from fogml.runs.run import FloatArray
from fogml.signals.noise_model import NoiseModel
from fogml.twin.noise import NoiseConstants
from fogml.twin.plant.power import SelfHeating
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


@dataclass(frozen=True)
class Stage:
    """Who rehearses: the twin made ready, its noise and constants.

    Attributes
    ----------
    model
        The twin with exact sensors, as a model that can be diagnosed.
    sensors
        Those that it has, whose noise tells how much rows weigh.
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
    sensors: Sensors
    noise: NoiseModel
    values: Mapping[str, float]
    facts: Facts
    columns: tuple[str, ...] | None
    assumed: tuple[str, ...]

    def candidate(self, id: str) -> Candidate:
        """An effect as a diagnosis would offer it.

        Raises
        ------
        InputError
            If there is none of this id.
        """
        declared: Candidate = effect(id)
        return self.model.candidates().get(id, declared)


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
    heating = twin.plant.heating
    plant = twin.plant
    if heating.steady_w == 0.0 and heating.initial_w == 0.0:
        watts = USUAL_POWER_W[twin.grade]
        plant = replace(plant, heating=SelfHeating(watts, watts, heating.time_constant_s, heating.node))
        assumed.append(
            f"the electronics turn {watts:g} W into heat while on; twin {twin.name} states no heat of its own"
        )
    ready = replace(twin, plant=plant)
    return Stage(
        TwinModel(replace(ready, sensors=Sensors(), noise=NoiseConstants())),
        ready.sensors,
        noise,
        dict(values),
        DEFAULT_FACTS if facts is None else facts,
        None if columns is None else tuple(columns),
        tuple(assumed),
    )


class Rehearsed:
    """Whitened columns of one run or of several together.

    Attributes
    ----------
    stage
        Who rehearses.
    fixed
        Whitened columns of the constants, each scaled by its prior's standard deviation, shape (m, c).
    """

    stage: Stage
    fixed: FloatArray

    def white(self, id: str, shapes: Sequence[Mapping[str, float]]) -> FloatArray:
        """Whitened responses of an effect to a unit of its amplitude, shape (m, shapes)."""
        raise NotImplementedError

    def beside(self, columns: FloatArray) -> FloatArray:
        """Inner products of whitened columns beside the constants, their priors known, shape (k, k)."""
        return products_beside(columns, self.fixed, posterior_factor(self.fixed))


class Rehearsal(Rehearsed):
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
    observation
        The run.
    """

    def __init__(self, on: Stage, family: Family, design: Design, sample_s: float = COARSE_S) -> None:
        self.stage = on
        programme = family.programme(design)
        sample_s = min(sample_s, max(math.floor(programme.total_s / LEAST_ROWS), 1.0))
        facts = mounted(on.facts, design)

        run = on.model.twin.simulate(programme, sample_s=sample_s, facts=facts, columns=on.columns).run
        self.observation = observe(run, on.model)
        replay = self.observation.model
        assert isinstance(replay, TwinOnRun)
        reading = replay.noise_of_sensors(on.sensors, on.values)
        self._whitener = RunWhitener(on.noise, self.observation, on.values, reading)
        self.fixed = self._whitener.whiten(constant_rows(self.observation, on.model.constants))

    def white(self, id: str, shapes: Sequence[Mapping[str, float]]) -> FloatArray:
        """Whitened responses of an effect to a unit of its amplitude, shape (m, shapes)."""
        o = self.observation
        columns = [o.response(id, shape, self.stage.values) for shape in shapes]
        return self._whitener.whiten(np.column_stack(columns))


class Together(Rehearsed):
    """Several runs of one unit, whose constants and effects are the same in all."""

    def __init__(self, runs: Sequence[Rehearsed]) -> None:
        self.stage, self._runs = runs[0].stage, runs
        self.fixed = np.concatenate([run.fixed for run in runs])

    def white(self, id: str, shapes: Sequence[Mapping[str, float]]) -> FloatArray:
        """Whitened responses of an effect to a unit of its amplitude, shape (m, shapes)."""
        return np.concatenate([run.white(id, shapes) for run in self._runs])


def mounted(facts: Facts, design: Design) -> Facts:
    """The facts with the design's mounting, where it states one."""
    return facts.model_copy(update={"input_axis": design.mounting or facts.input_axis})
