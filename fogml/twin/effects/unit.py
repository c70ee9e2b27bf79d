"""The bias of the unit itself: over temperature, field, attitude and time."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.runs.attitude import UP, earth_field
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.noise import stream
from fogml.twin.quantities import phase, shared, signed
from fogml.twin.set_up import EARTH_HORIZONTAL_UT, EARTH_VERTICAL_UT


class BiasPolynomial(BiasEffect):
    """The orders of the static bias above those of the nominal gyro.

    ::

        b = p_3 (v**3 + r_4 v**4 + r_5 v**5),      v = (T - 25) / 50

    The amplitude is p_3; ``quartic_ratio`` r_4 and ``quintic_ratio`` r_5 are p_4 / p_3 and p_5 / p_3.

    Source: IEEE Std 952-1997 (literature): thermal terms of the output model; ranges, half of a swing
    of 0.5 to 10 deg/h (tactical) and 0.01 to 0.2 deg/h (navigation), are engineering ones.
    """

    code = "C1"
    family = "static"
    place = "coil"
    title = "Static bias of third to fifth order in temperature"
    amplitude = signed("deg/h", (0.25, 5.0), (5e-3, 0.1), "p_3", 1e3)
    shape = (
        shared("quartic_ratio", "1", (-1.0, 1.0), "p_4 / p_3", (-1e3, 1e3)),
        shared("quintic_ratio", "1", (-1.0, 1.0), "p_5 / p_3", (-1e3, 1e3)),
    )
    needs = ("T",)
    sources = ("IEEE Std 952-1997",)
    shows = "values at soaks on a smooth curve over temperature, the same warming and cooling"
    confused_with = {
        "shupe_mohr": "more than one ramp: in one, temperature, time and rate go together",
        "mount_tilt": "yaw the fixture by 180 deg: only the tilt follows Earth's projection",
        "polarization_nonreciprocity": "a slow sweep with at least 10 points a period",
        "electronic_crosstalk": "a power step moves the electronics alone",
        "thermal_hysteresis": "both branches: a polynomial is one curve",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        v = inputs.u("T") / 50.0
        return v * v * v * (1.0 + v * (shape["quartic_ratio"] + v * shape["quintic_ratio"]))


class Magnetic(BiasEffect):
    """Faraday effect of a twisted fibre, radial, and its axial companion.

    ::

        b = s_r (B_x cos(psi) + B_y sin(psi)) + s_a B_z

    B in the gyro frame, z along the coil's axis [G]; s_r is the amplitude, after the shield, psi the
    shape's ``phase`` and ``axial_ratio`` is s_a / s_r. Where no field is recorded, it is Earth's in the
    gyro's attitude, in which the coil turns by the table's angle: 0.2 G to the north, and 0.4 G down in the
    northern hemisphere or up in the southern, or what the twin's surroundings state.

    Source: Hotate and Tabe, Applied Optics 25 (1986) and 26 (1987); IEEE Access 8 (2020) 222242, axial
    (read); ranges partly literature, partly engineering.
    """

    code = "C3"
    place = "coil and shield"
    title = "Magnetic sensitivity"
    amplitude = signed("deg/h/G", (0.05, 1.0), (1e-3, 2e-2), "s_r", 100.0)
    shape = (
        phase("phase", "direction of s_r"),
        shared("axial_ratio", "1", (0.1, 0.5), "s_a / s_r", (-100.0, 100.0)),
    )
    needs = ("B_x", "B_y", "B_z", "angle")
    sources = (
        "K. Hotate and K. Tabe, Applied Optics 25 (1986) 1086; 26 (1987)",
        "IEEE Access 8 (2020) 222242",
    )
    shows = "a sinusoid over the table's angle, once a turn; steps with currents near the unit"
    shown_on = "a turn of the table and back in two hours"
    confused_with = {
        "earth_rate": "a Helmholtz coil, or a turned shield: both are once a turn of heading",
        "mount_tilt": "a Helmholtz coil, or a turned shield",
        "table_wobble": "a Helmholtz coil, or a turned shield",
        "chamber_pickup": "a field sensor, or the same current in another loop",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        psi = np.radians(shape["phase"])
        if any(name in inputs.drives for name in ("B_x", "B_y", "B_z")):
            radial = np.cos(psi) * inputs.drive("B_x") + np.sin(psi) * inputs.drive("B_y")
            axial = inputs.drive("B_z")
        else:
            field = earth_field(inputs.facts, inputs.angle_deg, EARTH_HORIZONTAL_UT, EARTH_VERTICAL_UT)
            radial = np.cos(psi) * field["B_x"] + np.sin(psi) * field["B_y"]
            axial = field["B_z"]
        # 100 uT are 1 G.
        return (radial + shape["axial_ratio"] * axial) / 100.0


class GSensitivity(BiasEffect):
    """The winding's weight deforms the coil.

    ::

        b = g_1 a_ia + g_2 a_x

    a in g along the input axis and along the gyro's x axis, 1 where an axis points up; x does so when the
    input axis is horizontal. The attitude is the set-up's, and changes where a table turns about a horizontal
    axis. The amplitude is g_1 [deg/h/g], ``cross_ratio`` g_2 / g_1.

    Source: IEEE Std 952-1997 (literature); ranges are engineering ones, usually 0 in a fibre-optic gyro.
    """

    code = "C13"
    title = "Sensitivity to acceleration"
    amplitude = signed("deg/h/g", (1e-3, 2e-2), (2e-5, 1e-3), "g_1", 100.0)
    shape = (shared("cross_ratio", "1", (-1.0, 1.0), "g_2 / g_1", (-1e3, 1e3)),)
    needs = ("facts",)
    sources = ("IEEE Std 952-1997",)
    shows = "a constant that changes with attitude: a tumble test over several positions"
    shown_on = "a turn about a horizontal axis in an hour"
    confused_with = {
        "earth_rate": "positions with equal Earth projection and another weight",
        "turn_on_bias": "several power cycles",
        "mount_tilt": "positions with equal Earth projection and another weight",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        if inputs.facts.input_axis is None:
            return np.zeros(len(inputs))
        held = inputs.attitude
        sensitive = held.z + shape["cross_ratio"] * held.x
        return np.zeros(len(inputs)) + inputs.carried(UP, sensitive, mean=False)


class TurnOnBias(BiasEffect):
    """The bias is another one after each power-on.

    ::

        b = sigma_on xi_k,      xi_k ~ N(0, 1),      k = 0, 1, 2 ... the power cycle

    A simulation draws xi_k from its seed. A replay does not know them: there the amplitude is what the
    run's first power cycle has, xi_0 = 1, and those of later cycles are taken for what is expected, 0.

    Source: IEEE Std 952-1997 (literature): bias repeatability over at least six power cycles; ranges are
    engineering ones.
    """

    code = "C9"
    family = "power_cycles"
    place = "electronics"
    title = "Turn-on bias"
    amplitude = signed("deg/h", (0.05, 1.0), (5e-4, 5e-3), "sigma_on", 1e3)
    needs = ("powered_on",)
    sources = ("IEEE Std 952-1997",)
    shows = "a constant within a run that differs between runs, and a step at a power cycle"
    confused_with = {
        "earth_rate": "turn the unit over, or several power cycles",
        "g_sensitivity": "several power cycles",
        "ageing": "several power cycles on one day",
    }
    drawn_per_run = True
    seeded = True

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        cycles = len(inputs.power_ons_s) + 1
        if inputs.seed is None:
            return np.eye(1, cycles)[0][inputs.power_cycle]
        return stream(inputs.seed, self.id).standard_normal(cycles)[inputs.power_cycle]


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

    code = "C12"
    family = "warm_up"
    place = "electronics"
    title = "Warm-up of the bias"
    amplitude = signed("deg/h", (0.2, 5.0), (0.01, 0.2), "w_1", 1e3)
    shape = (
        shared("fast_time_constant", "s", (60.0, 300.0), "tau_1", (0.1, 1e6)),
        shared("slow_time_constant", "s", (600.0, 2400.0), "tau_2", (0.1, 1e7)),
        shared("slow_ratio", "1", (0.3, 3.0), "w_2 / w_1", (-1e3, 1e3)),
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
        slow = shape["slow_ratio"] * inputs.unwarmed(shape["slow_time_constant"])
        return inputs.unwarmed(shape["fast_time_constant"]) + slow


class Ageing(BiasEffect):
    """The bias creeps with time, ever more slowly.

    ::

        b = b_1 ln(1 + t / tau)

    t is the time since the unit's first run began [s]: by the facts ``in_use_since`` and ``started``, or by
    ``started`` alone where several runs are told together; else it is the recording's time. tau is the
    shape's ``time_constant``; well before tau it is a straight line. That of the scale factor is too small
    for a recording to show.

    Source: logarithmic ageing (engineering); ranges of b_1 give 0.1 to 1 deg/h (tactical) and 0.002 to
    0.02 deg/h (navigation) in the first year for tau = 100 h.
    """

    code = "C10"
    family = "ageing"
    place = "unit"
    title = "Ageing of the bias"
    amplitude = signed("deg/h", (0.02, 0.2), (4e-4, 4e-3), "b_1", 100.0)
    shape = (shared("time_constant", "s", (3600.0, 36e5), "tau", (1.0, 1e9)),)
    sources = ("Engineering ranges of the catalogue",)
    shows = "a slow drift with time, whatever the temperature does"
    confused_with = {
        "warmup_bias": "a power cycle at constant temperature, twice: only the warm-up starts again",
        "stress_relaxation": "a ramp restarts relaxation, not ageing",
        "moisture": "a step of humidity at constant temperature",
        "rate_ramp": "a soak of more than 6 h: a ramp of the noise is no logarithm",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return np.log1p(np.maximum(inputs.time + inputs.epoch_s, 0.0) / shape["time_constant"])
