"""Sensors that don't show what they sit on."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import OUTER, Sensing, Shape
from fogml.blind.frame.operators import lag
from fogml.blind.frame.record import World


class LagOfTwoStages(Sensing):
    """A sensor behind glue and housing: two stages of lag."""

    name, form, unit, fine_sensors = "sensor_lag", "two stages", "s", True
    greatest: ClassVar[float] = 900.0
    ranges = {"second_share": (0.1, 0.5)}
    evenly = ("second_share",)

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """Two lags whose time constants add up to the amplitude."""
        share = shape["second_share"]
        first = lag(world.sample_s, temperature, amplitude * (1.0 - share))
        return lag(world.sample_s, first, amplitude * share)


class CoarseSteps(Sensing):
    """A converter with whole steps that it cuts off rather than rounds: whole steps, in the mean unbiased."""

    name, form, unit = "sensor_quantisation", "truncation", "degC"
    greatest: ClassVar[float] = 2.0
    ranges = {"offset": (0.0, 1.0)}

    def read(self, values: FloatArray, amplitude: float, shape: Shape) -> FloatArray:
        steps = np.floor(values / amplitude + shape["offset"])
        return np.round(amplitude * (steps + 0.5 - shape["offset"]), 7)


class Elsewhere(Sensing):
    """Sensors that feel the case as well, the outer ones more: a mix of the place and the case."""

    name, form, unit, fine_sensors = "sensor_placement", "outer sensors more", "1", True
    records = ("T_case",)
    greatest: ClassVar[float] = 1.0
    ranges = {"outer": (0.9, 1.2)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        outer = name in OUTER
        share = amplitude * (shape["outer"] if outer else 1.0)
        return temperature + share * (world.nodes["T_case"] - temperature)


class StickySensor(Sensing):
    """One of several sensor elements repeats its last value for minutes, again and again."""

    name, known, form, faces = "sticky_sensor", False, "values held for minutes", True
    fine_sensors = True
    greatest: ClassVar[float] = 1.0

    def draw(self, rng: np.random.Generator) -> Shape:
        """How long it holds, how often [s], where the first hold lies."""
        hold = rng.uniform(250.0, 560.0)
        return {"hold": hold, "interval": hold * rng.uniform(1.5, 4.0), "phase": rng.random()}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """Inner sensors show the held value by a share of `amplitude`."""
        if name in OUTER:
            return temperature
        within = (world.time + shape["phase"] * shape["interval"]) % shape["interval"]
        fresh = within >= shape["hold"]
        last = np.maximum.accumulate(np.where(fresh, np.arange(len(fresh)), 0))
        return np.asarray(temperature + amplitude * (temperature[last] - temperature))


class CreepingSensor(Sensing):
    """Sensors whose glue creeps when hot: their error, one for all, grows with the time spent there."""

    name, known, form = "creeping_sensor", False, "error grows with time in heat"
    greatest: ClassVar[float] = 20.0
    ranges = {"onset": (25.0, 40.0)}
    """Where creep sets in [degC]."""

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """`amplitude` degC more per 1000 degC min above the onset."""
        excess = np.maximum(world.nodes["T_coil"] - shape["onset"], 0.0)
        return np.asarray(temperature + amplitude * np.cumsum(excess) * world.sample_s / 60e3)
