"""Replay of a run after others of its unit: what it remembers of them, and of storage between."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.twin.chain import through_chain
from fogml.twin.effect import Effect
from fogml.twin.inputs import REST, Inputs
from fogml.twin.memory import Memory
from fogml.twin.plant.estimate import EstimateState, estimate_nodes
from fogml.twin.plant.heat import PowerWindows
from fogml.twin.plant.network import PlantState, ThermalNetwork
from fogml.twin.recorder import chosen, logged
from fogml.twin.replay import Replayer, dates_s
from fogml.twin.twin import EffectSetting, Twin

_ROWS = 600
"""Samples of a storage, the closer the sooner after the run before: every state fades by its own time."""
_FIRST_S = 10.0
_CARRIED_S = 60.0
"""How long before a run what acts on the output is that of storage [s]: as long as a unit is carried."""
_INSTANT_S = 1e-3
"""How long before a run the unit is still in storage [s]: soon enough that no node's temperature moves."""
START_SLACK = 1e-3
"""Of a sample, that a run may begin before the one before has ended: what times are rounded by."""


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
    """Samples from `start` to the instant before `stop` [s]; none where nothing lies between.

    Air is linear between samples, which lie ever farther apart: without more of them it would go to that of
    the next run for hours before. The last is the plant's alone. What acts on the output is taken without it,
    as sensors that begin elsewhere than storage left them would have a rate out of reach.
    """
    span = stop - start
    if not span > 0.0:
        return np.empty(0)
    time = start + _FIRST_S * np.expm1(np.linspace(0.0, math.log1p(span / _FIRST_S), _ROWS)[:-1])
    carried = [stop - _CARRIED_S] if time[-1] < stop - _CARRIED_S else []
    return np.concatenate((time, carried, [max(stop - _INSTANT_S, 0.5 * (time[-1] + stop))]))


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


def replay_after(
    twin: Twin, run: Run, after: Sequence[Run], *, only: str | None = None, storage: Storage | None = None
) -> FloatArray:
    """What the twin's gyro would have put out in a run, after others of the same unit.

    Parameters
    ----------
    twin
        The twin.
    run
        The run.
    after
        The unit's runs before it; each states when it ``started``.
    only
        Id of an effect: the difference that it makes, in place of the whole output.
    storage
        Where the unit was between; off at 25 degC if None.

    Returns
    -------
    FloatArray
        Output [deg/h], shape (n,).

    Raises
    ------
    InputError
        If a run does not state when it started, two of them overlap, units differ, or `only` is not on.
    """
    if only is not None:
        without = replay_after(twin.without_effect(only), run, after, storage=storage)
        return replay_after(twin, run, after, storage=storage) - without
    whole, nominal, rows = _joined(twin, run, after, Storage() if storage is None else storage)

    def signature(declared: Effect, setting: EffectSetting, inputs: Inputs) -> FloatArray:
        return declared.in_hindsight(inputs.afresh(), **setting.shape)

    output = through_chain(twin, whole.afresh(), nominal.afresh(), signature=signature, trusting=True).output
    last = slice(len(whole) - rows, None)
    return logged(twin, output[last], chosen(whole, last, Memory())).output


def _joined(twin: Twin, run: Run, after: Sequence[Run], storage: Storage) -> tuple[Inputs, Inputs, int]:
    """Inputs of all runs and of the storage between them, one after the other on the unit's clock."""
    runs = _in_order(run, after)
    parts: list[tuple[FloatArray, dict[str, FloatArray], FloatArray, dict[str, FloatArray]]] = []
    windows: PowerWindows = ()
    left: dict[str, float] | None = None
    since, ended, network = 0.0, 0.0, twin.network
    for number, one in enumerate(runs):
        replayer = Replayer(one)
        begins = later_s(one.facts, runs[0].facts, one.name)
        clock = begins - dates_s(one)
        given = replayer.surrounded(twin, replayer.recorded)
        time = clock + given.time
        own = tuple((on + clock, off + clock) for on, off in replayer.windows)
        if number:
            if time[0] < ended - START_SLACK * _step(one):
                raise InputError(f"{one.name}: it starts before {runs[number - 1].name} has ended")
            windows = windows_with_history(windows, own, begins, ended, storage)
            assert left is not None
            between = storage_times(ended, begins)
            if len(between):
                state = plant_state(network, since, left)
                nodes = stored_nodes(network, between, storage, windows, state)
                last = {name: float(values[-1]) for name, values in parts[-1][3].items()}
                left = {name: float(values[-1]) for name, values in nodes.items()}
                since = float(between[-1])
                between, nodes = between[:-1], {name: values[:-1] for name, values in nodes.items()}
                drives = storage_drives(between, storage, last)
                parts.append((between, _with_sensor(nodes), np.zeros(len(between)), drives))
        else:
            windows = own
        nodes = estimate_nodes(
            network,
            time,
            given.temperatures,
            powered=windows,
            fan=given.drives.get("fan"),
            table_rate=given.afresh().turning_deg_s,
            state=_state_after(network, given.temperatures, since, left),
        )
        since = float(time[-1])
        left = {name: float(values[-1]) for name, values in nodes.items()}
        temperatures = {**_with_sensor(nodes), **given.temperatures}
        parts.append((time, temperatures, given.table_rate, dict(given.drives)))
        ended = float(time[-1]) + _step(one)
    target = Replayer(run)
    given = target.surrounded(twin, target.recorded)
    names = set.intersection(*(set(part[1]) for part in parts))
    whole = replace(
        given,
        time=np.concatenate([part[0] for part in parts]),
        temperatures={name: np.concatenate([part[1][name] for part in parts]) for name in sorted(names)},
        table_rate=np.concatenate([part[2] for part in parts]),
        drives={name: np.concatenate([_drive(part, name) for part in parts]) for name in given.drives},
        sensors={},
        epoch_s=runs[0].facts.epoch_s,
        powered_on_s=windows[0][0],
        power_ons_s=tuple(on for on, _ in windows[1:]),
        power_offs_s=tuple(off for _, off in windows[:-1]),
        memory=Memory(),
        cache={},
    )
    seen = {name: values for name, values in whole.temperatures.items() if name in given.temperatures}
    nominal = replace(whole, temperatures=seen)
    return whole, nominal, len(run)


def _with_sensor(nodes: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """A plant's temperatures, and ``T``: an only sensor sits on the coil's inner face."""
    return {"T": nodes["T_in"], **nodes}


def _in_order(run: Run, after: Sequence[Run]) -> list[Run]:
    """The runs by when they started, `run` last."""
    for one in after:
        later_s(run.facts, one.facts, f"{run.name} after {one.name}")
        if None not in (run.facts.unit, one.facts.unit) and run.facts.unit != one.facts.unit:
            raise InputError(
                f"{one.name}: it is of unit {one.facts.unit}, and {run.name} of {run.facts.unit}"
            )
    return [*sorted(after, key=lambda one: -later_s(run.facts, one.facts, one.name)), run]


def _state_after(
    network: ThermalNetwork,
    recorded: Mapping[str, FloatArray],
    time: float,
    left: Mapping[str, float] | None,
) -> EstimateState | None:
    """Where nodes that are not recorded go on from; at rest where nothing went before."""
    if left is None:
        return None
    known = [name for name in network.names if name in recorded]
    if "T" in recorded and "T_in" not in known:
        known.append("T_in")
    return EstimateState(nodes=plant_state(network.held_at(*known), time, left))


def _drive(
    part: tuple[FloatArray, dict[str, FloatArray], FloatArray, dict[str, FloatArray]], name: str
) -> FloatArray:
    """A drive over a part; at rest where that part did not record it."""
    return part[3][name] if name in part[3] else np.full(len(part[0]), REST.get(name, 0.0))


def _step(run: Run) -> float:
    """Sample interval [s]; what the last sample holds ends with it."""
    return float(np.median(np.diff(run.time))) if len(run) > 1 else 0.0
