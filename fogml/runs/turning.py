"""Where the table turns, how noisy its recorded rate is, and turning that a run does not state.

That is an output at rest that no bias reaches, or that stands off a while.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError, counted
from fogml.intervals import MEDIAN_SIZE
from fogml.numerals import short
from fogml.runs.attitude import attitude, with_table_axis
from fogml.runs.findings import Finding
from fogml.runs.run import Run
from fogml.signals import large

LEAST_RATE_DEG_S = 1e-3
"""Table rates below this count as zero [deg/s]."""


def white_noise(values: FloatArray) -> float:
    """Standard deviation of white noise on a series of plateaus, by the median of second differences."""
    if len(values) < 4:
        return 0.0
    bends = large.median(lambda: (np.abs(part) for _, part in large.differences(values, 2)))
    return bends / MEDIAN_SIZE / float(np.sqrt(6.0))


def turning(run: Run) -> BoolArray:
    """True where the table rate is not zero, shape (n,).

    A measured rate counts as zero within six times its own noise.
    """
    slowest, fastest = large.extremes(run.rate)
    if slowest >= -LEAST_RATE_DEG_S and fastest <= LEAST_RATE_DEG_S:
        return np.zeros(len(run), dtype=bool)
    least = least_rate_deg_s(run)
    return large.each(lambda rate: np.abs(rate) > least, run.rate, kind=bool)


def check_noise_run(noise: Run) -> None:
    """Refuse a run that can't tell a unit's noise."""
    if turning(noise).any():
        raise InputError(f"{noise.name}: the table turns in it; a noise run is a static one")


def least_rate_deg_s(run: Run, noises: float = 6.0) -> float:
    """The least table rate that is not rest [deg/s]: `LEAST_RATE_DEG_S`, or so many times its own noise."""
    return max(LEAST_RATE_DEG_S, noises * white_noise(run.rate))


def turned_earth_rate(run: Run) -> Iterator[Finding]:
    """What is said where a recorded table angle carries the input axis from where the facts have it."""
    angle = run.columns.get("angle")
    if angle is None or not run.earth_known or "position" in run.columns or not angle.any():
        return
    if attitude(with_table_axis(run.facts, run.rate)).fixed:
        return
    earth = large.each(lambda reference, rate: reference - 3600.0 * rate, run.reference_deg_h, run.rate)
    least, most = (short(value, 4) for value in large.extremes(earth))
    along = least if least == most else f"{least} to {most}"
    told = (
        f"'angle' turns the input axis: Earth rate along it is taken for {along} deg/h, 'input_axis' being "
        "where it points at table angle 0"
    )
    yield Finding("turned_earth_rate", told, column="angle", count=len(run))


CODE = "implausible_rest"


def implausible_rest(
    run: Run,
    gyro: FloatArray,
    *,
    least_deg_h: float = 1800.0,
    noises: float = 20.0,
    within_s: float = 10.0,
    most_deg_h: float = 360_000.0,
) -> Iterator[Finding]:
    """What the output does at rest that no bias does, no table rate being stated there.

    Parameters
    ----------
    run
        The run. One with positions says of itself that it is turned between them.
    gyro
        Its output [deg/h], shape (n,).
    least_deg_h, noises
        An output stands off by at least this [deg/h] and so many times its noise: 0.5 deg/s is more than a
        bias moves by within seconds, and slow for a table.
    within_s
        It goes there within this [s], faster than heat moves a bias, and stays for longer: no shock does.
    most_deg_h
        No gyro has a greater bias [deg/h]: cheap ones in silicon have up to 20 deg/s.
    """
    low, high = large.extremes(gyro)
    if high - low < least_deg_h and max(abs(low), abs(high)) < most_deg_h:
        return
    rest = large.each(np.logical_not, turning(run), kind=bool)
    if "position" in run.columns or np.count_nonzero(rest) < 4:
        return
    still = large.chosen(gyro, rest)
    middle = large.median(large.parts_of(still))
    if abs(middle) > most_deg_h:
        told = (
            f"the output is {short(middle / 3600.0, 4)} deg/s where no table rate is recorded, more than any "
            "bias: is its unit or scale factor stated wrongly, or the table's 'rate [deg/s]' not recorded?"
        )
        yield Finding(CODE, told, column="gyro", count=len(still))
        return
    least = max(least_deg_h, noises * white_noise(still))
    off = large.each(lambda x, at: at & (np.abs(x - middle) > least), gyro, rest, kind=bool)
    edges = np.flatnonzero(np.diff(off, prepend=False, append=False))
    spells = [
        (start, stop)
        for start, stop in edges.reshape(-1, 2).tolist()
        if _stands_off(run, gyro, rest, start, stop, within_s, least)
    ]
    if spells:
        start, stop = spells[0]
        level = float(np.median(gyro[start:stop])) - middle
        lasted = run.time[stop - 1] - run.time[start]
        times = "" if len(spells) == 1 else f", and {counted(len(spells) - 1, 'time')} more"
        told = (
            f"the output stands {short(level / 3600.0, 4)} deg/s off its level for {short(lasted, 4)} s from "
            f"{run.time[start]:.10g} s on{times}, and comes or goes within seconds, where no table rate "
            "is recorded: did the table turn? Record its 'rate [deg/s]', or leave these rows out"
        )
        count = sum(stop - start for start, stop in spells)
        yield Finding(CODE, told, column="gyro", row=start + 1, count=count)


def _stands_off(
    run: Run, gyro: FloatArray, rest: BoolArray, start: int, stop: int, within_s: float, least: float
) -> bool:
    """Whether a spell [start, stop) lasts, begins or ends within seconds, and beside no recorded turn."""
    time = run.time
    edges = [edge for edge in (start, stop) if 0 < edge < len(time)]
    lasts = stop - start >= 3 and time[stop - 1] - time[start] >= within_s
    if not lasts or not all(rest[edge - 1] and rest[edge] for edge in edges):
        return False
    for edge in edges:
        if time[edge] - time[edge - 1] > max(within_s, 3.0 * run.sample_s):
            continue  # over a gap more may have changed
        before = min(int(np.searchsorted(time, time[edge] - within_s)), edge - 1)
        after = max(int(np.searchsorted(time, time[edge - 1] + within_s, "right")) - 1, edge)
        if abs(gyro[after] - gyro[before]) > 0.5 * least:
            return True
    return False
