"""A run made in Python is checked as one from a file: the same faults are refused, dates become seconds."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from fogml.errors import InputError
from fogml.runs.run import Run

TIME = np.arange(100.0)
GYRO = np.random.default_rng(0).normal(size=100)
TEMPERATURE = 20.0 + 0.01 * TIME
NEVER = np.datetime64("NaT", "s")


def with_value(values, value):
    changed = values.copy()
    changed[50] = value
    return changed


FAULTS = {
    "nan": ({"gyro": with_value(GYRO, np.nan)}, "'gyro', sample 51: the value is missing"),
    "nan in T": ({"T": with_value(TEMPERATURE, np.nan)}, "'T', sample 51: the value is missing"),
    "infinite": ({"gyro": with_value(GYRO, -np.inf)}, "'gyro', sample 51: the value is infinite"),
    "beyond any sensor": ({"gyro": with_value(GYRO, 1e308)}, "'gyro', sample 51: .* which no sensor gives"),
    "reversed": ({"time": TIME[::-1]}, "'time', sample 2: time goes back"),
    "reset": ({"time": np.r_[TIME[:50], TIME[:50]]}, "'time', sample 51: time goes back"),
    "repeated": ({"time": with_value(TIME, 49.0)}, "'time', sample 51: time repeats"),
    "single precision": ({"time": (TIME + 1.7e9).astype("f4")}, "single precision .* 128 s apart"),
    "tiny steps": ({"time": 1e-299 * TIME}, "'time': samples 1 × 10⁻²⁹⁹ s apart are no gyro's"),
    "a matrix": ({"gyro": GYRO[:, None]}, r"'gyro': of shape \(100, 1\)"),
    "another length": ({"T": TEMPERATURE[1:]}, "columns differ in length"),
    "text": ({"T": np.full(100, "warm")}, "'T': holds .*numbers were expected"),
    "a missing date": ({"time": with_value(np.arange(100).astype("M8[s]"), NEVER)}, "NaT"),
    "objects": ({"gyro": np.array([None] * 100)}, "'gyro'.*(missing|no number)"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_refused(fault):
    changed, told = FAULTS[fault]
    columns = {"time": TIME, "gyro": GYRO, "T": TEMPERATURE, **changed}
    with pytest.raises(InputError, match=f"bench.*{told}"):
        Run("bench", columns)
    with pytest.raises(InputError, match=f"bench.*{told}"):
        Run.from_columns("bench", **columns)


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
@pytest.mark.parametrize("zone", [None, "UTC", "Asia/Shanghai"])
def test_dates_become_seconds(unit, zone):
    dates = pd.date_range("2026-03-02 08:00", periods=100, freq="s", tz=zone).as_unit(unit)
    for time in (dates, pd.Series(dates), dates - dates[0]):
        run = Run("bench", {"time": time, "gyro": GYRO})
        assert run.time.tolist() == TIME.tolist()
    assert Run("bench", {"time": dates.to_numpy(), "gyro": GYRO}).time.tolist() == TIME.tolist()


def test_a_part_and_added_columns():
    run = Run("bench", {"time": TIME, "gyro": GYRO, "T": TEMPERATURE})
    assert run[10:20].time.tolist() == TIME[10:20].tolist()
    with pytest.raises(InputError, match="'T', sample 51: the value is missing"):
        run.with_columns(T=with_value(TEMPERATURE, np.nan))
    with pytest.raises(ValueError, match="read-only"):
        run[10:20].gyro[0] = 1.0
