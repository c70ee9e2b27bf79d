"""Effects that no library holds: in time, in temperature, in what was before."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Demands, Shape
from fogml.blind.frame.operators import backlash, late, preisach
from fogml.blind.frame.record import World


class ThresholdSteps(Additive):
    """Contacts that open at some temperatures and close at others: sum of the relays."""

    name, known, form = "threshold_steps", False, "few relays of unlike steps"

    def draw(self, rng: np.random.Generator) -> Shape:
        """Where two to four contacts open, how far below they close, their steps."""
        found: Shape = {"contacts": float(rng.integers(2, 5))}
        for k in range(int(found["contacts"])):
            found |= {f"at_{k}": float(rng.uniform(-20.0, 55.0)), f"gap_{k}": float(rng.uniform(0.5, 8.0))}
            found[f"step_{k}"] = float(rng.standard_normal())
        return found

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        keys = range(int(shape["contacts"]))
        at, gap, step = (np.array([shape[f"{name}_{k}"] for k in keys]) for name in ("at", "gap", "step"))
        return preisach(world.nodes["T_can"], at, gap, step, world.past)


class RandomSteps(Additive):
    """Steps at random times that stay: a compound Poisson process."""

    name, known, stage, form = "random_steps", False, "noise", "steps in time"
    ranges = {"every": (2500.0, 12000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        met = rng.random(len(world.time)) < world.sample_s / shape["every"]
        return np.cumsum(met * rng.standard_normal(len(world.time)))


class SmoothWandering(Additive):
    """A bias that wanders smoothly, each run its own way: white noise smoothed over a length."""

    name, known, stage, form = "smooth_wandering", False, "noise", "smooth in time"
    ranges = {"length": (500.0, 4000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        width = shape["length"] / world.sample_s
        smooth = gaussian_filter1d(rng.standard_normal(len(world.time)), width, mode="wrap")
        return smooth * np.sqrt(2.0 * np.sqrt(np.pi) * width)


class ExcursionMemory(Additive):
    """A joint that gives way with the largest departure from where the run began, and never comes back."""

    name, known, form = "excursion_memory", False, "largest excursion so far"
    ranges = {"knee": (8.0, 40.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Saturating function of it."""
        coil = world.nodes["T_coil"]
        largest = np.maximum.accumulate(np.abs(coil - coil[0]))
        return 1.0 - np.exp(-((largest / shape["knee"]) ** 2))


class HotCreep(Additive):
    """Creep that runs while it is hot, and recovers while it is cold."""

    name, known, form = "hot_creep", False, "time above a temperature"
    ranges = {"above": (28.0, 45.0), "recovers": (0.0, 0.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Hours spent above less a share of those below, not under nothing."""
        hot = world.nodes["T_can"] > shape["above"]
        flow = np.cumsum(np.where(hot, 1.0, -shape["recovers"])) * world.sample_s / 3600.0
        return flow - np.minimum(np.minimum.accumulate(flow), 0.0)


class BranchCurves(Additive):
    """Heating and cooling follow two unlike curves over temperature."""

    name, known, form = "branch_curves", False, "two curves by the direction"
    ranges = {"up": (-10.0, 45.0), "down": (-10.0, 45.0), "width": (6.0, 20.0), "share": (-1.0, 1.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """A bell about one temperature in heating, about another in cooling."""
        coil = world.nodes["T_coil"]
        way = late(np.tanh(world.rates["T_coil"] / 0.05), 120.0, world.sample_s)
        bells = [np.exp(-0.5 * ((coil - shape[key]) / shape["width"]) ** 2) for key in ("up", "down")]
        return 0.5 * (1.0 + way) * bells[0] + 0.5 * (1.0 - way) * shape["share"] * bells[1]


class ConvectionCell(Additive):
    """Air that stirs: the square of the difference between lid and base, only while the lid is warmer."""

    name, known, stage, form = "convection_cell", False, "thermal", "gated square of a gradient"
    ranges = {"onset": (0.2, 3.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Excess over the onset, squared."""
        over = np.maximum(world.nodes["T_lid"] - world.nodes["T_base"] - shape["onset"], 0.0)
        return over**2


class BreathingLine(Additive):
    """A line in time whose strength breathes: sin times a slower sin."""

    name, known, stage, form = "breathing_line", False, "readout", "line with a beat"
    ranges = {"period": (1200.0, 4000.0), "beat": (6000.0, 20000.0), "a": (0.0, 6.28), "b": (0.0, 6.28)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        turn = 2.0 * np.pi * world.time
        slow = np.sin(turn / shape["beat"] + shape["b"])
        return np.asarray(slow * np.sin(turn / shape["period"] + shape["a"]))


class Condensation(Additive):
    """Dew that falls when the winding is colder than the air by much, and dries off."""

    name, known, form = "condensation", False, "dew and drying"
    ranges = {"below": (2.0, 8.0), "dries": (900.0, 5000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Dew by the excess of the difference, drying away."""
        falls = np.maximum(world.nodes["T_chamber"] - world.nodes["T_coil"] - shape["below"], 0.0)
        return np.asarray(late(falls, shape["dries"], world.sample_s) ** 0.7)


class HeatedTelegraph(Additive):
    """A contact that flickers, more often the hotter it is: -1 or 1."""

    name, known, stage, form = "heated_telegraph", False, "loop", "telegraph, faster in heat"
    ranges = {"dwell": (1500.0, 6000.0), "per_ten": (-0.4, 0.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        quick = np.exp(shape["per_ten"] * (world.nodes["T_board"] - 25.0) / 10.0)
        met = rng.random(len(world.time)) < np.minimum(world.sample_s * quick / shape["dwell"], 0.5)
        return np.asarray(1.0 - 2.0 * ((np.cumsum(met) + int(rng.random() < 0.5)) % 2))


class NarrowComb(Additive):
    """A few narrow resonances, each at its temperature, of either sign."""

    name, known, form = "narrow_comb", False, "narrow peaks over temperature"

    def draw(self, rng: np.random.Generator) -> Shape:
        """Where three to six peaks lie, how wide and high."""
        found: Shape = {"peaks": float(rng.integers(3, 7)), "width": float(rng.uniform(0.8, 2.5))}
        for k in range(int(found["peaks"])):
            found |= {f"at_{k}": float(rng.uniform(-30.0, 60.0)), f"size_{k}": float(rng.standard_normal())}
        return found

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Sum of Lorentz's curves over the can's temperature."""
        can, total = world.nodes["T_can"], np.zeros(len(world.time))
        for k in range(int(shape["peaks"])):
            total += shape[f"size_{k}"] / (1.0 + ((can - shape[f"at_{k}"]) / shape["width"]) ** 2)
        return total


class TurnbackSteps(Additive):
    """A jump at each turn from heating to cooling or back, which heals."""

    name, known, form = "turnback_steps", False, "jumps at turns"
    ranges = {"play": (1.0, 4.0), "heals": (2500.0, 15000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Jumps by the path since the last turn, dying away."""
        dragged = backlash(world.nodes["T_coil"], shape["play"])
        way, last, jump, out = 0.0, dragged[0], 0.0, np.empty(len(dragged))
        kept, turned = np.exp(-world.sample_s / shape["heals"]), dragged[0]
        for k, value in enumerate(dragged.tolist()):
            jump *= kept
            now = float(np.sign(value - last))
            if now and now != way:
                jump += (last - turned) / 20.0
                way, turned = now, last
            last, out[k] = value, jump
        return out


class WoundCable(Additive):
    """A cable that is wound up by the table: a bias by the turns made so far."""

    name, known, stage, form = "wound_cable", False, "rig", "turns made so far"
    demands = Demands(slow_turns=True)
    ranges = {"scale": (0.3, 2.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """tanh of the net turns."""
        return np.tanh(world.angle / 360.0 / shape["scale"])


class RateFatigue(Additive):
    """After each fast turn the bias comes back slowly: lagged size of the rate, where the table rests."""

    name, known, stage, form = "rate_fatigue", False, "loop", "recovery after turns"
    demands = Demands(turns=True)
    ranges = {"recovers": (200.0, 2500.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        tired = late(np.sqrt(np.abs(world.table_rate)), shape["recovers"], world.sample_s)
        return np.where(world.table_rate == 0.0, tired, 0.0)
