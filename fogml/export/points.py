"""Where exports are compared with the model: points and temperature histories in the trained box."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.export.plan import Plan
from fogml.export.self_test import sensor_range
from fogml.features.atoms import AtomValues
from fogml.features.features import Features
from fogml.features.own import Recursion
from fogml.features.signal import TIME_ON, input_of
from fogml.runs.columns import is_temperature
from fogml.runs.facts import Facts, ScaleFactor
from fogml.runs.run import Run
from fogml.signals.clock import EXPONENTIAL_SPAN

POINTS = 4096
_NEARER, _BEST = (1.0, 0.1, 0.02, 0.004), 32
"""Where a largest difference is looked for, round by round: within so many spans of the box about its middle,
half of all values on its faces, then about so many points that it was largest at."""
_LEAST_SPANS = 5.0
"""Longest windows that a history holds at least: it fills one, and another after each of its gaps."""
_LEAST_SAMPLES, _MOST_SAMPLES = 4000, 40_000
_MOST_FILLING = 4_000_000
"""Samples that a history is made longer by at most, so that its windows fill: 2000 s at 2 kHz."""
_CROSSINGS = 8.0
"""Times that a history of memories of turns could cross the box at its fastest rate.

Two for the sweep; the walk after it, at about half of that rate and with rests, gets to most of the box.
"""
GYRO_DEG_H = 20.0
"""Outputs of a rate up to this size are compared; a joint model's scale factor by a point at 10 deg/s."""


def box_points(plan: Plan, seed: int, beyond: float = 0.0, count: int = POINTS) -> FloatArray:
    """Atom values spread evenly over the trained box (n, a), or up to `beyond` spans outside it."""
    rng = np.random.default_rng([seed, 1])
    low, high = _ends(plan, beyond)
    return _with_directions(plan, rng.uniform(low, high, (count, len(low))))


def largest_in_box(
    plan: Plan, off: Callable[[FloatArray], FloatArray], seed: int, beyond: float = 0.0
) -> float:
    """Largest of what `off` tells of atom values (n, a) in the trained box, or so many spans `beyond` it.

    It is looked for nearer and nearer to where it is largest; infinite where it is no number.
    """
    rng, (low, high) = np.random.default_rng([seed, 3]), _ends(plan, beyond)
    count, largest = POINTS // len(_NEARER), 0.0
    about = np.tile(0.5 * (low + high), (count, 1))
    for share in _NEARER:
        moved = about + share * (high - low) * rng.uniform(-1.0, 1.0, about.shape)
        atoms = _with_directions(plan, np.clip(moved, low, high))
        values = off(atoms)
        largest = max(largest, float(np.where(np.isfinite(values), values, np.inf).max()))
        about = np.repeat(atoms[np.argsort(values)[-_BEST:]], count // _BEST, axis=0)
    return largest


def _ends(plan: Plan, beyond: float) -> tuple[FloatArray, FloatArray]:
    """The trained box and so many spans about it."""
    low, high = plan.limits.box_low, plan.limits.box_high
    margin = beyond * (high - low)
    return np.asarray(low - margin), np.asarray(high + margin)


def _with_directions(plan: Plan, atoms: FloatArray) -> FloatArray:
    """Atom values of which directions are -1, 0 or 1."""
    signs = [i for i, atom in enumerate(plan.atoms) if atom.operator == "sign"]
    atoms[:, signs] = np.clip(np.round(atoms[:, signs]), -1.0, 1.0)
    return atoms


@dataclass(frozen=True)
class History:
    """Temperatures, other columns and output over time, with gaps, and the atoms that they make.

    Attributes
    ----------
    time
        Time [s], shape (n,).
    temperatures
        Temperatures [degC] by sensor, shape (n, s).
    gyro
        Output in the model's unit, shape (n,).
    """

    time: FloatArray
    temperatures: FloatArray
    gyro: FloatArray

    def run(self, plan: Plan) -> Run:
        """As a run."""
        columns: dict[str, Any] = {"time": self.time, "gyro": self.gyro}
        columns |= {name: self.temperatures[:, i] for i, name in enumerate(plan.sensors)}
        if plan.gyro_unit != "count":
            return Run("history", columns)
        nominal = ScaleFactor(value=1.0 / float(plan.arrays["scale"][0]))
        return Run("history", columns, Facts(scale_factor=nominal), "count")

    def in_steps(self, plan: Plan, step_degC: float) -> History:
        """The same with temperatures in whole steps, as a thermometer shows them."""
        paths = self.temperatures.copy()
        for place, name in enumerate(plan.sensors):
            if is_temperature(name):
                paths[:, place] = np.round(paths[:, place] / step_degC) * step_degC
        return History(self.time, paths, self.gyro)

    def atoms(self, plan: Plan) -> AtomValues:
        """Values of a plan's atoms, as the library works them out."""
        if not plan.atoms:
            everywhere = np.ones(len(self.time), dtype=np.bool_)
            return AtomValues(np.empty((len(self.time), 0)), everywhere, everywhere)
        features = Features(", ".join(plan.names))
        features.thermometer = plan.thermometer
        return features.atom_values(self.run(plan), plan.sample_s)


def history(plan: Plan, seed: int, least: int = _LEAST_SAMPLES) -> History:
    """Ramps and soaks through the trained box and a little out of it, with gaps of all lengths.

    For memories of turns it begins with a sweep, after which they depend on nothing earlier.
    """
    rng = np.random.default_rng([seed, 2])
    swept = any(atom.settles for atom in plan.atoms)
    spans = [atom.window.span_s for atom in plan.atoms if atom.window]
    spans += [
        EXPONENTIAL_SPAN * (declared.time_s(atom.given) or 0.0)
        for atom in plan.atoms
        if isinstance(declared := atom.declared, Recursion)
    ]
    longest = max(spans, default=0.0)
    count = int(np.clip(12.0 * longest / plan.sample_s, _LEAST_SAMPLES, _MOST_SAMPLES))
    # So long in any case that windows fill, and go on after a gap.
    count = max(count, least, min(round(_LEAST_SPANS * longest / plan.sample_s), _MOST_FILLING))
    step = plan.sample_s
    ranges = [sensor_range(plan, sensor) for sensor in plan.sensors]
    if swept:
        crossing = max(60.0 * (high - low) / (fastest * step) for low, high, fastest in ranges)
        count = max(count, min(round(_CROSSINGS * crossing), _MOST_SAMPLES))
    time = step * np.arange(count)
    paths: FloatArray = np.empty((count, len(ranges)))
    for i, (low, high, fastest) in enumerate(ranges):
        span = high - low
        speed = fastest / 60.0
        if plan.sensors[i] == TIME_ON:
            paths[:, i] = np.linspace(low, high + 0.1 * span, count)
            continue
        if i == 0 or not is_temperature(plan.sensors[i]):
            paths[:, i] = _walk(rng, count, step, low - 0.1 * span, high + 0.1 * span, speed, swept)
            continue
        # Sensors of one gyro move together; how far apart is told by their difference, or by their ranges.
        first_low, first_high, _ = ranges[0]
        apart = 0.5 * (first_low + first_high - low - high), 0.02 * span
        middle, width = _offset(plan, plan.sensors[i]) or apart
        paths[:, i] = paths[:, 0] - middle - width * np.sin(2.0 * np.pi * (1.5 + i) * time / time[-1])
    gyro = output_size(plan) * rng.uniform(-1.0, 1.0, count)
    keep = np.ones(count, dtype=np.bool_)
    for length_s in (2 * step, 3 * step, 0.2 * longest, 0.3 * longest, 2.0 * longest):
        start, length = int(rng.integers(count // 2, count - 2)), round(length_s / step)
        keep[start : start + min(length, count // 20)] = False
    keep[-1] = True
    return History(np.asarray(time[keep], dtype=np.float64), paths[keep], gyro[keep])


def recorded_history(plan: Plan, run: Run, seed: int) -> History:
    """The times and readings of a recorded run, with outputs as a history has."""
    gyro = output_size(plan) * np.random.default_rng([seed, 5]).uniform(-1.0, 1.0, len(run))
    paths = [input_of(run, name) for name in plan.sensors]
    return History(run.time, np.column_stack(paths) if paths else np.empty((len(run), 0)), gyro)


def output_size(plan: Plan) -> float:
    """Largest output of a history, in the model's unit."""
    return GYRO_DEG_H / (abs(float(plan.arrays["scale"][0])) if plan.gives_rate else 1.0)


def reached_points(plan: Plan, seed: int, box_share: float = 0.25) -> tuple[FloatArray, str]:
    """Atom values that stand for what a unit meets, shape (n, a), and where they are, in words.

    In the trained box. Memories follow their signal and reach few corners of it, so that with memories most
    are of a history, and `box_share` as many in the box, which holds what the history happened not to reach.
    """
    atoms = box_points(plan, seed)
    if not any(atom.settles for atom in plan.atoms):
        return atoms, "points in the trained box"
    values, full, _ = history(plan, seed).atoms(plan)
    inside = values[full & ~plan.limited(values, full)[1]]
    if len(inside) == 0:
        return atoms, "points in the trained box"
    some = np.linspace(0, len(inside) - 1, min(POINTS, len(inside))).astype(np.intp)
    atoms = np.concatenate((atoms[: round(box_share * len(some))], inside[some]))
    return atoms, "points in the trained box and of ramps through it"


def _walk(
    rng: np.random.Generator, count: int, step_s: float, low: float, high: float, speed: float, swept: bool
) -> FloatArray:
    """A path of ramps at speeds up to `speed` [degC/s] and of soaks, within bounds.

    A sweep up, then down to where they begin, takes at most half of it, faster than `speed` where it must.
    """
    if low == high:
        return np.full(count, low)
    start, rates = rng.uniform(low, high), np.empty(0)
    if swept:
        ways = np.array([high - low, start - high])
        lengths = np.clip(np.abs(ways) / (speed * step_s), 1, count // 4).astype(int)
        rates = np.repeat(ways / (lengths * step_s), lengths)
        start = low
    while len(rates) < count:
        length = int(rng.integers(count // 40 + 2, count // 10 + 3))
        rate = 0.0 if rng.random() < 0.2 else float(rng.uniform(0.2, 1.1) * speed * rng.choice([-1.0, 1.0]))
        rates = np.append(rates, np.full(length, rate))
    path = np.cumsum(rates[:count]) * step_s + start
    folded = np.mod(path - low, 2.0 * (high - low))
    return np.asarray(low + np.minimum(folded, 2.0 * (high - low) - folded))


def _offset(plan: Plan, sensor: str) -> tuple[float, float] | None:
    """Middle and half-width of the first sensor less this one in the trained box, where that is told."""
    first = plan.sensors[0]
    for i, atom in enumerate(plan.atoms):
        if atom.operator == "value" and set(atom.signal.sensors) == {first, sensor}:
            weights = dict(atom.signal.parts)
            if abs(weights[first] + weights[sensor]) < 1e-9:
                ends = np.array([plan.limits.box_low[i], plan.limits.box_high[i]]) / weights[first]
                return float(ends.mean()), float(0.45 * abs(ends[1] - ends[0]))
    return None
