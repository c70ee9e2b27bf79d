"""Strain of the winding that follows temperature, its rate, or humidity."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import shared, signed


class ShupeMohr(BiasEffect):
    """Strain of the warming winding: a bias in proportion to the rate of temperature alone.

    ::

        b = S_m0 (1 + s1 u + s2 u**2) dT/dt,      u = T - 25

    S_m0 in deg/h per degC/min; ``linear_coefficient`` is s1 and ``quadratic_coefficient`` s2. T
    stands for the coil's mean. With s1 = s2 = 0 it is the nominal gyro's own term in DeltaT.

    Source: Mohr and Schadt, SPIE 5502 (2004) 410; Li et al., Chinese Optics Letters 13 (2015) 090603
    (literature); ranges are engineering ones.
    """

    code = "B3"
    family = "rate"
    place = "coil"
    title = "Elasto-optic Shupe effect (Mohr effect)"
    amplitude = signed("deg/h/(degC/min)", (0.2, 5.0), (0.01, 0.3), "S_m0", 1e3)
    shape = (
        shared("linear_coefficient", "1/degC", (-0.02, 0.02), "s1", (-1.0, 1.0)),
        shared("quadratic_coefficient", "1/degC2", (-2e-4, 2e-4), "s2", (-0.1, 0.1)),
    )
    needs = ("T",)
    sources = (
        "F. Mohr and F. Schadt, SPIE 5502 (2004) 410; IEEE SIBIRCON (2008)",
        "Z. Li et al., Chinese Optics Letters 13 (2015) 090603",
    )
    shows = "a plateau during the whole of each ramp, proportional to the rate"
    confused_with = {
        "shupe_trim": "not from the output alone; trim the fibre ends, or find a slope over temperature",
        "shupe_pure": "long ramps with sharp start and stop: shupe_pure spikes, this one has a plateau",
        "sensor_lag": "a lag acts by the slope of the static bias, which changes sign at its extremum",
        "logger_skew": "as for a lag; and edges of the table rate show the clock's error",
        "temperature_rate_product": "ramps at cold and at hot: only the product's plateau changes",
        "bias_polynomial": "more than one ramp: in one, temperature, time and rate go together",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        u = inputs.u("T")
        growth = 1.0 + u * (shape["linear_coefficient"] + shape["quadratic_coefficient"] * u)
        return growth * inputs.dT("T")


class TemperatureRateProduct(BiasEffect):
    """First-order change with temperature of the sensitivity to its rate.

    ::

        b = S_x (T - 25) dT/dt

    S_x in deg/h per degC and degC/min: the slope of elasto-optic strain, of dn/dT and of n.

    Source: first-order expansion of the Mohr effect (derived), the product that RBF networks take as
    an input; ranges, S_x / S_m0 of 0.001 to 0.02 per degC, are engineering ones.
    """

    code = "B4"
    family = "rate_product"
    place = "coil"
    title = "Temperature times its rate"
    amplitude = signed("deg/h/degC/(degC/min)", (2e-4, 0.1), (1e-5, 6e-3), "S_x", 1e3)
    needs = ("T",)
    sources = ("Expansion of F. Mohr and F. Schadt, SPIE 5502 (2004) 410",)
    shows = "plateaus in ramps that differ between cold and hot at the same rate"
    confused_with = {
        "shupe_mohr": "ramps at cold and at hot: only the product's plateau changes",
        "glass_transition": "that one is localised in temperature",
        "sensor_lag": "a power step; with a curved static bias a lag makes the same product",
        "logger_skew": "edges of the table rate; with a curved static bias a skew makes the same product",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return inputs.u("T") * inputs.dT("T")


class GlassTransition(BiasEffect):
    """The adhesive of the winding hardens at T_g: rate sensitivity peaks there, the bias steps.

    ::

        b = A dT/dt / cosh((T - T_g) / w)**2  +  A r (1 + tanh((T - T_g) / w)) / 2
        T_g = transition_temperature + 3 log10(|dT/dt|)

    A in deg/h per degC/min, with ``width`` w and, as ``static_ratio`` r, the step over A in degC/min.
    The rate in T_g is in degC/min, 0.01 at least.

    Source: Cordova, US5546482 (read) for spikes and crossings of the bias; ranges are engineering ones:
    -60 to -20 degC for silicone and acrylate, 40 to 90 degC for epoxy.
    """

    code = "B5"
    family = "transition"
    place = "coil"
    title = "Glass transition of coating or adhesive"
    amplitude = signed("deg/h/(degC/min)", (0.1, 25.0), (5e-3, 1.5), "A", 1e3)
    shape = (
        shared(
            "transition_temperature",
            "degC",
            (-60.0, 90.0),
            "T_g at 1 degC/min",
            (-150.0, 200.0),
            default=-25.0,
        ),
        shared("width", "degC", (3.0, 10.0), "w", (0.1, 100.0)),
        shared("static_ratio", "degC/min", (0.0, 0.2), "r", (-100.0, 100.0)),
    )
    needs = ("T",)
    per_decade_degc, slowest_degc_min = 3.0, 0.01
    """Shift of T_g per decade of the rate, and the rate that it counts at least with."""
    sources = ("A. Cordova et al., US5546482", "A. Cordova et al., US5847829")
    shows = "a peak and a step of the bias at one temperature in ramps; only the step in soaks"
    confused_with = {
        "polarization_nonreciprocity": "this one needs a moving temperature and has a single peak",
        "temperature_rate_product": "this one is localised in temperature",
        "shupe_mohr": "ramps over the whole range: the plateau of shupe_mohr has no peak",
        "bias_polynomial": "soaks: only a step is left of this one",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        rate = inputs.dT("T")
        transition = shape["transition_temperature"] + self.per_decade_degc * np.log10(
            np.hypot(rate, self.slowest_degc_min)
        )
        risen = np.tanh((inputs.temperature("T") - transition) / shape["width"])
        return rate * (1.0 - risen * risen) + 0.5 * shape["static_ratio"] * (1.0 + risen)


class Moisture(BiasEffect):
    """Coating and adhesive swell as they take up water.

    ::

        b = S_w dRH_c/dt + S_w0 (RH_c - 50),      dRH_c/dt = (RH - RH_c) / tau

    RH_c is the coil's relative humidity [%], ``time_constant`` tau its delay behind that of the air.
    The amplitude is S_w [deg/h per %/h]; ``static_ratio`` is S_w0 / S_w [1/h].

    Source: moisture-induced strain in gyroscope coils (read): a step of 60 % acts like 1 degC/min over
    15 degC, about 0.1 deg/h; first-order uptake for Fick's law, and ranges, are engineering.
    """

    code = "B11"
    family = "moisture"
    place = "coil"
    title = "Moisture in the coil"
    amplitude = signed("deg/h/(%/h)", (5e-3, 5e-2), (5e-4, 5e-3), "S_w", 100.0)
    shape = (
        shared("time_constant", "s", (36e3, 864e3), "tau", (60.0, 1e8)),
        shared("static_ratio", "1/h", (0.0, 0.1), "S_w0 / S_w", (-10.0, 10.0)),
    )
    needs = ("humidity",)
    sources = ("Moisture-induced strain in fibre-optic gyroscope coils",)
    shows = "a drift over days that follows humidity, which collapses as the chamber cools below dew point"
    confused_with = {
        "stress_relaxation": "a step of humidity, or a dry purge, at constant temperature",
        "ageing": "a step of humidity at constant temperature",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        air = inputs.drive("humidity")
        coil = inputs.memory.lag(self.id, inputs.time, air, shape["time_constant"])
        uptake = 3600.0 * (air - coil) / shape["time_constant"]
        return uptake + shape["static_ratio"] * (coil - 50.0)
