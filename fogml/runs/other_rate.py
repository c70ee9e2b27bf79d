"""What is of other times than the gyro's rows, brought to them: columns of another rate, simulated output.

Of simulators, understood are a folder of gnss-ins-sim (``time.csv`` and ``gyro-0.csv``, ``gyro-1.csv`` ...,
whose mean is taken), and any file that reads as a run: a CSV or MATLAB file with ``time`` and ``gyro``, as
Simulink's logged signals are written with ``writetable`` or ``save``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.numerals import duration, short
from fogml.runs.columns import DUTY, TIME_ON, column_spec, conversion, is_accepted, parse_header
from fogml.runs.findings import Finding
from fogml.runs.reader_process import StoredArray, StoredFile
from fogml.runs.run import Run
from fogml.signals import large

EMPTY_SHARE = 0.4
"""Share of empty rows from which on a column may be one of another rate."""
REGULAR_SHARE = 0.9
"""Share of its values that must be as many rows apart as usual, to half of that or one row."""
LONGEST_HOLE = 3.0
"""Nothing is filled in where values are more usual distances apart [s] than this."""
_LEAST_TIMES = 10


def is_of_another_rate(values: FloatArray) -> bool:
    """Whether a column is empty (NaN) in many rows, and evenly so."""
    held = np.flatnonzero(~np.isnan(values))
    # One that is full from its first value to its last is no slower: it begins later or ends before.
    span = held[-1] - held[0] + 1 if len(held) > 1 else 0
    if span == 0 or span - len(held) < EMPTY_SHARE * span:
        return False
    apart = np.diff(held)
    usual = float(np.median(apart))
    return float(np.mean(np.abs(apart - usual) <= max(1.0, 0.5 * usual))) >= REGULAR_SHARE


def is_held(name: str) -> bool:
    """Whether a column, a duty or a switch, keeps its value until the next one."""
    spec = column_spec(name)
    return spec is not None and spec.internal == DUTY


def on_gyro_rows(
    columns: Mapping[str, FloatArray],
) -> tuple[dict[str, FloatArray], IndexArray, tuple[Finding, ...]]:
    """Columns of another rate, interpolated in time between their own values, on the gyro's rows.

    Between two values of a duty or a switch the earlier one is held. Before the first value and after
    the last these are held. If the gyro itself is empty in most rows, only its own rows stay.

    Parameters
    ----------
    columns
        Columns of a run in internal units, each of shape (n,); times that don't go back.

    Returns
    -------
    columns, rows, findings
        Columns of shape (m,), the rows that they are of, and a finding for each column that was filled.
    """
    time = columns["time"]
    rows = large.count_up(len(time))
    if not any(np.isnan(values.min(initial=0.0)) for values in columns.values()):
        return dict(columns), rows, ()
    findings = []
    if is_of_another_rate(columns["gyro"]):
        rows = large.places(~np.isnan(columns["gyro"]))
        message = (
            f"'gyro' is in {len(rows)} of {len(time)} rows: the others, of another rate, are brought to these"
        )
        findings.append(Finding("other_rate", message, column="gyro", count=len(rows)))
    filled: dict[str, FloatArray] = {}
    for name, values in columns.items():
        is_known = column_spec(name) is not None
        sparse = is_known and name not in ("time", "gyro") and is_of_another_rate(values)
        if not sparse:
            filled[name] = values[rows]
            continue
        held = np.flatnonzero(~np.isnan(values))
        hold = is_held(name)
        filled[name] = _at(time[rows], time[held], values[held], hold)
        how = "held" if hold else "interpolated"
        message = (
            f"'{name}' is of another rate, {len(held)} values in {len(time)} rows; {how} at its true times"
        )
        findings.append(Finding("other_rate", message, column=name, row=int(held[0]) + 1, count=len(held)))
        findings += held_beyond(name, clock_ends(time[rows]), clock_ends(time[held]), len(held))
    return filled, rows, tuple(findings)


def _at(time: FloatArray, known: FloatArray, values: FloatArray, hold: bool) -> FloatArray:
    """Values at other times; NaN in holes."""
    before = np.clip(np.searchsorted(known, time, side="right") - 1, 0, len(known) - 1)
    if hold:
        found = values[before]
    else:
        found = np.interp(time, known, values)
    after = np.minimum(before + 1, len(known) - 1)
    apart = known[after] - known[before]
    hole = (apart > LONGEST_HOLE * float(np.median(np.diff(known)))) & (time != known[before])
    return np.where(hole, np.nan, found)


def other_clocks(
    time: FloatArray, columns: Mapping[str, FloatArray], units: Mapping[str, str | None]
) -> Iterator[Finding]:
    """What is said of unknown columns, in the units stated, that count up and show other times [s]."""
    for name, values in columns.items():
        unit = None if column_spec(name) or name == TIME_ON else units.get(name)
        if unit is not None and is_accepted("time", unit):
            yield from _other_clock(name, time, values, conversion("time", unit, "")[0])


def _other_clock(name: str, time: FloatArray, values: FloatArray, second: float) -> Iterator[Finding]:
    sound = large.each(lambda *x: np.isfinite(x).all(axis=0), values, time, kind=bool)
    own, its = large.chosen(time, sound), large.chosen(values, sound)
    if len(own) < _LEAST_TIMES or any((steps <= 0.0).any() for _, steps in large.differences(its)):
        return
    shown, true = (large.each(lambda x, start=x[0]: x - start, x) for x in (its, own))
    apart = large.each(lambda x, y: np.abs(second * x - y), shown, true)
    worst = int(np.argmax(apart))
    if apart[worst] > 2.0 * large.median(lambda: (np.abs(steps) for _, steps in large.differences(own))):
        its_s, own_s = short(second * float(shown[worst]), 6), short(float(true[worst]), 6)
        told = (
            f"'{name}' counts up as a clock does and shows {its_s} s where 'time' shows {own_s} s; what goes "
            "by it belongs into a file of its own, or a profile names it as the clock"
        )
        yield Finding("other_clock", told, column=name)


def held_beyond(
    name: str, run_s: tuple[float, float], own_s: tuple[float, float], count: int
) -> list[Finding]:
    """What is said of a column whose values are of a part of the run alone: beyond, the nearest is held.

    Parameters
    ----------
    name
        The column.
    run_s, own_s
        First and last time of the run, and of the column's own values [s].
    count
        How many values it has.
    """
    step_s = (own_s[1] - own_s[0]) / max(count - 1, 1)
    sides = ((own_s[0] - run_s[0], "before its first value"), (run_s[1] - own_s[1], "after its last"))
    told = [f"{duration(lost)} {side}" for lost, side in sides if lost > LONGEST_HOLE * step_s]
    # A switch keeps its value.
    if not told or is_held(name):
        return []
    message = f"'{name}' is not known {' and '.join(told)}: the nearest value is held there"
    return [Finding("held_beyond", message, column=name)]


def clock_ends(times: FloatArray) -> tuple[float, float]:
    """First and last of times, in any order, those apart that are none; NaN where all are none."""
    sound = times[np.isfinite(times)]
    return (float(sound.min()), float(sound.max())) if len(sound) else (float("nan"), float("nan"))


def interpolated(seconds: FloatArray, at: FloatArray, values: FloatArray, hold: bool = False) -> FloatArray:
    """Values of one rate at the times of another; the first and last are held beyond, with `hold` each."""
    sound = np.isfinite(at) & np.isfinite(values)
    if not sound.any():
        return np.full(len(seconds), np.nan)
    order = np.argsort(at[sound], kind="stable")
    known_s, known = at[sound][order], values[sound][order]
    if hold:
        return large.each(
            lambda part: known[np.maximum(np.searchsorted(known_s, part, side="right") - 1, 0)], seconds
        )
    return large.each(lambda part: np.interp(part, known_s, known), seconds)


def clock_s(cell: str, file: str) -> float:
    """Seconds in one unit of a clock, by its header cell."""
    return conversion("time", parse_header(cell)[1], file)[0]


class Beside:
    """A column of another group, read forward as the blocks of the run want it.

    Held of it are the values about the block's times; all of it where its own clock or the run's goes back.
    `step` values are read at once.
    """

    def __init__(
        self, cell: str, clock: tuple[str, StoredArray], array: StoredArray, step: int = 1 << 16
    ) -> None:
        self.cell, self.array, self.step = cell, array, step
        self.clock, self.times = clock
        self.count = min(max(self.times.shape), max(array.shape))
        self.read, self.is_whole = 0, False
        self.at_s, self.values = np.empty(0), np.empty(0)

    def at(self, stored: StoredFile, seconds: FloatArray) -> FloatArray:
        """The column at the times of a block, which comes after the block before."""
        sound = seconds[np.isfinite(seconds)]
        if not len(sound):
            return np.full(len(seconds), np.nan)
        if self.read > len(self.at_s) > 0 and sound.min() < self.at_s[0]:
            self._all(stored)
        while self.read < self.count and not (len(self.at_s) and self.at_s[-1] >= sound.max()):
            self._next(stored)
        hold = is_held(parse_header(self.cell)[0])
        found = interpolated(seconds, self.at_s, self.values, hold)
        if not self.is_whole:
            kept = max(int(np.searchsorted(self.at_s, sound.max(), side="right")) - 1, 0)
            self.at_s, self.values = self.at_s[kept:], self.values[kept:]
        return found

    def _next(self, stored: StoredFile) -> None:
        stop = min(self.read + self.step, self.count)
        at = stored.read(self.times, self.read, stop) * clock_s(self.clock, stored.path.name)
        values = stored.read(self.array, self.read, stop)
        sound = np.isfinite(at) & np.isfinite(values)
        before = self.at_s[-1:]
        self.at_s = np.concatenate([self.at_s, at[sound]])
        self.values = np.concatenate([self.values, values[sound]])
        self.read = stop
        if not self.is_whole and np.any(np.diff(np.concatenate([before, at[sound]])) < 0.0):
            self._all(stored)

    def _all(self, stored: StoredFile) -> None:
        stored.limits.check_size(stored.path, 2.0 * self.count)
        self.is_whole, self.read, self.step = True, 0, self.count
        self.at_s, self.values = np.empty(0), np.empty(0)
        self._next(stored)


AXES = ("x", "y", "z", "-x", "-y", "-z")
FINER = 0.75
"""A simulator with a step under this share of the run's is averaged over its samples; else interpolated."""
BEYOND = 1.5
"""Sample intervals of the run that the simulator's output may fall short of its ends by."""


def is_simulator_output(path: str | Path) -> bool:
    """Whether a path names a folder of gnss-ins-sim, or a file that is no YAML."""
    path = Path(path)
    return path.is_dir() or (path.is_file() and path.suffix.lower() not in (".yaml", ".yml"))


def read_gnss_ins_sim(folder: str | Path, axis: str | None) -> tuple[FloatArray, FloatArray]:
    """Time [s] and rate [deg/h] about one axis in a folder that gnss-ins-sim wrote, each of shape (n,).

    `axis` is one of `AXES`; with a minus, that of a gyro whose input axis points the other way.
    """
    folder = Path(folder)
    if axis not in AXES:
        raise InputError(f"{folder}: holds three axes; name one with --axis, of {', '.join(AXES)}")
    files = sorted(folder.glob("gyro-*.csv"))
    if not files or not (folder / "time.csv").is_file():
        raise InputError(
            f"{folder}: no time.csv and gyro-0.csv, which gnss-ins-sim writes; name its folder of results"
        )
    time, _ = _columns(folder / "time.csv", 1)
    rates = []
    for file in files:
        values, units = _columns(file, 3)
        place = "xyz".index(axis[-1])
        unit = units[place]
        factor = {"deg/s": 3600.0, "rad/s": float(np.degrees(3600.0)), "deg/h": 1.0}.get(unit)
        if factor is None:
            raise InputError(f"{file}: unit '{unit}' of the rate; deg/s, rad/s or deg/h was expected")
        if len(values) != len(time):
            raise InputError(f"{file}: {len(values)} rows, and {len(time)} in time.csv; they go together")
        rates.append((-factor if axis.startswith("-") else factor) * values[:, place])
    return time[:, 0], np.mean(rates, axis=0)


def _columns(file: Path, count: int) -> tuple[FloatArray, list[str]]:
    """Numbers of a file of gnss-ins-sim, shape (n, count), and the unit of each column."""
    try:
        text = file.read_text(encoding="utf-8")
        head, _, rest = text.partition("\n")
        values = np.loadtxt(rest.splitlines(), delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        told = f"rows of {count} numbers below one line of names were expected"
        raise InputError(f"{file}: {told} ({error})") from None
    cells = [cell.strip() for cell in head.split(",")]
    if values.shape[1] != count or len(cells) != count:
        raise InputError(f"{file}: {values.shape[1]} columns below '{head}'; {count} were expected")
    return values, [cell.rpartition("(")[2].rstrip(")").replace("deg/hr", "deg/h") for cell in cells]


def at_times_of(run: Run, time: FloatArray, rate: FloatArray, source: str) -> FloatArray:
    """A simulator's output at a run's samples [deg/h], shape (n,).

    Means over the run's sample interval where the simulator's step is shorter, so that fast noise and turning
    average as they do in a gyro; else in a straight line between its samples.

    Raises
    ------
    InputError
        If its times do not increase, or do not cover the run.
    """
    if len(time) < 2 or not np.all(np.diff(time) > 0.0):
        raise InputError(f"{source}: times that increase were expected, two at least")
    room = BEYOND * max(run.sample_s, float(np.median(np.diff(time))))
    if time[0] > run.time[0] + room or time[-1] < run.time[-1] - room:
        raise InputError(
            f"{source}: covers {time[0]:g} to {time[-1]:g} s, the run {run.time[0]:g} to {run.time[-1]:g} s; "
            "simulate all of the run, on its own clock"
        )
    if float(np.median(np.diff(time))) > FINER * run.sample_s:
        return np.asarray(np.interp(run.time, time, rate))
    area = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (rate[1:] + rate[:-1]))])
    half = 0.5 * run.sample_s
    low, high = (np.clip(run.time + by, time[0], time[-1]) for by in (-half, half))
    rise = np.interp(high, time, area) - np.interp(low, time, area)
    return np.asarray(rise / np.maximum(high - low, 1e-9))
