"""Scale factor error from turns: known scale factors, and drifts that must not leak into it."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.runs.run import Run
from fogml.validation.scale_factor import find_steps, scale_factor_error

MILLION = 1e6


def turning_run(turns: int = 4, rest_s: int = 600, rate: float = 10.0) -> Run:
    """At rest, 60 s one way, 60 s the other, again and again, 1 Hz."""
    one = np.concatenate([np.zeros(rest_s), np.full(60, rate), np.full(60, -rate)])
    table = np.concatenate([*[one] * turns, np.zeros(rest_s)])
    return Run.from_columns(
        time=np.arange(len(table)), gyro=3600.0 * table, rate=table, T=np.full(len(table), 25.0)
    )


def result(run: Run, error: np.ndarray):
    steps = find_steps(run, np.ones(len(run), dtype=bool))
    assert steps is not None
    return scale_factor_error(steps, error)


@pytest.mark.parametrize("ppm", [-500.0, 3.0, 1200.0])
def test_a_constant_scale_factor_error_is_found(ppm):
    run = turning_run()
    found = result(run, 3600.0 * run.rate * ppm / MILLION + 0.7)
    assert found.overall == pytest.approx(ppm, rel=1e-9)
    assert found.largest == pytest.approx(abs(ppm), rel=1e-9)


def test_a_linear_drift_of_the_bias_does_not_leak_in():
    run = turning_run()
    found = result(run, 0.01 * run.time)  # 36 deg/h per h
    assert abs(found.overall) < 1e-6
    assert found.largest < 1e-6


def test_turns_at_opposite_errors_show_in_the_largest():
    run = turning_run(turns=2)
    half = np.where(run.time < run.time[-1] / 2, 300.0, -300.0)
    found = result(run, 3600.0 * run.rate * half / MILLION)
    assert abs(found.overall) < 1.0
    assert found.largest == pytest.approx(300.0, rel=1e-6)


def test_turning_all_the_time_tells_it_too():
    table = np.tile(np.repeat([10.0, -10.0], 60), 5)
    run = Run.from_columns(time=np.arange(len(table)), gyro=table, rate=table)
    assert result(run, 3600.0 * table * 50.0 / MILLION).overall == pytest.approx(50.0, rel=1e-9)


def test_a_table_that_never_turned_tells_nothing():
    run = Run.from_columns(time=np.arange(100.0), gyro=np.zeros(100), rate=np.zeros(100))
    assert find_steps(run, np.ones(100, dtype=bool)) is None
    without = Run.from_columns(time=np.arange(100.0), gyro=np.zeros(100))
    assert find_steps(without, np.ones(100, dtype=bool)) is None


def test_a_spike_within_a_transition_is_cut():
    run = turning_run()
    error = 3600.0 * run.rate * 100.0 / MILLION
    error[np.flatnonzero(np.diff(run.rate)) + 1] += 1e4
    assert result(run, error).overall == pytest.approx(100.0, rel=1e-9)


def test_the_standard_error_is_that_of_turns_that_scatter():
    """Independent scale factors of single turns, by their definition over n - 1; none of one turn."""
    run = turning_run(turns=6)
    ppm = np.array([10.0, -20.0, 35.0, 5.0, -7.0, 60.0])
    each = np.zeros(len(run))
    for k, value in enumerate(ppm):
        each[720 * k : 720 * (k + 1)] = value
    found = result(run, 3600.0 * run.rate * each / MILLION)
    assert found.overall == pytest.approx(ppm.mean())
    assert found.se == pytest.approx(ppm.std(ddof=1) / np.sqrt(6.0))
    assert result(turning_run(turns=1), np.zeros(len(turning_run(turns=1)))).se is None
