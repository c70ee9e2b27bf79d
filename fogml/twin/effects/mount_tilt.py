"""Tilt of the mount over temperature."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import RigEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import tilt_response


class MountTilt(RigEffect):
    """A fixture that tilts with temperature and lets the input axis see the Earth otherwise.

    ::

        upright:     w = 15.041 cos(lat) beta cos(direction + table angle)
        horizontal:  w = 15.041 beta (sin(lat) cos(direction) - cos(lat) sin(heading) sin(direction))
                         + beta cos(direction) (table rate)
        beta = 1e-6 beta_1 (T_case - 25)

    The amplitude is beta_1 [urad/degC]; an upright axis tilts to north at ``direction`` 0 and to west at 90
    deg, a horizontal one upwards at 0 and clockwise in azimuth at 90 deg. 0.013 deg/h per mrad with the axis
    upright at 30 deg. The tilt at 25 degC belongs to the bias. The last term is the rate of a table whose
    axis is up, across the axis.

    Source: rates of Earth and table in the tilted frame (derived); 0.2 to 5 urad/degC is an engineering
    range.
    """

    id = "mount_tilt"
    code = "G2"
    place = "mount"
    title = "Tilt of the mount over temperature"
    amplitude = Quantity("amplitude", "urad/degC", (0.2, 5.0), (0.2, 5.0), "beta_1", (-1e4, 1e4), signed=True)
    shape = (
        Quantity("direction", "deg", (0.0, 180.0), (0.0, 180.0), "of the tilt", (-720.0, 720.0), default=0.0),
    )
    needs = ("T_case", "angle", "facts")
    sources = ("IEEE Std 952-1997",)
    shows = "a static bias over temperature that changes sign when an upright fixture is yawed by 180 deg"
    confused_with = {
        "bias_polynomial": "yaw the fixture by 180 deg, or put the axis the other way up",
        "magnetic": "a Helmholtz coil, or a turned shield",
        "table_wobble": "constant temperature: wobble stays",
        "input_axis_misalignment": "constant temperature: misalignment stays",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per urad/degC [deg/h], shape (n,)."""
        return 1e-6 * inputs.u("T_case") * tilt_response(inputs, shape["direction"])
