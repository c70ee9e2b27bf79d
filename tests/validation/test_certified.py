"""Intervals of a certificate's figures, against the scatter of repeated series."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2, t

from fogml.intervals import Z90
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.signals.averages import freedom_of_deviation
from fogml.validation.certified import sample_deviation
from fogml.validation.scale_factor import Steps, find_steps, scale_factor_error


def lagged(rng: np.random.Generator, share: float) -> np.ndarray:
    """A Gauss-Markov series of 200 averages."""
    series = np.zeros(400)
    for place, step in enumerate(rng.standard_normal(399), start=1):
        series[place] = share * series[place - 1] + step
    return series[200:]


@pytest.mark.parametrize("share", [0.0, 0.8])
def test_the_interval_of_a_deviation_counts_that_neighbours_are_alike(share: float) -> None:
    series = [lagged(np.random.default_rng(seed), share) for seed in range(150)]
    told = [sample_deviation(one) for one in series]
    expected = np.sqrt(np.mean([one.value**2 for one in told]))
    held = [one.ci90[0] <= expected <= one.ci90[1] for one in told]
    assert 0.82 <= np.mean(held) <= 0.97
    # sum over lags of the squared correlations: (1 + share**2) / (1 - share**2).
    freedom = np.median([freedom_of_deviation(one) for one in series])
    assert freedom == pytest.approx(199.0 * (1.0 - share**2) / (1.0 + share**2), rel=0.25)
    if share:
        alike = [one.value * np.sqrt(199.0 / chi2.ppf([0.95, 0.05], 199)) for one in told]
        assert np.mean([low <= expected <= high for low, high in alike]) < 0.75


def test_few_turns_tell_a_scale_factor_by_student_s_t() -> None:
    rng = np.random.default_rng(0)
    rate = np.concatenate((*[np.repeat([0.0, 10.0, -10.0], [300, 60, 60])] * 3, np.zeros(300)))
    gyro = 3600.0 * rate + rng.standard_normal(len(rate))
    run = Run("turns", {"time": 1.0 + np.arange(len(rate)), "rate": rate, "gyro": gyro}, Facts())
    steps = find_steps(run, np.ones(len(run), dtype=np.bool_))
    assert steps is not None
    error = scale_factor_error(steps, gyro - 3600.0 * rate)
    assert error.se is not None and error.half_width == pytest.approx(error.se * t.ppf(0.95, 2), rel=1e-3)
    assert error.half_width > 1.5 * Z90 * error.se


@pytest.mark.parametrize(
    "rates", [(10.0, 10.0, 10.0), (1.0, 10.0, 100.0), (1.0, 1.0, 10.0, 10.0), (1.0, 10.0)]
)
def test_the_interval_of_a_scale_factor_holds_it_whatever_the_rates(rates: tuple[float, ...]) -> None:
    """Steps up and down of each rate, scattered by equal noise of their heights; the truth is 0."""
    rng = np.random.default_rng(7)
    heights = 3600.0 * np.repeat(rates, 2) * np.tile([1.0, -1.0], len(rates))
    places = np.arange(2 * len(heights)).reshape(-1, 2)
    levels = np.column_stack((np.zeros(len(heights)), heights))
    usable = np.arange(4 * len(heights))
    steps = Steps(places, places + 2 * len(heights), levels, np.arange(len(heights)) // 2, usable)
    found = [scale_factor_error(steps, rng.standard_normal(len(usable))) for _ in range(1500)]
    held = np.mean([abs(one.overall) <= one.half_width for one in found])
    assert 0.88 <= held <= 0.96


@pytest.mark.parametrize("lag_s", [1.0, 2.0])
def test_a_lag_behind_commanded_rates_is_cut_as_long_as_it_lasts(lag_s: float) -> None:
    rng = np.random.default_rng(1)
    rate = np.concatenate((*[np.repeat([0.0, 10.0, -10.0], [600, 60, 60])] * 5, np.zeros(600)))
    keep = np.exp(-1.0 / lag_s)
    gyro = 3600.0 * lfilter([1.0 - keep], [1.0, -keep], rate) + 0.06 * rng.standard_normal(len(rate))
    run = Run("turns", {"time": 1.0 + np.arange(len(rate)), "rate": rate, "gyro": gyro}, Facts())
    steps = find_steps(run, np.ones(len(run), dtype=np.bool_))
    assert steps is not None and len(steps) == 15
    # Cut to within 2 % and 2.5 s more, as a table's time to rate, it was off by 128 and 664 ppm.
    error = scale_factor_error(steps, gyro - 3600.0 * rate)
    assert abs(error.overall) < 0.5
