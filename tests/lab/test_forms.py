"""Forms of the multi-point method, and their choice on held-out parts."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.features.parse import parse_features
from fogml.lab.forms import FormScore, multipoint_form, rank_forms, score_form, sensor_sets, smallest_within
from fogml.runs.facts import Facts
from fogml.runs.run import Run

SENSORS = ("T1", "T2", "T3")


def made(seed, noise=0.01, period=9000.0):
    """Bias of T1 squared and the rate of T2; T3 is unrelated."""
    random = np.random.default_rng(seed)
    time = 10.0 * np.arange(1800)
    first = 20.0 * np.sin(2 * np.pi * time / period)
    second = 15.0 * np.cos(2 * np.pi * time / (0.7 * period))
    third = 10.0 * np.sin(2 * np.pi * time / (1.3 * period) + 1.0)
    run = Run.from_columns(
        f"run {seed}",
        facts=Facts(unit="u", axis="x"),
        time=time,
        gyro=0.0 * time,
        T1=first,
        T2=second,
        T3=third,
    )
    rate = parse_features("dT2").transform(run)[:, 0]
    gyro = 0.3 + 1e-3 * first**2 + 0.2 * rate + random.normal(scale=noise, size=len(time))
    return run.with_columns(gyro=gyro)


def test_coefficients_of_the_papers_form():
    text = multipoint_form(("T1", "T2", "T3", "T4"), 5, 3)
    assert len(parse_features(text)) + 1 == 33
    assert multipoint_form(("T1",), 1, 0) == "T1" and multipoint_form(("T2",), 2, 1) == "T2^1..2, dT2"
    for sensors, order, rate in (((), 1, 0), (("T1",), 0, 1), (("T1",), 1, -1)):
        with pytest.raises(InputError, match="multi-point form"):
            multipoint_form(sensors, order, rate)


def test_sets_of_sensors():
    sets = sensor_sets(SENSORS)
    assert len(sets) == len(set(sets)) == 7 and sets[0] == ("T1",) and sets[-1] == SENSORS


@pytest.mark.parametrize("several", [False, True])
def test_folds_find_the_true_form(several):
    runs = [made(1), made(2, period=7000.0)] if several else made(1)
    forms = [multipoint_form(s, o, r) for s in sensor_sets(SENSORS) for o in (1, 2) for r in (0, 1)]
    ranked = rank_forms(forms, runs)
    assert [score.held_out_rms for score in ranked] == sorted(score.held_out_rms for score in ranked)
    chosen = smallest_within(ranked, 0.05)
    assert chosen.features == "T1^1..2, dT1, T2^1..2, dT2" and chosen.coefficients == 7
    # What is held out is left with the noise. Two runs are scored on 2500 windows of 14.4 s: of samples of
    # 10 s 44 in 100 hold two, whose mean has half the variance.
    noise = 0.01 * np.sqrt(1.0 - 0.44 / 2.0) if several else 0.01
    assert chosen.held_out_rms == pytest.approx(noise, rel=0.05)
    missing = score_form("T3^1..2, dT3", runs)
    assert missing.held_out_rms > 10.0 * chosen.held_out_rms


def test_the_smallest_of_near_equals_is_taken():
    scores = [FormScore("a", 9, 1.00), FormScore("b", 4, 1.015), FormScore("c", 2, 1.2)]
    assert smallest_within(scores).features == "b"
    assert smallest_within(scores, 0.5).features == "c"
    with pytest.raises(InputError, match="no form"):
        smallest_within([])
