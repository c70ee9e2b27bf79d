"""The Shupe effect: gradients across the coil that change, its leads and its winding."""

from __future__ import annotations

from fogml.arrays import FloatArray
from fogml.twin.coil import LayeredCoil, lead_sensitivity, midpoint_sensitivity
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.plant.network import PlantState
from fogml.twin.quantities import phase, shared, signed


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

    code = "B1"
    family = "gradient_rate"
    place = "coil"
    title = "Shupe effect of a changing gradient"
    amplitude = signed("deg/h/(degC/min)", (0.05, 2.0), (2e-3, 0.1), "S_g", 1e3)
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
        return inputs.dT("T_out") - inputs.dT("T_in")


class ShupeTrim(BiasEffect):
    """Fibre ends of unequal length: the coil's middle is off by delta.

    ::

        b = 2 n c_T delta (dT_coil/dt - dT_leads/dt) / D,      c_T = dn/dT + n alpha

    1.05 deg/h per degC/min and metre for the reference coil (D = 0.1 m). A rate common to coil and
    leads gives nothing. The leads lie between electronics and case and have the mean of both; in a chamber
    they ramp as the coil does, so that starts and ends of ramps show it. T stands for the coil's mean.

    Source: Senol et al., Scientific Reports (2024), arXiv 2311.16908 and Honeywell CA2137463C (read)
    for trimming; the coefficient is derived; ranges are engineering ones.
    """

    code = "B2"
    title = "Mid-point error of the coil"
    amplitude = signed("m", (0.1, 2.0), (0.005, 0.1), "delta", 1e3)
    needs = ("T", "T_leads")
    sources = ("M. Senol et al., Scientific Reports (2024), arXiv 2311.16908", "Honeywell, CA2137463C")
    shows = "at starts and ends of ramps, while coil and leads warm at different rates, and after power-on"
    confused_with = {
        "shupe_mohr": "long ramps: shupe_mohr has a plateau, this one only their starts and ends",
        "shupe_pure": "a power step: it warms the leads before any gradient across the coil",
        "sensor_lag": "a lag acts by the slope of the static bias, which changes sign at its extremum",
        "logger_skew": "edges of the table rate show the clock's error with no temperature in it",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return midpoint_sensitivity(inputs.coil) * (inputs.dT("T") - inputs.dT("T_leads"))


class PigtailShupe(BiasEffect):
    """Leads of unequal length or place: one near the electronics, the other near the case.

    ::

        b = n c_T (l_1 (dT_electronics/dt - dT/dt) - l_2 (dT_case/dt - dT/dt)) / D,    c_T = dn/dT + n alpha

    0.52 deg/h per degC/min and metre for the reference coil; T is the coil's. A rate common to all fibre
    gives nothing, as the integral of 2 z - L vanishes: in a long ramp of the chamber there is none of it.
    The amplitude is l_1; ``length_ratio`` is l_2 / l_1.

    Source: Shupe's integral over the fibre's ends and what lies between (derived); ranges are engineering
    ones, a navigation gyro's leads lying together but for some centimetres.
    """

    code = "B6"
    family = "leads"
    place = "leads"
    title = "Shupe effect of the leads"
    amplitude = signed("m", (0.1, 1.0), (0.005, 0.1), "l_1", 100.0)
    shape = (shared("length_ratio", "1", (0.3, 3.0), "l_2 / l_1", (-100.0, 100.0)),)
    needs = ("T_electronics", "T_case", "T")
    sources = ("D. M. Shupe, Applied Optics 19 (1980) 654",)
    shows = "fast answers to power-on and fans, and spikes at starts and ends of ramps; none along a ramp"
    confused_with = {
        "warmup_bias": "fans and ramps: a warm-up depends on the time since power-on alone",
        "shupe_pure": "a power step: the electronics move first",
        "shupe_mohr": "a long ramp: shupe_mohr has a plateau, this one none",
        "shupe_trim": "a sensor on the case: leads side by side feel the same",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        coil = inputs.dT("T")
        first, second = inputs.dT("T_electronics") - coil, inputs.dT("T_case") - coil
        return lead_sensitivity(inputs.coil) * (first - shape["length_ratio"] * second)


class AzimuthalGradient(BiasEffect):
    """Air that blows from one side warms one side of the coil first.

    ::

        b = S_az cos(psi - psi_0) d(T_out - T_in)/dt

    psi is the table's angle, psi_0 the shape's ``phase``; the cosine is its mean over the sample. The
    gradient from face to face stands for the horizontal one, which the same heat flow drives. S_az in
    deg/h per degC/min.

    Source: Shupe's integral for a side-on gradient (derived); range 0.1 to 0.3 of S_g of shupe_pure
    (engineering).
    """

    code = "B7"
    place = "coil"
    title = "Shupe effect of a side-on gradient"
    amplitude = signed("deg/h/(degC/min)", (0.01, 0.6), (4e-4, 0.03), "S_az", 1e3)
    shape = (phase("phase", "angle of the airflow"),)
    needs = ("T_in", "T_out", "angle")
    sources = ("D. M. Shupe, Applied Optics 19 (1980) 654",)
    shows = "spikes at the ends of ramps whose size and sign change as the unit is turned in the airflow"
    confused_with = {
        "shupe_pure": "turn the unit in the airflow: shupe_pure does not change",
        "magnetic": "in soaks only the magnetic part goes on",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return inputs.table_cosine(-shape["phase"]) * (inputs.dT("T_out") - inputs.dT("T_in"))


class ShupeWinding(BiasEffect):
    """Shupe's integral over the winding that the twin's coil states, with heat that goes from layer to layer.

    ::

        b = A n c_T / (L D) Int_0^L (2 z - L) dT(z)/dt dz  +  A n c_T / D (l_1 d_1 - l_2 d_2)
        dT_i/dt = kappa (T_i-1 - 2 T_i + T_i+1) / pitch**2

    The fibre passes the layers i in the order of the ``winding`` (cylinder, dipole, quadrupole, octupole);
    the first and the last one have the temperatures of the coil's faces T_in and T_out. The leads' part is
    that of ``pigtail_shupe``: d_1 and d_2 are the rates of T_electronics and T_case less that of T. Length,
    diameter, winding, layers, pitch, diffusivity and leads are those of the twin's ``coil``. A is the size
    over that of theory, 1 for a faultless winding; crossings and uneven tension make up to some times as
    much. At the onset of a ramp of 1 degC/min the reference coil has 22.5 (cylinder), 1.76 (dipole), 0.23
    (quadrupole) or 0.054 deg/h (octupole) with faces 120 and 240 s behind; on its plateau none.

    Source: Shupe, Applied Optics 19 (1980) 654; Frigo, SPIE 412 (1983) 268; conduction derived; the range of
    A is an engineering one.
    """

    code = "B12"
    title = "Shupe effect of the unit's winding"
    amplitude = signed("1", (0.5, 5.0), (0.5, 2.0), "A, over theory", 1e4)
    needs = ("T_in", "T_out", "T", "T_electronics", "T_case")
    conflicts = ("shupe_pure",)
    sources = ("D. M. Shupe, Applied Optics 19 (1980) 654", "N. J. Frigo, SPIE 412 (1983) 268")
    shows = "spikes at start, stop and reversal of a ramp; nothing in soaks and in long constant ramps"
    confused_with = {
        "shupe_pure": "not apart but by the spike's course: this one says where that one comes from",
        "shupe_mohr": "long ramps with sharp start and stop: this one spikes, shupe_mohr has a plateau",
        "shupe_trim": "a power step: it warms the leads before any gradient across the coil",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response over that of theory [deg/h], shape (n,)."""
        state = inputs.memory.kept(f"{self.id} layers", PlantState)
        travelled = LayeredCoil(inputs.coil).travelled(
            inputs.time, inputs.temperature("T_in"), inputs.temperature("T_out"), state
        )
        wound, coil = inputs.rate_per_minute(self.id, travelled), inputs.coil
        if coil.lead_1 == coil.lead_2 == 0.0:
            return wound
        common = inputs.dT("T")
        first, second = inputs.dT("T_electronics") - common, inputs.dT("T_case") - common
        return wound + lead_sensitivity(coil) * (coil.lead_1 * first - coil.lead_2 * second)


class AxialGradient(BiasEffect):
    """The coil's top, under the lid, and its bottom, on the plate, warm at different rates.

    ::

        b = S_ax d(T_top - T_bottom)/dt

    The axial form of Shupe's integral: a winding that is symmetric layer by layer is not turn by turn. S_ax
    in deg/h per degC/min. Top and bottom are nodes of the plant (`fogml.twin.plant.coil`), which the effect
    brings along where the twin states none: the bottom follows the plate, the top the lid. Zero in soaks and
    on the plateau of a long ramp, and zero where top and bottom are alike.

    Source: Shupe, Applied Optics 19 (1980) 654 (form derived for a gradient along the axis); 0.1 to 0.5 of
    S_g of shupe_pure (engineering).
    """

    code = "B13"
    title = "Shupe effect of an axial gradient"
    amplitude = signed("deg/h/(degC/min)", (0.02, 1.0), (1e-3, 0.05), "S_ax", 1e3)
    needs = ("T_top", "T_bottom")
    sources = ("D. M. Shupe, Applied Optics 19 (1980) 654",)
    shows = "slow spikes at start and stop of a ramp, as long as the plate takes to follow the air"
    confused_with = {
        "shupe_pure": "sensors on top and bottom; a warm plate under a cold unit moves this one alone",
        "azimuthal_gradient": "turn the unit in the airflow: only azimuthal_gradient changes",
        "hidden_thermal_node": "a sensor on the plate; that one acts on the static bias",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return inputs.dT("T_top") - inputs.dT("T_bottom")
