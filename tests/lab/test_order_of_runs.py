"""The order in which runs are given decides no figure."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.lab.acceptance import acceptance_json
from fogml.lab.rate_json import rate_json
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from tests.lab.test_acceptance_runs import table_run

SIZES = (1.0, 5.0, 20.0, 50.0)
RATES = 3600.0 * np.array([0.0, *(sign * size for size in SIZES for sign in (1.0, -1.0)), 0.0])


def wave(seed, hertz, gain):
    """The table to and fro, under a gyro in counts."""
    time = np.arange(0.0, 200.0, 0.25)
    rate = 2.0 * np.sin(2.0 * np.pi * hertz * time)
    gyro = 3600.0 * gain * rate + np.random.default_rng(seed).standard_normal(len(time))
    facts = Facts(unit="FOG-0417", axis="z")
    return Run.from_columns(
        f"wave {seed}", facts, time=time, gyro=gyro, rate=rate, T=np.full(len(time), 25.0)
    )


@pytest.fixture(scope="module")
def runs():
    """Two ladders of as many rates and samples, and waves of one frequency."""
    ladders = [table_run(f"ladder {k}", RATES, RATES * (1.0 + k * 1e-6), seed=k, noise=0.1) for k in (1, 2)]
    return [*ladders, wave(3, 0.05, 1.0), wave(4, 0.1, 0.8), wave(5, 0.1, 0.5)]


def told(values, rows):
    """Values with lists of rows in an order of their own."""
    return values | {key: sorted(values[key], key=repr) for key in rows}


def test_rate(runs):
    first, *others = (
        told(rate_json(order, source=""), ("runs", "gains", "ladder", "notes"))
        for order in (runs, runs[::-1], [*runs[1:], runs[0]])
    )
    assert all(other == first for other in others)
    assert first["scale_factor"]["scale_factor"] == pytest.approx(1.0, abs=1e-5)


def test_acceptance():
    """Noise terms are of the longest static run: of two as long, of the same one."""
    time, facts = np.arange(200.0), Facts(unit="FOG-0417", axis="z")
    still = [
        Run.from_columns(
            f"still {seed}", facts, time=time, gyro=np.random.default_rng(seed).standard_normal(len(time))
        )
        for seed in range(2)
    ]
    one, other = (acceptance_json(order, averaging_s=20.0) for order in (still, still[::-1]))
    assert one["rows"] == other["rows"]
    assert any(row["tested"] and row["of"].startswith("still") for row in one["rows"][-5:])
