"""A simulator's output in a column is enough for a diagnosis, whatever else it knows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.own_simulator import by_column, has_column
from fogml.gap.reading import rows_of
from fogml.runs.run import Run
from fogml.twin.replay import replay
from fogml.twin.simulate import simulate
from fogml.twin.twin_file import load_twin
from tests.report.diagnoses import series

STEPS = ["soak at 20 degC for 30 min", "ramp to 50 degC at 1 degC/min", "soak at 50 degC for 30 min"]


def run(seed: int) -> Run:
    """A run whose simulator knows a bias, a slope and a wave over temperature."""
    twin = load_twin("nominal").with_nominal(b0=2.0, b1=0.02, m=0.5)
    made = simulate(STEPS, twin, sample_s=20.0, seed=seed, columns=["T_in", "T_out"]).run
    T = made.temperature("T_in")
    wave = 0.3 * np.sin(T / 3.0)
    simulator = made.facts.earth_rate_deg_h + 1.8 + 0.02 * (T - 25.0) + wave
    columns = {**made.columns, "gyro": made.gyro + wave, "replayed": simulator}
    return Run(f"r{seed}", columns, made.facts)


def test_the_gap_is_recorded_less_the_column():
    runs = [run(1), run(2)]
    assert has_column(runs)
    told = by_column(load_twin("nominal"), runs[:1], runs[1:])
    apart = runs[0].columns["replayed"] - replay(told.model.twin, runs[0])
    assert abs(apart.mean()) < 0.01 and np.std(apart) < 0.25  # the wave's share that no constant holds
    for given, made in zip(runs, (*told.fit, *told.held_out)):
        gap = given.gyro_deg_h - given.columns["replayed"]
        np.testing.assert_allclose(made.gyro_deg_h - replay(told.model.twin, made), gap, atol=1e-9)
        assert "replayed" not in made.columns
        # What the simulator knows is no part of the gap: smooth rows leave what it misses.
        rows = rows_of(made, told.model.twin, 400)
        assert abs(rows.gap.mean() - 0.2) < 0.15 and np.std(rows.gap) < 0.25


def test_averages_of_a_replay_are_moved_by_what_the_column_is_apart():
    runs = [run(1), run(2)]
    told = by_column(load_twin("nominal"), runs[:1], runs[1:])
    centres = np.array([300.0, 900.0, 3300.0, 5000.0])
    none = np.zeros(4)
    replays = ("replayed_before", "replayed_recalibrated", "replayed_after")
    still = dict.fromkeys(("recorded", *replays, "gap_recalibrated", "gap_after"), none)
    given = replace(series("r1"), averaging_s=600.0, time_s=centres, **still)
    shown = told._moved(given)
    apart = runs[0].columns["replayed"] - replay(told.model.twin, runs[0])
    time = runs[0].time
    within = [(time >= centre - 300.0) & (time < centre + 300.0) for centre in centres]
    for name in ("recorded", *replays):
        moved = getattr(shown, name)
        np.testing.assert_allclose(moved, [apart[rows].mean() for rows in within], atol=1e-12)
    # What is recorded less replayed stays.
    assert not shown.gap_recalibrated.any() and not shown.gap_after.any()


def test_runs_that_have_it_and_runs_that_do_not_are_refused():
    one = run(1)
    bare = Run("bare", {n: v for n, v in one.columns.items() if n != "replayed"}, one.facts)
    assert not has_column([bare])
    with pytest.raises(InputError, match="bare: no column 'replayed"):
        has_column([one, bare])


def test_a_column_that_is_the_recorded_output_itself_is_refused():
    one, other = run(1), run(2)
    same = other.with_columns(replayed=other.gyro)
    with pytest.raises(InputError, match="r2, column 'replayed': is the recorded output itself"):
        by_column(load_twin("nominal"), [one], [same])


def test_a_simulator_whose_clock_is_late_beside_the_tables_is_told():
    """Levels of 0 and 10 deg/s of 5 min each; the simulator follows them 30 s late."""
    time = 2.0 * np.arange(1800.0)
    rate = 10.0 * (np.floor(time / 300.0) % 2)
    noise = np.random.default_rng(3).standard_normal(len(time))
    columns = {"time": time, "rate": rate, "T": 25.0 + time / 600.0}
    for late_s, said in ((0, 0), (30, 1)):
        replayed = 3600.0 * np.interp(time - late_s, time, rate)
        made = Run.from_columns("r", gyro=3600.0 * rate + noise, replayed=replayed, **columns)
        told = by_column(load_twin("nominal"), [made], [])
        assert len(told.late) == said
        assert all("'replayed' follows the recorded rate 30 s late" in words for words in told.late)
