"""Thermometers that go wrong in ways that no library holds."""

from __future__ import annotations

from typing import ClassVar

from fogml.blind.frame.form import Sensing, Shape
from fogml.blind.frame.record import FloatArray, World
from fogml.blind.second.memory import backlash

_OUTER = ("T_out", "T2", "T4")


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


FORMS = (SlippingSensor, LoosenedSensor, JumpingSensor)
