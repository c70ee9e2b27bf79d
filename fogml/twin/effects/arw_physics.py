"""Angle random walk as optics and receiver make it."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import WhiteNoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.optics import phase_noise_to_walk
from fogml.twin.quantities import Quantity


class ArwPhysics(WhiteNoiseEffect):
    """Shot, thermal and excess noise of the light at the receiver.

    ::

        S = (2 e I + 4 k T / R_f + I**2 RIN) / (R P_0 sin(phi_m) / 2)**2,      I = R P_0 (1 + cos phi_m) / 2
        RIN = 1.33 lambda**2 / (c dlambda),      N = A sqrt(S / 2) / K_S

    with P_0 = power 10**(-power_loss |T_electronics - 25| / 10), or by the course of ``light_power`` where
    that is on, for the unit's coil and receiver as the twin states them; the source is polarised and Gaussian
    (2 in place of 1.33 for a flat spectrum); ``modulation_depth`` is phi_m and the amplitude A the noise over
    that of physics. At 20 uW N is 1.89e-3, 8.2e-4 and 4.9e-4 deg/sqrt(h) for pi/2, 3 pi/4 and 7 pi/8 with the
    reference coil. Light that falls off room temperature raises N where shot or thermal noise leads, and not
    where excess noise does.

    Source: Lefevre (literature); numbers derived; ranges are engineering ones.
    """

    id = "arw_physics"
    code = "E8"
    title = "Angle random walk from photon noise"
    amplitude = Quantity("amplitude", "1", (1.0, 3.0), (1.0, 1.5), "over photon noise", (0.0, 1e4))
    shape = (
        Quantity("power", "uW", (5.0, 50.0), (10.0, 100.0), "P_0 at the receiver at 25 degC", (1e-3, 1e6)),
        Quantity("modulation_depth", "rad", (1.57, 2.75), (1.57, 2.75), "phi_m", (0.01, 3.13)),
        Quantity("power_loss", "dB/degC", (0.02, 0.05), (0.02, 0.05), "of the light off 25 degC", (0.0, 1.0)),
    )
    needs = ("T_electronics",)
    conflicts = ("angle_random_walk",)
    sources = (
        "H. C. Lefevre, The Fiber-Optic Gyroscope",
        "arXiv 2208.11213",
    )
    shows = "the Allan deviation at middle times, with slope -1/2; more off 25 degC unless excess noise leads"
    confused_with = {
        "angle_random_walk": "not apart: this one says where that one comes from",
    }
    candidate = False

    def strength(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Angle random walk of the unit's coil [deg/sqrt(h)], shape (n,)."""
        depth, power = shape["modulation_depth"], 1e-6 * shape["power"]
        dimmed = power * inputs.light.level(inputs.u("T_electronics"), power_loss=shape["power_loss"])
        receiver = inputs.light.receiver
        return phase_noise_to_walk(receiver.phase_density(inputs.coil, dimmed, depth), inputs.coil)
