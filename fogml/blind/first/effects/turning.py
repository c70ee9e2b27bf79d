"""What turning shows: scale factor, dead zone, table, mount."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Demands, Distorting, ScaleFactor, Shape
from fogml.blind.frame.operators import recurrence
from fogml.blind.frame.record import EARTH_DEG_H, World


class SourceBent(ScaleFactor):
    """Wavelength of the source, a little curved over its temperature: -u (1 + bend u)."""

    name, form, unit, records = "source_wavelength", "curved", "ppm/degC", ("T_electronics",)
    demands = Demands(turns=True, power_steps=True)
    ranges = {"bend": (-1.5e-3, 1.5e-3)}
    """Curvature [1/degC]."""

    def error(self, world: World, shape: Shape) -> FloatArray:
        u = world.nodes["T_electronics"] - 25.0
        return -u * (1.0 + shape["bend"] * u)


class ModulatorLoop(ScaleFactor):
    """Half-wave voltage behind a 2 pi loop that converges hyperbolically."""

    name, form, unit, records = "halfwave_voltage", "hyperbolic convergence", "ppm/degC", ("T_electronics",)
    demands = Demands(turns=True, power_steps=True, power_on=True)
    ranges = {"residual": (0.01, 0.03), "time_constant": (1.0, 60.0)}
    """What the loop leaves, its time constant."""
    evenly = ("time_constant",)

    def error(self, world: World, shape: Shape) -> FloatArray:
        """u (1 + (1 / rho - 1) / (1 + t / tau)**3)."""
        late = np.maximum(world.time_on, 0.0) / shape["time_constant"]
        unlearned = (1.0 / shape["residual"] - 1.0) / (1.0 + late) ** 3
        return (world.nodes["T_electronics"] - 25.0) * (1.0 + unlearned)


class PowerLaw(ScaleFactor):
    """Scale factor that grows with a power of the rate: (|Omega| / 100 deg/s)**p."""

    name, form = "sf_nonlinearity", "power law"
    ranges = {"exponent": (1.0, 2.0)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        return (np.abs(world.rate_deg_h) / 360000.0) ** shape["exponent"]


class Asymmetry(ScaleFactor):
    """Scale factors of the two directions, with an algebraic transition at zero."""

    name, form, unit = "sf_asymmetry", "algebraic transition", "ppm"
    ranges = {"width": (0.3, 3.0)}
    """Width of the transition [deg/h]."""
    evenly = ("width",)

    def error(self, world: World, shape: Shape) -> FloatArray:
        """w / sqrt(w**2 + width**2)."""
        w = world.rate_deg_h
        return w / np.hypot(w, shape["width"])


class DeadZone(Distorting):
    """A soft dead zone: what it swallows is gone a little beyond it."""

    name, stage, form, unit = "deadband", "loop", "exponential knee", "deg/h"
    demands, horizontal = Demands(turns=True, small_rates=True), True
    greatest: ClassVar[float] = 20.0
    ranges = {"knee": (1.0, 2.0)}

    def distorted(self, output: FloatArray, world: World, amplitude: float, shape: Shape) -> FloatArray:
        """w (1 - exp(-|w / w_d|**(2 n))), with w_d the amplitude and n the knee."""
        return -output * np.expm1(-(np.abs(output / amplitude) ** (2.0 * shape["knee"])))


class Skew(Distorting):
    """Samples that carry the time of later ones; the skew grows, so that no one number of it compares."""

    name, stage, form = "logger_skew", "logger", "growing skew"
    greatest: ClassVar[float] = 300.0
    ranges = {"growth": (0.0, 0.3)}

    def distorted(self, output: FloatArray, world: World, amplitude: float, shape: Shape) -> FloatArray:
        """y(t - d), straight between samples."""
        delay = amplitude * (1.0 + shape["growth"] * world.time / 3600.0)
        return np.interp(world.time - delay, world.time, output)


def _pick_up(world: World, direction_deg: float) -> FloatArray:
    """Earth rate that an upright axis picks up per radian of tilt carried round by the table [deg/h]."""
    north = EARTH_DEG_H * np.cos(np.radians(world.set_up.latitude))
    return north * world.mean_cosine(1.0, -direction_deg)


class Cone(Additive):
    """An input axis that goes round on a cone, the cone a little elliptic."""

    name, stage, form, unit = "input_axis_misalignment", "rig", "elliptic cone", "mrad"
    records, demands = ("angle",), Demands(slow_turns=True)
    ranges = {"direction": (0.0, 360.0), "ellipse": (0.0, 0.1)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Pick-up per mrad, and a second harmonic."""
        north = EARTH_DEG_H * np.cos(np.radians(world.set_up.latitude))
        second = shape["ellipse"] * world.mean_cosine(2.0, -2.0 * shape["direction"])
        return np.asarray(1e-3 * (_pick_up(world, shape["direction"]) + north * second))


class UnevenTable(Additive):
    """A table that turns unevenly, with a harmonic of the harmonic."""

    name, stage, form, unit = "table_rate_error", "rig", "two harmonics", "ppm"
    records, demands = ("angle",), Demands(slow_turns=True)

    def draw(self, rng: np.random.Generator) -> Shape:
        """Periods a turn, phase, share of twice the harmonic."""
        harmonic = float(rng.choice([1, 2, 3, 4, 6, 8, 12]))
        return {"harmonic": harmonic, "phase": rng.uniform(0.0, 360.0), "second": rng.uniform(0.0, 0.2)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """rate (cos(k angle + phase) + share cos(2 k angle + phase))."""
        k, phase = shape["harmonic"], -shape["phase"]
        uneven = world.mean_cosine(k, phase) + shape["second"] * world.mean_cosine(2.0 * k, phase)
        return np.asarray(3600e-6 * world.table_rate * uneven)


class SettlingTable(Additive):
    """A table whose servo settles slowly after each change of its rate."""

    name, known, stage, form = "settling_table", False, "rig", "slow settling after edges"
    demands = Demands(turns=True)
    ranges = {"time_constant": (40.0, 150.0)}
    """Time constant [s]."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Relaxing sum of the rate's changes, in ppm of them."""
        change = np.diff(world.table_rate, prepend=0.0)
        decay = np.full(len(change), world.sample_s / shape["time_constant"])
        return 3600e-6 * recurrence(decay, -change, 0.0)


class HuntingServo(Additive):
    """A servo that hunts while the table turns: a slow oscillation, its size by the root of the rate."""

    name, known, stage, form = "hunting_servo", False, "rig", "oscillation while turning"
    demands = Demands(slow_turns=True)
    ranges = {"period": (150.0, 900.0), "phase": (0.0, 2.0 * np.pi)}
    """Period [s] and phase."""
    evenly = ("period",)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """sqrt(|rate| / 0.1 deg/s) sin(2 pi t / period)."""
        size = np.sqrt(np.minimum(np.abs(world.table_rate), 1.0) / 0.1)
        return size * np.sin(2.0 * np.pi * world.time / shape["period"] + shape["phase"])
