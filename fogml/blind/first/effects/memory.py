"""Effects that remember: hysteresis, relaxation, hidden nodes, moisture, ageing."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.first.recurrences import bouc_wen, lag, play
from fogml.blind.frame.form import Additive, ScaleFactor, Shape
from fogml.blind.frame.record import World

_GAS_CONSTANT = 8.314


def _prandtl_ishlinskii(temperature: FloatArray, half_width: float, spread: float) -> FloatArray:
    """Plays with log-normally spread half widths, scaled to run from -1 to 1; shape (n,)."""
    x = np.linspace(-2.0, 2.0, 9)
    weight = np.exp(-0.5 * x * x)
    widths = half_width * np.exp(spread * x)
    loops = temperature[None, :] - play(temperature, widths)
    return np.asarray(weight @ loops / (weight @ widths))


class HysteresisBoucWen(Additive):
    """Bouc-Wen's hysteresis with exponent 2."""

    name, form = "thermal_hysteresis", "Bouc-Wen"
    ranges = {"half_width": (3.0, 20.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """-z, where dz/dT = 1 / length in unloading and (1 - z**2) / length in loading."""
        return -bouc_wen(world.nodes["T_coil"], shape["half_width"])


class HysteresisPreisach(Additive):
    """Preisach's hysteresis with a density over half widths (Prandtl-Ishlinskii)."""

    name, form = "thermal_hysteresis", "Preisach"
    ranges = {"half_width": (3.0, 20.0), "spread": (0.2, 0.5)}
    """Middle and spread of the half widths."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Minus the mean of the plays' departures."""
        return -_prandtl_ishlinskii(world.nodes["T_coil"], shape["half_width"], shape["spread"])


class ScaleFactorPreisach(ScaleFactor):
    """Preisach's hysteresis of the scale factor."""

    name, form = "sf_hysteresis", "Preisach"
    ranges = {"half_width": (3.0, 20.0), "spread": (0.2, 0.5)}
    """Middle and spread of the half widths."""
    evenly = ("half_width",)

    def error(self, world: World, shape: Shape) -> FloatArray:
        """Minus the mean of the plays' departures."""
        return -_prandtl_ishlinskii(world.nodes["T_coil"], shape["half_width"], shape["spread"])


class StressSpectrum(Additive):
    """A log-normal spectrum of Maxwell elements with an activation energy."""

    name, form = "stress_relaxation", "spectrum of Maxwell elements"
    ranges = {"time_constant": (900.0, 20000.0), "spread": (0.4, 1.0), "activation_kj": (42.0, 62.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """T less the weighted lags of T."""
        temperature = world.nodes["T_coil"]
        inverse = 1.0 / (temperature + 273.15) - 1.0 / 298.15
        slower = np.exp(1e3 * shape["activation_kj"] / _GAS_CONSTANT * inverse)
        x = np.linspace(-1.5, 1.5, 5)
        weight = np.exp(-0.5 * x * x)
        taus = shape["time_constant"] * np.exp(shape["spread"] * x)
        lags = [w * lag(world.sample_s, temperature, tau * slower) for w, tau in zip(weight, taus)]
        return np.asarray(temperature - sum(lags) / weight.sum())


class HiddenPlate(Additive):
    """The table's plate, of two layers, that no sensor shows."""

    name, stage, form = "hidden_thermal_node", "thermal", "plate of two layers"
    records = ("T_chamber",)
    ranges = {"deep_share": (0.0, 0.3)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Plate less coil."""
        share = shape["deep_share"]
        plate = (1.0 - share) * world.nodes["T_plate"] + share * world.nodes["T_plate_deep"]
        return np.asarray(plate - world.nodes["T_coil"])


class DeepPlate(Additive):
    """A thermal order that no twin has: a line of layers behind the air, seen at its far end."""

    name, known, stage = "wrong_thermal_structure", False, "thermal"
    form, records = "line of four layers", ("T_chamber",)

    def draw(self, rng: np.random.Generator) -> Shape:
        """Time constant of the whole line, share of the coil's own mean in what it is compared with."""
        return {"time_constant": rng.uniform(1500.0, 7200.0), "layers": 4.0}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Far end of the line less coil."""
        x = world.nodes["T_chamber"]
        for _ in range(int(shape["layers"])):
            x = lag(world.sample_s, x, shape["time_constant"] / shape["layers"])
        return np.asarray(x - world.nodes["T_coil"])


class MoistureFick(Additive):
    """Fick's uptake of water by a slab: its first modes."""

    name, form, records = "moisture", "modes of Fick's law", ("humidity",)
    ranges = {"time_constant": (36e3, 400e3), "static_ratio": (0.0, 0.1)}
    """Time constant of the slowest mode, static part."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Uptake [%/h] and the static part."""
        air = world.drives["humidity"]
        uptake, held = np.zeros_like(air), np.zeros_like(air)
        orders = np.array([1.0, 3.0, 5.0])
        weights = 1.0 / orders**2
        for order, weight in zip(orders, weights / weights.sum()):
            tau = shape["time_constant"] / order**2
            mode = lag(world.sample_s, air, tau)
            uptake += weight * 3600.0 * (air - mode) / tau
            held += weight * mode
        return uptake + shape["static_ratio"] * (held - 50.0)


class AgeingPower(Additive):
    """Ageing by a power of time."""

    name, form = "ageing", "power law"
    ranges = {"time_constant": (3600.0, 50e3), "exponent": (-0.3, 0.3)}
    """Time constant and exponent; exponent 0 is the logarithm."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """((1 + t / tau)**a - 1) / a."""
        a = shape["exponent"]
        log = np.log1p(world.time / shape["time_constant"])
        return np.expm1(a * log) / a if abs(a) > 1e-9 else log
