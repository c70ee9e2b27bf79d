"""What optics, electronics, machines, table and thermometers add; and effects that no library holds."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from scipy.interpolate import CubicSpline

from fogml.arrays import FloatArray
from fogml.blind.frame.form import OUTER, Additive, Demands, Distorting, ScaleFactor, Sensing, Shape
from fogml.blind.frame.operators import late
from fogml.blind.frame.record import World


class PolarisationProduct(Additive):
    """Two couplings that multiply: a product of two periods on the optics."""

    name, form = "polarization_nonreciprocity", "product of two periods"
    ranges = {"period": (4.0, 15.0), "other": (20.0, 60.0), "a": (0.0, 6.28), "b": (0.0, 6.28)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """cos times (1 + cos) of the slower one."""
        turn = 2.0 * np.pi * world.nodes["T_optics"]
        slow = 1.0 + np.cos(turn / shape["other"] + shape["b"])
        return slow * np.cos(turn / shape["period"] + shape["a"])


class PolarisationCreeping(Additive):
    """A beat over the source's temperature whose phase creeps with time."""

    name, form = "polarization_nonreciprocity", "creeping phase"
    ranges = {"period": (3.0, 12.0), "phase": (0.0, 6.28), "creep": (-1.5, 1.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """sin(2 pi T / period + phase + creep sqrt(t))."""
        hours = (world.time + 1.0) / 3600.0
        turn = 2.0 * np.pi * world.nodes["T_source"] / shape["period"]
        return np.sin(turn + shape["phase"] + shape["creep"] * np.sqrt(hours))


class BiasOfSpline(Additive):
    """A static bias through random values a few degrees apart: the spline at the inner annulus."""

    name, form = "bias_polynomial", "spline through random values"

    def draw(self, rng: np.random.Generator) -> Shape:
        """Distance of the values and they themselves."""
        found: Shape = {"apart": float(rng.uniform(16.0, 35.0))}
        return found | {f"value_{k}": float(rng.standard_normal()) for k in range(10)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        at = -70.0 + shape["apart"] * np.arange(10)
        curve = CubicSpline(at, [shape[f"value_{k}"] for k in range(10)])
        return np.asarray(curve(world.nodes["T_inner"]))


class BiasResonant(Additive):
    """A static bias with one broad dispersion: x / (1 + x**2)."""

    name, form = "bias_polynomial", "broad dispersion"
    ranges = {"at": (-20.0, 50.0), "width": (12.0, 35.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        x = (world.nodes["T_coil"] - shape["at"]) / shape["width"]
        return x / (1.0 + x * x)


class ValvePickup(Additive):
    """Each pulse of the valve moves the bias, behind a filter in the gyro: filtered valve."""

    name, form = "chamber_pickup", "a valve's pulses"
    ranges = {"filter": (5.0, 120.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        return late(world.drives["compressor"], shape["filter"], world.sample_s)


class SourceWithPump(ScaleFactor):
    """Wavelength by the source's temperature and by the power that pumps it."""

    name, form, records = "source_wavelength", "with its pump", ("T_electronics",)
    demands = Demands(turns=True, power_steps=True)
    ranges = {"pump": (-10.0, 10.0)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        """-(T_source - 25) and a part of the relative power."""
        power = world.drives["power"]
        return 25.0 - world.nodes["T_source"] + shape["pump"] * (power / power.mean() - 1.0)


class HysteresisOfRate(ScaleFactor):
    """Scale factor that bends with the square of the rate, more when warm."""

    name, form = "sf_nonlinearity", "square, by temperature"
    ranges = {"slope": (-0.01, 0.01)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        """(Omega / 100 deg/s)**2 (1 + s u)."""
        warm = 1.0 + shape["slope"] * (world.nodes["T_board"] - 25.0)
        return (world.rate_deg_h / 360000.0) ** 2 * warm


class AsymmetryOfStages(ScaleFactor):
    """Another gain of the two directions beyond a rate at which a stage is switched."""

    name, form = "sf_asymmetry", "beyond a rate"
    ranges = {"from": (1.0, 6.0)}

    def error(self, world: World, shape: Shape) -> FloatArray:
        """Sign of the rate where it exceeds the switch."""
        rate = world.rate_deg_h / 3600.0
        return np.sign(rate) * (np.abs(rate) > shape["from"])


class CreepingClock(Distorting):
    """A clock that drifts by the logger's temperature, so that the delay grows unevenly."""

    name, stage, form = "logger_skew", "logger", "clock by temperature"
    greatest: ClassVar[float] = 300.0
    ranges = {"by_heat": (0.0, 0.05), "growth": (0.0, 0.4)}

    def distorted(self, output: FloatArray, world: World, amplitude: float, shape: Shape) -> FloatArray:
        """y(t - d) with d growing by time and heat."""
        hours = world.time / 3600.0
        warm = 1.0 + shape["by_heat"] * (world.nodes["T_chamber"] - 25.0) * hours / 8.0
        delay = amplitude * np.maximum(warm + shape["growth"] * hours, 0.0)
        return np.interp(world.time - delay, world.time, output)


class LagBesideContact(Sensing):
    """A thermometer that touches with a part of itself and lags with the rest."""

    name, form, fine_sensors = "sensor_lag", "part in touch", True
    greatest: ClassVar[float] = 3000.0
    ranges = {"touching": (0.1, 0.6)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """A share at once, the rest late."""
        share = shape["touching"]
        return share * temperature + (1.0 - share) * late(temperature, amplitude, world.sample_s)


class StepsThatStick(Sensing):
    """A converter with hysteresis: its code moves on only when the value is most of a step away."""

    name, form, unit = "sensor_quantisation", "sticking steps", "degC"
    greatest: ClassVar[float] = 2.0

    def read(self, values: FloatArray, amplitude: float, shape: Shape) -> FloatArray:
        """The code held until the value is 0.8 steps away."""
        held, out = float(np.round(values[0] / amplitude)), np.empty(len(values))
        for k, value in enumerate((values / amplitude).tolist()):
            if abs(value - held) > 0.8:
                held = float(np.round(value))
            out[k] = held
        return np.round(amplitude * out, 7)


class FeelsTheMount(Sensing):
    """Inner thermometers feel the hub, outer ones the cover: a mix of the place with its neighbour."""

    name, form, fine_sensors, records = "sensor_placement", "hub and cover", True, ("T_case",)
    greatest: ClassVar[float] = 1.0
    ranges = {"inner": (0.2, 1.0)}

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        share = amplitude * (1.0 if name in OUTER else shape["inner"])
        beside = world.nodes["T_cover" if name in OUTER else "T_hub"]
        return temperature + share * (beside - temperature)


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
