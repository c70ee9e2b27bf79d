"""Creep of adhesive and coating."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity

_SLOWER = 5.0


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

    id = "stress_relaxation"
    code = "B9"
    family = "relaxation"
    place = "coil"
    title = "Stress relaxation in the winding"
    amplitude = Quantity(
        "amplitude", "deg/h/degC", (1e-3, 1e-2), (1e-5, 5e-4), "r", (-100.0, 100.0), signed=True
    )
    shape = (
        Quantity("time_constant", "s", (600.0, 43200.0), (600.0, 43200.0), "tau_1 at 25 degC", (1.0, 1e8)),
        Quantity("slow_share", "1", (0.0, 1.0), (0.0, 1.0), "share of tau_2", (0.0, 1.0), default=0.3),
    )
    needs = ("T",)
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
        """Response per deg/h/degC [deg/h], shape (n,)."""
        temperature, share = inputs.temperature("T"), shape["slow_share"]
        tau = shape["time_constant"] * np.exp2(-0.1 * (temperature - 25.0))
        # q = T - lag of T solves the element's equation, for any tau(t).
        quick = inputs.memory.lag(f"{self.id} quick", inputs.time, temperature, tau)
        slow = inputs.memory.lag(f"{self.id} slow", inputs.time, temperature, _SLOWER * tau)
        # Differences first: at rest there is exactly nothing left.
        return (1.0 - share) * (temperature - quick) + share * (temperature - slow)
