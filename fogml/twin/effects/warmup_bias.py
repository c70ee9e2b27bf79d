"""Bias after power-on."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class WarmupBias(BiasEffect):
    """What power-on does to the bias, as a function of the time since, where no node shows it.

    ::

        b = w_1 (exp(-t / tau_1) + r exp(-t / tau_2))

    t is the time since power-on of a unit that was cold; while it is off each part comes back as it went, so
    that a minute off brings little of it. The amplitude is w_1, ``fast_time_constant`` and
    ``slow_time_constant`` are tau_1 and tau_2, ``slow_ratio`` r is w_2 / w_1.

    Source: form and ranges are engineering ones; a north-seeker's start-up error of 0.09 to 0.1 deg, from
    the patent on seeking north at start-up (read), is of that size.
    """

    id = "warmup_bias"
    code = "C12"
    family = "warm_up"
    place = "electronics"
    title = "Warm-up of the bias"
    amplitude = Quantity("amplitude", "deg/h", (0.2, 5.0), (0.01, 0.2), "w_1", (-1e3, 1e3), signed=True)
    shape = (
        Quantity("fast_time_constant", "s", (60.0, 300.0), (60.0, 300.0), "tau_1", (0.1, 1e6)),
        Quantity("slow_time_constant", "s", (600.0, 2400.0), (600.0, 2400.0), "tau_2", (0.1, 1e7)),
        Quantity("slow_ratio", "1", (0.3, 3.0), (0.3, 3.0), "w_2 / w_1", (-1e3, 1e3)),
    )
    needs = ("powered_on",)
    sources = ("Patent on north seeking at start-up",)
    shows = "an exponential after power-on at constant temperature"
    confused_with = {
        "ageing": "a power cycle at constant temperature, twice: only the warm-up starts again",
        "self_heating": "a sensor on the electronics",
        "stress_relaxation": "a power cycle in a soak restarts the warm-up alone",
        "shupe_pure": "power-on in a soak, not in a ramp",
        "source_wavelength": "with the table turning and at rest: the source acts on the scale factor",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h of w_1 [deg/h], shape (n,)."""
        slow = shape["slow_ratio"] * inputs.unwarmed(shape["slow_time_constant"])
        return inputs.unwarmed(shape["fast_time_constant"]) + slow
