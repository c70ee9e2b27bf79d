"""Effects that no library holds, of different kinds: in time, temperature, memory, noise.

None is a relative of an effect of the catalogue: the best signature of each entry stays under a
cosine of 0.95 after projection of the nominal constants, which a test holds.
"""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Shape
from fogml.blind.frame.operators import play, recurrence
from fogml.blind.frame.record import World


class ModeHops(Additive):
    """The source hops between two modes at random times: a telegraph signal."""

    name, known, stage, form = "mode_hops", False, "noise", "random telegraph signal"
    ranges = {"dwell": (1500.0, 5000.0)}
    """Mean dwell [s]."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """-1 or 1."""
        hops = rng.random(len(world.time)) < world.sample_s / shape["dwell"]
        other = (np.cumsum(hops) + int(rng.random() < 0.5)) % 2
        return np.where(other == 1, -1.0, 1.0)


class IntegratorResets(Additive):
    """An integrator that winds up and is reset: a saw-tooth in time."""

    name, known, stage, form = "integrator_resets", False, "loop", "saw-tooth in time"
    ranges = {"period": (2000.0, 6000.0), "phase": (0.0, 1.0), "growth": (0.0, 0.05)}
    """Period [s], phase, growth of the period per hour."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """2 frac(t / period) - 1."""
        hours = world.time / 3600.0
        turn = world.time / shape["period"] * (1.0 - 0.5 * shape["growth"] * hours) + shape["phase"]
        return 2.0 * (turn % 1.0) - 1.0


class SweptBeat(Additive):
    """A beat between two oscillators that drift apart: a line whose frequency sweeps."""

    name, known, stage, form = "swept_beat", False, "readout", "swept line in time"
    ranges = {"period": (4000.0, 9000.0), "growth": (4.0, 10.0), "phase": (0.0, 2.0 * np.pi)}
    """First period [s], how many times faster at 8 h, phase."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """sin of a quadratic phase."""
        t = world.time
        turn = t / shape["period"] * (1.0 + 0.5 * (shape["growth"] - 1.0) * t / 28800.0)
        return np.sin(2.0 * np.pi * turn + shape["phase"])


class ColdRatchet(Additive):
    """A clamp that gives way a little further with each new coldest temperature, and stays."""

    name, known, form = "cold_ratchet", False, "depends on the coldest temperature so far"
    ranges = {"onset": (-5.0, 15.0)}
    """Where it begins to give way [degC]."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """How far below the onset it ever was [degC]."""
        coldest = np.minimum.accumulate(world.nodes["T_coil"])
        return np.maximum(shape["onset"] - coldest, 0.0)


class FreezeLatch(Additive):
    """Grease that freezes below one temperature and thaws only far above it: one wide relay."""

    name, known, form = "freeze_latch", False, "one wide relay"
    ranges = {"freezes": (-12.0, 5.0), "thaws": (28.0, 42.0)}
    """Where it freezes and thaws [degC]."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """1 while frozen."""
        temperature = world.nodes["T_coil"]
        crossing = np.where(temperature < shape["freezes"], 1, np.where(temperature > shape["thaws"], -1, 0))
        last = np.maximum.accumulate(np.where(crossing != 0, np.arange(len(crossing)), -1))
        return np.where(last >= 0, crossing[last] > 0, False).astype(np.float64)


class Echo(Additive):
    """Heat that comes back an hour later from a place far away."""

    name, known, stage, form = "thermal_echo", False, "thermal", "delayed rate of temperature"
    ranges = {"delay": (2700.0, 6000.0)}
    """Delay [s]."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """The case's rate of temperature a delay ago."""
        rate = world.rates["T_case"]
        return np.interp(world.time - shape["delay"], world.time, rate, left=0.0)


class ReversalCount(Additive):
    """Fatigue: each reversal of temperature adds a step that heals slowly."""

    name, known, form = "reversal_count", False, "steps at reversals"
    ranges = {"healing": (4000.0, 20000.0)}
    """Healing time [s]."""
    evenly = ("healing",)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """A step of 1 at each reversal of more than 5 degC."""
        temperature = world.nodes["T_coil"]
        followed = play(temperature, np.array([2.5]))[0]
        moving = np.sign(np.diff(followed, prepend=followed[:1]))
        last = np.maximum.accumulate(np.where(moving != 0.0, np.arange(len(moving)), 0))
        direction = moving[last]
        steps = np.abs(np.diff(direction, prepend=direction[:1])) / 2.0
        return recurrence(np.full(len(steps), world.sample_s / shape["healing"]), steps, 0.0)


class NarrowResonance(Additive):
    """A mechanical resonance met at one temperature: a dispersion curve a few degrees wide."""

    name, known, form = "narrow_resonance", False, "dispersion curve over temperature"
    ranges = {"temperature": (0.0, 45.0), "width": (1.5, 4.0)}
    """Where and how wide [degC]."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """2 x / (1 + x**2)."""
        x = (world.nodes["T_coil"] - shape["temperature"]) / shape["width"]
        return 2.0 * x / (1.0 + x * x)


class TemperatureStairs(Additive):
    """A correction table in the gyro with steps in temperature: a saw-tooth over it."""

    name, known, stage, form = "temperature_stairs", False, "readout", "saw-tooth over temperature"
    ranges = {"step": (8.0, 25.0), "offset": (0.0, 1.0)}
    """Step and where it lies [degC]."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """2 frac(T / step) - 1."""
        return 2.0 * ((world.nodes["T_in"] / shape["step"] + shape["offset"]) % 1.0) - 1.0


class DryFriction(Additive):
    """Dry friction in the mount: a bias that knows only the sign of the temperature's rate."""

    name, known, form = "dry_friction", False, "sign of the rate of temperature"
    ranges = {"onset": (0.01, 0.04)}
    """Rate at which it sets in [degC/min]."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """rate / sqrt(rate**2 + onset**2)."""
        rate = world.rates["T_coil"]
        return rate / np.hypot(rate, shape["onset"])


class HotBursts(Additive):
    """Partial discharges: bursts of noise within a window of temperature."""

    name, known, stage, form = "bursts_when_hot", False, "noise", "noise in a window of temperature"
    ranges = {"from": (30.0, 45.0), "correlation": (30.0, 200.0)}
    """From where [degC], correlation time of a burst [s]."""
    evenly = ("correlation",)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Correlated noise of unit variance while hot."""
        n = len(world.time)
        ratio = world.sample_s / shape["correlation"]
        drive = np.sqrt(-np.expm1(-2.0 * ratio)) * rng.standard_normal(n)
        noise = recurrence(np.full(n, ratio), drive, float(rng.standard_normal()))
        return noise * (world.nodes["T_case"] > shape["from"])
