"""The light at the receiver: what detects it, and how its power goes with temperature."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.optics import Receiver


@dataclass(frozen=True)
class Light:
    """Receiver and course of the light of a unit.

    Attributes
    ----------
    receiver
        Diode, amplifier and line width of the source.
    power_loss, power_slope
        Loss off 25 degC [dB/degC] and change [dB/(100 degC)] of the light's power, of which noise, loop gain
        and cross-talk then all go; None where each of these states its own.
    """

    receiver: Receiver = field(default_factory=Receiver)
    power_loss: float | None = None
    power_slope: float = 0.0

    def level(self, u: FloatArray, *, power_loss: float = 0.0, power_slope: float = 0.0) -> FloatArray:
        """Power over that at 25 degC at a temperature u off it [degC], shape (n,).

        ::

            P / P_0 = 10**(power_slope u / 1000 - power_loss |u| / 10)

        with the unit's own course where it has one, else with the stated one.
        """
        if self.power_loss is not None:
            power_loss, power_slope = self.power_loss, self.power_slope
        return np.asarray(np.power(10.0, 1e-3 * power_slope * u - 0.1 * power_loss * np.abs(u)))
