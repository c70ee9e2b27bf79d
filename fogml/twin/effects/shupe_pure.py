"""Pure Shupe effect of a changing gradient across the coil."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class ShupePure(BiasEffect):
    """Non-reciprocity of a temperature gradient across the winding that changes with time.

    ::

        b = S_g d(T_out - T_in)/dt

    The radial form of Shupe's integral over the fibre (`fogml.twin.coil`), with S_g in deg/h per
    degC/min. Zero in soaks and on the plateau of a long ramp. S_g is 0.05 to 2 for a quadrupole winding,
    about 4 for a dipole and 90 for a simple cylinder.

    Source: Shupe, Applied Optics 19 (1980) 654; Frigo, SPIE 412 (1983) 268; Lefevre (literature).
    Form and size derived with a layer model; ranges are engineering ones.
    """

    id = "shupe_pure"
    code = "B1"
    family = "gradient_rate"
    place = "coil"
    title = "Shupe effect of a changing gradient"
    amplitude = Quantity(
        "amplitude", "deg/h/(degC/min)", (0.05, 2.0), (2e-3, 0.1), "S_g", (-1e3, 1e3), signed=True
    )
    needs = ("T_in", "T_out")
    sources = (
        "D. M. Shupe, Applied Optics 19 (1980) 654",
        "N. J. Frigo, SPIE 412 (1983) 268",
        "H. C. Lefevre, The Fiber-Optic Gyroscope",
    )
    shows = "spikes at start, stop and reversal of a ramp; nothing in soaks and in long constant ramps"
    confused_with = {
        "shupe_mohr": "long ramps with sharp start and stop: this one spikes, shupe_mohr has a plateau",
        "shupe_trim": "a power step: it warms the leads before any gradient across the coil",
        "azimuthal_gradient": "turn the unit in the airflow: only azimuthal_gradient changes",
        "sensor_lag": "a power step: the lag is one of the sensor and leaves other heat inputs alone",
        "logger_skew": "edges of the table rate show the clock's error with no temperature in it",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/(degC/min) [deg/h], shape (n,)."""
        return inputs.dT("T_out") - inputs.dT("T_in")
