"""What is noticed in a run that was read: gaps, sampling, sensors, outliers, temperature span.

Nothing is changed; each finding says where and how much.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from datetime import timedelta

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError, counted
from fogml.numerals import short
from fogml.runs.findings import DEAD, SATURATION, Finding, dead_words
from fogml.runs.lateness import late_rate
from fogml.runs.outliers import OUTLIER_SIGMA, find_outliers
from fogml.runs.plausible import HOUR_S, implausible
from fogml.runs.run import Run
from fogml.runs.steps import coarse_output
from fogml.runs.stuck import stuck
from fogml.runs.thermometers import coarse, leading_temperature, resolution, spiked
from fogml.runs.turning import turning
from fogml.signals import large

SATURATED_SAMPLES = 3
"""Samples at an extreme, one after the other, from which on the output may saturate."""
SATURATED_IN_ALL = 10
"""Samples at an extreme in all: noise that reaches beyond it now and then is cut off one by one."""
SMALL_SPAN_DEGC = 5.0
"""A temperature span under this [degC] is small."""
_IRREGULAR_SHARE = 0.01
_IRREGULAR_INTERVAL = 0.1
_LEAST_STEPS = 8
_TAIL_RATIO = 3
_RESTING_SAMPLES = 10
_RESTING_RATIO = 10


def check_run(run: Run) -> tuple[Finding, ...]:
    """Everything noticed in a run, in O(n): first what `implausible` finds.

    ``temperature_dropouts``
        Readings of a thermometer that are none (`read_thermometer`).
    ``temperature_outliers``
        Other readings that stand out from their neighbours (`spiked`).
    ``coarse_thermometer``
        A thermometer of the coil whose steps make a rate of temperature wrong (`coarse`).
    ``gap``
        Intervals longer than 3 median sample intervals.
    ``irregular_sampling``
        More than 1 % of the other intervals are off the median by more than a tenth.
    ``stuck_sensor``
        A temperature holds one value for over 10 min while another moves by more than 0.5 degC
        and more than twice the sensor's resolution; or the gyro does, whose samples else differ.
        Or either, noisy else, holds one for 60 samples and ten times as long as it does else, no table
        turning; or the gyro for 60 samples while the table's rate changes.
    ``dead_output``
        The gyro has one value in every sample.
    ``saturation``
        The gyro stays at its greatest or least value for 3 samples on end, or is there in 10 in
        all, and over 3 times more often than at the value next to it, so that noise is cut off
        there; not where a quiet output rests at other values as well.
    ``coarse_output``
        The output is rounded to steps that its noise does not fill (`coarse_output`).
    ``late_rate``
        The output follows steps of the recorded rate a second or more late or early (`late_rate`).
    ``outliers``
        Gyro samples over 8 robust sigma off the median of the five about them (`find_outliers`).
    ``small_temperature_span``
        Under 5 degC.
    """
    if len(run) < 2:
        return ()
    parts = (
        implausible,
        _dropouts,
        spiked,
        coarse,
        _gaps,
        _irregular,
        stuck,
        _dead,
        _saturated,
        coarse_output,
        late_rate,
        _outliers,
        _span,
    )
    found: list[Finding] = []
    with np.errstate(over="ignore", invalid="ignore"):  # values near the greatest float
        for part in parts:
            found += part(run)
            large.release()
    return tuple(found)


def spoiling(run: Run) -> Iterator[Finding]:
    """Of `check_run` what makes an output's figures wrong: what can't be, spells of one value, saturation."""
    if len(run) < 2:
        return
    with np.errstate(over="ignore", invalid="ignore"):
        yield from implausible(run)
        yield from (finding for finding in stuck(run) if finding.column == "gyro")
        yield from _dead(run)
        yield from _saturated(run)


def refuse_dead(runs: Iterable[Run]) -> None:
    """Refuse runs whose output has one value in every sample, unless of a twin, which may have no noise."""
    for run in runs:
        for finding in _dead(run) if not run.facts.synthetic else ():
            raise InputError(f"{run.name}: {finding.message}; leave the run out, or record it again")


def _dropouts(run: Run) -> Iterator[Finding]:
    for name in run.temperature_columns:
        bad = run.dropouts(name)
        if bad is not None:
            count, row = int(np.count_nonzero(bad)), int(np.argmax(bad))
            readings = counted(count, "reading")
            message = (
                f"{readings} of '{name}' {'is' if count == 1 else 'are'} none, the first "
                f"{run.columns[name][row]:.6g} at {run.time[row]:.10g} s: out of range, or a jump that no "
                "heat makes; the last good one is held, the rows are flagged and left out of fit and score"
            )
            yield Finding("temperature_dropouts", message, column=name, row=row + 1, count=count)


def _gaps(run: Run) -> Iterator[Finding]:
    starts = run.gap_starts
    if len(starts):
        lengths = run.time[starts] - run.time[starts - 1]
        longest = int(np.argmax(lengths))
        gaps = counted(len(starts), "gap")
        message = (
            f"{gaps} longer than 3 sample intervals, the longest {short(lengths[longest], 4)} s at "
            f"{run.time[starts[longest] - 1]:.10g} s; the run is cut into {len(starts) + 1} stretches"
        )
        message += _put_forward(run, run.time[starts - 1], lengths)
        yield Finding("gap", message, column="time", row=int(starts[0]) + 1, count=len(starts))


def _put_forward(run: Run, since_s: FloatArray, lengths: FloatArray) -> str:
    """What a gap may come from that is an hour to a sample, from a full hour of a clock without a zone on."""
    begun = run.facts.started
    if begun is None or begun.tzinfo is not None or run.sample_s >= 0.25 * HOUR_S:
        return ""
    hour = np.abs(lengths - HOUR_S - run.sample_s) < 0.5 * run.sample_s
    if np.count_nonzero(hour) != 1:
        return ""
    last = begun + timedelta(seconds=float(since_s[hour][0]))
    next_s = 60.0 * last.minute + last.second + 1e-6 * last.microsecond + run.sample_s
    # The clock goes on from the first sample that the hour would have held.
    if not HOUR_S - 0.25 * run.sample_s <= next_s < HOUR_S + run.sample_s:
        return ""
    return (
        f"; that after {last.isoformat(' ', 'seconds')} is an hour from a full one on, as where local time "
        "is put forward in spring: then no sample is lost; write stamps in UTC or with their zone"
    )


def _irregular(run: Run) -> Iterator[Finding]:
    if run.clock.grid_s is not None:
        return
    limit = _IRREGULAR_INTERVAL * run.sample_s
    count, first = 0, 0
    for at, steps in large.differences(run.time):
        off = np.abs(steps - run.sample_s) > limit
        low, high = np.searchsorted(run.gap_starts - 1, [at, at + len(steps)])
        off[run.gap_starts[low:high] - 1 - at] = False
        first = first or (at + int(np.argmax(off)) + 2 if off.any() else 0)
        count += int(np.count_nonzero(off))
    if count > _IRREGULAR_SHARE * (len(run) - 1):
        message = (
            f"{count} of {len(run) - 1} intervals differ from the median of {short(run.sample_s, 4)} s by "
            "more than a tenth; true times are used"
        )
        yield Finding("irregular_sampling", message, column="time", row=first, count=count)


def _dead(run: Run) -> Iterator[Finding]:
    least, greatest = large.extremes(run.gyro)
    if greatest == least:
        yield Finding(DEAD, dead_words(greatest), column="gyro", row=1, count=len(run))


def _saturated(run: Run) -> Iterator[Finding]:
    gyro = run.gyro
    least, greatest = large.extremes(gyro)
    if greatest == least:
        return
    extremes = [(extreme, gyro == extreme) for extreme in (greatest, least)]
    if not any(_may_saturate(at) for _, at in extremes):
        return
    if greatest - least < _LEAST_STEPS * resolution(gyro):
        return  # so few steps hold no shape of noise that could be cut off
    usual = None
    for extreme, at in extremes:
        count = int(np.count_nonzero(at))
        if not _may_saturate(at):
            continue
        usual = usual or usual_rest(gyro)
        if extreme == greatest:
            next_to = np.max(gyro, where=~at, initial=-np.inf)
        else:
            next_to = np.min(gyro, where=~at, initial=np.inf)
        is_tail = count <= _TAIL_RATIO * np.count_nonzero(gyro == next_to)
        if not is_tail and not rests(_longest(at), usual):
            message = f"{count} samples of 'gyro' at its extreme of {extreme:.6g}; the output may saturate"
            at_rest = int(np.count_nonzero(at & ~turning(run)))
            row = int(np.argmax(at)) + 1
            yield Finding(SATURATION, message, column="gyro", row=row, count=count, at_rest=at_rest)


def usual_rest(values: FloatArray) -> int:
    """The most neighbouring samples of one value between the extremes; 1 where none are alike."""
    least, greatest = large.extremes(values)
    same = (values[1:] == values[:-1]) & (values[1:] != least) & (values[1:] != greatest)
    return _longest(same) + 1


def rests(spell: int, usual: int) -> bool:
    """Whether so many samples at an extreme are no limit: a quiet output of few steps rests elsewhere too."""
    return usual >= _RESTING_SAMPLES and spell < _RESTING_RATIO * usual


def _may_saturate(at: BoolArray) -> bool:
    return _longest(at) >= SATURATED_SAMPLES or int(np.count_nonzero(at)) >= SATURATED_IN_ALL


def _longest(mask: BoolArray) -> int:
    """Most neighbouring samples that are True."""
    true = np.flatnonzero(mask)
    if len(true) < 2:
        return len(true)
    edges = np.flatnonzero(np.diff(true) > 1)
    return int(np.diff(edges, prepend=-1, append=len(true) - 1).max())


def _outliers(run: Run) -> Iterator[Finding]:
    found, sigma = find_outliers(run.gyro, run.columns.get("rate"))
    if len(found):
        row = int(found[0])
        samples = counted(len(found), "sample")
        message = (
            f"{samples} of 'gyro' over {OUTLIER_SIGMA:g} robust sigma ({short(sigma[0], 4)}) off their "
            f"neighbours, the first {run.gyro[row]:.6g} at {run.time[row]:.10g} s; kept"
        )
        yield Finding("outliers", message, column="gyro", row=row + 1, count=len(found))


def _span(run: Run) -> Iterator[Finding]:
    temperature = leading_temperature(run)
    if temperature is None:
        return
    least, most = large.extremes(temperature)
    span = most - least
    if span < SMALL_SPAN_DEGC:
        message = f"the temperature spans {short(span)} degC only; under 5 degC a drift model is poorly told"
        yield Finding("small_temperature_span", message)
