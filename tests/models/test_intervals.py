"""Prediction intervals: the conformal rank, and how often they hold."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.models.feature_model import FeatureModel
from fogml.models.folds import told_by_each_other
from fogml.models.intervals import (
    LEVELS,
    Intervals,
    half_widths_of_runs,
    intervals_from_residuals,
    of_usual_averages,
    saved_intervals,
)
from fogml.models.mixed_effects_model import MixedEffectsModel
from fogml.models.names import make_model
from fogml.models.table import RunRows, averaged_table
from fogml.runs.run import Run
from fogml.strict import as_written
from fogml.testing.models import synthetic_run


def test_half_width_is_the_conformal_quantile():
    residuals = np.random.default_rng(0).permutation(np.arange(1.0, 100.0)) * np.resize([1, -1], 99)
    intervals = intervals_from_residuals(residuals, 100.0, "time blocks")
    assert intervals.half_width(0.9) == 90.0
    assert intervals.half_width(0.5) == 50.0
    assert intervals.half_width(0.995) == 99.0


def test_half_width_grows_outside_the_box():
    intervals = intervals_from_residuals(np.ones(50), 100.0, "time blocks")
    np.testing.assert_allclose(intervals.half_width(0.9, [0.0, 0.1, 1.0]), [1.0, 2.0, 11.0])


def test_conformal_intervals_hold_as_often_as_they_say():
    """Exchangeable residuals: coverage over many small samples is at least the level, and not far above."""
    rng = np.random.default_rng(1)
    held = [
        abs(rng.standard_t(3)) <= intervals_from_residuals(rng.standard_t(3, 40), 1.0, "x").half_width(0.9)
        for _ in range(4000)
    ]
    assert 0.89 < np.mean(held) < 0.925


@pytest.mark.parametrize("level", [0.5, 0.8, 0.9])
def test_intervals_hold_on_another_run_of_the_same_kind(level):
    model = FeatureModel("T^1..2, dT, T_in-T_out").fit(synthetic_run("0", 1.0))
    held = []
    for seed in range(2, 8):
        other = synthetic_run("other", 1.0, seed=seed)
        lower, upper = model.predict_interval(other, level)
        full = model.evaluate(other).full
        error, low, high = (
            x[full][: full.sum() // 100 * 100].reshape(-1, 100).mean(axis=1)
            for x in (other.error_deg_h, lower, upper)
        )
        held.append((low <= error) & (error <= high))
    assert abs(np.mean(held) - level) < 0.06


def test_a_network_of_first_differences_holds_its_own_training_run() -> None:
    """Of single samples differences are mostly noise, of averages they are not: their interval holds half."""
    rng, time = np.random.default_rng(0), np.arange(20_000.0)
    temperature = 40.0 * np.sin(2.0 * np.pi * time / 10_000.0)
    drift = 30.0 * np.gradient(temperature) + 0.3 * rng.standard_normal(len(time))
    read = temperature + 0.01 * rng.standard_normal(len(time))
    model = make_model("rbf-patent").fit(Run.from_columns("run", time=time, gyro=drift, T=read))
    left = drift - model.predict(Run.from_columns("run", time=time, gyro=drift, T=read))
    averages = np.abs(left.reshape(-1, 100).mean(axis=1))
    assert np.mean(averages <= model.intervals_.half_width(0.9)) >= 0.89


def test_three_runs_are_left_out_whole():
    runs = [synthetic_run(f"{s}", 2.0, seed=s) for s in range(3)]
    shifted = [run.with_columns(gyro=run.gyro + step) for run, step in zip(runs, (0.0, 0.3, -0.3))]
    model = FeatureModel("T^1..2, dT, T_in-T_out").fit(shifted)
    assert model.intervals_.folds == "whole runs"
    # Leaving out a run that lies 0.3 off the mean of all shows 0.45 off the mean of the others.
    assert model.intervals_.half_width(0.95) > 0.4


def test_the_shift_between_two_runs_is_in_their_interval() -> None:
    """Normal shifts: a third run lies within 2.92 differences of two as often as Cauchy's law says."""
    rng, time = np.random.default_rng(5), 100.0 * np.arange(40.0)

    def shifted(name: str) -> Run:
        gyro = rng.standard_normal() + 1e-3 * rng.standard_normal(len(time))
        return Run.from_columns(name, time=time, gyro=gyro)

    held = []
    for _ in range(150):
        model = make_model("mean").fit([shifted("a"), shifted("b")])
        held.append(np.abs(shifted("c").gyro - model.bias_) <= model.intervals_.half_width(0.9))
    expected = 2.0 / np.pi * np.arctan(2.92 * np.sqrt(2.0 / 1.5))
    assert abs(np.mean(held) - expected) < 0.09


@pytest.mark.parametrize(
    ("spans", "told"),
    [
        ([(0.0, 40.0)], False),
        ([(0.0, 40.0), (0.0, 40.0)], True),
        ([(0.0, 40.0), (20.0, 20.1)], False),  # what is at one temperature tells no cycle
        ([(0.0, 40.0), (5.0, 35.0), (20.0, 20.1)], True),
        ([(0.0, 40.0), (40.0, 80.0)], False),
        ([(20.0, 20.1), (50.0, 50.1)], True),
    ],
)
def test_runs_tell_each_other_where_they_share_temperatures(spans, told) -> None:
    temperatures = np.concatenate([np.linspace(*span, 50) for span in spans])[:, None]
    run_index = np.repeat(np.arange(len(spans)), 50)
    assert told_by_each_other(run_index, temperatures) == told


def test_a_richer_model_does_not_get_a_narrower_interval_for_fitting_noise():
    run = synthetic_run("short", 2.0)[:2400]
    plain = make_model("mean").fit(run).intervals_.half_width(0.9)
    rich = FeatureModel("T^1..9, dT^1..5, T*dT").fit(run).intervals_.half_width(0.9)
    in_sample = np.std(run.error_deg_h - FeatureModel("T^1..9, dT^1..5, T*dT").fit(run).predict(run))
    assert rich > 0.3 * in_sample and plain > 0.0


@pytest.mark.parametrize("seconds", [200, 260, 600])
def test_short_runs_get_intervals_too(seconds):
    model = make_model("polynomial").fit(synthetic_run("short", 1.0)[1200 : 1200 + seconds])
    summary = model.describe()["interval"]
    assert summary["half_width_90"] > 0.0 and summary["residuals"] > 0 and summary["averaging_s"] <= 100.0


def test_round_trip_and_bad_values():
    intervals = intervals_from_residuals(np.arange(10.0), 50.0, "whole runs")
    assert saved_intervals(as_written(intervals)) == intervals
    with pytest.raises(InputError, match="level"):
        intervals.half_width(1.0)
    assert intervals.half_width(0.995) == 9.0
    with pytest.raises(InputError, match=r"0\.999: must lie above 0 and not above 0\.995"):
        intervals.half_width(0.999)
    with pytest.raises(InputError, match="too short"):
        intervals_from_residuals([], 50.0, "time blocks")


def test_nine_runs_are_just_enough_for_nine_tenths():
    """The tenth run exceeds the largest of nine in one case of ten."""
    half = half_widths_of_runs([np.full(20, float(k)) for k in range(1, 10)])
    assert half[LEVELS.index(0.9)] == 9.0 and half[LEVELS.index(0.5)] == 5.0
    assert half[LEVELS.index(0.95)] > 9.0


def test_half_widths_of_long_averages_are_brought_to_the_usual_ones() -> None:
    """White noise: of averages over 400 s and over 100 s, by the closed form."""
    rng, sigma = np.random.default_rng(3), 0.5
    time = 10.0 * np.arange(40_000)
    rows = [RunRows(np.zeros((len(time), 1)), sigma * rng.standard_normal(len(time)), time)]
    table = averaged_table(rows, lambda atoms: atoms, 400.0)
    normal = NormalDist()
    z = np.array([normal.inv_cdf(0.5 + level / 2.0) for level in LEVELS])
    long = Intervals(400.0, tuple((z * sigma / np.sqrt(40.0)).tolist()), len(table), "runs")
    usual = of_usual_averages(long, rows, table, lambda atoms: np.zeros(len(atoms)))
    assert usual.averaging_s == 100.0
    np.testing.assert_allclose(usual.half_widths, z * sigma / np.sqrt(10.0), rtol=0.02)
    assert of_usual_averages(usual, rows, table, lambda atoms: np.zeros(len(atoms))) == usual


@pytest.mark.parametrize("runs", [1, 3])
def test_an_interval_of_many_hours_holds_averages_of_the_judgement(runs: int) -> None:
    """What it states is of 100 s averages however long the training is: no false doubt of a right model."""
    rng = np.random.default_rng(5)

    def recorded(rate: float) -> Run:
        legs = [25.0, 60.0, 60.0, -40.0, -40.0, 25.0]
        hours = np.cumsum([0.0, 35.0 / rate, 60.0, 100.0 / rate, 60.0, 65.0 / rate]) / 60.0
        time = np.arange(0.0, 3600.0 * hours[-1], 20.0)
        T = np.interp(time / 3600.0, hours, legs)
        gyro = 0.02 * (T - 25.0) + 0.3 * np.gradient(T, time) * 60.0 + 0.1 * rng.standard_normal(len(time))
        return Run("own", {"time": time, "gyro": gyro, "T": T})

    model = MixedEffectsModel().fit([recorded(0.5) for _ in range(runs)])
    test = recorded(0.6)
    left = test.gyro_deg_h - model.predict(test)
    count = len(left) // 5 * 5
    averages = left[:count].reshape(-1, 5).mean(axis=1)
    half = float(model.intervals_.half_width(0.9))
    assert model.intervals_.averaging_s == 100.0
    assert np.mean(np.abs(averages - averages.mean()) < half) > 0.85 and half < 4.0 * averages.std()
