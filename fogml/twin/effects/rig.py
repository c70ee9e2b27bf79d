"""Mount and table: how the input axis lies and turns."""

from __future__ import annotations

import math

import numpy as np

from fogml.arrays import FloatArray
from fogml.runs.facts import EARTH_RATE_DEG_H
from fogml.twin.effect import RigEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity, phase, shared, signed, unsigned
from fogml.twin.responses import line, tilt_response


class EarthRate(RigEffect):
    """Earth rate along the input axis, as far as the reference does not hold it.

    ::

        w_e = 15.041067 (cos(lat) a_north + sin(lat) a_up),      a the unit vector along the input axis

    so 15.041067 sin(lat) for an axis that points up, 15.041067 cos(lat) cos(heading) for a horizontal one.
    Where latitude and attitude are stated it is part of the reference and of every replay; this is what is
    missing where they are not, or are wrong, and the amplitude is its size. At a fixed attitude it is one
    with the nominal bias.

    Source: Earth rate, derived.
    """

    code = "G1"
    place = "mount"
    title = "Earth rate outside the reference"
    amplitude = Quantity(
        "amplitude",
        "deg/h",
        (0.0, EARTH_RATE_DEG_H),
        (0.0, EARTH_RATE_DEG_H),
        "missing Earth rate",
        (-EARTH_RATE_DEG_H, EARTH_RATE_DEG_H),
        signed=True,
    )
    sources = ("IEEE Std 952-1997",)
    shows = "a constant offset, and another one in another attitude"
    confused_with = {
        "magnetic": "a Helmholtz coil, or a turned shield: both are once a turn of heading",
        "turn_on_bias": "power cycles at the same attitude; then another attitude",
        "mount_tilt": "constant temperature: a tilt moves with it",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,): ones."""
        return np.ones(len(inputs))


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

    code = "G2"
    place = "mount"
    title = "Tilt of the mount over temperature"
    amplitude = signed("urad/degC", (0.2, 5.0), (0.2, 5.0), "beta_1", 1e4)
    shape = (shared("direction", "deg", (0.0, 180.0), "of the tilt", (-720.0, 720.0), default=0.0),)
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
        return 1e-6 * inputs.u("T_case") * tilt_response(inputs, shape["direction"])


class InputAxisMisalignment(RigEffect):
    """The input axis goes round the table's axis on a cone and meets Earth rate across it.

    ::

        w = sin(delta) E(direction, table angle) + (cos(delta) - 1) (3600 rate + earth)

    delta is the amplitude and E what a tilt picks up of the rates across it, as in ``mount_tilt``: Earth's,
    and with a horizontal axis the table's, 180 deg/h for 5 mrad at 10 deg/s. The signature is that pick-up
    for a small delta; `added_rate` is all of it. The loss of scale factor delta**2 / 2, 12.5 ppm at 5 mrad,
    can't be told from the nominal scale factor, nor changes with temperature of 0.1 to 5 urad/degC from its
    slope.

    Source: geometry (derived); 0.5 to 20 mrad (tactical) and 0.05 to 0.5 mrad (navigation) are engineering
    ranges.
    """

    code = "G3"
    place = "mount"
    title = "Misalignment of the input axis"
    amplitude = unsigned("mrad", (0.5, 20.0), (0.05, 0.5), "delta", 1500.0)
    shape = (phase("direction", "of the axis"),)
    needs = ("angle", "facts")
    sources = ("IEEE Std 952-1997", "Patent on decoupling scale factor and misalignment")
    shows = "once a turn of the table, and a loss of scale factor that goes with the cosine of tilt"
    shown_on = "a turn of the table and back in two hours"
    confused_with = {
        "table_wobble": "unmount and mount again turned by 180 deg: wobble stays with the table",
        "mount_tilt": "temperature: a tilt of the mount changes with it",
        "magnetic": "a Helmholtz coil, or a turned shield",
        "coil_expansion": "a series of tilts in four states separates scale factor and misalignment",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return 1e-3 * tilt_response(inputs, shape["direction"])

    def added_rate(
        self, signature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What the misalignment adds to the rate about the input axis [deg/h], exactly; shape (n,)."""
        pick_up = 1e3 * math.sin(1e-3 * amplitude) * signature
        return pick_up + 1e-6 * scale_factor_loss_ppm(amplitude) * inputs.input_rate_deg_h


def scale_factor_loss_ppm(misalignment: float) -> float:
    """Change of the scale factor, cos(delta) - 1, for a misalignment in mrad [ppm]; never positive."""
    return -2e6 * math.sin(0.5e-3 * misalignment) ** 2


class TableWobble(RigEffect):
    """A table whose plate is not square to its axis tilts the unit round with it.

    ::

        w = eps E(phase, table angle),      and a loss of eps**2 / 2 of the rate

    eps is the amplitude: 1 to 10 arcsec for a good table, 30 to 60 for a shaft through a chamber's wall. E
    is what such a tilt picks up, as in ``mount_tilt``: Earth rate once a turn with the axis upright, with a
    horizontal one the table's rate too. The loss is below 0.1 ppm and left out.

    Source: geometry (derived); ranges are engineering ones.
    """

    code = "G4"
    title = "Wobble of the table"
    amplitude = unsigned("arcsec", (1.0, 60.0), (1.0, 10.0), "eps", 1e5)
    shape = (phase("phase", "at angle 0"),)
    needs = ("angle", "facts")
    sources = ("IEEE Std 952-1997",)
    shows = "a sinusoid over the table's angle, once a turn"
    shown_on = "a turn of the table and back in two hours"
    confused_with = {
        "input_axis_misalignment": "mount the unit turned by 180 deg: wobble stays with the table",
        "magnetic": "a Helmholtz coil, or a turned shield",
        "mount_tilt": "temperature: a tilt of the mount changes with it",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return math.radians(1.0) / 3600.0 * tilt_response(inputs, shape["phase"])


class TableRateError(RigEffect):
    """The table turns unevenly: its true rate is not the recorded one.

    ::

        w = 1e-6 A rate cos(harmonic angle + phase)

    A [ppm] is 1 to 100 over whole turns and up to 1e4 within a degree; ``harmonic`` is 1 for the
    encoder's eccentricity, or the number of the motor's poles. A constant part is one with the
    nominal scale factor.

    Source: rate table practice; ranges are engineering ones.
    """

    code = "G5"
    place = "table"
    title = "Error of the table's rate"
    amplitude = unsigned("ppm", (1.0, 100.0), (1.0, 100.0), "A", 1e5)
    shape = (
        shared("harmonic", "1", (1.0, 36.0), "periods a turn", (0.01, 1e4), default=1.0),
        phase("phase", "at angle 0"),
    )
    needs = ("rate", "angle")
    sources = ("IEEE Std 952-1997",)
    shows = "an error in proportion to the rate, periodic over the table's angle"
    shown_on = "a turn of the table and back in two hours"
    confused_with = {
        "sf_nonlinearity": "another table, or the time of whole turns",
        "logger_skew": "between the edges of the rate: a skew shows at edges alone",
        "sf_asymmetry": "the time of whole turns of both signs",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        uneven = inputs.table_cosine(shape["phase"], shape["harmonic"])
        return 3600e-6 * inputs.table_rate * uneven


class TableJitter(RigEffect):
    """A true oscillation of the table about the input axis, as the samples alias it.

    ::

        w = a sin(2 pi t / alias_period + phase),      1 / alias_period = |f - m f_s|

    for jitter at f and samples at f_s. The amplitude a is that in the recording, after the samples'
    averaging of the jitter, sinc(f / f_s) of its size.

    Source: aliasing of a line (derived); ranges are engineering ones.
    """

    code = "F2"
    title = "Jitter of the table"
    amplitude = unsigned("deg/h", (0.01, 10.0), (1e-3, 1.0), "a", 1e6)
    shape = (
        shared("alias_period", "s", (30.0, 600.0), "in the recording", (1e-3, 1e7)),
        phase("phase", "at time 0"),
    )
    sources = ("IEEE Std 952-1997",)
    shows = "a narrow line at any temperature, gone with the table's servo off"
    confused_with = {
        "acoustic": "the fan off: this line stays",
        "supply_ripple": "another supply, or the table's servo off",
        "chamber_ripple": "the chamber off",
        "sinusoidal": "the table's servo off",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return line(inputs, shape["alias_period"], shape["phase"])
