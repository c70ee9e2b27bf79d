"""What the numbers of a run give away: a wrong sign or unit, thermometers apart, a gyro compensated before.

Each is said before anything else, as every figure after it would be wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise, permutations

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.intervals import SIGMA_PER_MEDIAN
from fogml.numerals import short
from fogml.runs.findings import Finding
from fogml.runs.run import Run
from fogml.runs.turning import implausible_rest, turned_earth_rate, turning
from fogml.signals import large

HOUR_S = 3600.0
FACTORS = {
    "deg/s taken for deg/h": 1.0 / HOUR_S,
    "deg/h taken for deg/s": HOUR_S,
    "rad/s taken for deg/s": np.pi / 180.0,
    "deg/s taken for rad/s": 180.0 / np.pi,
    "rad/s taken for deg/h": np.pi / 180.0 / 3600.0,
    "deg/h taken for rad/s": 180.0 / np.pi * 3600.0,
}
"""Factors by which a reading is off when its unit is taken for another."""
NEAR_EARTH_RATE = 0.3
"""A mean is Earth rate of the other sign or 3600 times off if it is as near to that as this share of it."""
NEAR_BY_CHANCE = 0.05
"""... and off by another unit if as near as this, as a plain bias may lie there too."""
STEADY = 3.0
"""... and, for one that is too small, if the samples scatter less than this many times the mean."""
LEAST_EARTH_RATE_DEG_H = 1.0
"""Less than this along the input axis [deg/h] tells nothing beside a bias."""
FAR_SCALE_FACTOR = 0.5
"""A scale factor off by more than this share is no error of a gyro."""
NEAR_FACTOR = 0.1
"""A ratio is that of two units if it is as near to it as this share."""
LEAST_TURN_SIGMA = 20.0
"""The table must turn this many times as fast as the output scatters at rest before it is judged."""
APART_DEGC = 80.0
"""Thermometers of one set-up don't differ by more on average [degC]: chamber to electronics, in a shock."""
KELVIN = (203.15, 400.0)
"""Readings in kelvin lie between these: -70 to 127 degC."""
HOTTEST_DEGC = 200.0
"""No coil is hotter on average [degC]."""
COUNTS = 400.0
"""Readings all beyond this are no temperature in any unit."""
COLDEST_DEGC = -100.0
"""No chamber is colder [degC]."""
HOT_DEGC = 100.0
"""Coils are specified to 85 degC, as the coating of their fibre is: what reads hotter may be Fahrenheit."""
HOT_ELECTRONICS_DEGC = 125.0
"""... and electronics to this."""
OWN_HEAT_DEGC = 10.0
"""A gyro's own heat and lags set the ends of two thermometers' ranges apart by less [degC]."""
HOTTER_DEGC = 30.0
"""... and such of electronics by less than this [degC]: what is hotter is so in another unit."""
FAHRENHEIT_SPANS = (1.5, 2.1)
"""Spans of two thermometers of one set-up have a ratio within these if one reads Fahrenheit: 1.8, but for
lags and heat that changes; without, about 1."""
FASTEST_DEGC_PER_MIN = 60.0
"""No chamber takes a gyro faster over `FAR_DEGC`: air of shock chambers changes by up to 50 degC/min."""
FAR_DEGC = 10.0
"""A thermometer's noise and a bad contact move means of parts of a run by less than this [degC]."""
SLOWEST_DEGC_PER_MIN = 0.0015
"""A temperature that moves by `FAR_DEGC` is faster at times [degC/min]: weather moves by 2 degC a day."""
SPREADSHEET_DAYS = (36526.0, 73050.0)
"""Days as spreadsheets count them, of the years 2000 to 2099."""
DAY_S = 86400.0
_PARTS = 64  # of a run, whose means noise moves little, and which a ramp of a chamber still spans
_PART_S = 6.0 * HOUR_S  # ... and none longer than a day's ups and downs
_ENDS = (0.02, 0.98)
Ends = tuple[float, float]


def implausible(run: Run) -> Iterator[Finding]:
    """What can't be as the run states it.

    ``already_compensated``
        The facts say so, or columns that ``fogml compensate`` writes are there.
    ``implausible_temperature``
        A temperature whose numbers are those of another unit: kelvin, Fahrenheit or raw counts.
    ``thermometers_apart``
        The means of two thermometers differ by more than 80 degC.
    ``implausible_clock``
        A temperature moves faster than any chamber takes a gyro, or slower than the weather; or the times
        of a fast logger are those of a spreadsheet's days.
    ``implausible_earth_rate``
        Earth rate is known, and the mean at rest is that with the other sign, or in another unit.
    ``implausible_scale_factor``
        The output follows the table rate with the other sign, or in another unit.
    ``implausible_rest``
        What the output does where no table rate is recorded, no bias does (`implausible_rest`).
    """
    yield from _compensated(run)
    told = {name: _unit_told(run.columns[name]) for name in run.temperature_columns}
    for name in (name for name, unit in told.items() if unit is not None):
        message = f"'{name}' is stated in degC and {told[name]}"
        yield Finding("implausible_temperature", message, column=name, count=len(run))
    others = [name for name, unit in told.items() if unit is None]
    found = list(_thermometers(run, others))
    yield from found
    yield from () if found else _hot(run, others)
    yield from _clock(run, others)
    try:
        gyro = run.gyro_deg_h
    except InputError:
        return  # counts whose scale factor is not stated
    yield from _scale_factor(run, gyro)
    yield from list(turned_earth_rate(run)) or _earth_rate(run, gyro)
    yield from implausible_rest(run, gyro)


def compensated_by(run: Run) -> str | None:
    """What says that the output is compensated already, or that a compensation lies beside it; else None."""
    if run.facts.compensated:
        return "its facts say 'compensated'"
    if "gyro_compensated" in run.columns:
        return "it holds a column 'gyro_compensated'"
    return None


def refuse_twice(run: Run) -> None:
    """Refuse to compensate what is compensated."""
    said = compensated_by(run)
    if said is not None:
        raise InputError(f"{run.name}: compensated already ({said}); compensate what it was made of")


def _compensated(run: Run) -> Iterator[Finding]:
    if run.facts.compensated:
        message = (
            "the output is compensated already: a model of it is one of what is left, and no drift model"
        )
        yield Finding("already_compensated", message, column="gyro")


def _unit_told(values: FloatArray) -> str | None:
    """What a temperature seems to be in, if not in degC."""
    least, most = large.extremes(values)
    if most < COLDEST_DEGC and least >= -COUNTS:
        return (
            f"reads {short(least, 4)} to {short(most, 4)}, colder than any chamber: degC "
            "under a header with [K]?"
        )
    if least >= -COUNTS and most <= HOTTEST_DEGC:
        return None
    low, middle, high = large.quantiles(large.parts_of(values), [_ENDS[0], 0.5, _ENDS[1]])
    if KELVIN[0] <= low and high <= KELVIN[1] and middle > HOTTEST_DEGC:
        return f"reads {short(low, 4)} to {short(high, 4)}: kelvin? Write the header with [K]"
    if low > COUNTS or high < -COUNTS:
        return (
            f"reads {short(low, 4)} to {short(high, 4)}: raw counts? State scale and offset "
            "in an import profile"
        )
    return None


def _thermometers(run: Run, names: Sequence[str]) -> Iterator[Finding]:
    if _most_apart([run.columns[name] for name in names]) < HOTTER_DEGC:
        return
    shares = (_ENDS[0], 0.5, _ENDS[1])
    told = {name: large.quantiles(large.parts_of(run.columns[name]), shares) for name in names}
    means = {name: middle for name, (_, middle, _) in told.items()}
    ends = {name: (low, high) for name, (low, _, high) in told.items()}
    pairs = [(a, b) for a in names for b in names if means[b] > means[a]]
    odd = {}
    for cold, warm in permutations(names, 2):
        if warm not in odd and _in_fahrenheit(ends[warm], ends[cold]):
            odd[warm] = (
                f"'{warm}' is 1.8 times '{cold}' and 32 more: Fahrenheit? Write its header with [degF]"
            )
    for name, why in odd.items():
        yield Finding("implausible_temperature", why, column=name, count=len(run))
    a, b = max(pairs, key=lambda pair: means[pair[1]] - means[pair[0]], default=(None, None))
    if a is not None and b is not None and a not in odd and b not in odd and means[b] - means[a] > APART_DEGC:
        why = (
            f"'{a}' and '{b}' differ by {short(means[b] - means[a], 4)} degC ({short(means[a], 4)} and "
            f"{short(means[b], 4)}): is one of them in another unit, or dead?"
        )
        yield Finding("thermometers_apart", why, column=a, count=len(run))


def _hot(run: Run, names: Sequence[str]) -> Iterator[Finding]:
    """Thermometers that read more than gyros stand, where no other one speaks against all of it."""
    for name in names:
        hot = HOT_ELECTRONICS_DEGC if name == "T_electronics" else HOT_DEGC
        if large.extremes(run.columns[name])[1] <= hot:
            continue
        low, high = large.quantiles(large.parts_of(run.columns[name]), _ENDS)
        if high > hot:
            message = (
                f"'{name}' reads {short(low, 4)} to {short(high, 4)} degC, hotter than fibre gyros are built "
                "for: Fahrenheit? Write its header with [degF]; if it was so hot, nothing is to be done"
            )
            yield Finding("implausible_temperature", message, column=name, count=len(run))


def _clock(run: Run, names: Sequence[str]) -> Iterator[Finding]:
    """A clock in another unit than its header says."""
    time = run.time
    if SPREADSHEET_DAYS[0] <= time[0] and time[-1] <= SPREADSHEET_DAYS[1] and run.sample_s < 60.0 / DAY_S:
        told = (
            f"the times, {time[0]:.10g} to {time[-1]:.10g} s, are days as a spreadsheet counts them, "
            f"one sample in {short(DAY_S * run.sample_s)} s: write the header as 'time [d]'; if samples are "
            f"{short(run.sample_s)} s apart, nothing is to be done"
        )
        yield Finding("implausible_clock", told, column="time", count=len(run))
        return
    parts = min(max(_PARTS, int(run.span_s / _PART_S)), len(run) // 2)
    edges = np.linspace(0, len(run), parts + 1).astype(int)
    rows = [_spread(a, b) for a, b in pairwise(edges)]
    middle = np.array([time[part].mean() for part in rows])
    for name in names:
        # Readings that are none, such as -9999, are few in each part.
        medians = np.array([np.median(run.columns[name][part]) for part in rows])
        # Stretches of such tell no temperature either.
        held = (medians > COLDEST_DEGC) & (medians < HOTTEST_DEGC)
        if not held.any():
            continue
        medians = medians[held]
        moved, within_s = np.abs(np.diff(medians)), np.diff(middle[held])
        fast = moved > FASTEST_DEGC_PER_MIN / 60.0 * within_s
        if moved[fast].sum() >= FAR_DEGC:
            told = (
                f"'{name}' moves by {short(moved[fast].sum())} degC in {short(within_s[fast].sum())} s in "
                "all, faster than a chamber takes a gyro: is the clock in a longer unit than its header "
                "says? Write 'time [s]', 'time [min]', 'time [h]' or 'time [d]'"
            )
            yield Finding("implausible_clock", told, column="time", count=len(run))
            return
        fastest = float(np.max(moved / within_s, initial=0.0)) * 60.0
        if np.ptp(medians) >= FAR_DEGC and fastest < SLOWEST_DEGC_PER_MIN:
            told = (
                f"'{name}' moves by {short(np.ptp(medians))} degC, but never faster than {short(fastest, 2)} "
                "degC/min, slower than chamber and weather: is the clock in a shorter unit, as ms or us? "
                f"Correct its header, as in 'time [ms]'; if samples are {short(run.sample_s)} s apart, "
                "nothing is to be done"
            )
            yield Finding("implausible_clock", told, column="time", count=len(run))
            return


def _spread(first: int, stop: int, blocks: int = 64) -> slice | IndexArray:
    """Rows from `first` to `stop`, or blocks of as many rows evenly over them, whose median is as good."""
    if stop - first <= blocks * blocks:
        return slice(first, stop)
    starts = np.linspace(first, stop - blocks, blocks).astype(np.intp)
    return np.asarray((starts[:, None] + np.arange(blocks)).ravel())


def _most_apart(columns: Sequence[FloatArray]) -> float:
    """A bound on how far apart the medians of columns are: each differs from the first by what samples do."""
    apart = [0.0]
    for other in columns[1:]:
        for part in large.parts_of(other, np.subtract, columns[0])():
            apart += [part.min(), part.max()]
    return float(np.ptp(apart))


def _in_fahrenheit(warm: Ends, cold: Ends) -> bool:
    """Whether one thermometer reads in Fahrenheit what another reads in degC, by the ends of their ranges.

    There temperatures stay most, so that lags count least.
    """
    apart = [(one - 32.0) / 1.8 - other for one, other in zip(warm, cold, strict=True)]
    span = cold[1] - cold[0]
    low, high = (share * span for share in FAHRENHEIT_SPANS)
    return (
        warm[1] - cold[1] > HOTTER_DEGC
        and max(map(abs, apart)) < OWN_HEAT_DEGC
        and low < warm[1] - warm[0] < high
    )


def _scale_factor(run: Run, gyro: FloatArray) -> Iterator[Finding]:
    turns = turning(run) if "rate" in run.columns else np.zeros(len(run), dtype=bool)
    if np.count_nonzero(turns) < 2:
        return
    rate = large.chosen(run.rate, turns)
    ratios = large.each(lambda output, rate: output / (3600.0 * rate), large.chosen(gyro, turns), rate)
    middle = large.median(large.parts_of(ratios))
    spread = large.median(large.parts_of(ratios, lambda part: np.abs(part - middle)))
    if abs(middle - 1.0) <= FAR_SCALE_FACTOR or spread > abs(middle) / LEAST_TURN_SIGMA:
        return
    told = f"the output follows the table rate {middle:.6g} times: {_why(middle)}"
    yield Finding("implausible_scale_factor", told, column="gyro", count=len(ratios))


def _why(ratio: float) -> str:
    """What a ratio to the truth comes from."""
    sign = "with the other sign" if ratio < 0.0 else ""
    for unit, factor in FACTORS.items():
        if abs(abs(ratio) / factor - 1.0) < NEAR_FACTOR:
            return " and ".join(part for part in (sign, unit) if part) + "? Correct the column's unit"
    if abs(abs(ratio) - 1.0) <= FAR_SCALE_FACTOR:
        return f"{sign}: is the axis or the table's sense turned round? Correct the sign"
    return "is the unit or the scale factor stated wrongly?"


def _earth_rate(run: Run, gyro: FloatArray) -> Iterator[Finding]:
    earth = run.facts.earth_rate_deg_h
    if earth is None or abs(earth) < LEAST_EARTH_RATE_DEG_H or "position" in run.columns:
        return  # where the unit is turned between positions, the facts tell one of them
    rest = ~turning(run) if "rate" in run.columns else np.ones(len(run), dtype=bool)
    if np.count_nonzero(rest) < 2:
        return
    at_rest = large.chosen(gyro, rest)
    mean = large.median(large.parts_of(at_rest))
    scatter = SIGMA_PER_MEDIAN * large.median(large.parts_of(at_rest, lambda part: np.abs(part - mean)))
    why = None
    if abs(mean + earth) < NEAR_EARTH_RATE * abs(earth):
        why = _why(-1.0)
    for unit, factor in FACTORS.items():
        near = NEAR_EARTH_RATE if max(factor, 1.0 / factor) == HOUR_S else NEAR_BY_CHANCE
        for sign in (1.0, -1.0):
            off = abs(mean / (sign * factor * earth) - 1.0)
            if off < near and (factor > 1.0 or scatter < STEADY * abs(mean)):
                turned = " and with the other sign" if sign < 0.0 else ""
                why = f"{unit}{turned}? Correct the column's unit"
    if why is None:
        return
    told = f"the output at rest is {short(mean, 4)} deg/h where Earth rate is {short(earth, 4)} deg/h: {why}"
    yield Finding("implausible_earth_rate", told, column="gyro", count=len(at_rest))
