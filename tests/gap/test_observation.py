"""Runs made ready: rows are plain means, blocks keep off gaps and off what a replay can't know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.observation import Unusable, observe
from fogml.runs.run import Run
from tests.gap.small_model import SmallModel

MODEL = SmallModel()


def run_at(time, **more) -> Run:
    rng = np.random.default_rng(len(time))
    columns = {"gyro": rng.standard_normal(len(time)), "T": 20.0 + rng.standard_normal(len(time))}
    return Run.from_columns("r", time=time, **(columns | more))


def test_few_samples_are_rows_as_they_are():
    run = run_at(np.arange(0.0, 1000.0, 10.0))
    o = observe(run, MODEL)
    assert len(o) == len(run) and o.width == 1 and o.row_s == 10.0
    np.testing.assert_array_equal(o.recorded, run.gyro)


def test_rows_are_plain_means_over_their_blocks():
    run = run_at(np.arange(0.0, 1003.0))
    o = observe(run, MODEL, largest_rows=100)
    assert o.width == 11 and o.row_s == 11.0 and len(o) <= 100
    blocks = [slice(a, a + 11) for a in range(0, 1003, 11)]
    np.testing.assert_allclose(o.recorded, [run.gyro[b].mean() for b in blocks])
    np.testing.assert_allclose(o.time, [run.time[b].mean() for b in blocks])
    np.testing.assert_allclose(o.temperature, [run.columns["T"][b].mean() for b in blocks])
    assert o.stops[-1] - o.starts[-1] == 1003 - 11 * 91


def test_rows_need_be_no_shorter_than_ten_seconds_where_there_are_enough_of_them():
    assert observe(run_at(np.arange(0.0, 36_001.0)), MODEL).row_s == 10.0
    # 3,000 s in rows of 10 s would be 300 of them.
    assert observe(run_at(np.arange(0.0, 3000.0)), MODEL).row_s == 1.0
    assert observe(run_at(np.arange(0.0, 5000.0)), MODEL).row_s == 2.0
    # Of a long run the bound on rows counts.
    week = observe(run_at(np.arange(0.0, 604_800.0, 10.0)), MODEL)
    assert week.row_s == 80.0 and len(week) <= 8192


def test_blocks_do_not_reach_over_a_gap():
    time = np.concatenate([np.arange(0.0, 605.0), np.arange(2000.0, 2700.0)])
    gyro = np.where(time < 1000.0, 1.0, 5.0)
    o = observe(run_at(time, gyro=gyro), MODEL, largest_rows=100)
    assert o.width > 1
    assert set(np.round(o.recorded, 12)) == {1.0, 5.0}
    assert int((o.stops - o.starts).sum()) == len(time)


def test_what_memory_hides_after_a_start_and_a_gap_is_left_out():
    time = np.concatenate([np.arange(0.0, 2000.0, 5.0), np.arange(4000.0, 6000.0, 5.0)])
    o = observe(run_at(time), replace(MODEL, memory_s=128.0))
    assert o.time.min() >= 128.0
    after = o.time[o.time > 2100.0]
    assert after.min() >= 4128.0 and after.min() < 4140.0
    assert ((o.time > 1900.0) & (o.time < 2000.0)).any()


def test_samples_without_a_number_are_left_out():
    time = np.arange(0.0, 2000.0, 5.0)
    flow, load = np.ones(len(time)), np.linspace(0.0, 10.0, len(time))
    flow[10], load[20:22] = np.nan, np.inf
    o = observe(run_at(time, flow=flow, load=load), MODEL)
    assert len(o.run) == len(time) - 3
    assert np.isfinite(o.recorded).all() and np.isfinite(o.temperature).all()


@pytest.mark.parametrize(
    ("time", "more", "message"),
    [
        (np.arange(0.0, 599.0), {}, "lasts 598 s; a diagnosis needs at least 600 s"),
        (np.arange(0.0, 900.0), {"flow": np.full(900, np.nan)}, "column 'flow' holds no number"),
        (np.arange(0.0, 3000.0, 100.0), {}, "too short for a replay"),
    ],
)
def test_what_can_not_be_used_says_why(time, more, message):
    with pytest.raises(Unusable, match=message):
        observe(run_at(time, **more), MODEL)


def test_numbers_that_never_meet_are_refused():
    time = np.arange(0.0, 900.0)
    even = np.arange(900) % 2 == 0
    flow, load = np.where(even, 1.0, np.nan), np.where(even, np.nan, 20.0)
    with pytest.raises(Unusable, match="no row has a number in every column"):
        observe(run_at(time, flow=flow, load=load), MODEL)


def test_a_models_refusal_is_passed_on():
    class Picky(SmallModel):
        def on(self, run):
            raise InputError(f"{run.name}: no column 'pressure'")

    with pytest.raises(Unusable, match="r: no column 'pressure'"):
        observe(run_at(np.arange(0.0, 900.0)), Picky())
