"""Bias that optics, electronics, supply, machines and fields drive; static bias over temperature."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Demands, Shape
from fogml.blind.frame.operators import late, preisach
from fogml.blind.frame.record import World


class PolarisationBeats(Additive):
    """One or two beats over the optics' temperature, which nobody records: sum of the sines."""

    name, form = "polarization_nonreciprocity", "one or two periods on the optics"

    def draw(self, rng: np.random.Generator) -> Shape:
        """Periods [degC], phases, share of the second one."""
        first = float(np.exp(rng.uniform(np.log(3.0), np.log(16.0))))
        second = float(first * rng.uniform(1.2, 2.6))
        share = float(rng.uniform(0.3, 1.0)) if rng.random() < 0.5 else 0.0
        phases = rng.uniform(0.0, 2.0 * np.pi, 2).tolist()
        return {"period": first, "second_period": second, "share": share, "a": phases[0], "b": phases[1]}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        turn = 2.0 * np.pi * (world.nodes["T_optics"] - 25.0)
        first = np.sin(turn / shape["period"] + shape["a"])
        return first + shape["share"] * np.sin(turn / shape["second_period"] + shape["b"])


class PolarisationFading(Additive):
    """A beat under the source's coherence: it is there about one temperature and fades away from it."""

    name, form = "polarization_nonreciprocity", "beat that fades"
    ranges = {"period": (3.0, 14.0), "phase": (0.0, 6.28), "about": (-5.0, 45.0), "reach": (18.0, 50.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """exp(-((T - T_0) / reach)**2) sin(2 pi T / period + phase)."""
        optics = world.nodes["T_optics"]
        there = np.exp(-(((optics - shape["about"]) / shape["reach"]) ** 2))
        return there * np.sin(2.0 * np.pi * optics / shape["period"] + shape["phase"])


class SmoothBias(Additive):
    """A static bias that is any smooth function of temperature: sum of the waves."""

    name, form = "bias_polynomial", "random smooth function"

    def draw(self, rng: np.random.Generator) -> Shape:
        """A length [degC] and twelve waves of a Gaussian process of it."""
        length = float(rng.uniform(14.0, 40.0))
        found: Shape = {}
        for k in range(12):
            found |= {f"wave_{k}": float(rng.standard_normal() / length)}
            found |= {f"phase_{k}": float(rng.uniform(0.0, 2.0 * np.pi))}
        return found

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        u = world.nodes["T_coil"] - 15.0
        return sum(
            (np.cos(shape[f"wave_{k}"] * u + shape[f"phase_{k}"]) for k in range(12)), np.zeros_like(u)
        )


class KneeBias(Additive):
    """A static bias with a knee: another slope on either side of one temperature."""

    name, form = "bias_polynomial", "knee"
    ranges = {"knee": (-15.0, 50.0), "width": (2.0, 9.0), "curve": (-0.02, 0.02)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """w log(1 + exp((T - T_0) / w)) and a cubic part."""
        d = world.nodes["T_in"] - shape["knee"]
        return shape["width"] * np.logaddexp(0.0, d / shape["width"]) + shape["curve"] * d**3 / 500.0


class ThermostatPickup(Additive):
    """Pick-up of the compressor that the thermostat switches, a little late; its duty varies."""

    name, form = "chamber_pickup", "a thermostat's compressor"
    ranges = {"late": (2.0, 90.0), "heater": (-0.5, 0.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Lagged compressor and a share of the heater."""
        machines = world.drives["compressor"] + shape["heater"] * world.drives["heater"]
        return late(machines, shape["late"], world.sample_s)


class ContactorPickup(Additive):
    """A current's inrush: each start of the compressor adds a pulse that dies away."""

    name, form, records = "chamber_pickup", "inrush at each start", ("compressor", "heater")
    ranges = {"decay": (40.0, 300.0), "held": (0.1, 0.8)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Pulses, and a share while it runs."""
        running = world.drives["compressor"]
        started = np.maximum(np.diff(running, prepend=running[0]), 0.0)
        pulses = late(started, shape["decay"], world.sample_s) * shape["decay"] / world.sample_s
        return pulses + shape["held"] * running


class FieldRemanent(Additive):
    """A shield that keeps some of the field it saw last."""

    name, form, records = "magnetic", "shield with remanence", ("B_x", "B_y", "B_z")
    demands = Demands(slow_turns=True)
    ranges = {"direction": (0.0, 360.0), "axial": (0.1, 0.5), "kept": (0.1, 0.5), "coercive": (3.0, 15.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Field along the sensitive direction [G], and relays of it."""
        psi, d = np.radians(shape["direction"]), world.drives
        along = np.cos(psi) * d["B_x"] + np.sin(psi) * d["B_y"] + shape["axial"] * d["B_z"]
        centres = along.mean() + np.linspace(-15.0, 15.0, 9)
        kept = preisach(along, centres, np.full(9, shape["coercive"]), np.full(9, 1.0 / 9.0))
        return along / 100.0 + shape["kept"] * 0.15 * kept


class SupplySaturating(Additive):
    """A regulator that gives way below its margin, and a ripple whose alias wanders."""

    name, form, records, demands = "supply_ripple", "soft regulator", ("supply",), Demands(power_steps=True)
    ranges = {"margin": (0.2, 1.0), "ripple": (0.02, 0.3), "frequency": (2e-4, 6e-3), "wander": (0.0, 0.3)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """tanh of the supply's departure over its margin, and the line."""
        supply = world.drives["supply"]
        given = shape["margin"] * np.tanh((supply - supply[0]) / shape["margin"])
        hours = world.time / 3600.0
        turn = shape["frequency"] * world.time * (1.0 + shape["wander"] * hours / 8.0)
        return given + shape["ripple"] * np.sin(2.0 * np.pi * turn)


class CrosstalkOfBoard(Additive):
    """Cross-talk by a thermistor's law of the board, and by what the supply gives."""

    name, form, records = "electronic_crosstalk", "thermistor's law", ("T_electronics", "supply")
    demands = Demands(power_steps=True)
    ranges = {"scale": (25.0, 80.0), "supply": (-15.0, 15.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """s (exp(u / s) - 1) and a part of the supply."""
        u, supply = world.nodes["T_board"] - 25.0, world.drives["supply"]
        bent = shape["scale"] * np.expm1(u / shape["scale"])
        return bent + shape["supply"] * (supply - supply[0])


class RattleThreshold(Additive):
    """Something that rattles above a level of vibration: (g - g_0)**p of what exceeds it, scaled at 0.1 g."""

    name, form, records = "vibration_rectification", "above a threshold", ("vibration",)
    largest = 20.0
    ranges = {"threshold": (0.0, 0.03), "exponent": (1.3, 2.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        above = np.maximum(world.drives["vibration"] - shape["threshold"], 0.0)
        return 0.01 * (above / 0.1) ** shape["exponent"]


class DriftThatTires(Additive):
    """A drift that slows down over the run: tau (1 - exp(-t / tau)) in hours."""

    name, stage, form = "rate_ramp", "noise", "saturating line"
    ranges = {"tires": (25000.0, 200000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        tau = shape["tires"] / 3600.0
        return -tau * np.expm1(-world.time / shape["tires"])


class LineWithOvertone(Additive):
    """A line in time with an overtone: sin and a share of sin of twice."""

    name, stage, form = "sinusoidal", "noise", "line with an overtone"
    ranges = {"period": (200.0, 950.0), "phase": (0.0, 6.28), "second": (0.0, 0.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        turn = 2.0 * np.pi * world.time / shape["period"] + shape["phase"]
        return np.sin(turn) + shape["second"] * np.sin(2.0 * turn)
