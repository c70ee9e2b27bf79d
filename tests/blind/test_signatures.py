"""Noise of the fit runs as the other methods are told it."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.blind.signatures import Stack, noise_of
from fogml.runs.writing import write_run
from tests.blind.suites import SAMPLE_S, N, cycle


def test_noise_of_the_fit_runs_does_not_depend_on_the_units_of_the_constants(tmp_path):
    run = cycle()
    rng = np.random.default_rng(4)
    white = 60.0 * N / np.sqrt(SAMPLE_S) * rng.standard_normal(len(run))
    # A drift that the constants explain, far above the noise.
    gyro = white + 0.3 * (run.columns["T_in"] - 25.0)
    write_run(run.with_columns(gyro=gyro), tmp_path / "a.csv")
    found = []
    for size in (1.0, 1e-6):
        stack = Stack([tmp_path / "a.csv"])
        stack.nominal = size * stack.nominal
        found.append(noise_of(None, stack))
    told, again = (noise.N for noise in found)
    assert again == pytest.approx(told, rel=1e-6)
    assert abs(told / N - 1.0) < 0.2
