"""The runs on which verdicts are held against the next run, and the page of it."""

from __future__ import annotations

import numpy as np

from experiments.verdicts.__main__ import GRADES, chamber, lagged, one, page, play, recorded, unit
from fogml.signals.bases import play as play_of_the_library


def test_the_plain_runs_are_what_they_are_said_to_be() -> None:
    rng = np.random.default_rng(3)
    air = chamber(rng, "one range", trains=True)
    assert air[0] == 25.0 and air.min() == -35.0 and air.max() == 65.0
    assert np.abs(np.diff(air)).max() <= 2.0 / 6.0 + 1e-12  # degC in 10 s at 2 degC/min
    np.testing.assert_allclose(air + play(air, 8.0), play_of_the_library(air, 8.0), atol=1e-9)
    step = lagged(np.concatenate(([0.0], np.ones(60))), 100.0)
    np.testing.assert_allclose(step[1:], 1.0 - np.exp(-0.1 * np.arange(1, 61)), atol=1e-12)
    of = unit(rng) | {
        "cubic": np.array([2.0, 0.0, 0.0]),
        "rate": 0.0,
        "play": 0.0,
        "N": 0.0,
        "K": 0.0,
        "power_on": 0.0,
    }
    run = recorded(rng, of, air, "a")
    np.testing.assert_allclose(run.gyro, 9.0 + (lagged(air, of["lag_s"]) - 25.0) / 25.0, atol=1e-9)


def test_a_unit_gets_a_verdict_and_the_page_counts_it() -> None:
    row = one(1, "one range")
    assert row["grade"] in GRADES and row["rms"][1] < row["rms"][0]
    row["grade"] = "use"
    told = page([row, {**row, "rms": [1.0, 2.0]}], 1)
    assert "| one range | use | 2 | 50% (9% … 91%) | 100% (34% … 100%) |" in told
    assert "| any | use | 0 | – | – | – |" in told
