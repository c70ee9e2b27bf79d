"""Effects that no library holds, in sensors and table."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fogml.blind.first.recurrences import recurrence
from fogml.blind.frame.form import Additive, Demands, Sensing, Shape
from fogml.blind.frame.record import FloatArray, World


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
        if name in ("T_out", "T2", "T4"):
            return temperature
        within = (world.time + shape["phase"] * shape["interval"]) % shape["interval"]
        fresh = within >= shape["hold"]
        last = np.maximum.accumulate(np.where(fresh, np.arange(len(fresh)), 0))
        return np.asarray(temperature + amplitude * (temperature[last] - temperature))


class CreepingSensor(Sensing):
    """Sensors whose glue creeps when hot: their error, one for all, grows with the time spent there."""

    name, known, form = "creeping_sensor", False, "error grows with time in heat"
    greatest: ClassVar[float] = 20.0

    def draw(self, rng: np.random.Generator) -> Shape:
        """Where creep sets in [degC]."""
        return {"onset": rng.uniform(25.0, 40.0)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """`amplitude` degC more per 1000 degC min above the onset."""
        excess = np.maximum(world.nodes["T_coil"] - shape["onset"], 0.0)
        return np.asarray(temperature + amplitude * np.cumsum(excess) * world.sample_s / 60e3)


class SettlingTable(Additive):
    """A table whose servo settles slowly after each change of its rate."""

    name, known, stage, form = "settling_table", False, "rig", "slow settling after edges"
    demands = Demands(turns=True)

    def draw(self, rng: np.random.Generator) -> Shape:
        """Time constant [s]."""
        return {"time_constant": rng.uniform(40.0, 150.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Relaxing sum of the rate's changes, in ppm of them."""
        change = np.diff(world.table_rate, prepend=0.0)
        decay = np.full(len(change), world.sample_s / shape["time_constant"])
        return 3600e-6 * recurrence(decay, -change, 0.0)


class HuntingServo(Additive):
    """A servo that hunts while the table turns: a slow oscillation, its size by the root of the rate."""

    name, known, stage, form = "hunting_servo", False, "rig", "oscillation while turning"
    demands = Demands(slow_turns=True)

    def draw(self, rng: np.random.Generator) -> Shape:
        """Period [s] and phase."""
        return {"period": rng.uniform(150.0, 900.0), "phase": rng.uniform(0.0, 2.0 * np.pi)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """sqrt(|rate| / 0.1 deg/s) sin(2 pi t / period)."""
        size = np.sqrt(np.minimum(np.abs(world.table_rate), 1.0) / 0.1)
        return size * np.sin(2.0 * np.pi * world.time / shape["period"] + shape["phase"])


FORMS = (StickySensor, CreepingSensor, SettlingTable, HuntingServo)
