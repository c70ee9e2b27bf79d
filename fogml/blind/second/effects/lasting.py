"""Effects that remember: loops, fading strain, hidden masses, water, age."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Demands, ScaleFactor, Shape
from fogml.blind.frame.operators import bouc_wen_general, faded, late, maxwell_slip, preisach, slab_lag
from fogml.blind.frame.record import World

_CLUSTER = 12


def _clusters(rng: np.random.Generator) -> Shape:
    """Grains that switch together: where each lies in Preisach's plane, how large and spread out it is."""
    count = int(rng.integers(3, 10))
    found: Shape = {"grains": float(count)}
    # Wider loops the hotter (or the colder) it is.
    lean, typical = rng.uniform(-0.02, 0.02), float(np.exp(rng.uniform(np.log(3.0), np.log(16.0))))
    for k in range(count):
        centre = float(rng.uniform(-30.0, 60.0))
        half = float(typical * np.exp(lean * (centre - 15.0) + 0.4 * rng.standard_normal()))
        found |= {f"centre_{k}": centre, f"half_width_{k}": half, f"weight_{k}": float(rng.exponential())}
        found[f"spread_{k}"] = float(rng.uniform(1.0, 8.0))
    return found


def _grains(winding: FloatArray, shape: Shape, past: tuple[float, ...]) -> FloatArray:
    """The loops of all grains, from -1 to 1; shape (n,)."""
    x = np.linspace(-1.8, 1.8, _CLUSTER)
    bell = np.exp(-0.5 * x * x)
    total, weights = np.zeros_like(winding), 0.0
    for k in range(int(shape["grains"])):
        weight = shape[f"weight_{k}"]
        centres = shape[f"centre_{k}"] + shape[f"spread_{k}"] * x
        # The outer ones of a grain are harder to turn.
        half = shape[f"half_width_{k}"] * (1.0 + 0.15 * x * x)
        total += preisach(winding, centres, half, weight * bell / bell.sum(), past)
        weights += weight
    return total / weights


class LoopOfGrains(Additive):
    """Preisach's hysteresis whose density depends on the centre, in grains: the relays' weighted sum."""

    name, form = "thermal_hysteresis", "Preisach in grains"

    def draw(self, rng: np.random.Generator) -> Shape:
        """The grains."""
        return _clusters(rng)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        return _grains(world.nodes["T_coil"], shape, world.past)


class LoopOfSlips(Additive):
    """Springs that slip, at less stretch the hotter they are."""

    name, form = "thermal_hysteresis", "Maxwell slip that softens"
    ranges = {"reach": (3.0, 25.0), "shape": (0.8, 3.0), "softening": (30.0, 150.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Force of ten springs, reaches by Weibull's law."""
        level = (np.arange(10) + 0.5) / 10.0
        reaches = shape["reach"] * (-np.log(1.0 - level)) ** (1.0 / shape["shape"])

        def reach(temperature: float) -> FloatArray:
            return reaches * np.exp((25.0 - temperature) / shape["softening"])

        return -maxwell_slip(world.nodes["T_coil"], np.full(10, 0.1 / shape["reach"]), reach, world.past)


class LoopOfBoucWen(Additive):
    """Bouc and Wen's equation with any exponent, unloading unlike loading."""

    name, form = "thermal_hysteresis", "Bouc-Wen of any exponent"
    ranges = {"length": (2.0, 18.0), "exponent": (0.7, 3.0), "asymmetry": (0.55, 0.95)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """-z over the can's side of the winding."""
        length, exponent, asymmetry = shape["length"], shape["exponent"], shape["asymmetry"]
        return -bouc_wen_general(world.nodes["T_out"], length, exponent, asymmetry, world.past)


class ScaleLoopOfGrains(ScaleFactor):
    """Preisach's hysteresis of the scale factor, in grains: the relays' weighted sum."""

    name, form = "sf_hysteresis", "Preisach in grains"

    def draw(self, rng: np.random.Generator) -> Shape:
        """The grains."""
        return _clusters(rng)

    def error(self, world: World, shape: Shape) -> FloatArray:
        return _grains(world.nodes["T_coil"], shape, world.past)


class ScaleLoopOfSlips(ScaleFactor):
    """Slipping springs in the scale factor: force of springs whose reaches are evenly spread."""

    name, form = "sf_hysteresis", "Maxwell slip"
    ranges = {"reach": (4.0, 25.0)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        reaches = shape["reach"] * np.linspace(0.2, 1.8, 8)
        return -maxwell_slip(world.nodes["T_coil"], np.full(8, 0.125), lambda _: reaches, world.past)


def _hastened(temperature: FloatArray, per_ten: float) -> FloatArray:
    return np.exp(per_ten * np.clip(temperature - 25.0, -70.0, 60.0) / 10.0)


class StressStretched(Additive):
    """Strain that fades as a stretched exponential in the material's own time."""

    name, form = "stress_relaxation", "stretched exponential"
    ranges = {"time_constant": (900.0, 15000.0), "exponent": (0.35, 0.75), "per_ten": (0.3, 0.9)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Kohlrausch's kernel over each change of temperature."""
        tau, beta, winding = shape["time_constant"], shape["exponent"], world.nodes["T_coil"]
        quick = _hastened(winding, shape["per_ten"])
        return faded(world.time, winding, lambda t: np.exp(-((t / tau) ** beta)), quick)


class StressPower(Additive):
    """Strain that fades as a power of time: (1 + t / tau)**-p over each change of temperature."""

    name, form = "stress_relaxation", "power law"
    ranges = {"time_constant": (200.0, 4000.0), "exponent": (0.3, 1.2), "per_ten": (0.2, 0.8)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        tau, power, winding = shape["time_constant"], shape["exponent"], world.nodes["T_coil"]
        quick = _hastened(winding, shape["per_ten"])
        return faded(world.time, winding, lambda t: (1.0 + t / tau) ** -power, quick)


class HiddenBase(Additive):
    """The unit's own base, which no sensor sits on, against the winding."""

    name, stage, form, records = "hidden_thermal_node", "thermal", "the base", ("T_chamber",)
    ranges = {"lid_share": (0.0, 0.3)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Base and some of the lid less winding."""
        share = shape["lid_share"]
        there = (1.0 - share) * world.nodes["T_base"] + share * world.nodes["T_lid"]
        return there - world.nodes["T_coil"]


class HiddenSlab(Additive):
    """The far side of a thick slab in the chamber's air: far face less winding."""

    name, stage, form, records = "hidden_thermal_node", "thermal", "a slab", ("T_chamber",)
    ranges = {"time_constant": (3000.0, 12000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        far = slab_lag(world.time, world.nodes["T_chamber"], shape["time_constant"])
        return far - world.nodes["T_coil"]


class AnotherOrder(Additive):
    """A winding whose bias follows a place behind three unequal masses of its own."""

    name, known, stage = "wrong_thermal_structure", False, "thermal"
    form, records = "three masses behind can and base", ("T_chamber",)
    ranges = {"first": (300.0, 1500.0), "second": (800.0, 3000.0), "base_share": (0.1, 0.9)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Lagged mix of can and base less winding."""
        share = shape["base_share"]
        there = share * world.nodes["T_base"] + (1.0 - share) * world.nodes["T_can"]
        for key in ("first", "second"):
            there = late(there, shape[key], world.sample_s)
        return there - world.nodes["T_coil"]


class WaterOfTwoStages(Additive):
    """Water that is taken up fast at the surface and slowly inside, faster when warm; swelling saturates."""

    name, form, records = "moisture", "two stages, by temperature", ("humidity",)
    ranges = {"fast": (4000.0, 20000.0), "slow": (40000.0, 300000.0), "held": (0.0, 0.02)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Rate of uptake [%/h] and a part of what is held."""
        air, quick = world.drives["humidity"], _hastened(world.nodes["T_coil"], 0.4)
        fast = faded(world.time, air, lambda t: 1.0 - np.exp(-t / shape["fast"]), quick) + air[0]
        slow = faded(world.time, air, lambda t: 1.0 - np.exp(-t / shape["slow"]), quick) + air[0]
        uptake = 3600.0 * np.gradient(0.5 * fast + 0.5 * slow, world.sample_s)
        return uptake + shape["held"] * 100.0 * np.tanh((slow - 40.0) / 40.0)


class AgeingOfDays(Additive):
    """Ageing by the logarithm of the time since the first run, days between included: log(1 + t / tau)."""

    name, form, several_runs = "ageing", "logarithm of days", False
    ranges = {"time_constant": (1800.0, 200000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        return np.log1p((world.since_first + world.time) / shape["time_constant"])


class AgeingOfHeat(Additive):
    """Ageing by a power of time spent, where heat counts for more: (t_0 + own time)**p, scaled to hours."""

    name, form = "ageing", "power of hot time"
    ranges = {"exponent": (0.3, 0.8), "per_ten": (0.1, 0.5), "before": (1000.0, 20000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        spent = np.cumsum(_hastened(world.nodes["T_coil"], shape["per_ten"])) * world.sample_s
        return ((shape["before"] + world.since_first + spent) / 3600.0) ** shape["exponent"]


class TurnOnOfTwo(Additive):
    """The modulator comes up in one of two states, and never quite in the same place."""

    name, form, several_runs, drawn_per_run = "turn_on_bias", "one of two states", True, True
    demands = Demands(power_on=True)
    ranges = {"scatter": (0.1, 0.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """A constant of this run."""
        state = float(rng.choice([-1.0, 1.0]) + shape["scatter"] * rng.standard_normal())
        return np.full(len(world.time), state)
