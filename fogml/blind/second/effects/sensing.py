"""Thermometers that don't show what they sit on."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Sensing, Shape
from fogml.blind.frame.operators import late
from fogml.blind.frame.record import World
from fogml.blind.second.memory import backlash, slab_lag

_OUTER = ("T_out", "T2", "T4")


class LagThroughGlue(Sensing):
    """A thermometer behind a bed of glue: heat creeps through it, on one face more slowly."""

    name, form, unit, fine_sensors = "sensor_lag", "diffusion through glue", "", True
    greatest: ClassVar[float] = 2000.0
    ranges = {"outer": (0.4, 1.6)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """The far face of a slab whose L^2 / D is twice the amplitude."""
        tau = 2.0 * amplitude * (shape["outer"] if name in _OUTER else 1.0)
        return slab_lag(world.time, temperature, max(tau, 1e-3), modes=8)


class LagOneFace(Sensing):
    """Only the inner face's thermometers have come loose."""

    name, form, fine_sensors = "sensor_lag", "inner face alone", True
    greatest: ClassVar[float] = 2000.0

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """One lag."""
        return temperature if name in _OUTER else late(temperature, amplitude, world.sample_s)


class UnevenSteps(Sensing):
    """A converter whose steps are uneven: every other code is wide."""

    name, form, unit = "sensor_quantisation", "uneven steps", "degC"
    greatest: ClassVar[float] = 2.0
    ranges = {"uneven": (0.1, 0.45), "at": (0.0, 1.0)}

    def read(self, values: FloatArray, amplitude: float, shape: Shape) -> FloatArray:
        """The middle of the code that holds the value."""
        pair = values / (2.0 * amplitude) + shape["at"]
        whole, part = np.floor(pair), pair % 1.0
        edge = 0.5 * (1.0 + shape["uneven"])
        middle = np.where(part < edge, 0.5 * edge, 0.5 * (1.0 + edge))
        return np.round(2.0 * amplitude * (whole + middle - shape["at"]), 7)


class BetweenCanAndLid(Sensing):
    """Thermometers that feel the can and the lid as well, outer ones the can, inner ones the lid."""

    name, form, fine_sensors, records = "sensor_placement", "can and lid", True, ("T_case",)
    greatest: ClassVar[float] = 1.0
    ranges = {"lid": (0.2, 1.0)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """A mix of the place with can or lid."""
        if name in _OUTER:
            return temperature + amplitude * (world.nodes["T_can"] - temperature)
        return temperature + amplitude * shape["lid"] * (world.nodes["T_lid"] - temperature)


class WarmedByTheBoard(Sensing):
    """Thermometers that the board's heat reaches along their wires."""

    name, form, fine_sensors, records = "sensor_placement", "heat along the wires", True, ("T_case",)
    greatest: ClassVar[float] = 1.0
    ranges = {"delay": (10.0, 200.0)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """A mix of the place with the can, which the board warms, a little late."""
        there = late(
            0.7 * world.nodes["T_can"] + 0.3 * world.nodes["T_board"], shape["delay"], world.sample_s
        )
        return temperature + amplitude * (there - temperature)


class SlippingSensor(Sensing):
    """An inner thermometer that sticks to its place and slips after it."""

    name, known, form, fine_sensors = "slipping_sensor", False, "stick and slip", True
    greatest: ClassVar[float] = 40.0

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """Dragged along with a play."""
        return temperature if name in _OUTER else backlash(temperature, amplitude)


class LoosenedSensor(Sensing):
    """A thermometer that comes off at one time: from there on it feels the can by a share."""

    name, known, form, fine_sensors = "loosened_sensor", False, "loose from one time on", True
    greatest: ClassVar[float] = 1.0
    ranges = {"at": (0.2, 0.7)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """A mix with the can after a share of the run."""
        if name in _OUTER:
            return temperature
        loose = world.time > shape["at"] * world.time[-1]
        return temperature + amplitude * loose * (world.nodes["T_can"] - temperature)


class JumpingSensor(Sensing):
    """A bridge that jumps between two calibrations."""

    name, known, form = "jumping_sensor", False, "jumps between two offsets"
    greatest: ClassVar[float] = 30.0
    ranges = {"period": (2000.0, 9000.0), "phase": (0.0, 1.0), "share": (0.2, 0.6)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """Another offset for a share of each period, whose length changes."""
        turn = world.time / shape["period"] * (1.0 - 0.3 * world.time / world.time[-1]) + shape["phase"]
        return temperature + amplitude * (turn % 1.0 < shape["share"])
