"""What happens to a unit between two of its runs: it cools, dries and creeps on, off or on, in storage."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.runs.facts import Facts
from fogml.twin.inputs import REST
from fogml.twin.plant.heat import PowerWindows
from fogml.twin.plant.network import PlantState, ThermalNetwork

_ROWS = 600
"""Samples of a storage, the closer the sooner after the run before: every state fades by its own time."""
_FIRST_S = 10.0


@dataclass(frozen=True)
class Storage:
    """Where and how a unit is kept between runs.

    Attributes
    ----------
    temperature
        Of the air [degC].
    humidity
        Relative, of the air [%].
    powered
        Whether the unit stays on.
    """

    temperature: float = 25.0
    humidity: float = 50.0
    powered: bool = False

    def __post_init__(self) -> None:
        for name, value, low, high in (
            ("temperature", self.temperature, -100.0, 150.0),
            ("humidity", self.humidity, 0.0, 100.0),
        ):
            if not low <= value <= high:
                raise InputError(f"storage: {name} is {value:g}; it lies between {low:g} and {high:g}")


def later_s(facts: Facts, first: Facts, name: str) -> float:
    """How long after a unit's first run another one started [s].

    Raises
    ------
    InputError
        If one does not state when it started, or the later one started first.
    """
    if facts.started is None or first.started is None:
        raise InputError(f"{name}: each of a unit's runs needs the fact 'started', to tell the time between")
    try:
        later = (facts.started - first.started).total_seconds()
    except TypeError:
        raise InputError(f"{name}: 'started' has a time zone in some of the runs only; add it") from None
    if later < 0.0:
        raise InputError(f"{name}: it started before the run that it is to come after")
    return later


def storage_times(start: float, stop: float) -> FloatArray:
    """Samples from `start` to before `stop` [s]; none where nothing lies between."""
    span = stop - start
    if not span > 0.0:
        return np.empty(0)
    return np.asarray(start + _FIRST_S * np.expm1(np.linspace(0.0, math.log1p(span / _FIRST_S), _ROWS))[:-1])


def storage_drives(time: FloatArray, storage: Storage, last: Mapping[str, float]) -> dict[str, FloatArray]:
    """What acts on a stored unit: machines at rest; what lasts, such as dose and supply, as it was."""
    rest = REST | {"humidity": storage.humidity, "fan": 0.0}
    lasting = ("dose", "supply", "angle", "B_x", "B_y", "B_z")
    return {name: np.full(len(time), last[name] if name in lasting else rest[name]) for name in last}


def stored_nodes(
    network: ThermalNetwork, time: FloatArray, storage: Storage, powered: PowerWindows, state: PlantState
) -> dict[str, FloatArray]:
    """Temperatures of a plant in storage [degC], by name, shape (n,), from what the run before left."""
    return network.temperatures(time, np.full(len(time), storage.temperature), powered=powered, state=state)


def plant_state(network: ThermalNetwork, time: float, nodes: Mapping[str, float]) -> PlantState:
    """A plant's state at a time [s] from its temperatures [degC] by name."""
    return PlantState(
        time=time,
        nodes=np.array([nodes[name] for name in network.nodes]),
        boundary=np.array([nodes[name] for name in network.boundary]),
    )


def windows_with_history(
    before: PowerWindows, own: PowerWindows, start: float, ended: float, storage: Storage
) -> PowerWindows:
    """When the unit was on, on its own clock, with what came before a run.

    Parameters
    ----------
    before
        Windows up to the end of the run before, on the unit's clock.
    own
        Windows of the run on the unit's clock; minus infinity, or a time before the run, where it was on
        already.
    start, ended
        When the run starts and the one before ended [s].
    storage
        Whether it stayed on between.
    """
    joined = [(on, min(off, ended)) for on, off in before if on < ended]
    windows = list(own)
    on_already = bool(windows) and windows[0][0] <= ended
    if windows and (on_already or windows[0][0] < start):
        stays = (storage.powered or math.isfinite(windows[0][0])) and on_already
        if stays and joined and joined[-1][1] >= ended:
            windows[0] = (joined.pop()[0], windows[0][1])
        else:
            windows[0] = (max(windows[0][0], start if on_already else ended), windows[0][1])
    return (*joined, *windows)
