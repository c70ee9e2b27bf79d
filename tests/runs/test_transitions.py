"""Changes of the table's rate: found where they were put, timed, and cut by the stated margin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.runs.facts import Facts, ScaleFactor
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_names, shipped_run
from fogml.runs.transitions import find_transitions, transition_mask, usual_margin_s

CHANGES = np.array([200.0, 260.0, 320.0, 500.0, 560.0])
LEVELS = np.array([0.0, -10.0, 10.0, 0.0, 10.0, 0.0])


def commanded(time: np.ndarray) -> np.ndarray:
    return LEVELS[np.searchsorted(CHANGES, time, side="right")]


def followed(time: np.ndarray, acceleration: float) -> np.ndarray:
    """The table's true rate: each change at a constant acceleration [deg/s^2]."""
    rate = np.full(len(time), LEVELS[0])
    for at, step in zip(CHANGES, np.diff(LEVELS)):
        rate += np.sign(step) * np.clip((time - at) * acceleration, 0.0, abs(step))
    return rate


def runs(sample_s: float, acceleration: float = np.inf, rate_noise=0.0, gyro_noise=5.0) -> dict[str, Run]:
    time = np.arange(0.0, 800.0, sample_s)
    command = commanded(time)
    true = command if np.isinf(acceleration) else followed(time, acceleration)
    rng = np.random.default_rng(5)
    gyro = 3600.0 * true * 1.001 + 3.0 + gyro_noise * rng.standard_normal(len(time))
    measured = true + rate_noise * rng.standard_normal(len(time))
    return {
        "command": Run.from_columns(time=time, gyro=gyro, rate=command),
        "measured": Run.from_columns(time=time, gyro=gyro, rate=measured),
        "gyro": Run.from_columns(time=time, gyro=gyro),
    }


@pytest.mark.parametrize("sample_s", [0.01, 0.1, 1.0, 10.0])
@pytest.mark.parametrize("source", ["command", "measured", "gyro"])
@pytest.mark.parametrize("acceleration", [np.inf, 10.0, 4.0])
def test_changes_are_found_where_they_begin(sample_s, source, acceleration):
    run = runs(sample_s, acceleration, rate_noise=0.002)[source]
    found = run.time[find_transitions(run)]
    assert len(found) == len(CHANGES)
    assert np.abs(found - CHANGES).max() <= max(0.2, sample_s)


@pytest.mark.parametrize("sample_s", [0.01, 0.1])
@pytest.mark.parametrize("source", ["command", "measured", "gyro"])
def test_the_margin_is_the_time_to_rate_that_is_not_recorded_and_more(sample_s, source):
    run = runs(sample_s, acceleration=4.0, rate_noise=0.002)[source]
    # 20 deg/s at 4 deg/s^2; the last 2 % of a step are within the gyro's band.
    beyond_s = 5.0 if source == "command" else 0.0
    assert usual_margin_s(run) == pytest.approx(beyond_s + 2.5, abs=0.15)


def test_a_table_that_steps_at_once_takes_no_time():
    for run in runs(0.1).values():
        assert usual_margin_s(run) == 2.5


def test_earth_rate_in_turns_about_another_axis_is_no_settling():
    """Turns of 10 deg/s upright, and of 2 deg/s with 0.3 deg of the axis along: Earth rate comes and goes."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        rate = np.concatenate([np.repeat(np.tile([0.0, size, 0.0, -size], 10), 70) for size in (10.0, 2.0)])
        along = np.repeat([1.0, 0.005], len(rate) // 2)
        earth = 11.5 * np.cos(np.radians(np.cumsum(rate) + 360.0 * rng.random())) * (along < 1.0)
        gyro = 3600.0 * along * rate + earth + 0.5 * rng.standard_normal(len(rate))
        assert usual_margin_s(Run.from_columns(time=np.arange(len(rate)), gyro=gyro, rate=rate)) <= 4.5


def test_lost_rows_lengthen_no_margin():
    """A table that takes 4 s to its rate; of rows every second 40 % are lost."""
    rise = np.linspace(0.0, 20.0, 5)
    rate = np.tile(np.concatenate([np.zeros(40), rise, np.full(40, 20.0), rise[::-1]]), 40)
    kept = np.random.default_rng(2).random(len(rate)) > 0.4
    time, rate = np.arange(len(rate))[kept], rate[kept]
    run = Run.from_columns(time=time, gyro=3600.0 * rate, rate=rate)
    assert usual_margin_s(run) <= 3.5
    assert set(rate[~transition_mask(run)]) == {0.0, 20.0}


@pytest.mark.parametrize("margin_s", [0.0, 1.0, 7.3])
@pytest.mark.parametrize("sample_s", [0.1, 1.0])
def test_the_mask_cuts_the_margin_and_nothing_else(margin_s, sample_s):
    run = runs(sample_s)["command"]
    distance = np.abs(run.time[:, None] - CHANGES).min(axis=1)
    mask = transition_mask(run, margin_s)
    assert mask[distance <= margin_s - 1e-9].all()
    assert not mask[distance > max(margin_s, sample_s) + 1e-9].any()
    assert mask[np.searchsorted(run.time, CHANGES - 1e-9) - 1].all()


def test_the_default_margin_keeps_to_the_bounds_of_the_source():
    run = runs(0.01, acceleration=4.0)["measured"]
    distance = np.abs(run.time[:, None] - CHANGES).min(axis=1)
    margin = distance[transition_mask(run)].max()
    assert 5.0 < margin < 10.0  # 5 s to rate


def test_every_sample_that_is_left_is_on_a_plateau():
    run = runs(0.1, acceleration=4.0)["command"]
    left = ~transition_mask(run)
    assert np.abs(followed(run.time, 4.0) - commanded(run.time))[left].max() < 1e-9


@pytest.mark.parametrize("late_s", [-8.0, 3.0, 5.0, 12.0, 24.0])
@pytest.mark.parametrize("sample_s", [0.1, 1.0])
def test_nothing_is_left_that_another_clock_puts_at_another_rate(late_s, sample_s):
    """Turns of a minute, rests of a minute; a table's log that is late or early by seconds."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 2400.0, sample_s)
    programme = np.array([0.0, 10.0, 0.0, -10.0])
    true, recorded = (
        programme[(np.maximum(time - delay, 0.0) // 60.0).astype(int) % 4] for delay in (0.0, late_s)
    )
    gyro = 3600.0 * 1.0002 * true + 0.02 * time + 2.0 * rng.standard_normal(len(time))
    mask = transition_mask(Run.from_columns(time=time, gyro=gyro, rate=recorded))
    assert (recorded == true)[~mask].all()
    assert mask.mean() < 0.9


def test_a_bias_that_wanders_is_no_lateness():
    """A random walk of 1 deg/h a root second, far below steps of 10 deg/s, over plateaus of a minute."""
    for seed in range(20):
        rng, time = np.random.default_rng(seed), np.arange(1500.0)
        rate = np.array([0.0, 10.0, 0.0, -10.0])[(time // 60.0).astype(int) % 4]
        gyro = 3600.0 * rate + np.cumsum(rng.standard_normal(len(time)))
        run = Run.from_columns(time=time, gyro=gyro, rate=rate)
        begins = find_transitions(run)
        assert not transition_mask(run)[begins - 5].any()


def test_a_fixture_that_is_tilted_in_a_rest_is_no_settling():
    """Rest, turn, rest, of 40 s each; in between the fixture is tilted, and Earth rate is another."""
    rng = np.random.default_rng(2)
    programme, block = np.repeat([0.0, 10.0, 0.0], 40), np.repeat(np.arange(20), 120)
    rate = np.tile(programme, 20) * (1.0 - 2.0 * (block % 2))
    gyro = 3600.0 * rate - 10.0 * (block % 2) + 0.5 * rng.standard_normal(len(rate))
    run = Run.from_columns(time=np.arange(len(rate)), gyro=gyro, rate=rate)
    tilted = np.flatnonzero(np.diff(block)) + 1
    assert transition_mask(run, others=tilted).mean() < 0.1 < 0.3 < transition_mask(run).mean()


def test_slow_samples_on_both_sides_of_a_change_are_cut():
    run = runs(10.0)["command"]
    rows = find_transitions(run)
    mask = transition_mask(run)
    assert mask[rows].all()
    assert mask[rows - 1].all()
    assert mask.sum() == 2 * len(rows)


def test_counts_tell_turns_too_where_the_scale_factor_is_known():
    run = runs(0.1)["gyro"]
    counts = Run("counts", {"time": run.time, "gyro": run.gyro * 7.0}, gyro_unit="count")
    assert len(find_transitions(counts)) == 0
    facts = Facts(scale_factor=ScaleFactor(value=7.0))
    counts = Run("counts", {"time": run.time, "gyro": run.gyro * 7.0}, facts, gyro_unit="count")
    assert np.array_equal(find_transitions(counts), find_transitions(run))


@pytest.mark.parametrize("name", shipped_names())
def test_recordings_at_rest_have_none(name):
    run = shipped_run(name)
    assert len(find_transitions(run)) == 0
    assert not transition_mask(run).any()


def test_a_drifting_gyro_with_outliers_does_not_turn():
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 3600.0)
    gyro = 50.0 * np.sin(time / 300.0) + 0.5 * rng.standard_normal(len(time))
    gyro[rng.integers(0, len(time), 20)] += 5e4
    assert len(find_transitions(Run.from_columns(time=time, gyro=gyro))) == 0


def test_a_rate_that_changes_all_the_time_is_no_transition():
    time = np.arange(0.0, 1000.0, 0.1)
    rate = 10.0 * np.sin(2 * np.pi * time / 400.0)
    run = Run.from_columns(time=time, gyro=3600 * rate, rate=rate)
    assert not transition_mask(run).any()


@pytest.mark.parametrize("rows", [0, 1, 2, 3])
def test_a_few_rows_are_no_trouble(rows):
    time = np.arange(float(rows))
    run = Run.from_columns(time=time, gyro=time, rate=time)
    assert transition_mask(run).shape == (rows,)


def test_a_negative_margin_is_refused():
    with pytest.raises(InputError, match="margin"):
        transition_mask(runs(1.0)["command"], -1.0)
    with pytest.raises(InputError, match="margin"):
        transition_mask(runs(1.0)["command"], float("nan"))


@settings(max_examples=50, deadline=None)
@given(
    gaps=st.lists(st.integers(40, 200), min_size=1, max_size=8),
    rates=st.lists(st.sampled_from([-100.0, -1.0, -0.01, 0.0, 0.5, 10.0]), min_size=9, max_size=9),
    sample_s=st.sampled_from([0.05, 0.5, 3.0]),
)
def test_any_programme_of_commands_comes_back(gaps, rates, sample_s):
    rate = np.repeat(rates[: len(gaps) + 1], [*gaps, 40])
    run = Run.from_columns(time=sample_s * np.arange(len(rate)), gyro=3600 * rate, rate=rate)
    expected = np.flatnonzero(np.diff(rate)) + 1
    assert find_transitions(run).tolist() == expected.tolist()
