"""Top and bottom of the coil as nodes, for a gradient along its axis."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fogml.errors import InputError
from fogml.twin.plant.network import ThermalNetwork
from fogml.twin.quantities import Quantity

TOP, BOTTOM = "T_top", "T_bottom"
END_NODES = frozenset((TOP, BOTTOM))
_COIL = ("T_out", "T_in", "T_coil_", "T_layer_")

QUANTITIES: tuple[Quantity, ...] = (
    Quantity("share", "1", (0.05, 0.2), (0.05, 0.2), "of the coil's heat capacity, each end", (1e-4, 0.4)),
    Quantity("across", "s", (60.0, 600.0), (60.0, 600.0), "ends to the winding between them", (1.0, 1e6)),
    Quantity("top", "s", (300.0, 1800.0), (300.0, 1800.0), "top to the case's lid", (1.0, 1e6)),
    Quantity("bottom", "s", (120.0, 900.0), (120.0, 900.0), "bottom to what the unit stands on", (1.0, 1e6)),
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
        for quantity in QUANTITIES:
            quantity.check(getattr(self, quantity.name), "thermal plant, ends")


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
