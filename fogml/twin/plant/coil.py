"""The coil in a heat network: conduction from layer to layer, and its two ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.twin.plant.network import PlantState, ThermalNetwork
from fogml.twin.quantities import Quantity, check_all, limited, shared

_FACE_SHARE = 1e-3
LINE = (
    limited("inner_radius", "m", 1e-4, 10.0),
    limited("outer_radius", "m", 1e-4, 10.0),
    limited("diffusivity", "m2/s", 1e-9, 1e-3),
)
"""The constants of `RadialLine` with their units."""
_LARGEST_LAYERS = 1000


@dataclass(frozen=True)
class RadialLine:
    """The coil as a hollow cylinder in which heat flows radially.

    ::

        dT/dt = kappa (1/r) d/dr (r dT/dr)

    Finite volumes: layers of equal thickness, counted from the inside, each with its temperature
    in the middle; the conductance between two middles is that of the cylinder between them.

    Attributes
    ----------
    inner_radius, outer_radius
        Of the winding pack [m].
    diffusivity
        kappa across the pack [m^2/s].
    layers
        Number of layers.
    """

    inner_radius: float = 0.047
    outer_radius: float = 0.053
    diffusivity: float = 2e-7
    layers: int = 32

    def __post_init__(self) -> None:
        check_all(self, (*LINE, limited("layers", "layers", 1, _LARGEST_LAYERS, whole=True)), "coil")
        if not self.inner_radius < self.outer_radius:
            raise InputError(
                f"coil: radii are {self.inner_radius:g} and {self.outer_radius:g} m; "
                "the inner one is below the outer one"
            )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the layers in a network, from the inside."""
        return tuple(f"T_layer_{number}" for number in range(1, self.layers + 1))

    @cached_property
    def radii(self) -> FloatArray:
        """Radius in the middle of each layer [m], from the inside, shape (layers,)."""
        edges = np.linspace(self.inner_radius, self.outer_radius, self.layers + 1)
        return 0.5 * (edges[1:] + edges[:-1])

    def between_faces(self, capacity: float = 1.0) -> ThermalNetwork:
        """The coil alone, driven by the temperatures of its faces ``T_out`` and ``T_in``.

        `capacity` is that of the whole coil [J/K]; the temperatures don't depend on it.
        """
        # Rings of equal thickness hold heat in proportion to the radius in their middle.
        capacities = capacity * self.radii / self.radii.sum()
        ring = math.pi * (self.outer_radius**2 - self.inner_radius**2)
        conductivity = self.diffusivity * capacity / ring
        places = np.concatenate([[self.inner_radius], self.radii, [self.outer_radius]])
        conductances = 2.0 * math.pi * conductivity / np.log(places[1:] / places[:-1])
        chain = ("T_in", *self.names, "T_out")
        links = dict(zip(pairwise(chain), conductances.tolist()))
        return ThermalNetwork(dict(zip(self.names, capacities.tolist())), links)

    def temperatures(
        self, time: FloatArray, outer: FloatArray, inner: FloatArray, state: PlantState | None = None
    ) -> FloatArray:
        """Temperature of each layer [degC] between given faces, shape (layers, n), from the inside.

        Parameters
        ----------
        time, outer, inner
            Time [s] and temperature of the faces [degC], linear between samples, shape (n,).
        state
            Left by the block before; at rest where fresh.
        """
        network = self.between_faces()
        solved = network.temperatures(time, {"T_out": outer, "T_in": inner}, state=state)
        return np.stack([solved[name] for name in self.names])


def with_line(network: ThermalNetwork, line: RadialLine) -> ThermalNetwork:
    """A network with its coil replaced by a conduction line of the same heat capacity.

    The links of ``T_out`` to the case and of ``T_in`` to the hub stay as they are. The faces carry
    a thousandth of the layer beside them, so that they remain nodes which may be recorded.

    Raises
    ------
    InputError
        If the network has no nodes for both faces of the coil and for the hub.
    """
    missing = [name for name in ("T_out", "T_in", "T_hub") if name not in network.capacities]
    if missing:
        raise InputError(
            f"thermal plant: a conduction line needs a node '{missing[0]}'; take order 5 or more"
        )
    coil = [name for name in network.capacities if name in ("T_out", "T_in") or name.startswith("T_coil_")]
    alone = line.between_faces(sum(network.capacities[name] for name in coil))
    capacities = dict(alone.capacities)
    faces = {}
    for face, layer in (("T_out", line.names[-1]), ("T_in", line.names[0])):
        faces[face] = _FACE_SHARE * capacities[layer]
        capacities[layer] -= faces[face]
    # Only links that leave the coil stay.
    kept = {pair: value for pair, value in network.links.items() if not set(pair) <= set(coil)}
    others = {name: value for name, value in network.capacities.items() if name not in coil}
    return replace(network, capacities={**others, **faces, **capacities}, links={**kept, **alone.links})


TOP, BOTTOM = "T_top", "T_bottom"
END_NODES = frozenset((TOP, BOTTOM))
_COIL = ("T_out", "T_in", "T_coil_", "T_layer_")

QUANTITIES: tuple[Quantity, ...] = (
    shared("share", "1", (0.05, 0.2), "of the coil's heat capacity, each end", (1e-4, 0.4)),
    shared("across", "s", (60.0, 600.0), "ends to the winding between them", (1.0, 1e6)),
    shared("top", "s", (300.0, 1800.0), "top to the case's lid", (1.0, 1e6)),
    shared("bottom", "s", (120.0, 900.0), "bottom to what the unit stands on", (1.0, 1e6)),
)
"""The constants of `CoilEnds` with their units and engineering ranges."""


@dataclass(frozen=True)
class CoilEnds:
    """How the ends of the winding hang together with what is above, below and between them.

    ::

        C dT_top/dt    = C (T_case - T_top) / top + C ((T_out + T_in) / 2 - T_top) / across
        C dT_bottom/dt = C (T_plate - T_bottom) / bottom + C ((T_out + T_in) / 2 - T_bottom) / across

    C is ``share`` of the coil's heat capacity, which the rest of the coil has so much less of. Where the
    plant has no table plate, the bottom stands on the case. Ends of equal time constants at the same
    temperature have none between them.

    Attributes
    ----------
    share
        Of the coil's heat capacity in each end.
    across, top, bottom
        Time constants [s]. Along 25 mm of winding heat takes h**2 / (pi**2 kappa), about 300 s.
    """

    share: float = 0.1
    across: float = 300.0
    top: float = 900.0
    bottom: float = 300.0

    def __post_init__(self) -> None:
        check_all(self, QUANTITIES, "thermal plant, ends")


def with_ends(network: ThermalNetwork, ends: CoilEnds) -> ThermalNetwork:
    """A network with nodes ``T_top`` and ``T_bottom`` split off its coil.

    Raises
    ------
    InputError
        If the network has no nodes for both faces of the coil and for the case.
    """
    missing = [name for name in ("T_out", "T_in", "T_case") if name not in network.capacities]
    if missing:
        raise InputError(f"thermal plant: the coil's ends need a node '{missing[0]}'; take order 3 or more")
    coil = [name for name in network.capacities if name.startswith(_COIL)]
    whole = sum(network.capacities[name] for name in coil)
    capacities = {
        name: (1.0 - 2.0 * ends.share) * value if name in coil else value
        for name, value in network.capacities.items()
    }
    capacity = ends.share * whole
    below = "T_plate" if "T_plate" in network.capacities else "T_case"
    links = dict(network.links)
    for end, other, time_constant in ((TOP, "T_case", ends.top), (BOTTOM, below, ends.bottom)):
        links[end, other] = capacity / time_constant
        for face in ("T_out", "T_in"):
            links[end, face] = 0.5 * capacity / ends.across
        capacities[end] = capacity
    return replace(network, capacities=capacities, links=links)
