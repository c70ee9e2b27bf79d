"""Regimes of a run, told from its temperatures, its table rate and its time of power-on."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import BoolArray, IndexArray
from fogml.runs.columns import coil_sensor_number
from fogml.runs.run import Run
from fogml.runs.temperature_motion import LEAST_TRAVEL_DEGC, Motion, Move, find_motion
from fogml.runs.turning import turning

START_UP_S = 1800.0
"""Start-up lasts this long after power-on [s], less where the temperatures settle before."""
SHORTEST_START_UP_S = 600.0
"""Start-up lasts at least this long after a stated power-on [s]."""
AFTER_RAMP_S = 600.0
"""A sensor that looks settled hides gradients in the coil: this long after a ramp is no soak yet [s]."""
GREATEST_SELF_HEATING_DEGC = 25.0
"""A rise from the first sample on is self-heating only up to this [degC]."""

_START_UP, _RAMP_UP, _RAMP_DOWN, _SOAK, _AFTER_RAMP, _TURNING = range(6)


@dataclass(frozen=True, eq=False)
class Regimes:
    """What went on at each sample.

    Attributes
    ----------
    labels
        Index into `names` for each sample, shape (n,).
    moved
        Rows that follow a gap in which temperature moved unseen: a regime begins there.
    """

    names: ClassVar[tuple[str, ...]] = (
        "start_up",
        "ramp_up",
        "ramp_down",
        "soak",
        "after_ramp",
        "turning",
    )
    labels: NDArray[np.int8]
    moved: IndexArray

    def mask(self, name: str) -> BoolArray:
        """True where the regime is `name`, shape (n,)."""
        return np.asarray(self.labels == self.names.index(name))

    def segments(self) -> list[tuple[str, int, int]]:
        """The regimes one after another as (name, first row, row after the last)."""
        if len(self.labels) == 0:
            return []
        changes = np.union1d(np.flatnonzero(np.diff(self.labels)) + 1, self.moved)
        edges = [0, *changes.tolist(), len(self.labels)]
        return [(self.names[self.labels[a]], a, b) for a, b in pairwise(edges)]


def regimes(run: Run) -> Regimes:
    """Tell the regimes of a run from its data.

    ``ramp_up`` and ``ramp_down``: the coil's temperature moves by more than 1.5 degC, at a rate
    that can be told from the sensor's noise (0.05 degC/min or more). ``after_ramp``: it has slowed
    down for good, and some sensor of the coil still moves, or less than 10 min have passed.
    ``soak``: the rest. ``turning``: the table rate is not zero, whatever the temperature does.
    ``start_up``: 30 min from the stated power-on, or until the temperatures have settled (10 min
    at least); where no power-on is stated, a rise from the first sample on that slows down as
    self-heating does, up to 30 min. A run without temperatures is a soak where it does not turn.

    The result is computed once for a run.
    """
    known: Regimes | None = run.__dict__.get("_regimes")
    if known is None:
        known = _found(run)
        known.labels.flags.writeable = False
        run.__dict__["_regimes"] = known
    return known


def _found(run: Run) -> Regimes:
    labels = np.full(len(run), _SOAK, dtype=np.int8)
    moved = np.empty(0, dtype=np.intp)
    columns = _followed(run)
    motion = None
    if len(run) > 1 and columns:
        temperatures = [run.temperature(name) for name in columns]
        motion = find_motion(run.time, run.sample_s, temperatures)
        labels = motion.grid.to_rows(_temperature_labels(motion, run.facts.powered_on is None))
        parts = motion.grid.part_edges[1:-1]
        travel = np.abs(motion.temperature[parts] - motion.temperature[parts - 1])
        moved = motion.grid.starts[parts[travel >= LEAST_TRAVEL_DEGC]]
    if run.facts.powered_on is not None:
        end = _start_up_end(run.facts.powered_on, motion)
        labels[(run.time >= run.facts.powered_on) & (run.time < end)] = _START_UP
    if "rate" in run.columns:
        labels[turning(run)] = _TURNING
    return Regimes(labels, moved)


def _followed(run: Run) -> list[str]:
    """The temperature that tells ramps first, then the coil's other sensors."""
    coil = [
        name
        for name in run.temperature_columns
        if name in ("T", "T_in", "T_out") or coil_sensor_number(name) is not None
    ]
    if coil:
        leading = next((name for name in ("T", "T_in") if name in coil), coil[0])
        return [leading, *(name for name in coil if name != leading)]
    order = ("T_case", "T_electronics", "T_chamber")
    return [name for name in order if name in run.temperature_columns][:1]


def _temperature_labels(motion: Motion, find_self_heating: bool) -> NDArray[np.int8]:
    """Labels of the grid's bins, shape (m,)."""
    grid = motion.grid
    labels = np.full(len(grid.time), _SOAK, dtype=np.int8)
    edges = grid.part_edges
    settled = np.flatnonzero(~motion.moving)
    for number, move in enumerate(motion.moves):
        labels[move.start : move.knee] = _RAMP_UP if move.direction > 0 else _RAMP_DOWN
        limit = int(edges[np.searchsorted(edges, move.start, side="right")])
        if number + 1 < len(motion.moves):
            limit = min(limit, motion.moves[number + 1].start)
        if move.knee < move.stop or move.stop < limit:
            place = np.searchsorted(settled, move.stop)
            still = int(settled[place]) if place < len(settled) else len(grid.time)
            waited = int(np.searchsorted(grid.time, grid.time[move.knee - 1] + AFTER_RAMP_S))
            labels[move.knee : min(max(still, waited, move.stop), limit)] = _AFTER_RAMP
    if find_self_heating and motion.moves and _is_self_heating(motion, motion.moves[0]):
        first = motion.moves[0]
        end = int(np.searchsorted(grid.time, grid.time[0] + START_UP_S))
        labels[first.start : first.stop] = _AFTER_RAMP
        labels[: min(first.stop, end)] = _START_UP
    return labels


def _is_self_heating(motion: Motion, move: Move) -> bool:
    """Whether a move is a rise from the first sample on that slows down as self-heating does.

    An exponential approach is at half way little more than half as fast as at its beginning; a
    chamber's ramp is as fast there, or faster.
    """
    if move.start > 0 or move.direction < 0 or not 0.0 < move.travel <= GREATEST_SELF_HEATING_DEGC:
        return False
    progress = (motion.temperature[: move.stop] - motion.temperature[0]) / move.travel
    reached = [int(np.argmax(progress >= share)) for share in (0.2, 0.4, 0.6)]
    beginning, early, late = motion.grid.time[reached]
    first = 0.2 / max(beginning - motion.grid.time[0], 1e-9)
    half_way = 0.2 / max(late - early, 1e-9)
    return bool(half_way < 0.75 * first)


def _start_up_end(powered_on: float, motion: Motion | None) -> float:
    """When the start-up after a stated power-on ends [s]."""
    if motion is None:
        return powered_on + START_UP_S
    time = motion.grid.time
    settled = ~motion.moving & (time >= powered_on + SHORTEST_START_UP_S)
    end = float(time[np.argmax(settled)]) if settled.any() else np.inf
    return min(powered_on + START_UP_S, end)
