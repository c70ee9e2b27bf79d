"""Bias that electronics, supply, chamber machines and fields drive; static bias over temperature."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Demands, Shape
from fogml.blind.frame.operators import lag
from fogml.blind.frame.record import World


class PolarisationChirped(Additive):
    """A beat over the electronics' temperature whose period drifts over it."""

    name, form, unit = "polarization_nonreciprocity", "beat with a drifting period", "deg/h"
    records = ("T_electronics",)
    ranges = {"period": (2.0, 15.0), "phase": (0.0, 360.0), "drift": (-2e-4, 2e-4)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """sin(2 pi u (1 + drift u) / period + phase)."""
        u = world.nodes["T_electronics"] - 25.0
        turns = u * (1.0 + shape["drift"] * u) / shape["period"]
        return np.sin(2.0 * np.pi * turns + np.radians(shape["phase"]))


class BiasCurve(Additive):
    """Static bias of third to sixth order: v**3 + r4 v**4 + r5 v**5 + r6 v**6 with v = u / 50."""

    name, form, unit = "bias_polynomial", "orders three to six", "deg/h"
    ranges = {"quartic_ratio": (-1.0, 1.0), "quintic_ratio": (-1.0, 1.0), "sixth_ratio": (-0.1, 0.1)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        v = (world.nodes["T_in"] - 25.0) / 50.0
        higher = shape["quartic_ratio"] + v * (shape["quintic_ratio"] + v * shape["sixth_ratio"])
        return np.asarray(v**3 * (1.0 + v * higher))


class MachinePickup(Additive):
    """Pick-up of heater and compressor, a little bent over their duty and a little late."""

    name, form, unit = "chamber_pickup", "bent over the duty", "deg/h"
    records = ("heater", "compressor")
    ranges = {"exponent": (0.95, 1.05), "delay": (0.5, 3.0)}
    """Exponent over the duty, delay [s]."""
    evenly = ("delay",)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """heater**p + compressor, lagged."""
        duty = world.drives["heater"] ** shape["exponent"] + world.drives["compressor"]
        return lag(world.sample_s, duty, shape["delay"])


class FieldBent(Additive):
    """Sensitivity to a field behind a shield that saturates a little."""

    name, form, unit = "magnetic", "shield that saturates", "deg/h/G"
    records = ("B_x", "B_y", "B_z")
    demands = Demands(slow_turns=True)
    ranges = {"phase": (0.0, 360.0), "axial_ratio": (0.1, 0.5), "bend": (0.0, 0.05)}
    """Direction, ratio of the axial part, bend of the shield over the field."""
    evenly = ("axial_ratio",)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """B / (1 - bend B / 50 uT) of the field along the sensitive direction [G]."""
        psi = np.radians(shape["phase"])
        d = world.drives
        along = np.cos(psi) * d["B_x"] + np.sin(psi) * d["B_y"] + shape["axial_ratio"] * d["B_z"]
        return along * (1.0 + shape["bend"] * np.abs(along) / 50.0) / 100.0


class SupplyTriangle(Additive):
    """Supply voltage and a ripple of triangular form: V - V_0 + a triangle(t)."""

    name, form, unit = "supply_ripple", "triangular ripple", "deg/h/V"
    records = ("supply",)
    demands = Demands(power_steps=True)
    ranges = {"ripple": (0.05, 0.5), "alias_frequency": (1e-4, 1e-2), "phase": (0.0, 360.0)}
    """Size of the ripple, its alias, its phase."""
    evenly = ("ripple",)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        turn = shape["alias_frequency"] * world.time + shape["phase"] / 360.0
        wave = 2.0 * np.arcsin(np.sin(2.0 * np.pi * turn)) / np.pi
        supply = world.drives["supply"]
        return np.asarray(supply - supply[0] + shape["ripple"] * wave)


class Crosstalk(Additive):
    """Cross-talk that grows with the electronics' temperature, a little more when hot."""

    name, form, unit = "electronic_crosstalk", "bent over temperature", "deg/h/degC"
    records = ("T_electronics", "supply")
    demands = Demands(power_steps=True)
    ranges = {"supply_ratio": (-20.0, 20.0), "bend": (-1e-3, 1e-3)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """u (1 + bend u) + ratio (V - V_0)."""
        u = world.nodes["T_electronics"] - 25.0
        supply = world.drives["supply"]
        return np.asarray(u * (1.0 + shape["bend"] * u) + shape["supply_ratio"] * (supply - supply[0]))


class TurnOn(Additive):
    """Another bias after each power-on, from Student's distribution: a constant of this run."""

    name, form, several_runs = "turn_on_bias", "Student's distribution", True
    drawn_per_run = True
    demands = Demands(power_on=True)
    ranges = {"freedom": (4.0, 10.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        return np.full(len(world.time), rng.standard_t(shape["freedom"]))


class Rectification(Additive):
    """Vibration rectified by a power near two: (g / 0.1)**p * 0.01, which is g**2 at 0.1 g."""

    name, form, unit, records = "vibration_rectification", "power near two", "deg/h/g2", ("vibration",)
    largest = 5.0
    ranges = {"exponent": (1.8, 2.2)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        return 0.01 * (world.drives["vibration"] / 0.1) ** shape["exponent"]


class DriftBent(Additive):
    """A steady drift: hours since the first sample."""

    name, stage, form, unit = "rate_ramp", "noise", "line", "deg/h/h"

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        return world.time / 3600.0


class WanderingLine(Additive):
    """A line whose phase wanders a little."""

    name, stage, form, unit = "sinusoidal", "noise", "line of wandering phase", "deg/h"
    drawn_per_run = True
    ranges = {"frequency": (1e-3, 2e-2), "wander": (0.0, 0.2)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """sin(2 pi f t + phase + random walk of `wander` rad per sqrt(h))."""
        steps = rng.standard_normal(len(world.time)) * np.sqrt(world.sample_s / 3600.0)
        phase = 2.0 * np.pi * rng.random() + shape["wander"] * np.cumsum(steps)
        return np.sin(2.0 * np.pi * shape["frequency"] * world.time + phase)
