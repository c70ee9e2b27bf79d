"""Tests on a rate table: scale factor, range, threshold, dead zone and resolution (IEEE Std 952).

Every plateau of the table's rate is one point of output over input. The line through them is the scale
factor; small rates against that line tell the rest. A bias that drifts steadily is told by rates that come
again: of rates that come once, it can't be told from a scale factor that goes with their size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.lab.rate_errors import Spread, spread_of
from fogml.lab.rate_pieces import ROUND_OFF_DEG_H, Plateaus, merged
from fogml.settings_check import check_numbers
from fogml.validation.scale_factor import LEAST_LEVELS, nonlinearity_ppm

LEAST_FOR_DRIFT = 3
"""Plateaus that a straight drift needs: two would leave nothing over."""


@dataclass(frozen=True)
class Criteria:
    """What counts as following.

    Attributes
    ----------
    answers
        Share of the expected output from which on a rate counts as seen: 50 % by IEEE Std 952.
    dead
        Share of the expected change of output below which a zone is dead: 10 % by IEEE Std 952.
    range_error
        Share by which a rate within the range may fall short of the line of the rates below it.
    small
        Share of the greatest rate below which rates tell threshold, dead zone and steps of resolution: they
        add little to the scale factor.
    doubt
        Standard error of a share beyond which noise, not the gyro, answers, and the rate is left out.
    errors
        Standard errors that a share has to lie beyond a limit: 2 are 95 %.
    """

    answers: float = 0.5
    dead: float = 0.1
    range_error: float = 0.01
    small: float = 0.02
    doubt: float = 0.2
    errors: float = 2.0

    def __post_init__(self) -> None:
        chances, shares = ("answers", "dead", "range_error"), ("small", "doubt")
        check_numbers(self, chances=chances, shares=shares, may_be_0=("errors",))


@dataclass(frozen=True)
class Line:
    """Output over rate: scale factor, its standard error, and what the rates leave [ppm].

    Attributes
    ----------
    scale_factor, se, ci90
        Output over input, its standard error, and the interval that holds it and the mean of both senses'
        with 90 %. The rates' scatter about the line counts as noise of two parts, one that goes with rate,
        such as the table's; so does nonlinearity other than asymmetry. None where nothing is left over.
    nonlinearity_ppm, nonlinearity_ci90_ppm
        Greatest deviation of a rate's output from the line over the greatest output; None for fewer than
        four rates. Its 90 % interval is `fogml.lab.rate_errors.nonlinearity_within`'s, which takes the run.
    asymmetry_ppm, asymmetry_ci90_ppm
        Scale factor of the positive rates less that of the negative ones, and its 90 % interval; None where
        one sense lacks.
    """

    scale_factor: float
    se: float | None
    ci90: tuple[float, float] | None
    nonlinearity_ppm: float | None
    asymmetry_ppm: float | None
    asymmetry_ci90_ppm: tuple[float, float] | None
    nonlinearity_ci90_ppm: tuple[float, float] | None = None


@dataclass(frozen=True)
class Bracket:
    """A size [deg/h] known to lie from `above` to `below`; None where no test was on that side."""

    above: float | None
    below: float | None


@dataclass(frozen=True)
class Range:
    """Rates that the output follows [deg/h].

    Attributes
    ----------
    followed
        The greatest rate that it follows.
    exceeded
        The smallest rate that it does not; None where it follows all.
    output
        Size of the output beyond, mean of all such rates; None likewise.
    """

    followed: float
    exceeded: float | None
    output: float | None


@dataclass(frozen=True)
class Answer:
    """A small rate or a small step: its size [deg/h], the share of it that shows, and the error of that."""

    size: float
    share: float
    se: float


def scale_line(plateaus: Plateaus, criteria: Criteria) -> tuple[Line, Range] | None:
    """Scale factor and range of a ladder of rates; None where fewer than two rates differ.

    Rates are taken in by their size as long as the output of the next one falls short of the line through
    those below it by `range_error` at most, and is not cut off. Beyond a dead zone it catches up instead.
    """
    if len(plateaus) < 3 or len(np.unique(merged(plateaus.rate, plateaus.rate_error))) < 2:
        return None
    size = merged(np.abs(plateaus.rate), plateaus.rate_error)
    sizes = np.unique(size[size >= criteria.small * size.max()])
    within = np.ones(len(plateaus), dtype=np.bool_)
    for place in range(len(sizes) - 1, 0, -1):
        below = size < 0.5 * (sizes[place - 1] + sizes[place])
        if np.ptp(plateaus.rate[below]) == 0.0:
            break
        scale, bias, drift = _fit(plateaus[below])
        expected = scale * plateaus.rate + bias + drift * plateaus.time
        top = (size >= 0.5 * (sizes[place - 1] + sizes[place])) & within
        lacking = (np.sign(scale * plateaus.rate) * (expected - plateaus.output))[top].max(initial=0.0)
        if lacking <= criteria.range_error * sizes[place] and not plateaus.clipped[top].any():
            break
        within = below
    kept, beyond = plateaus[within], plateaus[~within]
    exceeded = output = None
    if len(beyond):
        exceeded = float(np.abs(beyond.rate).min())
        output = float(np.abs(beyond.output).mean())
    return _line(kept, criteria), Range(float(np.abs(kept.rate).max()), exceeded, output)


def _levels(plateaus: Plateaus) -> IndexArray:
    """Number of each plateau's rate among those that differ, shape (k,)."""
    return np.unique(merged(plateaus.rate, plateaus.rate_error), return_inverse=True)[1]


def _drift_gain(plateaus: Plateaus, level: IndexArray) -> FloatArray | None:
    """What outputs are multiplied with for a steady drift of the bias [1/s], by rates that come again.

    None where none does.
    """
    count = np.bincount(level)
    time = plateaus.time - (np.bincount(level, plateaus.time) / count)[level]
    return time / (time @ time) if (count > 1).any() else None


def _fit(plateaus: Plateaus) -> tuple[float, float, float]:
    """Scale factor, bias [deg/h] at time 0 and its drift [deg/h per s]."""
    by_time = _drift_gain(plateaus, _levels(plateaus))
    drift = 0.0 if by_time is None else float(by_time @ plateaus.output)
    line = np.column_stack([plateaus.rate, np.ones(len(plateaus))])
    scale, bias = np.linalg.lstsq(line, plateaus.output - drift * plateaus.time, rcond=None)[0].tolist()
    return scale, bias, drift


def _line(plateaus: Plateaus, criteria: Criteria) -> Line:
    scale, bias, drift = _fit(plateaus)
    above = plateaus.output - drift * plateaus.time - bias
    level, rate, constant = _levels(plateaus), plateaus.rate, np.ones(len(plateaus))
    count, greatest = np.bincount(level), float(np.abs(rate).max())
    by_time = _drift_gain(plateaus, level)
    least = criteria.small * greatest
    two_sided = len(count) >= LEAST_LEVELS and (rate > least).any() and (rate < -least).any()
    # The gain of |rate| beside that of the rate is half of the difference of the two senses.
    matrix = np.column_stack([rate, constant, np.abs(rate)] if two_sided else [rate, constant])
    explained = matrix if by_time is None else np.column_stack([matrix, plateaus.time - plateaus.time.mean()])
    scatter = (constant, (rate / greatest) ** 2)

    def known(gain: FloatArray) -> Spread | None:
        """How well a gain of the outputs is known, those of the drift taken off."""
        if by_time is not None:
            gain = gain - float(gain @ plateaus.time) * by_time
        # What the plateaus' own noise makes, or what they scatter by, whichever is more.
        return spread_of(gain, explained, plateaus.output, scatter, least=float(np.mean(plateaus.error**2)))

    asymmetry, asymmetry_ends, uneven = None, None, 0.0
    if two_sided:
        mean, _, half = np.linalg.pinv(matrix)
        # What asymmetry makes of the line where one sense has more rates.
        uneven, gain = abs(scale - float(mean @ above)), 2e6 * half / scale
        asymmetry, told = float(gain @ above), known(gain)
        if told is not None:
            asymmetry_ends = (asymmetry - told.half_width, asymmetry + told.half_width)
    found = known(np.linalg.pinv(np.column_stack([rate, constant]))[0])
    half_width = uneven + (0.0 if found is None else found.half_width)
    return Line(
        scale,
        None if found is None else found.se,
        None if found is None else (scale - half_width, scale + half_width),
        nonlinearity_ppm(*(np.bincount(level, values) / count for values in (rate, above))),
        asymmetry,
        asymmetry_ends,
    )


def drift_shown(plateaus: Plateaus) -> tuple[float, float]:
    """What a scale factor that drifts steadily over a ladder does, as shares of the drift.

    How far off its middle value the line's scale factor is, and what nonlinearity shows; both are 0 of rates
    that come again the other way round.
    """
    course = plateaus.time - 0.5 * (plateaus.time.min() + plateaus.time.max())
    grown = replace(plateaus, output=plateaus.rate * course / np.ptp(course))
    scale, bias, drift = _fit(grown)
    level = _levels(plateaus)
    left = grown.output - drift * plateaus.time - bias - scale * plateaus.rate
    means = np.bincount(level, left) / np.bincount(level)
    return abs(scale), float(np.abs(means).max() / np.abs(plateaus.rate).max())


def near_zero(plateaus: Plateaus, greatest: float, criteria: Criteria) -> Plateaus:
    """The plateaus whose rate is small against the greatest of all [deg/h]."""
    return plateaus[np.abs(plateaus.rate) < criteria.small * greatest]


def _zero_of(small: Plateaus) -> float | None:
    """The rate that small ones come on top of [deg/h], where the output is zero if the table is set so.

    To it the table returns most; else it is the middle of a ladder of both senses.
    """
    if len(small) < LEAST_FOR_DRIFT:
        return None
    rates, count = np.unique(merged(small.rate, small.rate_error), return_counts=True)
    returned = rates[count == max(count.max(), LEAST_FOR_DRIFT)]
    if len(returned) == 1:
        return float(returned[0])
    return 0.5 * float(rates[0] + rates[-1]) if rates[0] < 0.0 < rates[-1] else None


def zero_answers(small: Plateaus, scale_factor: float, criteria: Criteria) -> list[Answer]:
    """Which share of each small rate shows, by size, in both senses together.

    They are told from the output at the rate that they come on top of, over time; where that does not come
    again, from the means of both senses. Sizes of one sense are left out: a zone about zero has two ends.
    """
    if (zero := _zero_of(small)) is None:
        return []
    rate = small.rate - zero
    sizes = merged(np.abs(rate), small.rate_error)
    sense = np.sign(rate) * (np.abs(rate) > ROUND_OFF_DEG_H + small.rate_error.max())
    tested = np.intersect1d(sizes[sense > 0.0], sizes[sense < 0.0])
    kept = (sense == 0.0) | np.isin(sizes, tested)
    small, sizes, sense = small[kept], sizes[kept], sense[kept]
    since = small.time - small.time.mean()
    steady = np.column_stack([np.ones(len(small)), since / max(np.ptp(since), 1.0)])
    rows = sense == 0.0 if np.sum(sense == 0.0) >= LEAST_FOR_DRIFT else np.ones(len(small), dtype=np.bool_)
    matrix = np.column_stack([steady, sense[:, None] * (sizes[:, None] == tested)])
    bias = np.linalg.lstsq(matrix[rows], small.output[rows], rcond=None)[0][:2]
    above = sense * (small.output - steady @ bias)
    answers = []
    for size in tested.tolist():
        here, expected = sizes == size, abs(scale_factor) * size
        shown = float(np.mean([above[here & (sense == way)].mean() for way in (1.0, -1.0)])) / expected
        noise = small.error[here] ** 2 + small.rate_error[here] ** 2
        se = float(np.sqrt(noise.mean() / here.sum())) / expected
        if se <= criteria.doubt:
            answers.append(Answer(size, shown * float(np.sign(scale_factor)), se))
    return answers


def step_answers(
    plateaus: Plateaus, greatest: float, scale_factor: float, criteria: Criteria
) -> list[Answer]:
    """Which share of each small step between neighbouring plateaus away from zero shows, by size."""
    step, low = np.diff(plateaus.rate), criteria.small * greatest
    far = np.minimum(np.abs(plateaus.rate[:-1]), np.abs(plateaus.rate[1:])) >= low
    here = far & (np.abs(step) < low) & (step != 0.0)
    noise = plateaus.error**2 + plateaus.rate_error**2
    sizes = merged(np.abs(step), np.hypot(plateaus.rate_error[:-1], plateaus.rate_error[1:]))
    answers = []
    for size in np.unique(sizes[here]):
        which = here & (sizes == size)
        share = np.diff(plateaus.output)[which] / (scale_factor * step[which])
        both = noise[:-1][which] + noise[1:][which]
        se = float(np.sqrt(both.mean() / which.sum())) / (abs(scale_factor) * float(size))
        if se <= criteria.doubt:
            answers.append(Answer(float(size), float(share.mean()), se))
    return answers


def least_seen(answers: Sequence[Answer], criteria: Criteria) -> Bracket | None:
    """The size from which on all are seen: threshold of rates, resolution of steps; None without a test.

    One that noise leaves open is neither seen nor unseen.
    """
    if not answers:
        return None
    slack = criteria.errors
    last = max((one.size for one in answers if one.share + slack * one.se < criteria.answers), default=None)
    seen = [one.size for one in answers if one.share - slack * one.se >= criteria.answers]
    return Bracket(last, min((size for size in seen if last is None or size > last), default=None))


def dead_zone(answers: Sequence[Answer], criteria: Criteria) -> Bracket | None:
    """Width of the zone about zero in which the output does not change with the rate; None without a test.

    The zone reaches as far as less than `dead` of the rate shows, as noise allows, and it has ended where the
    output changes by that share of a change of the rate, beyond noise.
    """
    if not answers:
        return None
    size = np.array([0.0, *(one.size for one in answers)])
    share, se = (np.array([0.0, *(getattr(one, part) for one in answers)]) for part in ("share", "se"))
    noise = criteria.errors * se
    silent = (share - noise < criteria.dead) & (share + noise < criteria.answers)
    inside = len(silent) if silent.all() else int(np.argmin(silent))
    changed = np.diff(size * share) - np.hypot((size * noise)[1:], (size * noise)[:-1])
    ends = np.flatnonzero(changed >= criteria.dead * np.diff(size))
    ends = ends[ends >= inside - 1]
    outside = 2.0 * float(size[ends[0] + 1]) if len(ends) else None
    return Bracket(2.0 * float(size[inside - 1]), outside)
