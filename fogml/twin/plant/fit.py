"""Constants of a thermal plant from recorded temperatures: chamber air in, case, coil and electronics out.

Recorded chamber air drives the network, and each constant that moves another recorded temperature is fitted,
as a factor on its value with a log-normal prior, by least squares (Levenberg and Marquardt). Without the air
nothing is fitted: another node's temperature does not tell what heats the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.runs.run import Run
from fogml.settings_check import check_numbers
from fogml.twin.plant.heat import HEATING, PowerWindows
from fogml.twin.plant.network import AIR
from fogml.twin.plant.standard import QUANTITIES
from fogml.twin.replay import inputs_of_run
from fogml.twin.set_up import Plant
from fogml.twin.twin import Twin

READ = ("T_case", "T_out", "T_in", "T_electronics")
_TIMES = tuple(q.name for q in QUANTITIES if q.unit == "s" and q.name != "plate")
_HEATING = ("steady", "time_constant")
_QUANTITY = {q.name: q for q in (*QUANTITIES, *HEATING)}


@dataclass(frozen=True)
class FitSettings:
    """How a plant is fitted.

    Attributes
    ----------
    factor
        One standard deviation of a constant's prior, as a factor: their ranges are about two of them wide.
    settling_s
        A run may begin far from rest: so much of it is not fitted to, or a quarter where that is less [s].
    most_rows, fewest_rows
        Rows of a run, means of as many samples: at most one a minute in ten hours, well under any constant.
    least_motion_degc
        A run that moves less tells nothing of a plant [degC].
    misfit_degc
        What a network of a few nodes may miss of a sensor, at least [degC].
    told
        A constant counts as told where its logarithm's standard error is below this share of its prior's.
    """

    factor: float = 2.0
    settling_s: float = 3600.0
    most_rows: int = 600
    fewest_rows: int = 32
    least_motion_degc: float = 2.0
    misfit_degc: float = 0.02
    told: float = 0.5

    def __post_init__(self) -> None:
        may_be_0 = ("settling_s", "least_motion_degc")
        check_numbers(self, above_1=("factor",), shares=("told",), may_be_0=may_be_0)


STANDARD = FitSettings()
"""How a plant is fitted unless told otherwise."""


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
    fan: FloatArray | None
    table_rate: FloatArray
    read: Mapping[str, FloatArray]
    counted: BoolArray


def fit_plant(twin: Twin, runs: Sequence[Run], settings: FitSettings = STANDARD) -> PlantFit | None:
    """A plant's constants from what runs of one unit recorded; None where they tell none.

    Parameters
    ----------
    twin
        Whose plant to start from, and effects that change it; the plant's shares and capacities stay as they
        are, since temperatures alone tell ratios.
    runs
        With chamber air and another temperature recorded, the same ones.
    settings
        How closely.
    """
    from scipy.optimize import least_squares

    plant = twin.plant
    shared = frozenset.intersection(*(frozenset(_recorded(run)) for run in runs)) if runs else frozenset()
    names = [name for name in READ if name in shared]
    chamber = all(AIR in run.columns for run in runs)
    if not names or not chamber or plant.line is not None or plant.ends is not None:
        return None
    courses = [c for run in runs if (c := _course(run, names, settings)) is not None]
    if not courses:
        return None
    start = _values(plant)
    sd = np.log(settings.factor)

    def residuals(logs: FloatArray, free: Sequence[str]) -> FloatArray:
        moved = _with(twin, {n: start[n] * float(np.exp(x)) for n, x in zip(free, logs)})
        parts = [_left(moved, course) / settings.misfit_degc for course in courses]
        return np.concatenate([*parts, logs / sd])

    free = _moving(residuals, tuple(start))
    if not free:
        return None
    found = least_squares(residuals, np.zeros(len(free)), args=(free,), method="lm", max_nfev=60 * len(free))
    left = found.fun[: len(found.fun) - len(free)]
    # Residuals of a network that is not quite right go on for hours: as many as they are long count for one.
    inflated = max(float(np.mean(left**2)), 1.0) * _correlated(left)
    covariance = np.linalg.inv(found.jac.T @ found.jac / inflated + np.eye(len(free)) / sd**2)
    told = [i for i in range(len(free)) if covariance[i, i] ** 0.5 < settings.told * sd]
    if not told:
        return None
    fitted = _with(twin, {free[i]: start[free[i]] * float(np.exp(found.x[i])) for i in told})
    by_run = [np.split(_left(fitted, c), len(names)) for c in courses]
    misfit = {
        name: float(np.sqrt(np.mean(np.concatenate([parts[i] for parts in by_run]) ** 2)))
        for i, name in enumerate(names)
    }
    kept = covariance[np.ix_(told, told)]
    return PlantFit(fitted.plant, tuple(_key(free[i]) for i in told), kept, misfit)


def _recorded(run: Run) -> dict[str, FloatArray]:
    """Temperatures of places that a run tells [degC]; an only sensor is taken for the coil's inner face."""
    told = {name: run.temperature(name) for name in READ if run.sensors(name)}
    if "T_in" not in told and "T" in run.columns:
        told["T_in"] = run.temperature("T")
    return told


def _course(run: Run, names: Sequence[str], settings: FitSettings) -> _Course | None:
    run = run.without_dropouts
    inputs, powered = inputs_of_run(run)
    told = _recorded(run) | {AIR: run.columns[AIR]}
    usable = np.all([np.isfinite(told[name]) for name in (*names, AIR)], axis=0)
    step = max(1, int(usable.sum()) // settings.most_rows)
    # Means: of samples that lie so far apart a ripple of the chamber's air would make a slow wave.
    starts = np.arange(0, int(usable.sum()), step)
    time = _means(run.time[usable], starts)
    read = {name: _means(told[name][usable], starts) for name in (*names, AIR)}
    # What holds until the next mean is one of the samples from this one's middle on.
    held = np.append(0, starts[1:] + step // 2) if len(starts) > 1 else starts
    held = np.minimum(held, int(usable.sum()) - 1)
    turning = _means(inputs.turning_deg_s[usable], held)
    fan = _means(inputs.drives["fan"][usable], held) if "fan" in inputs.drives else None
    if len(time) < settings.fewest_rows:
        return None
    if max(float(np.ptp(values)) for values in read.values()) < settings.least_motion_degc:
        return None
    skipped = min(settings.settling_s, 0.25 * float(time[-1] - time[0]))
    return _Course(powered, time, read.pop(AIR), fan, turning, read, time - time[0] >= skipped)


def _means(values: FloatArray, starts: IndexArray) -> FloatArray:
    """Means of values from each of some places up to the next."""
    return np.asarray(np.add.reduceat(values, starts) / np.diff(starts, append=len(values)))


def _left(twin: Twin, course: _Course) -> FloatArray:
    """Recorded less solved of every temperature that is fitted [degC]."""
    solved = twin.network.temperatures(
        course.time, course.air, powered=course.powered, fan=course.fan, table_rate=course.table_rate
    )
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


def _with(twin: Twin, values: Mapping[str, float]) -> Twin:
    """A twin with its plant's constants changed; the power after switching on goes with the steady one."""
    plant = twin.plant
    values = {name: _QUANTITY[name].within(value) for name, value in values.items()}
    times = {name: value for name, value in values.items() if name not in _HEATING}
    heating = plant.heating
    if "steady" in values and heating.steady_w > 0.0:
        initial = _QUANTITY["initial"].within(heating.initial_w * values["steady"] / heating.steady_w)
        heating = replace(heating, steady_w=values["steady"], initial_w=initial)
    if "time_constant" in values:
        heating = replace(heating, time_constant_s=values["time_constant"])
    changed = replace(plant, constants=replace(plant.constants, **times), heating=heating)
    return replace(twin, plant=changed)
