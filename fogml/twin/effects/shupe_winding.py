"""Shupe effect of the unit's own winding, layer by layer."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.coil import LayeredCoil, lead_sensitivity
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.plant.network import PlantState
from fogml.twin.quantities import Quantity


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

    id = "shupe_winding"
    code = "B12"
    title = "Shupe effect of the unit's winding"
    amplitude = Quantity("amplitude", "1", (0.5, 5.0), (0.5, 2.0), "A, over theory", (-1e4, 1e4), signed=True)
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
        travelled = LayeredCoil.of(inputs.coil).travelled(
            inputs.time, inputs.temperature("T_in"), inputs.temperature("T_out"), state
        )
        wound, coil = inputs.rate_per_minute(self.id, travelled), inputs.coil
        if coil.lead_1 == coil.lead_2 == 0.0:
            return wound
        common = inputs.dT("T")
        first, second = inputs.dT("T_electronics") - common, inputs.dT("T_case") - common
        return wound + lead_sensitivity(coil) * (coil.lead_1 * first - coil.lead_2 * second)
