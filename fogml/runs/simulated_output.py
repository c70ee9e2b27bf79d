"""What another simulator gives for a run, read from its files and brought to the run's own times.

Understood are a folder of gnss-ins-sim (``time.csv`` and ``gyro-0.csv``, ``gyro-1.csv`` ..., whose mean is
taken), and any file that reads as a run: a CSV or MATLAB file with ``time`` and ``gyro``, as Simulink's
logged signals are written with ``writetable`` or ``save``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.runs.run import Run

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
