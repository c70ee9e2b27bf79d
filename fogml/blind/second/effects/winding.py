"""Bias of the winding, its leads and its start."""

from __future__ import annotations

import numpy as np
from scipy.special import expit

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Additive, Demands, Shape
from fogml.blind.frame.operators import backlash, late
from fogml.blind.frame.record import World
from fogml.blind.second.plant import AXIAL, RADIAL

_C_T = 0.6
"""deg/h per m of fibre and degC/min."""


class WarmupTwoMasses(Additive):
    """Heat that reaches its place through two masses: it comes late, and either may have more of it."""

    name, form, demands = "warmup_bias", "two masses in a row", Demands(power_on=True)
    ranges = {"fast": (60.0, 500.0), "slow": (700.0, 4000.0), "share": (-0.5, 0.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """What two lags in a row leave of a step, and a share of the first one's."""
        t, a, b = np.maximum(world.time_on, 0.0), shape["fast"], shape["slow"]
        both = (b * np.exp(-t / b) - a * np.exp(-t / a)) / (b - a)
        return both + shape["share"] * np.exp(-t / a)


class WarmupPower(Additive):
    """A warm-up that never quite ends: a power of the time since power-on."""

    name, form, demands = "warmup_bias", "power law", Demands(power_on=True)
    ranges = {"time_constant": (100.0, 1500.0), "exponent": (0.7, 2.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """(1 + t / tau)**-p."""
        return (1.0 + np.maximum(world.time_on, 0.0) / shape["time_constant"]) ** -shape["exponent"]


class ShupePattern(Additive):
    """Shupe's integral over a winding in radius and height, wound in a pattern of its own."""

    name, form, faces, fine_sensors = "shupe_pure", "integral over radius and height", True, True
    ranges = {"axial": (-0.7, 0.7), "skew": (-0.5, 0.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Weighted rates of all parts, weights adding up to nothing."""
        r, z = np.linspace(-1.0, 1.0, RADIAL)[:, None], np.linspace(-1.0, 1.0, AXIAL)[None, :]
        weights = r + shape["axial"] * z + shape["skew"] * r * z
        weights = (weights - weights.mean()).ravel()
        return world.shell_rates @ (weights / np.abs(weights).sum())


class ShupeCan(Additive):
    """Rate of the gradient between can and spool, as the fibre feels it through its potting."""

    name, form, faces, fine_sensors = "shupe_pure", "can against spool", True, True
    ranges = {"potting": (5.0, 90.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Lagged d(T_can - T_spool)/dt."""
        return late(world.rates["T_can"] - world.rates["T_spool"], shape["potting"], world.sample_s)


class MohrLogistic(Additive):
    """Strain of potting that is stiff in the cold and soft in heat: a logistic sensitivity to the rate."""

    name, form = "shupe_mohr", "logistic over temperature"
    ranges = {"middle": (0.0, 45.0), "width": (8.0, 25.0), "soft": (-0.6, 0.5)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """(soft + (1 - soft) / (1 + exp((T - T_0) / w))) dT/dt of the winding."""
        stiff = expit((shape["middle"] - world.nodes["T_coil"]) / shape["width"])
        return (shape["soft"] + (1.0 - shape["soft"]) * stiff) * world.rates["T_coil"]


class MohrOneWay(Additive):
    """Strain that answers heating and cooling by other amounts, hot by more than cold."""

    name, form = "shupe_mohr", "heating unlike cooling"
    ranges = {"cooling": (0.2, 0.7), "slope": (-0.012, 0.012)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """(1 + s u) dT/dt, times a share while cooling."""
        rate = world.rates["T_coil"]
        strength = 1.0 + shape["slope"] * (world.nodes["T_coil"] - 25.0)
        return strength * np.where(rate < 0.0, shape["cooling"] * rate, rate)


class ProductHidden(Additive):
    """Product of the optics' temperature and the base's rate, which no sensor sees."""

    name, form = "temperature_rate_product", "hidden places"
    ranges = {"middle": (5.0, 45.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """(T_optics - T_0) dT_base/dt."""
        return (world.nodes["T_optics"] - shape["middle"]) * world.rates["T_base"]


class ProductBent(Additive):
    """A sensitivity to the outer face's rate that is a parabola of the spool's temperature."""

    name, form = "temperature_rate_product", "parabola of the spool"
    ranges = {"middle": (10.0, 40.0), "bend": (-0.01, 0.01), "delay": (10.0, 200.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """u (1 + c u) of the spool times the lagged dT_out/dt."""
        u = world.nodes["T_spool"] - shape["middle"]
        return u * (1.0 + shape["bend"] * u) * late(world.rates["T_out"], shape["delay"], world.sample_s)


class TransitionRichards(Additive):
    """A step of unequal sides, met at another temperature in heating than in cooling."""

    name, form = "glass_transition", "Richards' sigmoid with its own hysteresis"
    ranges = {"middle": (-25.0, 55.0), "width": (1.5, 7.0), "side": (0.2, 4.0), "loop": (0.5, 5.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """(1 + exp(-x))**-nu, x = (T - T_0) / w with T dragged along with a play."""
        dragged = backlash(world.nodes["T_coil"], shape["loop"], world.past)
        x = (dragged - shape["middle"]) / shape["width"]
        return expit(x) ** shape["side"]


class TransitionPeak(Additive):
    """A one-sided peak of the sensitivity to the rate, steep on its hot side."""

    name, form = "glass_transition", "skewed peak"
    ranges = {"middle": (-25.0, 55.0), "cold": (4.0, 14.0), "hot": (1.5, 5.0), "step": (0.0, 0.15)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """dT/dt / (1 + (d / w)**2) with another w on either side, and a step in softplus."""
        d = world.nodes["T_coil"] - shape["middle"]
        width = np.where(d < 0.0, shape["cold"], shape["hot"])
        step = shape["step"] * (expit(d / shape["hot"]) + 0.02 * np.logaddexp(0.0, d / shape["cold"]))
        return world.rates["T_coil"] / (1.0 + (d / width) ** 2) + step


class LeadsInBay(Additive):
    """Leads from the winding to the optics on the base; one of them passes the source."""

    name, form, records = "pigtail_shupe", "leads past optics, base and source", ("T_electronics", "T_case")
    fine_sensors, demands = True, Demands(power_steps=True)
    ranges = {"ratio": (0.3, 3.0), "near_source": (0.1, 0.7), "jacket": (5.0, 60.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """c_T (l_1 (dT_1 - dT_coil)/dt - l_2 (dT_2 - dT_coil)/dt)."""
        coil, share = world.rates["T_coil"], shape["near_source"]
        first = share * world.rates["T_source"] + (1.0 - share) * world.rates["T_board"]
        first = late(first, shape["jacket"], world.sample_s) - coil
        return _C_T * (first - shape["ratio"] * (world.rates["T_optics"] - coil))


class SectorWind(Additive):
    """Air that strikes one sector: a lobe about its direction times the rate between can and winding."""

    name, form, faces, fine_sensors = "azimuthal_gradient", "one lobe", True, True
    records, demands = ("angle",), Demands(slow_turns=True)
    ranges = {"direction": (0.0, 360.0), "second": (0.0, 0.4)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """(cos + second cos 2)(angle - direction) d(T_can - T_coil)/dt."""
        lobe = world.mean_cosine(1.0, shape["direction"])
        lobe = lobe + shape["second"] * world.mean_cosine(2.0, 2.0 * shape["direction"])
        return lobe * (world.rates["T_can"] - world.rates["T_coil"])


class SlipByGradient(Additive):
    """Slips of the winding on its spool once the difference between them exceeds what friction holds."""

    name, form, demands, quick_plant = "thermal_shock", "slips by the gradient", Demands(shock=True), True
    ranges = {"threshold": (3.0, 8.0), "healing": (2000.0, 30000.0)}

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Each time the friction gives way, a jump by what it lets go; healing by and by."""
        stretch = (world.nodes["T_coil"] - world.nodes["T_spool"]).tolist()
        out, held, jump = np.empty(len(stretch)), stretch[0], 0.0
        kept = np.exp(-world.sample_s / shape["healing"])
        for k, value in enumerate(stretch):
            jump *= kept
            if abs(value - held) > shape["threshold"]:
                jump += (value - held) * rng.uniform(0.5, 1.0)
                held = value
            out[k] = jump
        return out
