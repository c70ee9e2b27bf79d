"""What the winding remembers: hysteresis, relaxation, slips."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.effect import BiasEffect, ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.quantities import shared, signed


class ThermalHysteresis(BiasEffect):
    """Rate-independent memory of the bias: the branches up and down differ at equal temperature.

    ::

        b = A (s - T) / w,      s = min(max(s, T - w), T + w)

    with half width w [degC], a play operator. The amplitude is A = k_h w [deg/h], which is half of
    the opening of a full loop.

    Source: play operator of hysteresis (literature); ranges, from a loop opening of 0.05 to 1 deg/h
    (tactical) and 0.002 to 0.05 deg/h (navigation) over 100 degC, are engineering ones.
    """

    code = "B8"
    family = "loops"
    place = "coil"
    title = "Thermal hysteresis of the bias"
    amplitude = signed("deg/h", (0.025, 0.5), (0.001, 0.025), "k_h times half_width", 1e3)
    shape = (shared("half_width", "degC", (3.0, 20.0), "half width of the loop", (0.01, 200.0)),)
    needs = ("T",)
    sources = ("A. Visintin, Differential Models of Hysteresis (1994): play operator",)
    shows = "soaks at equal temperature differ after warming and after cooling; minor loops close"
    confused_with = {
        "sensor_lag": "two ramp rates: the loop of a lag opens with the rate, this one does not",
        "stress_relaxation": "a soak of 4 to 6 h: relaxation decays, hysteresis stays",
        "hidden_thermal_node": "a soak of several time constants: the node comes to rest",
        "bias_polynomial": "both branches: a polynomial is one curve",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h of k_h w [deg/h], shape (n,), between -1 and 1."""
        temperature = inputs.temperature("T")
        half_width = shape["half_width"]
        return (inputs.memory.play(self.id, temperature, half_width) - temperature) / half_width


class StressRelaxation(BiasEffect):
    """Stress that a change of temperature leaves in the winding, and that creeps away.

    ::

        b = r sum_j a_j q_j,      dq_j/dt = -q_j / tau_j + dT/dt
        tau_j(T) = tau_j 2**(-(T - 25) / 10)

    r in deg/h per degC; two Maxwell elements, tau_1 = ``time_constant`` at 25 degC and tau_2 five
    times as long, with a_1 = 1 - ``slow_share`` and a_2 = ``slow_share``.

    Source: Maxwell elements of viscoelasticity (literature); time constants of 10 min to 24 h, halved
    every 10 degC, and sizes are engineering ones.
    """

    code = "B9"
    family = "relaxation"
    place = "coil"
    title = "Stress relaxation in the winding"
    amplitude = signed("deg/h/degC", (1e-3, 1e-2), (1e-5, 5e-4), "r", 100.0)
    shape = (
        shared("time_constant", "s", (600.0, 43200.0), "tau_1 at 25 degC", (1.0, 1e8)),
        shared("slow_share", "1", (0.0, 1.0), "share of tau_2", (0.0, 1.0), default=0.3),
    )
    needs = ("T",)
    slower = 5.0
    """tau_2 over tau_1."""
    sources = ("J. D. Ferry, Viscoelastic Properties of Polymers, 3rd ed. (1980)",)
    shows = "an exponential tail in soaks, after all temperatures have come to rest"
    confused_with = {
        "hidden_thermal_node": "a power step and flat sensors; a time constant that falls with temperature",
        "thermal_hysteresis": "a soak of 4 to 6 h: relaxation decays, hysteresis stays",
        "warmup_bias": "a power cycle in a soak restarts the warm-up alone",
        "moisture": "a step of humidity at constant temperature",
        "ageing": "a ramp restarts relaxation, not ageing",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        temperature, share = inputs.temperature("T"), shape["slow_share"]
        # The mean of the rates at both ends: an error goes with the square of the interval.
        pace = np.exp2(0.1 * (temperature - 25.0))
        pace = 0.5 * (pace + inputs.memory.previous(f"{self.id} pace", pace))
        tau = shape["time_constant"] / pace
        # q = T - lag of T solves the element's equation, for any tau(t).
        quick = inputs.memory.lag(f"{self.id} quick", inputs.time, temperature, tau)
        slow = inputs.memory.lag(f"{self.id} slow", inputs.time, temperature, self.slower * tau)
        # Differences first: at rest there is exactly nothing left.
        return (1.0 - share) * (temperature - quick) + share * (temperature - slow)


class ThermalShock(BiasEffect):
    """The winding slips in a fast change of temperature, and partly creeps back.

    ::

        b = J q,      dq/dt = -q / tau + ds/dt,      E[ds/dt] = sign(dT/dt) max(|dT/dt| - threshold, 0)

    J in deg/h per degC that the temperature travels above the threshold [degC/min]. In a simulation s
    is a sum of slips in the direction of the change, drawn from its seed: Poisson in number,
    ``slips`` of them per degC of the excess, and exponential in height, 1 / ``slips`` degC in the mean. A
    replay, which can't know them, has their mean, a smooth course. The reversible part of a shock, a large
    d(gradient)/dt, is ``shupe_pure``; that of the scale factor follows its own nodes.

    Source: slip events above about 5 degC/min (engineering, form and ranges); a published shock test
    for the scale factor, Telemetry and Remote Control 46 (2025) (read).
    """

    code = "B10"
    place = "coil"
    title = "Slips under thermal shock"
    amplitude = signed("deg/h/degC", (1e-3, 2e-2), (2e-5, 5e-4), "J", 100.0)
    shape = (
        shared("threshold", "degC/min", (3.0, 8.0), "rate without slips", (0.1, 100.0)),
        shared("time_constant", "s", (1800.0, 36000.0), "of creeping back", (1.0, 1e8)),
    )
    slips: ClassVar[float] = 4.0
    """Slips per degC that the temperature travels above the threshold: some tens in a shock."""
    needs = ("T",)
    sources = ("Telemetry and Remote Control 46(3) (2025)",)
    shows = "steps that do not repeat while temperature changes faster than the threshold, then relaxation"
    shown_on = "thermal shocks of 60 degC/min with a threshold of 3 degC/min"
    confused_with = {
        "shupe_pure": "after the shock: shupe_pure is gone with the gradient",
        "stress_relaxation": "a slow ramp over the same range leaves no slips",
        "thermal_hysteresis": "a slow ramp over the same range leaves no slips",
    }
    drawn_per_run = True
    seeded = True

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        rate = inputs.dT("T")
        excess = np.sign(rate) * np.maximum(np.abs(rate) - shape["threshold"], 0.0)
        step_min = (inputs.time - inputs.memory.previous(f"{self.id} time", inputs.time)) / 60.0
        slipped = excess * step_min
        if inputs.seed is not None:
            slipped = self._drawn(slipped, inputs.seed, inputs.memory)
        travelled = inputs.memory.total(f"{self.id} travelled", slipped)
        lagged = inputs.memory.lag(f"{self.id} relaxed", inputs.time, travelled, shape["time_constant"])
        return travelled - lagged

    def _drawn(self, mean: FloatArray, seed: int, memory: Memory) -> FloatArray:
        """Sums of slips [degC] whose expected value is `mean` at each sample, shape (n,)."""
        counts = memory.generator(f"{self.id} counts", seed).poisson(self.slips * np.abs(mean))
        # A sum of exponential heights is gamma distributed; samples without a slip draw none.
        found, some = np.zeros(len(mean)), counts > 0
        heights = memory.generator(f"{self.id} heights", seed).standard_gamma(counts[some])
        found[some] = heights / self.slips
        return np.copysign(found, mean)


class SfHysteresis(ScaleFactorEffect):
    """Rate-independent memory of the scale factor, as that of the bias in ``thermal_hysteresis``.

    ::

        s = A (p - T) / w,      p = min(max(p, T - w), T + w)

    with half width w [degC]. The amplitude A = k w [ppm] is half of the opening of a full loop.

    Source: play operator of hysteresis (literature). Sizes from a published peak-to-peak change over
    temperature of 835 ppm raw and 38 ppm after correction (read), taken as full loops.
    """

    code = "D8"
    family = "scale_factor_loops"
    place = "coil"
    title = "Thermal hysteresis of the scale factor"
    amplitude = signed("ppm", (10.0, 400.0), (1.0, 20.0), "k times half_width", 1e5)
    shape = (shared("half_width", "degC", (3.0, 20.0), "half width of the loop", (0.01, 200.0)),)
    needs = ("T",)
    sources = (
        "A. Visintin, Differential Models of Hysteresis (1994): play operator",
        "Telemetry and Remote Control 46(3) (2025): scale factor over temperature",
    )
    shows = "turns in soaks at equal temperature differ after warming and after cooling"
    confused_with = {
        "thermal_hysteresis": "turning and at rest: this one needs a rate",
        "coil_expansion": "turns at each soak on both branches: expansion is one curve",
        "source_wavelength": "turns at each soak on both branches",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm of k w [ppm], shape (n,), between -1 and 1."""
        temperature = inputs.temperature("T")
        half_width = shape["half_width"]
        return (inputs.memory.play(self.id, temperature, half_width) - temperature) / half_width
