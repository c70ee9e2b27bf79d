"""Outputs that are rounded to steps, against the error of their means; angles that are counted."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.runs.checks import check_run
from fogml.runs.facts import Facts
from fogml.runs.run import Run

LEVELS = np.repeat(np.random.default_rng(5).uniform(-30.0, 30.0, 16), 1000)


def rounded(noise: float, seed: int, counted: bool) -> np.ndarray:
    """Sixteen rates with white noise in steps of 1 deg/h: each rounded, or the angle counted."""
    output = LEVELS + noise * np.random.default_rng(seed).standard_normal(len(LEVELS))
    return np.diff(np.floor(np.cumsum(output)), prepend=0.0) if counted else np.rint(output)


def is_told(gyro: np.ndarray) -> bool:
    run = Run("run", {"time": 1.0 * np.arange(len(gyro)), "gyro": gyro}, Facts())
    return "coarse_output" in [finding.code for finding in check_run(run)]


@pytest.mark.parametrize("counted", [False, True], ids=["rounded", "counted"])
@pytest.mark.parametrize("noise", [0.02, 0.1, 0.6, 2.0])
def test_rounding_is_told_where_means_are_off_by_more_than_noise(noise: float, counted: bool) -> None:
    gyro = rounded(noise, 1, counted)
    off = (gyro - LEVELS).reshape(16, -1).mean(axis=1)
    beyond_noise = np.sqrt(np.mean(off**2)) > 3.0 * noise / np.sqrt(1000.0) + 0.03
    assert is_told(gyro) == beyond_noise == (noise < 0.3 and not counted)


def test_digits_of_a_file_are_no_steps() -> None:
    assert not is_told(np.round(LEVELS + 0.3 * np.random.default_rng(2).standard_normal(len(LEVELS)), 3))
