"""Nodes that a recording lacks, by a plant, and when the unit was on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.runs.columns import TIME_ON
from fogml.runs.run import Run
from fogml.twin.memory import Memory
from fogml.twin.plant.heat import ALWAYS_ON, PowerWindows, windows_since
from fogml.twin.plant.network import AIR, PlantState, ThermalNetwork
from fogml.twin.truth import read_time_on


@dataclass
class EstimateState:
    """What an estimate remembers from block to block. A fresh one for a whole recording."""

    nodes: PlantState = field(default_factory=PlantState)
    rise: PlantState = field(default_factory=PlantState)
    memory: Memory = field(default_factory=Memory)


def estimate_nodes(
    network: ThermalNetwork,
    time: FloatArray,
    recorded: Mapping[str, FloatArray],
    *,
    powered: PowerWindows = ALWAYS_ON,
    fan: FloatArray | None = None,
    table_rate: FloatArray | None = None,
    state: EstimateState | None = None,
) -> dict[str, FloatArray]:
    """Every temperature of a plant [degC], by name, each of shape (n,): recorded ones as they are.

    Parameters
    ----------
    network
        The plant.
    time
        Time [s], shape (n,).
    recorded
        Recorded temperatures by name [degC], shape (n,); an only sensor ``T`` is taken for
        ``T_in`` where that is not recorded.
    powered, fan, table_rate
        As in `ThermalNetwork.temperatures`.
    state
        Left by the block before; at rest where fresh.

    Raises
    ------
    InputError
        If nothing is recorded that the plant has.

    Notes
    -----
    Recorded nodes are boundaries of the network, the others follow from them, starting at rest.
    Chamber air, where it is not recorded, is what the recorded node next to it asks for: less its
    self-heating, and ahead of it by its delay L in a steady ramp, ``(1 + 2 L s) / (1 + L s)``. That
    is right in soaks and in steady ramps, and at most doubles a sensor's noise.
    """
    state = EstimateState() if state is None else state
    known = _known(network, recorded)
    boundary = {name: known[name] for name in known if name in network.nodes or name in network.boundary}
    missing = [name for name in network.boundary if name not in boundary]
    if missing and missing != [AIR]:
        raise InputError(f"thermal plant: the temperature '{missing[0]}' is neither recorded nor chamber air")
    if missing:
        cold = np.zeros(len(time))
        rises = network.temperatures(
            time, cold, powered=powered, fan=fan, table_rate=table_rate, state=state.rise
        )
        boundary[AIR] = _chamber(network, time, boundary, rises, state.memory)
    held = network.held_at(*boundary)
    solved = held.temperatures(
        time, boundary, powered=powered, fan=fan, table_rate=table_rate, state=state.nodes
    )
    return {**solved, **boundary, **known}


def recorded_power(run: Run, on_share: float = 0.2) -> PowerWindows:
    """When the unit was on: from ``time_on`` of a simulated run, else from ``power`` or ``supply`` and facts.

    A column that is never above 0 tells nothing. A unit that is on at the first sample was switched on at the
    fact ``powered_on``, or long before where that is not stated.

    Parameters
    ----------
    run
        A recording.
    on_share
        Share of the largest value that two neighbouring samples reach from which on the unit is on: a warm
        unit draws less than one that starts, and a meter's offset or a stand-by far less than either.
    """
    if TIME_ON in run.columns and len(run):
        return windows_since(run.time, read_time_on(run.columns[TIME_ON]))
    earlier = -math.inf if run.facts.powered_on is None else run.facts.powered_on
    columns = [run.columns[name] for name in ("power", "supply") if name in run.columns]
    column = next((values for values in columns if np.any(values > 0.0)), None)
    if column is None:
        return ((earlier, math.inf),)
    held = np.isfinite(column)
    time, column = run.time[held], column[held]
    # A reading that stands alone is a spike.
    on = column > on_share * np.minimum(column[1:], column[:-1]).max(initial=column.min())
    changes = time[1:][np.diff(on.astype(np.int8)) != 0].tolist()
    edges = [
        *([min(earlier, float(time[0]))] if on[0] else []),
        *changes,
        *([math.inf] if on[-1] else []),
    ]
    return tuple(zip(edges[::2], edges[1::2]))


def _known(network: ThermalNetwork, recorded: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Recorded temperatures that the plant has, and nodes that are read by a recorded one's name."""
    known = {name: recorded[name] for name in network.names if name in recorded}
    if "T" in recorded and "T_in" not in known and "T_in" in network.names:
        known["T_in"] = recorded["T"]
    if not known:
        held = ", ".join(recorded) or "none"
        raise InputError(f"thermal plant: it has {', '.join(network.names)}; recorded is {held}")
    for name, weights in network.readings.items():
        if name in known and len(weights) == 1:
            known.setdefault(next(iter(weights)), known[name])
    return known


def _chamber(
    network: ThermalNetwork,
    time: FloatArray,
    known: Mapping[str, FloatArray],
    rises: Mapping[str, FloatArray],
    memory: Memory,
) -> FloatArray:
    """Chamber air [degC] that the known node next to it asks for, shape (n,).

    `rises` is what self-heating alone makes of each node.
    """
    lags = network.ramp_lags_s()
    nearest = min(known, key=lambda name: lags[name])
    alone = known[nearest] - rises[nearest]
    return 2.0 * alone - memory.lag("chamber air", time, alone, lags[nearest])
