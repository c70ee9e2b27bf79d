"""Whether a design index can be reached at all: an rms of averages does not fall below the noise in them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.validation.results import RunJudgement

LEVEL = 0.9
"""Confidence of the interval about a floor."""


def floor_interval(floor: float, averages: int, level: float = LEVEL) -> tuple[float, float]:
    """Interval in which the rms of so many averages of noise alone lies [deg/h].

    Parameters
    ----------
    floor
        Standard deviation of the noise in one average [deg/h].
    averages
        How many there are, taken as independent (chi-squared).
    level
        Share of the cases in it.
    """
    from scipy.stats import chi2

    tails = chi2.ppf([0.5 * (1.0 - level), 0.5 * (1.0 + level)], max(averages, 1))
    low, high = floor * np.sqrt(tails / max(averages, 1))
    return float(low), float(high)


def left_is_noise(judged: RunJudgement) -> bool:
    """Whether what is left after a model is the gyro's own noise, as far as the averages can tell.

    Their standard deviation is at most the upper end of its interval for noise alone, of the upper end of the
    floor's.
    """
    upper = judged.floor if judged.floor_ci90 is None else judged.floor_ci90[1]
    return judged.after.bias_stability <= floor_interval(upper, len(judged.series.time) - 1)[1]


def out_of_reach(
    index: float, floors: Sequence[float], averages: Sequence[int], averaging_s: float, where: str
) -> str | None:
    """The sentence that no model can meet a design index on some runs; None where one may.

    Parameters
    ----------
    index
        Greatest rms of averages allowed [deg/h].
    floors, averages
        Noise floor of each run [deg/h], and its number of averages.
    averaging_s
        Averaging time [s].
    where
        Names the runs.
    """
    count = int(np.sum(averages))
    if not count:
        return None
    floor = float(np.sqrt(np.average(np.square(floors), weights=averages)))
    low, high = floor_interval(floor, count)
    if index >= low:
        return None
    return (
        f"No model can reach the design index of {index:g} deg/h: the noise alone leaves {floor:.3g} deg/h "
        f"rms ({low:.3g} to {high:.3g}, {LEVEL:.0%}) in averages over {averaging_s:g} s of {where}"
    )
