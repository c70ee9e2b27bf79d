"""What shows where the gyro or the table turns; what thermometers feel."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import OUTER, Additive, Demands, Distorting, ScaleFactor, Sensing, Shape
from fogml.blind.frame.operators import backlash, late, slab_lag
from fogml.blind.frame.record import EARTH_DEG_H, World


class SourceOwnHeat(ScaleFactor):
    """Wavelength of a source that follows its own chip, not the board: -u (1 + bend u) of the source."""

    name, form, records = "source_wavelength", "the chip's temperature", ("T_electronics",)
    demands = Demands(turns=True, power_steps=True)
    ranges = {"bend": (-3e-3, 3e-3)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        u = world.nodes["T_source"] - 25.0
        return -u * (1.0 + shape["bend"] * u)


class ModulatorBehind(ScaleFactor):
    """Half-wave voltage of the chip on the optics, behind a loop that learns slowly."""

    name, form, records = "halfwave_voltage", "the optics, behind a loop", ("T_electronics",)
    demands = Demands(turns=True, power_steps=True, power_on=True)
    ranges = {"learns": (200.0, 1500.0), "left": (0.1, 0.6)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        """What the loop has not yet followed, and a share that it never does."""
        u = world.nodes["T_optics"] - 25.0
        return u - (1.0 - shape["left"]) * late(u, shape["learns"], world.sample_s)


class SineResidual(ScaleFactor):
    """The sine of an open-loop rest, and closed-loop steps of the ramp."""

    name, form = "sf_nonlinearity", "sine and ripple"
    ranges = {"full": (120.0, 400.0), "ripple": (0.0, 0.3), "step": (7.0, 40.0), "phase": (0.0, 6.28)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        """1 - sinc(rate / full) and a ripple over the rate."""
        rate = np.abs(world.rate_deg_h) / 3600.0
        ripple = shape["ripple"] * np.sin(2.0 * np.pi * rate / shape["step"] + shape["phase"])
        return (1.0 - np.sinc(rate / shape["full"])) * 6.0 + 0.1 * ripple


class CubicRoot(ScaleFactor):
    """A rest that grows with the root of the rate: (|Omega| / 100 deg/s)**p."""

    name, form = "sf_nonlinearity", "root of the rate"
    ranges = {"exponent": (0.3, 0.8)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        return (np.abs(world.rate_deg_h) / 360000.0) ** shape["exponent"]


class AsymmetryWithRate(ScaleFactor):
    """The two directions differ, at high rates by less: sgn(rate) / (1 + |rate| / fades)."""

    name, form = "sf_asymmetry", "fading with the rate"
    ranges = {"fades": (30.0, 300.0)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        rate = world.rate_deg_h / 3600.0
        return np.tanh(rate / 1e-4) / (1.0 + np.abs(rate) / shape["fades"])


class LockIn(Distorting):
    """A zone in which two waves lock: nothing within it, and the root of the squares' difference beyond."""

    name, stage, form, unit = "deadband", "loop", "lock-in", "deg/h"
    demands, horizontal = Demands(turns=True, small_rates=True), True
    greatest: ClassVar[float] = 20.0

    def distorted(self, output: FloatArray, world: World, amplitude: float, shape: Shape) -> FloatArray:
        """sgn(w) sqrt(w**2 - w_d**2) beyond w_d."""
        return np.sign(output) * np.sqrt(np.maximum(output**2 - amplitude**2, 0.0))


class BufferSkew(Distorting):
    """A logger that stamps by blocks: the delay grows through a block, and blocks come later and later."""

    name, stage, form = "logger_skew", "logger", "blocks"
    greatest: ClassVar[float] = 300.0
    ranges = {"block": (200.0, 1800.0), "saw": (0.0, 0.8)}

    def distorted(self, output: FloatArray, world: World, amplitude: float, shape: Shape) -> FloatArray:
        """y(t - d), d a share of a saw-tooth and the rest held."""
        saw = (world.time / shape["block"]) % 1.0
        delay = amplitude * (1.0 - shape["saw"] + 2.0 * shape["saw"] * saw)
        return np.interp(world.time - delay, world.time, output)


class Wobble(Additive):
    """An axis that is off, on a bearing that wobbles twice a turn."""

    name, stage, form, unit = "input_axis_misalignment", "rig", "with a wobble", "mrad"
    records, demands = ("angle",), Demands(slow_turns=True)
    ranges = {"direction": (0.0, 360.0), "wobble": (0.0, 0.3), "at": (0.0, 360.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Earth's horizontal rate picked up per mrad."""
        north = 1e-3 * EARTH_DEG_H * np.cos(np.radians(world.set_up.latitude))
        once = world.mean_cosine(1.0, -shape["direction"])
        return north * (once + shape["wobble"] * world.mean_cosine(2.0, shape["at"]))


class MotorPoles(Additive):
    """A motor whose poles pull: a triangle over the angle."""

    name, stage, form = "table_rate_error", "rig", "triangle over the angle"
    records, demands = ("angle",), Demands(slow_turns=True)

    def draw(self, rng: np.random.Generator) -> Shape:
        """Poles and phase."""
        return {"poles": float(rng.choice([1, 2, 3, 4, 6])), "phase": float(rng.uniform(0.0, 360.0))}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """rate times the triangle's first three odd harmonics."""
        pull = sum(
            (world.mean_cosine(k * shape["poles"], k * shape["phase"]) / k**2 for k in (1.0, 3.0, 5.0)),
            np.zeros_like(world.time),
        )
        return 3600e-6 * world.table_rate * pull


class LagThroughGlue(Sensing):
    """A thermometer behind a bed of glue: heat creeps through it, on one face more slowly."""

    name, form, unit, fine_sensors = "sensor_lag", "diffusion through glue", "", True
    greatest: ClassVar[float] = 2000.0
    ranges = {"outer": (0.4, 1.6)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """The far face of a slab whose L^2 / D is twice the amplitude."""
        tau = 2.0 * amplitude * (shape["outer"] if name in OUTER else 1.0)
        return slab_lag(world.time, temperature, max(tau, 1e-3), modes=8)


class LagOneFace(Sensing):
    """Only the inner face's thermometers have come loose: one lag."""

    name, form, fine_sensors = "sensor_lag", "inner face alone", True
    greatest: ClassVar[float] = 2000.0

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        return temperature if name in OUTER else late(temperature, amplitude, world.sample_s)


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
        if name in OUTER:
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
    """An inner thermometer that sticks to its place and slips after it: dragged along with a play."""

    name, known, form, fine_sensors = "slipping_sensor", False, "stick and slip", True
    greatest: ClassVar[float] = 40.0

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        return temperature if name in OUTER else backlash(temperature, amplitude)


class LoosenedSensor(Sensing):
    """A thermometer that comes off at one time: from there on it feels the can by a share."""

    name, known, form, fine_sensors = "loosened_sensor", False, "loose from one time on", True
    greatest: ClassVar[float] = 1.0
    ranges = {"at": (0.2, 0.7)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """A mix with the can after a share of the run."""
        if name in OUTER:
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
