"""Nonlinearity and asymmetry of the scale factor, against responses that are written out."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from fogml.runs.run import Run
from fogml.validation.metrics import RunMetrics
from fogml.validation.scale_factor import find_ladder, find_steps, ladder_figures, scale_factor_error

RATES = (5.0, 10.0, 20.0, 40.0)
DEG_H = 3600.0


def ladder_run(rates: tuple[float, ...] = RATES, *, rest: bool = True, plateau_s: int = 120) -> Run:
    """Each rate one way, then the other, from rest and back to it, 1 Hz; or straight from rate to rate."""
    levels = [0.0]
    for rate in rates:
        levels += [rate, 0.0, -rate, 0.0] if rest else [rate, -rate]
    if not rest:
        # Up and down the same way, so that a steady drift of the bias cancels.
        levels = [*levels[1:], *levels[-2:0:-1], levels[1]]
    table = np.repeat(levels, plateau_s)
    return Run.from_columns(time=np.arange(len(table)), gyro=DEG_H * table, rate=table)


def figures(run: Run, error: np.ndarray):
    steps = find_steps(run, np.ones(len(run), dtype=bool))
    assert steps is not None
    ladder = find_ladder(steps)
    assert ladder is not None
    return ladder_figures(ladder, steps.of(error))


def closed_form(rates: np.ndarray, output: np.ndarray) -> float:
    slope, offset = np.polyfit(rates, output, 1)
    return 1e6 * np.abs(output - slope * rates - offset).max() / np.abs(output).max()


def test_a_cubic_response_gives_its_deviation_from_the_line():
    run = ladder_run()
    cubic = 2e-7 / 40.0**2
    found = figures(run, 0.3 + DEG_H * cubic * run.rate**3 + 0.01 * run.time)
    levels = np.array([0.0, *RATES, *(-r for r in RATES)])
    expected = closed_form(levels, levels + cubic * levels**3)
    assert found.nonlinearity == pytest.approx(expected, rel=1e-6)
    assert found.asymmetry == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("ppm", [4.0, 250.0])
def test_two_slopes_give_the_asymmetry(ppm):
    run = ladder_run()
    error = DEG_H * run.rate * np.where(run.rate > 0.0, 0.5e-6 * ppm, -0.5e-6 * ppm)
    found = figures(run, error + 0.02 * run.time)
    assert found.asymmetry == pytest.approx(ppm, rel=1e-6)
    levels = np.array([0.0, *RATES, *(-r for r in RATES)])
    assert found.nonlinearity == pytest.approx(
        closed_form(levels, levels + 0.5e-6 * ppm * np.abs(levels)), rel=1e-6
    )


def test_a_constant_scale_factor_error_is_linear():
    run = ladder_run()
    found = figures(run, DEG_H * run.rate * 800e-6 - 3.0)
    assert found.nonlinearity == pytest.approx(0.0, abs=1e-6)
    assert found.asymmetry == pytest.approx(0.0, abs=1e-6)


def test_without_rest_the_line_is_told_and_the_asymmetry_is_not():
    run = ladder_run(rest=False)
    cubic = 3e-7 / 40.0**2
    found = figures(run, DEG_H * cubic * run.rate**3)
    levels = np.array([*RATES, *(-r for r in RATES)])
    assert found.nonlinearity == pytest.approx(closed_form(levels, levels + cubic * levels**3), rel=1e-6)
    assert found.asymmetry is None


def test_one_rate_both_ways_tells_the_asymmetry_alone():
    run = ladder_run((10.0,))
    found = figures(run, DEG_H * np.abs(run.rate) * 5e-6)
    assert found.nonlinearity is None
    assert found.asymmetry == pytest.approx(10.0, rel=1e-6)
    one_way = Run.from_columns(
        time=np.arange(360.0), gyro=np.zeros(360), rate=np.repeat([0.0, 10.0, 0.0], 120)
    )
    assert figures(one_way, np.zeros(360)).asymmetry is None


def test_noise_averages_out_over_the_steps():
    run = ladder_run(plateau_s=600)
    noise = np.random.default_rng(0).standard_normal(len(run))
    found = figures(run, noise)
    # 60 s beside each step: 0.13 deg/h a piece, of 144 000 deg/h.
    assert found.nonlinearity is not None and found.nonlinearity < 5.0


def test_the_metrics_of_a_run_hold_them():
    run = ladder_run(plateau_s=600)
    used = run.rate == 0.0
    told = RunMetrics(run, used, 100.0).figures(DEG_H * np.abs(run.rate) * 1e-5)
    assert told.scale_factor_asymmetry == pytest.approx(20.0, rel=1e-6)
    assert told.scale_factor_nonlinearity is not None
    still = run.with_columns(rate=np.zeros(len(run)))
    assert RunMetrics(still, used, 100.0).figures(np.zeros(len(run))).scale_factor_asymmetry is None


SLOW_AND_FAST = (0.1, 0.5, 1.0, 5.0, 100.0, 300.0)


@pytest.mark.parametrize("rest", [True, False])
def test_every_level_counts_however_slow(rest):
    """A ladder from 0.1 to 300 deg/s with an output that is curved near zero."""
    run = ladder_run(SLOW_AND_FAST, rest=rest)
    output = run.rate + 2e-3 * np.tanh(run.rate / 1.0)
    steps = find_steps(run, np.ones(len(run), dtype=bool))
    ladder = find_ladder(steps)
    wanted = sorted([*SLOW_AND_FAST, *(-r for r in SLOW_AND_FAST), *((0.0,) if rest else ())])
    assert ladder.rates / DEG_H == pytest.approx(wanted, abs=1e-9)
    assert (ladder.rest is not None) == rest
    levels = np.array(wanted)
    found = ladder_figures(ladder, steps.of(DEG_H * (output - run.rate)))
    assert found.nonlinearity == pytest.approx(closed_form(levels, levels + 2e-3 * np.tanh(levels)), rel=1e-4)


def test_asymmetry_of_slow_rates_is_that_of_least_squares_over_all():
    """Two slopes from rest, the way forward 751 ppm steeper, none dropped for being slow."""
    run = ladder_run(SLOW_AND_FAST)
    error = DEG_H * np.maximum(run.rate, 0.0) * 751e-6
    found = figures(run, error)
    assert found.asymmetry == pytest.approx(751e-6 / (1.0 + 0.5 * 751e-6) * 1e6, rel=1e-6)
    only_slow = ladder_run((0.1, 0.5, 1.0, 5.0))
    both = np.where(np.abs(only_slow.rate) < 10.0, 751e-6, 0.0) * np.maximum(only_slow.rate, 0.0)
    assert figures(only_slow, DEG_H * both).asymmetry == pytest.approx(found.asymmetry, rel=1e-6)


def test_slow_turns_are_left_out_of_the_largest_error_of_single_turns_and_that_is_said():
    run = ladder_run(SLOW_AND_FAST, plateau_s=600)
    metrics = RunMetrics(run, run.rate == 0.0, 100.0)
    noise = np.random.default_rng(0).standard_normal(len(run))
    found = metrics.figures(noise + DEG_H * run.rate * 20e-6)
    assert found.scale_factor_error_largest == pytest.approx(20.0, abs=2.0)
    assert "8 turns below 2 % of the greatest rate" in metrics.notes[0]


def test_rows_that_are_lost_at_random_hardly_make_the_scale_factor_less_sure() -> None:
    time = np.arange(7200.0)
    turn = np.where(time % 600.0 < 240.0, 0.0, np.where(time % 600.0 < 420.0, 10.0, -10.0))
    off, largest = {0.0: [], 0.3: []}, []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        gyro = 3600.0 * turn * (1.0 + 1e-5) + rng.normal(0.0, 0.06, len(time))
        for lost, errors in off.items():
            kept = rng.random(len(time)) >= lost
            run = Run("turns", {"time": time[kept], "gyro": gyro[kept], "rate": turn[kept]})
            steps = find_steps(run, np.ones(len(run), dtype=bool))
            assert steps is not None and len(steps) == 35
            told = scale_factor_error(steps, run.error_deg_h)
            errors.append(told.overall - 10.0)
            largest.append(told.largest)
    rms = {lost: np.sqrt(np.mean(np.square(errors))) for lost, errors in off.items()}
    # By the rows that are left it is 1.2 times; where every lost row parted a piece, it was four times.
    assert rms[0.3] < 1.8 * rms[0.0] and max(largest) < 10.6


def test_ramps_of_a_slow_table_leave_all_rates():
    """At 5 deg/s2 the table takes 40 s from 100 to -100 deg/s, nearly as long as it stays there."""
    levels = np.array([0.0, 10.0, -10.0, 50.0, -50.0, 100.0, -100.0, 0.0])
    parts = [np.zeros(60)]
    for start, stop in pairwise(levels.tolist()):
        parts += [np.linspace(start, stop, int(abs(stop - start) / 5.0), endpoint=False), np.full(60, stop)]
    table = np.concatenate(parts)
    # The gyro follows with a lag: what is left of it is cut after each ramp, however short.
    gyro = DEG_H * table
    for row in range(1, len(gyro)):
        gyro[row] += (gyro[row - 1] - gyro[row]) * np.exp(-2.0)
    cubic = 2e-5 / 100.0**2
    run = Run.from_columns(
        time=np.arange(len(table)), gyro=gyro + DEG_H * cubic * table**3, rate=table, T=25.0 + 0.0 * table
    )
    found = figures(run, run.gyro - DEG_H * table)
    rates = np.unique(levels)
    assert found.nonlinearity == pytest.approx(closed_form(rates, rates + cubic * rates**3), rel=1e-3)
    assert found.asymmetry == pytest.approx(0.0, abs=0.01)


def test_a_slow_table_whose_ramps_are_not_recorded_moves_no_scale_factor():
    """Commands at once, a table that takes 40 s between them at 5 deg/s2, and a gyro that lags by 2 s."""
    command = np.repeat([0.0, *[100.0, -100.0, 0.0] * 6], 120)
    table = command.copy()
    for row in range(1, len(table)):
        table[row] = table[row - 1] + np.clip(command[row] - table[row - 1], -5.0, 5.0)
    gyro = table.copy()
    for row in range(1, len(gyro)):
        gyro[row] += (gyro[row - 1] - gyro[row]) * np.exp(-0.5)
    noise = 0.2 * np.random.default_rng(1).standard_normal(len(gyro))
    run = Run.from_columns(
        time=np.arange(len(table)), gyro=DEG_H * 1.00005 * gyro + noise, rate=command, T=25.0 + 0.0 * table
    )
    steps = find_steps(run, np.ones(len(run), dtype=bool))
    assert steps is not None
    found = scale_factor_error(steps, run.gyro - DEG_H * command)
    assert found.overall == pytest.approx(50.0, abs=0.5)
