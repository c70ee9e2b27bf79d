"""The usual network of a gyro in its chamber, stated by time constants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from itertools import pairwise

import numpy as np

from fogml.twin.inputs import LEADS
from fogml.twin.plant.network import AIR, ThermalNetwork
from fogml.twin.quantities import Quantity, check_all, limited, shared


@dataclass(frozen=True)
class ThermalConstants:
    """Time constants [s], heat capacities [J/K] and shares of the usual network.

    A time constant is how far a node is behind the one that it hangs on while the chamber ramps
    steadily, all of the network together: ``T_out - T_in = coil * rate`` to the digit.
    """

    case: float = 900.0
    case_to_coil: float = 360.0
    coil: float = 180.0
    coil_to_hub: float = 120.0
    electronics: float = 300.0
    plate: float = 2400.0
    case_capacity: float = 500.0
    coil_capacity: float = 120.0
    hub_capacity: float = 120.0
    electronics_capacity: float = 120.0
    plate_capacity: float = 4500.0
    hub_share: float = 0.5
    plate_share: float = 0.0

    def __post_init__(self) -> None:
        check_all(self, QUANTITIES, "thermal plant")

    def as_dict(self) -> dict[str, float]:
        """The constants by name."""
        return asdict(self)


def _time(name: str, low: float, high: float, meaning: str) -> Quantity:
    return shared(name, "s", (low, high), meaning, (1.0, 1e6))


def _capacity(name: str, low: float, high: float) -> Quantity:
    return shared(name, "J/degC", (low, high), "heat capacity", (1e-2, 1e6))


QUANTITIES: tuple[Quantity, ...] = (
    _time("case", 300.0, 1800.0, "case behind chamber air"),
    _time("case_to_coil", 120.0, 900.0, "outer face of the coil behind the case"),
    _time("coil", 60.0, 600.0, "inner face of the coil behind its outer face"),
    _time("coil_to_hub", 60.0, 600.0, "hub behind the inner face"),
    _time("electronics", 180.0, 600.0, "electronics behind the case"),
    _time("plate", 1200.0, 3600.0, "table plate behind chamber air"),
    _capacity("case_capacity", 300.0, 900.0),
    _capacity("coil_capacity", 60.0, 240.0),
    _capacity("hub_capacity", 60.0, 240.0),
    _capacity("electronics_capacity", 60.0, 240.0),
    _capacity("plate_capacity", 2000.0, 10000.0),
    shared("hub_share", "1", (0.2, 0.8), "link electronics - hub", (0.0, 0.95)),
    shared("plate_share", "1", (0.0, 0.5), "link plate - case", (0.0, 0.95)),
)
"""The constants of `ThermalConstants` with their units and engineering ranges."""

LARGEST_ORDER = 64
ORDER = limited("order", "nodes", 1, LARGEST_ORDER, whole=True)
"""Number of nodes of `standard_network`."""


def standard_network(constants: ThermalConstants | None = None, order: int = 6) -> ThermalNetwork:
    """The network chamber air -> case -> coil outer face -> inner face -> hub, with electronics and plate.

    Parameters
    ----------
    constants
        Time constants, capacities and shares.
    order
        Number of nodes. 1: the unit as a whole; 2: case, coil; 3: case, outer and inner face; 4:
        and electronics; 5: and hub; 6: and table plate; above: ``order - 4`` nodes in the coil.
        What has no node of its own is part of its neighbour, which is read in its place.

    Returns
    -------
    ThermalNetwork
        With temperatures ``T_chamber, T_case, T_out, T_in, T_electronics, T_hub, T_leads`` at any order,
        ``T_plate`` from order 6 on, ``T_coil_2`` ... between the faces, and no self-heating.

    Raises
    ------
    InputError
        If the order is out of range.

    Notes
    -----
    In a steady ramp every node stores ``C_i = sum_j G_ij (L_i - L_j)`` with L its delay, which gives
    one conductance after the other from the hub outwards. `hub_share` and `plate_share` are the
    cross links electronics - hub and plate - case as a share of ``1 / (tau / C + |L - L'| / C')``;
    below 1 they leave every other conductance positive.
    """
    c = ThermalConstants() if constants is None else constants
    ORDER.check(order, "thermal plant")
    network = _full(c, max(2, order - 4), order)
    if order < 6:
        capacities = {name: value for name, value in network.capacities.items() if name != "T_plate"}
        links = {pair: value for pair, value in network.links.items() if "T_plate" not in pair}
        network = replace(network, capacities=capacities, links=links)
    # Each smaller order joins one node more to the one that it hangs on.
    joined = (("T_hub", "T_in"), ("T_electronics", "T_case"), ("T_in", "T_out"), ("T_out", "T_case"))
    if order < 3:
        for node in network.nodes:
            network = join(network, node, "T_out") if node.startswith("T_coil_") else network
    for node, onto in joined[: max(0, 5 - order)]:
        network = join(network, node, onto)
    return network


def join(network: ThermalNetwork, node: str, onto: str) -> ThermalNetwork:
    """The network with a node made part of another one, which is read in its place."""
    capacities = {name: value for name, value in network.capacities.items() if name != node}
    capacities[onto] += network.capacities[node]
    links: dict[tuple[str, str], float] = {}
    for (a, b), value in network.links.items():
        a, b = (onto if name == node else name for name in (a, b))
        pair = (b, a) if (b, a) in links else (a, b)
        if a != b:
            links[pair] = links.get(pair, 0.0) + value
    readings: dict[str, Mapping[str, float]] = {node: {onto: 1.0}}
    for name, weights in network.readings.items():
        moved: dict[str, float] = {}
        for source, weight in weights.items():
            target = onto if source == node else source
            moved[target] = moved.get(target, 0.0) + weight
        readings[name] = moved
    heating = replace(network.heating, node=onto) if network.heating.node == node else network.heating
    return ThermalNetwork(capacities, links, readings, heating, network.airflow)


def _full(c: ThermalConstants, coil_nodes: int, order: int) -> ThermalNetwork:
    coil = ("T_out", *(f"T_coil_{i}" for i in range(2, coil_nodes)), "T_in")
    # Faces stand for half a layer each, as in the trapezoid rule.
    weights = np.full(coil_nodes, 1.0)
    weights[[0, -1]] = 0.5
    parts = c.coil_capacity * weights / weights.sum()
    outer = c.case + c.case_to_coil
    inner = outer + c.coil
    # Nodes that are to be joined have the same delay from the start.
    hub = inner + c.coil_to_hub if order >= 5 else inner
    electronics = c.case + c.electronics if order >= 4 else c.case

    apart = abs(hub - electronics)
    to_hub = c.hub_share / (c.electronics / c.electronics_capacity + apart / c.hub_capacity)
    to_hub = to_hub if order >= 4 else 0.0
    carried = to_hub * (hub - electronics)
    links = {("T_electronics", "T_hub"): to_hub}
    links["T_case", "T_electronics"] = (c.electronics_capacity + carried) / c.electronics
    links["T_in", "T_hub"] = (c.hub_capacity - carried) / c.coil_to_hub
    # What passes between two coil nodes is stored further in.
    passing = c.hub_capacity - carried + np.cumsum(parts[::-1])[::-1][1:]
    across = float(passing.sum()) / c.coil
    links.update(dict.fromkeys(pairwise(coil), across))
    links["T_case", "T_out"] = (c.hub_capacity - carried + c.coil_capacity) / c.case_to_coil

    unit = c.case_capacity + c.coil_capacity + c.hub_capacity + c.electronics_capacity
    to_plate = c.plate_share / (c.case / unit + abs(c.plate - c.case) / c.plate_capacity)
    to_plate = to_plate if order >= 6 else 0.0
    drawn = to_plate * (c.plate - c.case)
    links["T_plate", "T_case"] = to_plate
    links[AIR, "T_case"] = (unit + drawn) / c.case
    links[AIR, "T_plate"] = (c.plate_capacity - drawn) / c.plate
    capacities = {"T_case": c.case_capacity, **dict(zip(coil, parts.tolist()))}
    capacities |= {"T_hub": c.hub_capacity, "T_electronics": c.electronics_capacity}
    capacities["T_plate"] = c.plate_capacity
    return ThermalNetwork(capacities, links, {"T_leads": LEADS})


# Every constant has its quantity, so that none goes unchecked.
assert {quantity.name for quantity in QUANTITIES} == {field.name for field in fields(ThermalConstants)}
