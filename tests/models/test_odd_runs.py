"""Runs that are short, still or coarse are modelled and judged, or refused in words."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sklearn.linear_model import Ridge

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.gap import diagnose
from fogml.models.names import MODEL_NAMES, make_model
from fogml.models.saved import load_model, save_model
from fogml.models.table import RunRows, averaging_of
from fogml.report.compare_page import compare_page
from fogml.report.train_page import train_page
from fogml.runs.facts import Facts
from fogml.runs.noise_of_run import noise_report
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from fogml.testing import check_model
from fogml.twin.replay import replay
from fogml.twin.twin_file import load_twin
from fogml.validation.inspection import inspection_json
from fogml.validation.judge import judge

FACTS = Facts(unit="U", axis="z", latitude=0.0, input_axis="up")


def run_of(gyro: FloatArray, T: FloatArray, sample_s: float, name: str = "run.csv") -> Run:
    time = sample_s * (np.arange(len(gyro)) + 1.0)
    return Run(name, {"time": time, "gyro": gyro, "T": T}, FACTS)


@pytest.mark.parametrize("name", ["auto", "mixed-effects", "polynomial"])
@pytest.mark.parametrize("rows", [60, 200])
def test_a_model_of_a_short_run_is_saved_as_it_can_be_read(name: str, rows: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    T = 25.0 + 20.0 * np.sin(np.arange(rows) * 60.0 / 3000.0)
    run = run_of(0.02 * T + 0.1 * rng.normal(size=rows), T, 60.0)
    model = make_model(name).fit([run])
    save_model(model, tmp_path / "model")
    again = load_model(tmp_path / "model")
    np.testing.assert_array_equal(again.predict(run), model.predict(run))
    assert again.intervals_.averaging_s >= 60.0


def test_noise_beside_a_temperature_that_steps_between_two_soaks() -> None:
    """The square of such a temperature does not move: it told constants of 1e130 once."""
    rng = np.random.default_rng(1)
    T = np.repeat([0.0, 50.0], 4500)
    run = run_of(0.03 * rng.normal(size=9000) + 1e-3 * T, T, 1.0)
    terms = noise_report(run)["terms"]
    assert terms["N"]["value"] == pytest.approx(0.03 / 60.0, rel=0.05)


@pytest.mark.parametrize(
    ("gyro", "T", "sample_s"),
    [
        pytest.param(np.zeros(900), np.linspace(0.0, 50.0, 900), 1.0, id="dead output"),
        pytest.param(np.full(900, 44.9), np.linspace(0.0, 50.0, 900), 10.0, id="output that stands still"),
        pytest.param(
            np.where(np.arange(900) == 300, 1e9, 3.0), np.full(900, 25.0), 10.0, id="one spike in it"
        ),
        pytest.param(np.round(np.sin(np.arange(900) / 90.0)), np.full(900, 25.0), 10.0, id="three counts"),
        pytest.param(
            np.sin(np.arange(900.0)), np.repeat([0.0, 50.0], 450), 600.0, id="a step at ten minutes a sample"
        ),
        pytest.param(np.sin(np.arange(8.0)), np.linspace(0.0, 50.0, 8), 60.0, id="eight samples"),
    ],
)
def test_odd_runs_are_judged_with_figures_that_are_finite(
    gyro: FloatArray, T: FloatArray, sample_s: float
) -> None:
    rng = np.random.default_rng(2)
    warm = np.concatenate([np.linspace(0.0, 50.0, 450), np.linspace(50.0, 0.0, 450)])
    train = run_of(0.02 * warm + 0.1 * rng.normal(size=900), warm, sample_s, "train.csv")
    test = run_of(gyro, T, sample_s, "test.csv")
    judged = judge(make_model("mean").fit([train]), [train], [test], averaging_s=2.0 * sample_s)
    found = judged.test[0]
    assert np.isfinite([found.before.rms, found.after.rms, found.floor]).all()
    assert "Rms before" in train_page(judged) and "test.csv" in compare_page({"mean": judged})


@pytest.mark.parametrize("name", [*MODEL_NAMES, "sklearn.neighbors.KNeighborsRegressor"])
@pytest.mark.parametrize("rows", [2, 3, 5])
def test_a_few_rows_are_fitted_or_refused_in_words(name: str, rows: int) -> None:
    rng = np.random.default_rng(1)
    T = np.linspace(0.0, 30.0, rows)
    for gyro, temperature in ((rng.normal(size=rows), T), (np.zeros(rows), np.full(rows, 25.0))):
        faces = {"T": temperature, "T_in": temperature, "T_out": 1.01 * temperature}
        run = Run("run.csv", {"time": np.arange(1.0, rows + 1.0), "gyro": gyro, **faces}, FACTS)
        try:
            drift = make_model(name).fit([run]).predict(run)
        except InputError as error:
            assert "training row" in str(error) or "can't be fitted" in str(error)
        else:
            assert np.isfinite(drift).all()


def test_columns_that_nothing_is_computed_of_may_hold_infinite_values() -> None:
    rng = np.random.default_rng(4)
    power = 300.0 + rng.normal(size=100)
    power[[7, 30]] = np.inf, np.nan
    columns = {"time": np.arange(1.0, 101.0), "gyro": rng.normal(size=100), "optical_power": power}
    told = inspection_json([Run("run.csv", columns, FACTS)])["runs"][0]["columns"][2]
    finite = power[np.isfinite(power)]
    assert (told["least"], told["greatest"]) == (finite.min(), finite.max())
    assert (told["mean"], told["standard_deviation"]) == pytest.approx((finite.mean(), finite.std()))


def test_runs_shorter_than_the_windows_are_refused_with_what_to_do() -> None:
    rng = np.random.default_rng(3)
    time = 0.01 * (np.arange(900) + 1.0)
    T = 20.0 + 30.0 * np.sin(np.linspace(0.0, 8.0, 900))
    columns = {"time": time, "gyro": rng.normal(size=900), "T_in": T, "T_out": T + rng.normal(size=900)}
    with pytest.raises(InputError, match="give longer runs, or state shorter windows"):
        make_model("auto").fit([Run("short.csv", columns, FACTS)])


@pytest.mark.parametrize("name", ["auto", "polynomial", "mean"])
def test_a_run_is_given_once(name: str) -> None:
    """Left out, a run that is there twice would be judged by itself: intervals of half the width."""
    rng = np.random.default_rng(2)
    T = 25.0 + 20.0 * np.sin(np.arange(400) * 60.0 / 3000.0)
    first, second = (run_of(0.02 * T + 0.1 * rng.normal(size=400), T, 60.0, f"{n}.csv") for n in "ab")
    later = Run("copy.csv", {**first.columns, "time": first.time + 7.0}, FACTS)
    make_model(name).fit([first, second])
    for twice in (first, later):
        with pytest.raises(InputError, match=r"the same samples as a\.csv; give each run once"):
            make_model(name).fit([first, second, twice])


@pytest.mark.parametrize("name", ["auto", "rbf", "polynomial"])
def test_a_logger_that_wakes_for_a_second_in_four_is_trained_on(name: str) -> None:
    """Averages as short as so short a run allows are less than half full there: none was left to judge by."""
    time = np.arange(0.0, 1800.0, 0.1)
    time = time[time % 4.0 < 1.0 - 1e-9]
    temperature = 30.0 - 15.0 * np.cos(2.0 * np.pi * time / 900.0)
    gyro = 10.0 + 0.1 * temperature + np.random.default_rng(0).normal(0.0, 0.1, len(time))
    run = Run.from_columns("bursts", None, time=time, gyro=gyro, T_in=temperature)
    model = make_model(name).fit([run])
    told = model.evaluate(run).drift
    assert np.std(told - 0.1 * temperature) < 0.05
    assert 0.0 < model.intervals_.half_width(0.9) < 1.0


def test_averages_are_longer_for_bursts_alone() -> None:
    time = np.arange(0.0, 3600.0, 0.5)
    even = RunRows(np.zeros((len(time), 1)), np.zeros(len(time)), time)
    assert averaging_of([even], 7.5) == 7.5
    bursts = time[time % 20.0 < 5.0]
    held = averaging_of([RunRows(np.zeros((len(bursts), 1)), np.zeros(len(bursts)), bursts)], 15.0)
    assert 4.0 * 15.0 <= held <= 8.0 * 15.0


STILL = run_of(np.random.default_rng(2).normal(size=60), np.linspace(20.0, 30.0, 60), 60.0)
MEAN = make_model("mean").fit(STILL)
TABLE = pd.DataFrame({"time": [0.0]})


@pytest.mark.parametrize(
    ("action", "told"),
    [
        (lambda: write_run(TABLE, "x.csv"), "runs are needed, found DataFrame"),  # type: ignore[arg-type]
        (lambda: MEAN.compensate([STILL]), "one run is needed, found list"),  # type: ignore[arg-type]
        (lambda: noise_report("run.csv"), "runs are needed, found str"),  # type: ignore[arg-type]
        (lambda: replay("nominal", "run.csv"), "runs are needed, found str"),  # type: ignore[arg-type]
        (lambda: replay(None, STILL), "the name or file of one, is needed, found NoneType"),  # type: ignore[arg-type]
        (lambda: diagnose("nominal", TABLE), "runs are needed, found DataFrame"),  # type: ignore[arg-type]
        (lambda: diagnose("nominnal", [STILL]), "no such twin; did you mean 'nominal'"),
        (lambda: save_model(Ridge(), "x"), r"FeatureModel\('T, dT', Ridge\(\)\)"),  # type: ignore[arg-type]
        (lambda: check_model(Ridge()), "a drift model is needed, found Ridge"),  # type: ignore[arg-type]
        (lambda: make_model("polynomial", ["T"]), "a text such as"),  # type: ignore[arg-type]
        (lambda: Run("x", STILL.columns, {"unit": "U"}), "x: facts are dict"),  # type: ignore[arg-type]
        (lambda: STILL.with_facts({"unit": "U"}), "facts are dict"),  # type: ignore[arg-type]
        (lambda: Run.from_pandas(STILL.to_pandas(), "x", {"unit": "U"}), "x: facts are dict"),  # type: ignore[arg-type]
    ],
)
def test_what_is_another_thing_than_asked_is_named(action: Callable[[], object], told: str) -> None:
    with pytest.raises(InputError, match=told):
        action()


def test_a_replay_takes_a_twin_by_its_name() -> None:
    np.testing.assert_array_equal(replay("nominal", STILL), replay(load_twin("nominal"), STILL))
