"""Readings that stand out and steps too coarse for a rate are told, and nothing of sound ones."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.features.operators import Window
from fogml.runs.checks import check_run
from fogml.runs.run import Run
from fogml.runs.thermometers import RATE_WINDOW_S


def cycle(sample_s=1.0, seed=0, noise=0.01):
    """Two soaks with ramps of 1 degC/min between them."""
    time = np.arange(0.0, 9000.0, sample_s)
    rng = np.random.default_rng(seed)
    true = np.interp(time, [0.0, 1500.0, 4500.0, 6000.0, 8400.0], [20.0, 20.0, 70.0, 70.0, 30.0])
    return {
        "time": time,
        "gyro": rng.normal(0.0, 0.1, len(time)),
        "T": true + rng.normal(0.0, noise, len(time)),
    }


def told(columns):
    codes = ("temperature_outliers", "coarse_thermometer", "temperature_dropouts")
    return [one for one in check_run(Run("run", columns)) if one.code in codes]


@pytest.mark.parametrize("size", [1.0, -4.0])
def test_single_readings_that_stand_out_are_told(size):
    columns = cycle()
    assert told(columns) == []
    spoiled = columns["T"].copy()
    spoiled[[700, 3000]] += size
    (found,) = told(columns | {"T": spoiled})
    assert (found.code, found.column, found.row, found.count) == ("temperature_outliers", "T", 701, 2)


def test_a_sharp_turn_of_a_temperature_is_no_reading_that_stands_out():
    """As of electronics that are switched off and on, sampled slowly and without noise."""
    time = 10.0 * np.arange(900.0)
    turns = np.interp(time, [0.0, 3000.0, 3200.0, 3400.0, 9000.0], [25.0, 45.0, 25.0, 45.0, 46.0])
    gyro = np.random.default_rng(0).normal(size=900)
    assert told({"time": time, "gyro": gyro, "T": turns}) == []
    turns[500] += 2.0
    assert [(one.code, one.row) for one in told({"time": time, "gyro": gyro, "T": turns})] == [
        ("temperature_outliers", 501)
    ]


@pytest.mark.parametrize("sample_s", [0.2, 1.0, 10.0])
@pytest.mark.parametrize("digits", [1 / 1024, 1 / 16, 0.1, 0.25])
def test_steps_that_leave_a_rate_as_it_is_are_not(sample_s, digits):
    columns = cycle(sample_s)
    assert told(columns | {"T": digits * np.round(columns["T"] / digits)}) == []


def test_whole_degrees_are_told_with_the_error_of_a_rate():
    """Against the rate by two windows of means of the rounded readings, and of the readings."""
    assert Window().length_s == RATE_WINDOW_S
    columns = cycle(noise=0.0)
    whole = np.round(columns["T"] + 0.3)
    (found,) = told(columns | {"T": whole})
    assert found.code == "coarse_thermometer" and "steps of 1 degC" in found.message
    rows = int(RATE_WINDOW_S)
    off = []
    for shift in np.linspace(0.0, 1.0, 50, endpoint=False):
        slow = 40.0 + shift + 0.3 * columns["time"][: 2 * rows] / 60.0
        older, newer = (np.round(slow) - slow).reshape(2, rows).mean(axis=1)
        off.append(60.0 * (newer - older) / RATE_WINDOW_S)
    assert float(found.message.split("off by ")[1].split()[0]) == pytest.approx(np.std(off), rel=0.35)


def test_noise_that_rounds_the_steps_off_is_no_fault():
    columns = cycle(noise=0.6)
    assert told(columns | {"T": np.round(columns["T"])}) == []
