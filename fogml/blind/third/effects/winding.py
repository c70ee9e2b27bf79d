"""Bias of the winding, what it remembers, and its start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Demands, ScaleFactor, Shape
from fogml.blind.frame.operators import faded, late
from fogml.blind.frame.record import World


def duhem(x: FloatArray, quickness: float, knee: float, past: Sequence[float] = ()) -> FloatArray:
    """Coleman and Hodgdon's loop: dz = a |dx| (tanh(x / knee) - z) about 20 degC; shape (n,).

    Exact for each step with the anhysteretic curve taken at its middle.
    """
    path = [*past, *x.tolist()]
    about = 20.0
    out, last = np.empty(len(path)), path[0]
    z = float(np.tanh((last - about) / knee))
    for k, value in enumerate(path):
        curve = float(np.tanh((0.5 * (value + last) - about) / knee))
        z = curve + (z - curve) * float(np.exp(-quickness * abs(value - last)))
        out[k], last = z, value
    return out[len(past) :]


def dead_zone_plays(
    x: FloatArray, half_widths: FloatArray, weights: FloatArray, dead: float, past: Sequence[float] = ()
) -> FloatArray:
    """Plays whose sum is felt above a threshold alone: loops of unlike sides (Kuhnen); shape (n,)."""
    path = np.concatenate([np.asarray(past, dtype=np.float64), x])
    held = np.full(len(half_widths), path[0])
    total = np.empty(len(path))
    for k, value in enumerate(path.tolist()):
        held = np.minimum(np.maximum(held, value - half_widths), value + half_widths)
        total[k] = weights @ held
    mixed = total - 20.0
    return (mixed + 0.7 * np.maximum(mixed - dead, 0.0))[len(past) :]


def eyring(time: FloatArray, x: FloatArray, time_constant_s: float, stress: float) -> FloatArray:
    """Strain q with dq/dt = dx/dt - (s / tau) sinh(q / s), from 0; shape (n,).

    Each step lets q decay exactly by the law's own solution, then adds the change of x.
    """
    step = float(time[1] - time[0]) / time_constant_s
    kept, change = float(np.exp(-step)), np.diff(x, prepend=x[0])
    out, q = np.empty(len(x)), 0.0
    for k, added in enumerate(change.tolist()):
        # tanh(q / 2 s) decays exponentially under this law.
        half = np.tanh(np.clip(0.5 * q / stress, -15.0, 15.0)) * kept
        q = 2.0 * stress * float(np.arctanh(half)) + added
        out[k] = q
    return out


class WarmupHunting(Additive):
    """A warm-up that overshoots: a temperature controller that hunts."""

    name, form, demands = "warmup_bias", "damped swing", Demands(power_on=True)
    ranges = {"fade": (500.0, 2500.0), "period": (1500.0, 8000.0), "phase": (-0.7, 0.7)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """exp(-t / tau) cos(2 pi t / period + phase)."""
        t = np.maximum(world.time_on, 0.0)
        return np.exp(-t / shape["fade"]) * np.cos(2.0 * np.pi * t / shape["period"] + shape["phase"])


class ShupeDelayed(Additive):
    """Rates of three annuli, the outer one felt later than the inner one."""

    name, form, faces, fine_sensors = "shupe_pure", "three annuli with delays", True, True
    ranges = {"middle": (-0.4, 0.4), "delay": (2.0, 40.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Weighted rates adding up to nothing in a steady ramp."""
        outer = late(world.shell_rates[:, 0], shape["delay"], world.sample_s)
        middle = shape["middle"]
        return outer + middle * world.shell_rates[:, 1] - (1.0 + middle) * world.shell_rates[:, 2]


class MohrSaturating(Additive):
    """Strain by the rate that saturates in fast ramps: r tanh(rate / r) (1 + s u)."""

    name, form = "shupe_mohr", "saturating in the rate"
    ranges = {"fast": (0.2, 1.5), "slope": (-0.015, 0.015)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        rate, fast = world.rates["T_middle"], shape["fast"]
        return fast * np.tanh(rate / fast) * (1.0 + shape["slope"] * (world.nodes["T_hub"] - 25.0))


class ProductOfHub(Additive):
    """The hub's temperature by the cover's rate: (T_hub - T_0) late(dT_cover/dt)."""

    name, form = "temperature_rate_product", "hub by cover"
    ranges = {"middle": (0.0, 50.0), "delay": (50.0, 500.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        rate = late(world.rates["T_cover"], shape["delay"], world.sample_s)
        return (world.nodes["T_hub"] - shape["middle"]) * rate


class TransitionArctan(Additive):
    """A broad step with algebraic tails, and other slopes on its sides."""

    name, form = "glass_transition", "arctangent with a kink"
    ranges = {"middle": (-20.0, 55.0), "width": (2.0, 9.0), "kink": (-0.06, 0.06), "shift": (0.0, 4.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """arctan(x) and a kink, met later in fast ramps."""
        rate = late(world.rates["T_middle"], 300.0, world.sample_s)
        d = world.nodes["T_middle"] - shape["middle"] - shape["shift"] * np.tanh(rate)
        return np.arctan(d / shape["width"]) + shape["kink"] * np.maximum(d, 0.0)


class LeadsOneFree(Additive):
    """One lead hangs free in the cover's air, the other lies on the tray."""

    name, form, records = "pigtail_shupe", "one lead free", ("T_electronics", "T_case")
    fine_sensors, demands = True, Demands(power_steps=True)
    ranges = {"ratio": (0.3, 3.0), "air": (20.0, 120.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Rates of board and cover less the winding's."""
        coil = world.rates["T_coil"]
        free = late(world.rates["T_cover"], shape["air"], world.sample_s)
        return 0.5 * (world.rates["T_board"] - coil - shape["ratio"] * (free - coil))


class ShadowedSide(Additive):
    """One side in the lee of the air: a rectified cosine of the table's angle."""

    name, form, faces, fine_sensors = "azimuthal_gradient", "rectified cosine", True, True
    records, demands = ("angle",), Demands(slow_turns=True)
    ranges = {"direction": (0.0, 360.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """max(cos(angle - direction), 0) less its mean, times the gradient's rate."""
        lobe = np.maximum(np.cos(np.radians(world.angle - shape["direction"])), 0.0) - 1.0 / np.pi
        return lobe * (world.rates["T_outer"] - world.rates["T_inner"])


class StickingLayers(Additive):
    """Layers that tear loose one by one below thresholds that each have of their own, and heal when warm."""

    name, form, demands, quick_plant = "thermal_shock", "layers that tear", Demands(shock=True), True
    ranges = {"strength": (2.5, 6.0), "healing": (3000.0, 30000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Sum of steps that heal."""
        rate = np.abs(world.rates["T_outer"])
        steps = np.zeros(len(rate))
        for strength in shape["strength"] * (1.0 + rng.exponential(0.3, 12)):
            torn = np.flatnonzero(rate > strength)
            if len(torn):
                steps[torn[0]] += float(np.sign(world.rates["T_outer"][torn[0]])) * rng.uniform(0.5, 1.5)
        tau = shape["healing"]
        return late(steps, tau, world.sample_s) * tau / world.sample_s


class LoopOfDuhem(Additive):
    """Coleman and Hodgdon's loop: z over the winding's temperature."""

    name, form = "thermal_hysteresis", "Duhem"
    ranges = {"quickness": (0.04, 0.25), "knee": (15.0, 60.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        return duhem(world.nodes["T_middle"], shape["quickness"], shape["knee"], world.past)


class LoopOneSided(Additive):
    """Plays that are felt more when it is hot: a loop of unlike sides."""

    name, form = "thermal_hysteresis", "plays with a dead zone"
    ranges = {"widest": (6.0, 30.0), "dead": (-20.0, 20.0), "shape": (0.5, 2.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """The plays' sum less what it would be without them."""
        part = np.linspace(0.1, 1.0, 8)
        weights = part ** shape["shape"] / (part ** shape["shape"]).sum()
        winding = world.nodes["T_inner"]
        loops = dead_zone_plays(winding, shape["widest"] * part, weights, shape["dead"], world.past)
        return loops - dead_zone_plays(winding, 0.0 * part, weights, shape["dead"])


class ScaleLoopOfDuhem(ScaleFactor):
    """Coleman and Hodgdon's loop in the scale factor: z over the winding's temperature."""

    name, form = "sf_hysteresis", "Duhem"
    ranges = {"quickness": (0.04, 0.25), "knee": (15.0, 60.0)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        return duhem(world.nodes["T_middle"], shape["quickness"], shape["knee"], world.past)


class StressEyring(Additive):
    """Strain that creeps away by a law in its own size: fast while large, slow when small."""

    name, form = "stress_relaxation", "Eyring's creep"
    ranges = {"time_constant": (2000.0, 20000.0), "stress": (4.0, 20.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """What is left of the changes."""
        return eyring(world.time, world.nodes["T_middle"], shape["time_constant"], shape["stress"])


class StressFractional(Additive):
    """Strain that fades without a time constant of its own."""

    name, form = "stress_relaxation", "fractional"
    ranges = {"time_constant": (500.0, 10000.0), "order": (0.4, 0.9)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """1 / (1 + (t / tau)**a) over each change of temperature."""
        tau, order = shape["time_constant"], shape["order"]
        return faded(world.time, world.nodes["T_outer"], lambda t: 1.0 / (1.0 + (t / tau) ** order))


class HiddenMount(Additive):
    """The mount, which air and tray both warm: mount and a share of the tray less winding."""

    name, stage, form, records = "hidden_thermal_node", "thermal", "the mount", ("T_chamber",)
    ranges = {"tray": (0.0, 0.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        share = shape["tray"]
        there = (1.0 - share) * world.nodes["T_mount"] + share * world.nodes["T_tray"]
        return there - world.nodes["T_coil"]


class OtherInside(Additive):
    """A bias that follows the difference of optics and hub, each behind masses that no twin has."""

    name, known, stage = "wrong_thermal_structure", False, "thermal"
    form, records = "optics against hub", ("T_chamber",)
    ranges = {"delay": (600.0, 4000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """late(T_optics) - T_hub."""
        return late(world.nodes["T_optics"], shape["delay"], world.sample_s) - world.nodes["T_hub"]


class AgeingSettles(Additive):
    """Ageing that comes to an end within days: 1 - exp(-t / tau) since the first run."""

    name, form = "ageing", "settling exponentially"
    ranges = {"days": (0.05, 3.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        return -np.expm1(-(world.since_first + world.time) / (86400.0 * shape["days"]))


class TurnOnOfLaplace(Additive):
    """Mostly the same bias after power-on, and at times quite another one: a constant of this run."""

    name, form, several_runs, drawn_per_run = "turn_on_bias", "Laplace's distribution", True, True
    demands = Demands(power_on=True)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        return np.full(len(world.time), rng.laplace())
