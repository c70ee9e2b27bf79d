"""Thermally induced non-reciprocity of a wound coil by Shupe's integral: windings, layers of fibre.

Light that goes round both ways meets a piece of fibre at different times. Where that piece warms
at a rate ``Tdot(z)``, the difference reads as a rate of turn

::

    Omega = n / (L D) (dn/dT + n alpha) Int_0^L (2 z - L) Tdot(z) dz

with z the distance along the fibre from one end. Its sign is a convention of direction.

References
----------
D. M. Shupe, Applied Optics 19 (1980) 654. N. J. Frigo, SPIE 412 (1983) 268, for windings.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError, known_are
from fogml.twin.optics import DEG_H, REFERENCE_COIL, WINDINGS, Coil, Winding
from fogml.twin.plant.network import PlantState, ThermalNetwork

_PER_MINUTE = 1.0 / 60.0
# Which half of the fibre each layer belongs to, from the innermost outwards, over and over.
_HALVES = {"dipole": "AB", "quadrupole": "ABBA", "octupole": "ABBABAAB"}


def midpoint_sensitivity(coil: Coil = REFERENCE_COIL) -> float:
    """Rate error per metre of mid-point error and degC/min between coil and leads [deg/h].

    ``2 n (dn/dT + n alpha) / D``: 1.05 for the reference coil.
    """
    return 2.0 * coil.index * coil.phase_slope / coil.diameter * _PER_MINUTE / DEG_H


def lead_sensitivity(coil: Coil = REFERENCE_COIL) -> float:
    """Rate error per metre of lead and degC/min of it [deg/h]: half of `midpoint_sensitivity`."""
    return 0.5 * midpoint_sensitivity(coil)


def winding_order(winding: Winding, layers: int = 32) -> IntArray:
    """Layers in the order in which the fibre passes them, 0 the innermost, shape (layers,).

    A cylinder is wound from one end to the other. The others are wound from the fibre's middle
    outwards, the halves taking turns: A B (dipole), A B B A (quadrupole), A B B A B A A B (octupole).

    Raises
    ------
    InputError
        For an unknown winding, or a number of layers that is no multiple of its pattern.
    """
    if winding not in WINDINGS:
        raise InputError(f"winding '{winding}' is not known; {known_are(winding, WINDINGS, 'windings')}")
    number = np.arange(layers)
    if winding == "cylinder":
        return number
    pattern = _HALVES[winding]
    if layers < len(pattern) or layers % len(pattern):
        raise InputError(f"a {winding} has a multiple of {len(pattern)} layers, not {layers}")
    first = np.array([half == "A" for half in pattern * (layers // len(pattern))])
    return np.concatenate([number[first][::-1], number[~first]])


def layer_weights(coil: Coil = REFERENCE_COIL) -> FloatArray:
    """Rate error [deg/h] per degC/min of each layer, innermost first, shape (layers,); adds to 0.

    All layers hold the same length of fibre.
    """
    edges = np.linspace(0.0, coil.length, coil.layers + 1)
    # Integral of 2 z - L over each stretch of fibre.
    moments = np.diff(edges * edges) - coil.length * np.diff(edges)
    factor = coil.index * coil.phase_slope / (coil.length * coil.diameter) * _PER_MINUTE / DEG_H
    weights = np.empty(coil.layers)
    weights[winding_order(coil.winding, coil.layers)] = factor * moments
    return weights


def radial_sensitivity(coil: Coil = REFERENCE_COIL) -> float:
    """Rate error per degC/min of T_out - T_in [deg/h], for temperatures linear across the layers."""
    return float(layer_weights(coil) @ np.linspace(0.0, 1.0, coil.layers))


@dataclass(frozen=True)
class LayeredCoil:
    """A coil as layers that conduct heat radially from its outer and inner face.

    The first and the last layer have the faces' temperatures.

    Raises
    ------
    InputError
        If layers and winding don't fit together.
    """

    coil: Coil = REFERENCE_COIL

    def __post_init__(self) -> None:
        winding_order(self.coil.winding, self.coil.layers)

    @property
    def settling_s(self) -> float:
        """Time constant of the slowest change of the profile h**2 / (pi**2 kappa) [s]."""
        height = self.coil.pitch * (self.coil.layers - 1)
        return height * height / (np.pi**2 * self.coil.diffusivity)

    @cached_property
    def network(self) -> ThermalNetwork:
        """The layers between the faces ``T_in`` and ``T_out`` as a heat network."""
        inner = [f"layer_{number}" for number in range(2, self.coil.layers)]
        chain = ["T_in", *inner, "T_out"]
        conductance = self.coil.diffusivity / self.coil.pitch**2
        return ThermalNetwork(dict.fromkeys(inner, 1.0), dict.fromkeys(pairwise(chain), conductance))

    def temperatures(
        self, time: FloatArray, inner: FloatArray, outer: FloatArray, state: PlantState | None = None
    ) -> FloatArray:
        """Temperature of each layer [degC], innermost first, shape (n, layers).

        Parameters
        ----------
        time
            Time [s], shape (n,).
        inner, outer
            Temperatures of the two faces [degC], shape (n,); linear between the samples.
        state
            Left by the block before, and taken along; at rest where fresh.
        """
        nodes = self.network.temperatures(time, {"T_in": inner, "T_out": outer}, state=state)
        between = [nodes[name] for name in self.network.nodes]
        return np.column_stack([inner, *between, outer])

    def travelled(
        self, time: FloatArray, inner: FloatArray, outer: FloatArray, state: PlantState | None = None
    ) -> FloatArray:
        """The rate error's integral over time [deg/h min], shape (n,); parameters as in `temperatures`.

        Its rate per minute is the error: the layers' temperatures with the winding's weights.
        """
        return np.asarray(self.temperatures(time, inner, outer, state) @ layer_weights(self.coil))
