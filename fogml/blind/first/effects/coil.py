"""Bias of the winding: gradients, strain, glass transition, leads; what it remembers."""

from __future__ import annotations

import numpy as np
from scipy.special import erf

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Demands, ScaleFactor, Shape
from fogml.blind.frame.operators import bouc_wen, lag, play, recurrence
from fogml.blind.frame.record import World

_LEAD_DEG_H_PER_M = 0.525


def _winding_weights(shells: int, cubic: float) -> FloatArray:
    """Weights of the shells in Shupe's integral: odd about the middle, sum of the outer half 1."""
    x = np.linspace(-1.0, 1.0, shells)
    w = x + cubic * x**3
    return np.asarray(2.0 * w / np.abs(w).sum())


class WarmupStretched(Additive):
    """A stretched exponential of the time since power-on: exp(-(t / tau)**beta)."""

    name, form, demands = "warmup_bias", "stretched exponential", Demands(power_on=True)
    ranges = {"time_constant": (300.0, 1500.0), "exponent": (0.6, 0.9)}
    evenly = ("time_constant",)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        t = np.maximum(world.time_on, 0.0)
        return np.exp(-((t / shape["time_constant"]) ** shape["exponent"]))


class ShupeShells(Additive):
    """Shupe's integral over all shells of the winding."""

    name, form, unit, faces = "shupe_pure", "integral over shells", "deg/h/(degC/min)", True
    fine_sensors = True
    ranges = {"cubic": (0.0, 0.4)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Outer half's rate less inner half's, weighted; scaled to faces' rates for a straight profile."""
        shells = world.shell_rates.shape[1]
        w = _winding_weights(shells, shape["cubic"])
        straight = float(w @ np.linspace(0.0, 1.0, shells))
        return world.shell_rates @ w / straight


class MohrCurved(Additive):
    """Strain of the winding whose sensitivity to the rate grows exponentially over temperature."""

    name, form = "shupe_mohr", "exponential over temperature"

    def draw(self, rng: np.random.Generator) -> Shape:
        """Slope and curvature of the sensitivity's logarithm."""
        sign = 1.0 if rng.random() < 0.5 else -1.0
        return {"slope": sign * rng.uniform(0.008, 0.016), "curvature": rng.uniform(-3e-5, 3e-5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """exp(a u + c u**2) dT/dt of the winding's mean."""
        u = world.nodes["T_coil"] - 25.0
        growth = np.exp(np.clip(u * (shape["slope"] + shape["curvature"] * u), -2.0, 2.0))
        return growth * world.rates["T_coil"]


class RateProduct(Additive):
    """Product of the winding's mean temperature and its rate, bending over at the ends."""

    name, form, unit = "temperature_rate_product", "saturating product", "deg/h/degC/(degC/min)"
    ranges = {"middle": (20.0, 30.0), "bend": (90.0, 200.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """u / sqrt(1 + (u / bend)**2) dT/dt."""
        u = world.nodes["T_coil"] - shape["middle"]
        return u / np.sqrt(1.0 + (u / shape["bend"]) ** 2) * world.rates["T_coil"]


class GlassGaussian(Additive):
    """A Gaussian peak of the sensitivity to the rate, and a static step by the error function."""

    name, form, unit = "glass_transition", "Gaussian peak and error function", "deg/h/(degC/min)"
    ranges = {
        "transition_temperature": (-25.0, 55.0),
        "width": (3.0, 10.0),
        "static_ratio": (0.0, 0.2),
        "shift": (2.0, 4.0),
    }

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """dT/dt exp(-0.75 x**2) + r (1 + erf(x)) / 2 with x = (T - T_g) / w."""
        rate = world.rates["T_in"]
        transition = shape["transition_temperature"] + shape["shift"] * np.log10(np.hypot(rate, 0.02))
        x = (world.nodes["T_in"] - transition) / shape["width"]
        return rate * np.exp(-0.75 * x * x) + 0.5 * shape["static_ratio"] * (1.0 + erf(x))


class Leads(Additive):
    """Leads along the way from the electronics to the hub and to the case."""

    name, form = "pigtail_shupe", "leads past hub and case"
    records, fine_sensors = ("T_electronics", "T_case"), True
    demands = Demands(power_steps=True)
    ranges = {"length_ratio": (0.3, 2.0), "hub_share": (0.0, 0.03), "jacket": (10.0, 40.0)}
    """Ratio of the lengths, share of the hub in what the first lead feels, lag of its jacket [s]."""
    evenly = ("length_ratio",)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """n c_T (l_1 (dT_1/dt - dT_coil/dt) - l_2 (dT_case/dt - dT_coil/dt)) / D."""
        h, coil = shape["hub_share"], world.rates["T_coil"]
        around = (1.0 - h) * world.rates["T_electronics"] + h * world.rates["T_hub"]
        first = lag(world.sample_s, around, shape["jacket"])
        second = world.rates["T_case"] - coil
        return _LEAD_DEG_H_PER_M * (first - coil - shape["length_ratio"] * second)


class SideWind(Additive):
    """A gradient across the coil's diameter, from air that blows from one side."""

    name, form, unit, faces = "azimuthal_gradient", "integral over shells", "deg/h/(degC/min)", True
    fine_sensors = True
    demands = Demands(slow_turns=True)
    records = ("angle",)
    ranges = {"phase": (0.0, 360.0), "cubic": (0.0, 0.4)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """cos(angle - phase) d(T_out - T_in)/dt."""
        return world.mean_cosine(1.0, shape["phase"]) * ShupeShells().response(world, shape, rng)


class SlipEvents(Additive):
    """Single slips of random height while the winding's rate is above a threshold; they creep back."""

    name, form = "thermal_shock", "single slips of random height"
    demands, quick_plant = Demands(shock=True), True
    ranges = {"threshold": (3.0, 5.0), "time_constant": (1800.0, 36000.0)}
    """Threshold and time of creeping back."""
    evenly = ("time_constant",)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Relaxing sum of slips: as many as chance has it, gamma distributed in height."""
        rate = world.rates["T_in"]
        excess = np.sign(rate) * np.maximum(np.abs(rate) - shape["threshold"], 0.0)
        # Four slips per degC of mean height 1/4 keep the mean of the catalogue's form. They are counted: of a
        # process without a smallest slip a short excess would show 1e-60 of what a longer one does.
        travelled = excess * world.sample_s / 60.0
        count = rng.poisson(4.0 * np.abs(travelled))
        heights = rng.gamma(np.maximum(4.0 * count, 1.0), 1.0 / 16.0)
        slips = np.where(count > 0, heights, 0.0) * np.sign(travelled)
        decay = np.full(len(slips), world.sample_s / shape["time_constant"])
        return recurrence(decay, slips, 0.0)


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
    """Preisach's hysteresis of the scale factor: minus the mean of the plays' departures."""

    name, form = "sf_hysteresis", "Preisach"
    ranges = {"half_width": (3.0, 20.0), "spread": (0.2, 0.5)}
    """Middle and spread of the half widths."""
    evenly = ("half_width",)

    def error(self, world: World, shape: Shape) -> FloatArray:
        return -_prandtl_ishlinskii(world.nodes["T_coil"], shape["half_width"], shape["spread"])


class StressSpectrum(Additive):
    """A log-normal spectrum of Maxwell elements with an activation energy: T less the weighted lags of T."""

    name, form = "stress_relaxation", "spectrum of Maxwell elements"
    ranges = {"time_constant": (900.0, 20000.0), "spread": (0.4, 1.0), "activation_kj": (42.0, 62.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        temperature = world.nodes["T_coil"]
        inverse = 1.0 / (temperature + 273.15) - 1.0 / 298.15
        slower = np.exp(1e3 * shape["activation_kj"] / _GAS_CONSTANT * inverse)
        x = np.linspace(-1.5, 1.5, 5)
        weight = np.exp(-0.5 * x * x)
        taus = shape["time_constant"] * np.exp(shape["spread"] * x)
        lags = [w * lag(world.sample_s, temperature, tau * slower) for w, tau in zip(weight, taus)]
        return np.asarray(temperature - sum(lags) / weight.sum())


class HiddenPlate(Additive):
    """The table's plate, of two layers, that no sensor shows: plate less coil."""

    name, stage, form = "hidden_thermal_node", "thermal", "plate of two layers"
    records = ("T_chamber",)
    ranges = {"deep_share": (0.0, 0.3)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
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
    """Ageing by a power of time: ((1 + t / tau)**a - 1) / a."""

    name, form = "ageing", "power law"
    ranges = {"time_constant": (3600.0, 50e3), "exponent": (-0.3, 0.3)}
    """Time constant and exponent; exponent 0 is the logarithm."""

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        a = shape["exponent"]
        log = np.log1p(world.time / shape["time_constant"])
        return np.expm1(a * log) / a if abs(a) > 1e-9 else log
