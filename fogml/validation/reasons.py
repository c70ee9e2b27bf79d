"""What a single run says for or against the use of a model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from fogml.numerals import percent, short
from fogml.runs.findings import IMPLAUSIBLE
from fogml.validation.floors import made_worse, most_noise
from fogml.validation.results import RunJudgement

Grade = Literal["use", "use_with_care", "do_not_use"]


@dataclass(frozen=True)
class Reason:
    """One thing that decides: how far, in a few words, in a sentence, and what to do about it."""

    grade: Grade
    brief: str
    sentence: str
    next_step: str


def still_reason(run: RunJudgement, mostly_still: float, what: str) -> Reason | None:
    """What speaks against a model where the gyro's output stood still."""
    if run.still is None:
        return None
    told, share = run.still
    mostly = share > mostly_still
    how = f"nothing is {what} there" if mostly else f"what is {what} there goes by it"
    return Reason(
        "do_not_use" if mostly else "use_with_care",
        f"the output of {run.run} stands still",
        f"{run.run}: {told}. At {percent(share, 0)} of the samples the output stands still: {how}.",
        f"See whether the gyro was connected and switched on, and record {run.run} again.",
    )


def saturated_reason(run: RunJudgement, least: float, mostly: float, what: str) -> Reason | None:
    """What speaks against a model where at least so many of the output's samples are at its range's ends."""
    if run.saturated is None or run.saturated[1] < least:
        return None
    told, share = run.saturated
    return Reason(
        "do_not_use" if share > mostly else "use_with_care",
        f"the output of {run.run} saturates",
        f"{run.run}: {told}. At {percent(share, 0)} of the samples it is at the end of its range: what is "
        f"{what} there is the range, not the gyro.",
        f"Record {run.run} again with a range that holds the output, or leave these rows out.",
    )


def implausible_reasons(run: RunJudgement) -> Iterator[Reason]:
    """What speaks against a model where the numbers of a run can't be what they are stated to be."""
    for finding in run.findings:
        if finding.code in IMPLAUSIBLE:
            told = IMPLAUSIBLE[finding.code]
            yield Reason(
                "use_with_care",
                f"{told} of {run.run} can't be as stated",
                f"{run.run}: {finding.message}.".replace("?.", "?")
                + " If it is wrong, so is every figure here, "
                "and what the model makes of another run.",
                f"Put {told} of {run.run} right, or make sure of it, and train and judge again.",
            )


_FACTORS = {
    58.0: "deg/min, 60 times deg/h, or in radians, 57",
    1000.0: "thousandths",
    3600.0: "deg/s, 3600 times deg/h",
    206265.0: "rad/s, 206265 times deg/h",
}


def unit_reasons(
    train: Sequence[RunJudgement], test: Sequence[RunJudgement], *, units_apart: float = 40.0
) -> Iterator[Reason]:
    """What speaks against a model where two runs seem to be in different units.

    What two runs of one gyro move by, and their noise, both differ by less than `units_apart` times unless
    one is in another unit: radians, the nearest to degrees, are 57 of them.
    """
    for other, run in combinations((*train, *test), 2):
        moves = run.before.bias_stability, other.before.bias_stability
        noises = run.floor, other.floor
        if min(*moves, *noises) <= 0.0:
            continue
        apart = [abs(math.log(a / b)) for a, b in (moves, noises)]
        same_way = (moves[0] > moves[1]) == (noises[0] > noises[1])
        if same_way and min(apart) > math.log(units_apart):
            factor = min(_FACTORS, key=lambda one: abs(apart[1] - math.log(one)))
            near = abs(apart[1] - math.log(factor)) < math.log(2.0)
            yield Reason(
                "do_not_use",
                f"{run.run} and {other.run} seem to be in different units",
                f"{run.run} moves by {short(moves[0])} deg/h and {other.run} by {short(moves[1])}, and "
                f"their noise is as far apart ({short(noises[0], 2)} and {short(noises[1], 2)}): is one of "
                f"them in {_FACTORS[factor] if near else 'another unit'}?",
                "Put the unit of the output right, and train and judge again.",
            )
            return


def reversed_reasons(run: RunJudgement, *, steadier: float = 2.0) -> Iterator[Reason]:
    """What speaks against a model where the drift comes with the other sign than it was trained on.

    With the drift added a run that moves by more than its noise is steadier `steadier` times at least: three
    quarters of what it moves by are then the drift's course, reversed.
    """
    moves, reversed_ = run.before.bias_stability, float(np.std(run.series.before + run.series.drift))
    if moves > steadier * max(run.floor, reversed_):
        yield Reason(
            "do_not_use",
            f"the output of {run.run} seems to be reversed",
            f"Of {short(moves)} deg/h of bias stability on {run.run} the model makes "
            f"{short(run.after.bias_stability)}; of the output with its sign changed it would leave "
            f"{short(reversed_)}: was the axis turned over, or the sign changed on the way?",
            "Put the sign of the output right, and judge it again.",
        )


def opposite_reasons(train: Sequence[RunJudgement], *, steadier: float = 2.0) -> Iterator[Reason]:
    """What speaks against a model that was trained on runs of which one has the other sign.

    What a cubic in temperature with its rate makes of one run leaves of another one, added to it, half as
    much as that moves by, or less (1 / `steadier`), and each of the other: one of the two is reversed, that
    which is so beside more of the others.
    """
    pairs = [
        (a, b)
        for a, b in combinations(train, 2)
        if all(
            moves > steadier * max(run.floor, left)
            for run, (moves, left) in ((b, _with_course_of(a, b)), (a, _with_course_of(b, a)))
        )
    ]
    if not pairs:
        return
    counts = {run.run: sum(run in pair for pair in pairs) for run in train}
    most = [name for name, count in counts.items() if count == max(counts.values())]
    if len(most) == 1:
        (who,) = most
        what = f"the output of {who} seems to be reversed"
        how = f"What {who} does over temperature, the other training runs do with the other sign"
    else:
        who = " or ".join(sorted({run.run for run in pairs[0]}))
        what = f"{' and '.join(run.run for run in pairs[0])} seem to be of opposite signs"
        how = "What one of these training runs does over temperature, the other does with the other sign"
    yield Reason(
        "do_not_use",
        what,
        f"{how}, so that what they teach cancels: was the axis turned over, or the sign changed on the way?",
        f"Put the sign of {who} right, and train again.",
    )


def _with_course_of(one: RunJudgement, other: RunJudgement) -> tuple[float, float]:
    """What the output of `other` moves by, and with the course of `one` over temperature added [deg/h].

    By the averages at temperatures and rates that both have.
    """
    points = [np.array([run.series.temperature, run.series.rate]) for run in (one, other)]
    low = np.max([values.min(axis=1) for values in points], axis=0)[:, None]
    high = np.min([values.max(axis=1) for values in points], axis=0)[:, None]
    scale = np.where(high > low, high - low, 1.0)
    tables, outputs = [], []
    for run, values in zip((one, other), points, strict=True):
        within = np.all((values >= low) & (values <= high), axis=0)
        t, rate = (values[:, within] - low) / scale
        tables.append(np.column_stack([np.ones(len(t)), t, t**2, t**3, rate, t * rate]))
        outputs.append(run.series.before[within])
    if min(map(len, outputs)) <= 2 * tables[0].shape[1]:
        return 0.0, 0.0
    course = tables[1] @ np.linalg.lstsq(tables[0], outputs[0], rcond=None)[0]
    return float(np.std(outputs[1])), float(np.std(outputs[1] + course))


def gained_reasons(run: RunJudgement) -> Iterator[Reason]:
    """What a run says for or against the model by how much it takes away there."""
    before, after = run.before.rms, run.after.rms
    noise = most_noise(run, len(run.series.time))
    gained = before - after
    # The mean of one run also holds what its power-on shifted, by chance: that is no merit and no fault.
    steadier = run.before.bias_stability - run.after.bias_stability
    # By squares, as drift and noise add up: where noise is half of it, drift that is gone hardly shows.
    pairs = ((before, after), (run.before.bias_stability, run.after.bias_stability))
    taken = math.sqrt(max(0.0, *(a**2 - b**2 for a, b in pairs)))
    within = (
        f"{short(run.before.bias_stability)} deg/h of bias stability become {short(run.after.bias_stability)}"
    )
    if gained < 0.0 and after > noise and steadier >= run.floor:
        yield Reason(
            "use_with_care",
            f"the mean of {run.run} moved",
            f"Within {run.run} {within}, but its mean lies {short(run.after.bias)} deg/h off, "
            f"{short(run.before.bias)} without the model: that power-on shifted it, or the model did.",
            "Judge it on more runs: their means tell which, and how repeatable the bias is.",
        )
    elif made_worse(run, before, after):
        yield Reason(
            "do_not_use",
            f"worse than none on {run.run}",
            f"It makes {run.run} worse: {short(after)} deg/h rms after, {short(before)} before.",
            "Train on runs that are like the ones it is used on, or leave the output as it is.",
        )
    elif taken < run.floor:
        only_noise = after <= noise
        yield Reason(
            "use_with_care" if only_noise else "do_not_use",
            f"takes away less than the noise on {run.run}",
            f"On {run.run} {short(before)} deg/h rms become {short(after)}: {short(taken)} is taken "
            "away, less than "
            f"the noise floor of {short(run.floor)}{', and only noise is left' if only_noise else ''}.",
            "Leave the output as it is." if only_noise else "Compare other models (fogml compare).",
        )
    elif max(gained, steadier) < run.floor and after > noise:
        yield Reason(
            "use_with_care",
            f"leaves most of it on {run.run}",
            f"On {run.run} {short(before)} deg/h rms become {short(after)}: less is gained than the noise "
            f"floor of {short(run.floor)}, and more is left.",
            "Compare other models (fogml compare).",
        )
    elif steadier < -run.floor:
        yield Reason(
            "use_with_care",
            f"less steady than without on {run.run}",
            f"The mean of {run.run} comes out nearer, but within it {within}: that power-on may have shifted "
            "the mean that way.",
            "Judge it on more runs, or compare other models (fogml compare).",
        )
