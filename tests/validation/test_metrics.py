"""The figures of an error series against closed forms, and their invariants."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.runs.run import Run
from fogml.validation.metrics import RunMetrics, figures_of_averages

series = st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=50)


def everywhere(run: Run) -> np.ndarray:
    return np.ones(len(run), dtype=bool)


def static_run(error: np.ndarray, sample_s: float = 1.0) -> Run:
    return Run.from_columns(time=np.arange(len(error)) * sample_s, gyro=error)


@given(series)
def test_squares_add_up(values):
    figures = figures_of_averages(values)
    assert figures.rms**2 == pytest.approx(figures.bias**2 + figures.bias_stability**2)
    assert figures.rms == pytest.approx(np.sqrt(np.mean(np.square(values))), abs=1e-9)


@given(series, st.floats(-100, 100))
def test_a_constant_moves_the_bias_alone(values, constant):
    before = figures_of_averages(values)
    after = figures_of_averages(np.add(values, constant))
    assert after.bias == pytest.approx(before.bias + constant, abs=1e-9)
    assert after.bias_stability == pytest.approx(before.bias_stability, abs=1e-9)
    assert after.range == pytest.approx(before.range, abs=1e-9)


@settings(max_examples=20)
@given(st.integers(0, 1000))
def test_the_order_of_averages_does_not_matter(seed):
    values = np.random.default_rng(seed).normal(size=30)
    forwards, backwards = astuple(figures_of_averages(values)), astuple(figures_of_averages(values[::-1]))
    assert forwards == pytest.approx(backwards, rel=1e-12)


def test_white_noise_falls_with_the_square_root_of_the_averaging_time():
    noise = np.random.default_rng(1).normal(size=400_000)
    run = static_run(noise)
    stability = RunMetrics(run, everywhere(run), 100.0).figures(noise).bias_stability
    # 4000 averages: their scatter is known to 1 / sqrt(8000), 1.1 %.
    assert stability == pytest.approx(0.1, rel=0.05)


def test_a_ramp_has_the_closed_form_of_equal_steps():
    # Averages of a ramp over 10 windows of 10 samples are m equal steps of 10 samples' slope.
    error = np.arange(100) * 0.01
    run = static_run(error)
    figures = RunMetrics(run, everywhere(run), 10.0).figures(error)
    assert figures.bias == pytest.approx(0.495)
    assert figures.range == pytest.approx(0.9)
    assert figures.bias_stability == pytest.approx(0.1 * np.sqrt((10**2 - 1) / 12))
    assert figures.bias_stability_10s == figures.bias_stability


def test_rows_that_do_not_count_change_nothing():
    error = np.random.default_rng(2).normal(size=1000)
    run = static_run(error)
    used = everywhere(run)
    used[300:400] = False
    spoiled = error.copy()
    spoiled[300:400] = 1e6
    metrics = RunMetrics(run, used, 100.0)
    assert metrics.figures(spoiled) == metrics.figures(error)


def test_ten_second_figure_is_missing_where_samples_are_rare():
    error = np.random.default_rng(3).normal(size=100)
    run = static_run(error, sample_s=20.0)
    assert RunMetrics(run, everywhere(run), 100.0).figures(error).bias_stability_10s is None


def test_too_few_averages_is_an_error():
    run = static_run(np.zeros(120))
    with pytest.raises(InputError, match="at least 2 are needed"):
        RunMetrics(run, everywhere(run), 100.0)


def test_averages_shorter_than_a_sample_are_an_error():
    run = static_run(np.zeros(120), sample_s=2.0)
    with pytest.raises(InputError, match="samples are 2 s apart"):
        RunMetrics(run, everywhere(run), 1.0)


@pytest.mark.parametrize("averaging_s", [0.0, -1.0, float("nan"), float("inf")])
def test_an_averaging_time_that_is_none(averaging_s):
    run = static_run(np.zeros(120))
    with pytest.raises(InputError, match="positive"):
        RunMetrics(run, everywhere(run), averaging_s)
