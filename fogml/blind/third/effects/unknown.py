"""Effects that no library holds."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Sensing, Shape
from fogml.blind.frame.operators import late
from fogml.blind.frame.record import World


class Bistable(Additive):
    """A membrane with two rests: temperature drives it over the sill and back, slowly."""

    name, known, form = "bistable_membrane", False, "double well"
    ranges = {"middle": (5.0, 40.0), "drive": (0.03, 0.1), "time_constant": (300.0, 2000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """dz/dt = (z - z**3 + drive (T - T_0)) / tau."""
        push = shape["drive"] * (world.nodes["T_middle"] - shape["middle"])
        step, z, out = world.sample_s / shape["time_constant"], -1.0, np.empty(len(push))
        for k, force in enumerate(push.tolist()):
            z = min(max(z + step * (z - z**3 + force), -3.0), 3.0)
            out[k] = z
        return out


class Avalanches(Additive):
    """Small slips wherever the winding goes where it has not been for a while, more of them in the cold."""

    name, known, form = "avalanches", False, "random slips along the path"
    ranges = {"size": (0.3, 1.2)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Heavy-tailed slips by the path travelled, in its direction."""
        change = np.diff(world.nodes["T_middle"], prepend=world.nodes["T_middle"][0])
        cold = np.exp(-(world.nodes["T_middle"] - 10.0) / 30.0)
        met = rng.poisson(np.minimum(0.5 * cold * np.abs(change), 50.0))
        return np.cumsum(np.sign(change) * met * rng.exponential(1.0, len(change)) ** (1.0 / shape["size"]))


class Pulses(Additive):
    """Pulses at random times that die away: shot noise."""

    name, known, stage, form = "decaying_pulses", False, "readout", "pulses in time"
    ranges = {"every": (2500.0, 9000.0), "decay": (300.0, 2500.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        met = rng.random(len(world.time)) < world.sample_s / shape["every"]
        sizes = met * rng.standard_normal(len(world.time))
        return late(sizes, shape["decay"], world.sample_s) * shape["decay"] / world.sample_s


class FastestRate(Additive):
    """What the fastest ramp so far has left behind."""

    name, known, form = "fastest_rate", False, "largest rate so far"
    ranges = {"knee": (0.3, 2.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Saturating function of the largest rate of the outer annulus."""
        largest = np.maximum.accumulate(np.abs(world.rates["T_outer"]))
        return np.tanh(largest / shape["knee"])


class DistantHeat(Additive):
    """Heat that comes by a pipe: the tray's difference to the cover of an hour ago, rectified."""

    name, known, stage, form = "distant_heat", False, "thermal", "rectified and delayed"
    ranges = {"delay": (2000.0, 6000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """max(T_tray - T_cover, 0) a delay ago."""
        over = np.maximum(world.nodes["T_tray"] - world.nodes["T_cover"], 0.0)
        return np.interp(world.time - shape["delay"], world.time, over)


class LooseConnector(Additive):
    """A connector that is noisy while the temperature moves, at random strength."""

    name, known, stage, form = "loose_connector", False, "noise", "noise by the rate of temperature"
    ranges = {"correlation": (60.0, 500.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Correlated noise times the rate."""
        noise = late(rng.standard_normal(len(world.time)), shape["correlation"], world.sample_s)
        scale = np.sqrt(2.0 * shape["correlation"] / world.sample_s)
        return noise * scale * np.minimum(np.abs(world.rates["T_outer"]), 2.0)


class Staircase(Additive):
    """A table of corrections with unequal steps: the step that the board's temperature lies on."""

    name, known, stage, form = "unequal_stairs", False, "readout", "unequal steps over temperature"

    def draw(self, rng: np.random.Generator) -> Shape:
        """Twelve edges and heights."""
        edges = np.cumsum(rng.uniform(4.0, 16.0, 12)) - 55.0
        found: Shape = {f"edge_{k}": float(edge) for k, edge in enumerate(edges)}
        return found | {f"height_{k}": float(rng.standard_normal()) for k in range(13)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        edges = np.array([shape[f"edge_{k}"] for k in range(12)])
        heights = np.array([shape[f"height_{k}"] for k in range(13)])
        return heights[np.searchsorted(edges, world.nodes["T_board"])]


class SweepingLine(Additive):
    """A line whose frequency follows the supply and the board."""

    name, known, stage, form = "sweeping_line", False, "loop", "line that heat sweeps"
    ranges = {"period": (1500.0, 5000.0), "by_heat": (0.01, 0.03), "phase": (0.0, 6.28)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """sin of the integral of a frequency that grows with the board's temperature."""
        faster = 1.0 + shape["by_heat"] * (world.nodes["T_board"] - 20.0)
        turn = np.cumsum(np.maximum(faster, 0.05)) * world.sample_s / shape["period"]
        return np.sin(2.0 * np.pi * turn + shape["phase"])


class TiredSensor(Sensing):
    """Thermometers whose gain drifts away with the time spent hot."""

    name, known, form = "tired_sensor", False, "gain by time in heat"
    greatest: ClassVar[float] = 5.0

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """Gain growing by `amplitude` in an hour above 30 degC."""
        hot = np.cumsum(world.nodes["T_coil"] > 30.0) * world.sample_s / 3600.0
        return temperature + 0.1 * amplitude * hot * (temperature - 25.0)
