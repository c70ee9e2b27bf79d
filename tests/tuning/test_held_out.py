"""Averages that a fold leaves out are those whose nearest row of their own run is held."""

import numpy as np

from fogml.models.table import TrainingTable
from fogml.tuning.held_out import HeldOut, _apart
from fogml.tuning.plan import Choice, Space
from tests.tuning.world import SPACE, runs


def table_of(times):
    time, runs = np.concatenate(times), np.repeat(np.arange(len(times)), [len(t) for t in times])
    count = len(time)
    return TrainingTable(np.zeros((count, 1)), np.zeros(count), runs, time, np.zeros(count, dtype=np.intp))


def test_an_average_goes_with_the_nearest_row_of_its_run():
    rows = table_of([np.arange(0.0, 40.0), np.arange(100.0, 160.0)])
    averages = table_of([np.arange(2.0, 40.0, 5.0), np.arange(102.0, 160.0, 5.0)])
    held = np.arange(10, 20)
    expected = [
        not np.isin(np.argmin(np.where(rows.run_index == run, np.abs(rows.time_s - t), np.inf)), held)
        for run, t in zip(averages.run_index, averages.time_s, strict=True)
    ]
    np.testing.assert_array_equal(_apart(averages, rows, held), expected)
    assert 0 < np.sum(expected) < len(expected)


def test_errors_are_of_averages_over_the_time_that_is_stated():
    """White noise of 0.02 deg/h in samples of 4 s is 0.02 sqrt(4 / T) in averages over T."""
    held = HeldOut(runs(2, 9000), Space.model_validate(SPACE))
    results = list(held.judged(Choice("polynomial", "T, dT[first]", {})))
    rows = np.concatenate([one.rows for one in results])
    rms = np.sqrt(np.average(np.concatenate([one.squared_errors for one in results]), weights=rows))
    assert held.averaging_s > 20.0
    np.testing.assert_allclose(rms, 0.02 * np.sqrt(4.0 / held.averaging_s), rtol=0.1)
