"""Constants of a thermal plant from recorded temperatures: chamber air in, case, coil and electronics out.

Recorded chamber air drives the network, and each constant that moves another recorded temperature is fitted,
as a factor on its value with a log-normal prior, by least squares (Levenberg and Marquardt). Without the air
nothing is fitted: another node's temperature does not tell what heats the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.runs.columns import TIME_ON
from fogml.runs.run import Run
from fogml.twin.memory import Memory
from fogml.twin.plant.heat import ALWAYS_ON, PowerWindows, windows_since
from fogml.twin.plant.network import AIR, PlantState, ThermalNetwork
from fogml.twin.plant.standard import QUANTITIES
from fogml.twin.set_up import Plant
from fogml.twin.truth import read_time_on

_ON_SHARE = 0.2


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


def recorded_power(run: Run) -> PowerWindows:
    """When the unit was on: from ``time_on`` of a simulated run, else from ``power`` or ``supply`` and facts.

    On is above a fifth of the largest value; a column that is never above 0 tells nothing. A unit that is on
    at the first sample was switched on at the fact ``powered_on``, or long before where that is not stated.
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
    on = column > _ON_SHARE * column.max()
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


FACTOR = 2.0
"""One standard deviation of a constant's prior, as a factor: their ranges are about two of them wide."""
SETTLING_S = 3600.0
"""A run may begin far from rest: so much of it is not fitted to, or a quarter where that is less [s]."""
MOST_ROWS = 600
"""Rows of a run: a minute in ten hours, well under any constant."""
FEWEST_ROWS = 32
LEAST_MOTION_DEGC = 2.0
"""A run that moves less tells nothing of a plant."""
MISFIT_DEGC = 0.02
"""What a network of a few nodes may miss of a sensor, at least [degC]."""
TOLD = 0.5
"""A constant counts as told where its logarithm's standard error is below this share of its prior's."""
READ = ("T_case", "T_out", "T_in", "T_electronics")
_TIMES = tuple(q.name for q in QUANTITIES if q.unit == "s" and q.name != "plate")
_HEATING = ("steady", "time_constant")


@dataclass(frozen=True)
class PlantFit:
    """A plant as fitted.

    Attributes
    ----------
    plant
        With the constants that the runs tell.
    names
        Of those constants, as in a twin file: ``plant.case``, ``plant.heating.steady``.
    covariance
        Of their logarithms, shape (k, k).
    misfit_degc
        Rms of what is left of each temperature that was fitted.
    """

    plant: Plant
    names: tuple[str, ...]
    covariance: FloatArray
    misfit_degc: Mapping[str, float]


@dataclass(frozen=True)
class _Course:
    """One run on its rows: what drives, what is fitted, and where."""

    powered: PowerWindows
    time: FloatArray
    air: FloatArray
    read: Mapping[str, FloatArray]
    counted: BoolArray


def fit_plant(plant: Plant, runs: Sequence[Run]) -> PlantFit | None:
    """A plant's constants from what runs of one unit recorded; None where they tell none.

    Parameters
    ----------
    plant
        To start from; its shares and capacities stay as they are, since temperatures alone tell ratios.
    runs
        With chamber air and another temperature recorded, the same ones.
    """
    from scipy.optimize import least_squares

    shared = frozenset.intersection(*(frozenset(_recorded(run)) for run in runs)) if runs else frozenset()
    names = [name for name in READ if name in shared]
    chamber = all(AIR in run.columns for run in runs)
    if not names or not chamber or plant.line is not None or plant.ends is not None:
        return None
    courses = [c for run in runs if (c := _course(run, names)) is not None]
    if not courses:
        return None
    start = _values(plant)
    sd = np.log(FACTOR)

    def residuals(logs: FloatArray, free: Sequence[str]) -> FloatArray:
        moved = _with(plant, {n: start[n] * float(np.exp(x)) for n, x in zip(free, logs)})
        parts = [_left(moved, course) / MISFIT_DEGC for course in courses]
        return np.concatenate([*parts, logs / sd])

    free = _moving(residuals, tuple(start))
    if not free:
        return None
    found = least_squares(residuals, np.zeros(len(free)), args=(free,), method="lm", max_nfev=60 * len(free))
    left = found.fun[: len(found.fun) - len(free)]
    # Residuals of a network that is not quite right go on for hours: as many as they are long count for one.
    inflated = max(float(np.mean(left**2)), 1.0) * _correlated(left)
    covariance = np.linalg.inv(found.jac.T @ found.jac / inflated + np.eye(len(free)) / sd**2)
    told = [i for i in range(len(free)) if covariance[i, i] ** 0.5 < TOLD * sd]
    if not told:
        return None
    fitted = _with(plant, {free[i]: start[free[i]] * float(np.exp(found.x[i])) for i in told})
    by_run = [np.split(_left(fitted, c), len(names)) for c in courses]
    misfit = {
        name: float(np.sqrt(np.mean(np.concatenate([parts[i] for parts in by_run]) ** 2)))
        for i, name in enumerate(names)
    }
    kept = covariance[np.ix_(told, told)]
    return PlantFit(fitted, tuple(_key(free[i]) for i in told), kept, misfit)


def _recorded(run: Run) -> dict[str, FloatArray]:
    """Temperatures of places that a run tells [degC]; an only sensor is taken for the coil's inner face."""
    told = {name: run.temperature(name) for name in READ if run.sensors(name)}
    if "T_in" not in told and "T" in run.columns:
        told["T_in"] = run.temperature("T")
    return told


def _course(run: Run, names: Sequence[str]) -> _Course | None:
    run = run.without_dropouts
    step = max(1, len(run) // MOST_ROWS)
    told = _recorded(run) | {AIR: run.columns[AIR]}
    time, read = run.time[::step], {name: told[name][::step] for name in (*names, AIR)}
    usable = np.all([np.isfinite(values) for values in read.values()], axis=0)
    time, read = time[usable], {name: values[usable] for name, values in read.items()}
    if len(time) < FEWEST_ROWS or max(float(np.ptp(v)) for v in read.values()) < LEAST_MOTION_DEGC:
        return None
    skipped = min(SETTLING_S, 0.25 * float(time[-1] - time[0]))
    return _Course(recorded_power(run), time, read.pop(AIR), read, time - time[0] >= skipped)


def _left(plant: Plant, course: _Course) -> FloatArray:
    """Recorded less solved of every temperature that is fitted [degC]."""
    solved = plant.network.temperatures(course.time, course.air, powered=course.powered)
    return np.concatenate([_apart(course, read, solved[name]) for name, read in course.read.items()])


def _apart(course: _Course, read: FloatArray, solved: FloatArray) -> FloatArray:
    """Where it counts and less the mean, as sensors differ by an offset [degC]."""
    left = (read - solved)[course.counted]
    return np.asarray(left - left.mean())


def _moving(residuals: Callable[..., FloatArray], names: Sequence[str]) -> tuple[str, ...]:
    """The constants that move what is fitted by a tenth of its misfit where they are a tenth larger."""
    still = residuals(np.zeros(1), names[:1])
    size = len(still) - 1
    moved = {n: residuals(np.array([0.1]), (n,))[:size] - still[:size] for n in names}
    return tuple(n for n, by in moved.items() if float(np.sqrt(np.mean(by**2))) > 0.1)


def _correlated(left: FloatArray) -> float:
    """How many residuals count for one: 1 + 2 sums of their correlations, those above a twentieth."""
    spread = left - left.mean()
    power = np.abs(np.fft.rfft(spread, 2 * len(spread))) ** 2
    correlation = np.fft.irfft(power)[: len(spread)]
    if correlation[0] <= 0.0:
        return 1.0
    correlation /= correlation[0]
    stop = int(np.argmax(correlation < 0.05)) or len(correlation)
    return float(1.0 + 2.0 * correlation[1:stop].sum())


def _values(plant: Plant) -> dict[str, float]:
    """Constants that may be fitted, by name."""
    values = {name: float(getattr(plant.constants, name)) for name in _TIMES}
    if plant.heating.steady_w > 0.0:
        values |= {"steady": plant.heating.steady_w, "time_constant": plant.heating.time_constant_s}
    return values


def _key(name: str) -> str:
    return f"plant.heating.{name}" if name in _HEATING else f"plant.{name}"


def _with(plant: Plant, values: Mapping[str, float]) -> Plant:
    """A plant with constants changed; the power after switching on goes with the steady one."""
    limits = {q.name: q.limits for q in QUANTITIES}
    times = {n: float(np.clip(v, *limits[n])) for n, v in values.items() if n not in _HEATING}
    heating = plant.heating
    if "steady" in values and heating.steady_w > 0.0:
        factor = values["steady"] / heating.steady_w
        heating = replace(heating, steady_w=values["steady"], initial_w=heating.initial_w * factor)
    if "time_constant" in values:
        heating = replace(heating, time_constant_s=max(values["time_constant"], 1.0))
    return replace(plant, constants=replace(plant.constants, **times), heating=heating)
