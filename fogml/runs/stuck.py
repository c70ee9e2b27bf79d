"""Sensors that stay at one value."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import counted
from fogml.runs.findings import Finding
from fogml.runs.run import Run
from fogml.runs.steps import noisy_beyond
from fogml.runs.thermometers import resolution
from fogml.signals import large

STUCK_S = 600.0
"""A sensor that shows one value for longer [s] may be stuck; less far behind another is any sound one."""
MOVED_DEGC = 0.5
"""What another sensor must have gone away by [degC], at least, and twice the sensor's resolution."""
MOVED_DEG_S = 0.1
"""What the table's rate must have changed by meanwhile [deg/s]: more than any dead zone is wide."""
FROZEN_SAMPLES = 60
"""Samples of one value, one after the other, from which on a noisy output may be frozen."""
FROZEN_RATIO = 10
"""How many times longer that is than any other value stays, those that are frozen apart."""
_MARK_SHARE = 0.49
_LEAST_SPELLS = 100
_NOISY_SPELL = 2
_LOOKED_AT = 100_000
"""Readings, at most, whose noise is looked at: so many tell it to a percent."""


def stuck(run: Run) -> Iterator[Finding]:
    """Spells of one value of a thermometer, or of the gyro, that no sound sensor shows."""
    marks = _marks(run.time)
    for name in (*run.temperature_columns, "gyro"):
        told = _beside_others(run, name, marks)
        yield from _frozen(run, name) if told is None else (told,)


def _beside_others(run: Run, name: str, marks: IndexArray | None) -> Finding | None:
    """Long spells of a column while a thermometer moves."""
    values = run.columns[name]
    if marks is not None and not _stays(values, marks):
        return None
    starts, stops, total = _long_spells(run.time, values)
    if not len(starts):
        return None
    least = max(MOVED_DEGC, 2.0 * resolution(values)) if name != "gyro" else MOVED_DEGC
    if name == "gyro":
        # A quiet output of few steps rests at one value for long; a noisy one hardly ever.
        spells = total - len(starts)
        samples = len(values) - int((stops - starts).sum())
        if spells < _LEAST_SPELLS or samples > _NOISY_SPELL * spells:
            return None
    others = [run.temperature(other) for other in run.temperature_columns if other != name]
    found = [
        i
        for i, (a, b) in enumerate(zip(starts, stops))
        if any(
            np.ptp(x[a:b]) > least if name == "gyro" else _left(run.time[a:b], x[a:b], values[a], least)
            for x in others
        )
    ]
    if not found:
        return None
    first, last = int(starts[found[0]]), int(stops[found[0]]) - 1
    times = "" if len(found) == 1 else f", and {counted(len(found) - 1, 'time')} more,"
    message = (
        f"'{name}' stays at {values[first]:.6g} from {run.time[first]:.10g} s to "
        f"{run.time[last]:.10g} s{times} while a temperature moves; the sensor may be stuck"
    )
    count = int((stops - starts)[found].sum())
    return Finding("stuck_sensor", message, column=name, row=first + 1, count=count)


def _left(time: FloatArray, other: FloatArray, value: float, least: float) -> bool:
    """Whether another thermometer leaves a value, or passes through it, and stays away for long.

    In a soak one that has settled stays while others come to it, and, for its lag, when they leave it.
    """
    off = other - value if other[0] >= value else value - other
    away = np.flatnonzero((off > off[0] + least) | (off < -least))
    return len(away) > 0 and bool(time[-1] - time[away[0]] > STUCK_S)


def _frozen(run: Run, name: str) -> Iterator[Finding]:
    """Spells that a noisy output or thermometer makes by no chance, however short or steady the run."""
    values, half = run.columns[name], FROZEN_SAMPLES // 2
    turned = name == "gyro" and "rate" in run.columns and float(np.ptp(run.columns["rate"])) > 0.0
    same = values[1:] == values[:-1]
    if len(same) < FROZEN_SAMPLES or not same[: len(same) // half * half].reshape(-1, half).all(axis=1).any():
        return
    true = np.flatnonzero(same)
    edges = np.flatnonzero(np.diff(true) > 1)
    lengths = np.diff(edges, prepend=-1, append=len(true) - 1) + 1
    starts = true[np.concatenate(([0], edges + 1))]
    if turned:  # coarse counts rest at one value while the table stands
        yield from _unmoved(run, starts, lengths)
        return
    ordinary = int(np.max(lengths, where=lengths < FROZEN_SAMPLES, initial=1))
    found = np.flatnonzero(lengths >= max(FROZEN_SAMPLES, FROZEN_RATIO * ordinary))
    count = int(lengths[found].sum())
    others = len(same) - len(true) + 1 - len(found)
    if not len(found) or others < _LEAST_SPELLS or len(values) - count > _NOISY_SPELL * others:
        return
    first, last = int(starts[found[0]]), int(starts[found[-1]] + lengths[found[-1]])
    # A coarse thermometer changes with each sample of a fast ramp, and not in a soak.
    moving = max(values[:first], values[last:], key=len)[:_LOOKED_AT]
    if name != "gyro" and not noisy_beyond(moving, resolution(moving)):
        return
    spells = "" if len(found) == 1 else f", and {counted(len(found) - 1, 'time')} more"
    message = (
        f"'{name}' stays at {values[first]:.6g} for {lengths[found[0]]} samples from {run.time[first]:.10g} "
        f"s on{spells}, where else no value lasts longer than {ordinary}; the "
        f"{'output' if name == 'gyro' else 'sensor'} may be stuck"
    )
    yield Finding("stuck_sensor", message, column=name, row=first + 1, count=count)


def _unmoved(run: Run, starts: IndexArray, lengths: IndexArray) -> Iterator[Finding]:
    """Spells of one output while the table's rate changes.

    At an end of its range only where the table is slower there than where the output is within.
    """
    long = lengths >= FROZEN_SAMPLES
    gyro, rate, (low, high) = run.gyro, run.columns["rate"], large.extremes(run.gyro)
    within = large.each(lambda x, rate: np.abs(rate) * ((low < x) & (x < high)), gyro, rate)
    fastest = 0.95 * large.extremes(within)[1]
    spells = [
        (start, length)
        for start, length in zip(starts[long].tolist(), lengths[long].tolist())
        if np.ptp(turned := rate[start : start + length]) > MOVED_DEG_S
        and (low < gyro[start] < high or np.abs(turned).min() < fastest)
    ]
    if spells:
        first, length = spells[0]
        times = "" if len(spells) == 1 else f", and {counted(len(spells) - 1, 'time')} more,"
        message = (
            f"'gyro' stays at {run.gyro[first]:.6g} for {length} samples from {run.time[first]:.10g} s on"
            f"{times} while the table's rate changes; the output may be stuck"
        )
        count = sum(length for _, length in spells)
        yield Finding("stuck_sensor", message, column="gyro", row=first + 1, count=count)


def _marks(time: FloatArray) -> IndexArray | None:
    """First samples at or after marks so near that a spell of a stuck value holds two; None at long gaps."""
    apart_s = _MARK_SHARE * STUCK_S
    if time[-1] - time[0] > apart_s * len(time):
        return None
    marks = np.searchsorted(time, np.arange(time[0], time[-1], apart_s))
    return marks if np.all(marks[1:] > marks[:-1]) else None


def _stays(values: FloatArray, marks: IndexArray) -> bool:
    """Whether a column holds one value from any mark to the next."""
    if len(marks) < 2:
        return False
    large.release()
    same = values[1 : marks[-1] + 1] == values[: marks[-1]]
    return bool(np.logical_and.reduceat(same, marks[:-1]).any())


def _long_spells(time: FloatArray, values: FloatArray) -> tuple[IndexArray, IndexArray, int]:
    """Spells [start, stop) of one value that last long, and how many there are of any length."""
    kept, total, begin = [], 1, 0
    for part in large.pieces(values, overlap=1):
        changes = part.start + 1 + np.flatnonzero(values[part][1:] != values[part][:-1])
        total += len(changes)
        # The last spell of a part may go on in the next one.
        edges = np.concatenate([[begin], changes, [len(values)] if part.stop == len(values) else []])
        edges = edges.astype(np.intp)
        spells = np.column_stack((edges[:-1], edges[1:]))
        kept.append(spells[time[spells[:, 1] - 1] - time[spells[:, 0]] > STUCK_S])
        begin = int(edges[-1])
    starts, stops = np.concatenate(kept).T
    return starts, stops, total
