"""Several models on one split, leave one run out, and the search for the design index."""

from __future__ import annotations

import re
import tracemalloc
from functools import partial

import numpy as np
import pytest
from scipy.stats import chi2

from fogml.errors import InputError
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.signals.floor import Floor
from fogml.validation.compare import compare
from fogml.validation.floors import floor_interval, out_of_reach
from fogml.validation.index_search import Candidate, candidates, train_until_index
from fogml.validation.judge import judge
from tests.validation.known_drift import KnownDrift

pytestmark = pytest.mark.usefixtures("without_noise_terms")


def cubic_run(name: str, seed: int, noise: float = 0.1, bias: float = 0.0) -> Run:
    """Up and down over 60 degC in 6000 s, drift cubic in T."""
    time = np.arange(0.0, 6000.0, 2.0)
    temperature = 30.0 * np.sin(2 * np.pi * time / 6000.0)
    drift = bias + 0.02 * temperature + 2e-5 * temperature**3
    error = drift + noise * np.random.default_rng(seed).normal(size=len(time))
    return Run.from_columns(name, time=time, gyro=error, T=temperature)


@pytest.fixture(scope="module")
def runs():
    return [cubic_run(f"{name}.csv", seed) for seed, name in enumerate("abc")]


def makers(*names):
    return {name: partial(make_model, name) for name in names}


def test_each_model_is_judged_as_if_alone(runs):
    result = compare(makers("mean", "M1"), runs[:1], runs[1:2])
    alone = judge(make_model("M1").fit(runs[:1]), runs[:1], runs[1:2])
    assert result.judgements["M1"].test[0].after == alone.test[0].after
    assert list(result.judgements) == ["mean", "M1"]


def test_all_are_judged_on_the_same_rows(runs):
    def late():
        return KnownDrift(full_from_s=1000.0)

    result = compare({"mean": makers("mean")["mean"], "late": late}, runs[:1], runs[1:2])
    used = {name: judgement.test[0].rows_used for name, judgement in result.judgements.items()}
    assert used == {"mean": 2500, "late": 2500}
    mean, late_model = (make().fit(runs[:1]) for make in (makers("mean")["mean"], late))
    alone = judge(mean, runs[:1], runs[1:2])
    beside = judge(mean, runs[:1], runs[1:2], beside=[late_model])
    assert alone.test[0].rows_used == 3000
    assert beside.test[0].after == result.judgements["mean"].test[0].after != alone.test[0].after


def test_errors_of_all_models_are_not_held_at_once():
    rows, peaks = 20_000, []
    time = np.arange(float(rows))
    gyro = np.random.default_rng(1).normal(size=rows)
    pair = [
        Run.from_columns(f"{name}.csv", time=time, gyro=gyro + number) for number, name in enumerate("ab")
    ]
    for count in (2, 2, 8):
        tracemalloc.start()
        try:
            compare({f"mean {i}": makers("mean")["mean"] for i in range(count)}, pair[:1], pair[1:])
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    # The first time tells what is imported and cached; six more drifts of two runs do not fit.
    assert peaks[2] - peaks[1] < 6 * 2 * 8 * rows / 2


def test_leaving_one_out_of_several_models_is_each_alone(runs):
    together = compare(makers("mean", "M1"), runs, None, limits={"rms": 5.0})
    for name, judgement in together.judgements.items():
        alone = compare(makers(name), runs, None, limits={"rms": 5.0}).judgements[name]
        assert [run.after for run in judgement.test] == [run.after for run in alone.test]
        assert judgement.limits == alone.limits
        assert judgement.notes == alone.notes


def test_one_that_cannot_be_fitted_does_not_stop_the_rest(runs):
    steps = []
    result = compare(makers("joint", "M3", "mean"), runs[:1], runs[1:2], step=steps.append)
    assert list(result.judgements) == ["mean"]
    assert list(result.failed) == ["joint", "M3"]
    assert "T_in" in result.failed["M3"]
    assert steps == ["joint", "M3", "mean"]


def test_a_regressor_s_own_error_is_a_reason(runs):
    class Refusing(KnownDrift):
        def fit(self, runs):
            raise ValueError("n_neighbors is too large")

    result = compare({"bad": Refusing, "mean": makers("mean")["mean"]}, runs[:1], runs[1:2])
    assert result.failed["bad"] == "ValueError: n_neighbors is too large"


def test_a_defect_is_not_a_reason(runs):
    class Broken(KnownDrift):
        def fit(self, runs):
            raise AssertionError

    with pytest.raises(AssertionError):
        compare({"bad": Broken}, runs[:1], runs[1:2])


def test_nothing_fitted_is_an_error(runs):
    with pytest.raises(InputError, match="joint"):
        compare(makers("joint"), runs[:1], runs[1:2])


def test_leave_one_out_never_trains_on_the_run_it_judges(runs):
    seen = []

    class Recording(KnownDrift):
        def fit(self, runs):
            seen.append([run.name for run in runs])
            return super().fit(runs)

    result = compare({"one": Recording}, runs, None).judgements["one"]
    assert seen[:3] == [["b.csv", "c.csv"], ["a.csv", "c.csv"], ["a.csv", "b.csv"]]
    assert seen[3] == ["a.csv", "b.csv", "c.csv"]
    assert [run.run for run in result.test] == ["a.csv", "b.csv", "c.csv"]
    assert not any(finding.code == "seen_in_training" for run in result.test for finding in run.findings)


def test_leave_one_out_judges_by_hand(runs):
    found = compare(makers("M1"), runs, None, design_index=1.0, limits={"range": 1e-9})
    result = found.judgements["M1"]
    by_hand = judge(make_model("M1").fit(runs[:2]), runs[:2], runs[2])
    assert result.test[2].after == by_hand.test[0].after
    assert result.design_index is not None
    assert result.design_index.value == max(run.after.rms for run in result.test)
    assert not result.limits[0].met


def test_leave_one_out_needs_two(runs):
    with pytest.raises(InputError, match="at least two"):
        compare(makers("M1"), runs[:1], None)


def test_candidates_go_from_small_to_large():
    names = candidates("auto", None)
    assert [candidate.model for candidate in names] == sorted(
        (candidate.model for candidate in names), key=["polynomial", "rbf"].index
    )
    sizes = [candidate.centres for candidate in candidates("rbf", "T")]
    assert sizes == sorted(sizes)
    assert candidates("M2", None) == [Candidate("M2", None)]


@pytest.mark.parametrize("count", [1, 2])
def test_the_search_stops_at_the_first_that_meets_the_index(runs, count):
    # Noise of 0.1 in 50 samples: 0.014. T alone misses the cubic by far; T^1..3 holds it.
    found = train_until_index(runs[:count], 0.03, model="polynomial")
    assert [trial.candidate.features for trial in found.trials] == ["T", "T^1..3"]
    assert found.met
    assert found.chosen is found.trials[-1]
    assert "2 tries" in found.summary()
    after = judge(found.model, runs[:count], runs[2]).test[0].after
    assert after.rms < 0.03


def test_an_index_out_of_reach_takes_the_nearest(runs):
    found = train_until_index(runs[:2], 0.0139, model="polynomial", features="T")
    assert not found.met
    assert len(found.trials) == len(candidates("polynomial", "T"))
    assert found.chosen.rms == min(trial.rms for trial in found.trials)
    assert "none meets" in found.summary()


def test_an_index_is_out_of_reach_only_below_the_least_noise_that_the_floor_allows():
    floor, count = Floor(3.0e-3, 1.6e-3, 5.0e-3), 24
    least = 1.6e-3 * np.sqrt(chi2.ppf(0.05, count) / count)
    most = 5.0e-3 * np.sqrt(chi2.ppf(0.95, count) / count)
    assert out_of_reach(1.001 * least, [floor], [count], 600.0, "a.csv") is None
    told = out_of_reach(0.999 * least, [floor], [count], 600.0, "a.csv")
    assert f"leaves 0.00300 deg/h rms ({least:.3g} to {most:.3g}, 90 %)" in told


def test_an_index_below_the_floor_is_said_at_once(runs):
    """White noise of 0.1 in averages of 50 samples: 0.0141, and 120 averages tell it to a tenth."""
    found = train_until_index(runs[:2], 0.01, model="polynomial")
    assert not found.met and found.trials == ()
    assert "No model can reach the design index of 0.01" in found.summary()
    said = re.search(r"leaves (\S+) deg/h rms \((\S+) to (\S+), 90 %\)", found.summary())
    floor, low, high = (float(value) for value in said.groups())
    assert floor == pytest.approx(0.1 / np.sqrt(50), rel=0.05) and low < 0.1 / np.sqrt(50) < high
    judged = judge(found.model, runs[:2], runs[2], design_index=0.01)
    assert any("No model can reach" in note for note in judged.notes)
    assert not any(
        "No model" in note for note in judge(found.model, runs[:2], runs[2], design_index=0.02).notes
    )
    # The rms of averages of noise lies in the interval as often as it says.
    white = np.random.default_rng(1).normal(size=(2000, 40))
    low, high = floor_interval(1.0, 40)
    inside = (np.sqrt((white**2).mean(axis=1)) > low) & (np.sqrt((white**2).mean(axis=1)) < high)
    assert inside.mean() == pytest.approx(0.9, abs=0.025)


def test_each_part_of_a_single_run_is_held_out_once(runs, monkeypatch):
    fitted_times = []

    class Recording(KnownDrift):
        def fit(self, runs):
            fitted_times.append(np.concatenate([run.time for run in runs]))
            return super().fit(runs)

    monkeypatch.setattr(Candidate, "make", lambda self, seed: Recording())
    train_until_index(runs[0], 0.0141, model="any")
    *folds, whole = fitted_times
    assert len(folds) == 5
    times, counts = np.unique(np.concatenate(folds), return_counts=True)
    np.testing.assert_array_equal(times, runs[0].time)
    assert set(counts) == {4}
    np.testing.assert_array_equal(whole, runs[0].time)


def test_the_search_where_nothing_can_be_fitted(runs):
    with pytest.raises(InputError, match="T_in"):
        train_until_index(runs[:2], 0.03, model="M3")


def test_turns_of_the_table_are_no_noise_that_puts_an_index_out_of_reach():
    """White noise of 1 deg/h a second leaves 0.1 in 100 s; one that lags its table is off by 1e4 in turns."""
    time = np.arange(0.0, 20000.0)
    rate = 10.0 * np.where(time // 500 % 2 == 1, np.where(time // 1000 % 2 == 0, 1.0, -1.0), 0.0)
    seen = np.convolve(rate, np.exp(-np.arange(10.0) / 1.5) / np.exp(-np.arange(10.0) / 1.5).sum())[
        : len(time)
    ]
    temperature = 30.0 * np.sin(2 * np.pi * time / 6000.0)
    noise = np.random.default_rng(0).normal(size=len(time))
    run = Run.from_columns(
        "t.csv", time=time, gyro=3600.0 * seen + 0.02 * temperature + noise, T=temperature, rate=rate
    )
    found = train_until_index(run, 0.2, model="polynomial", features="T")
    assert found.out_of_reach is None
    assert found.chosen is not None and found.met


def test_an_index_below_the_noise_is_told_of_runs_left_out_too(runs):
    (judgement,) = compare(makers("M1"), runs, None, design_index=1e-3).judgements.values()
    assert sum("No model can reach the design index" in note for note in judgement.notes) == len(runs)


def test_stated_parameters_are_those_of_every_candidate(runs):
    found = train_until_index(runs[:2], 0.03, model="polynomial", features="T", parameters={"ridge": 0.5})
    assert found.model.regressor_.ridge_ == 0.5
    tried = candidates("rbf", "T", {"centres": 12, "tune": False})
    assert [one.make(0).regressor.get_params()["centres"] for one in tried] == [12]
    with pytest.raises(InputError, match="'auto' takes no parameters"):
        train_until_index(runs[:2], 0.03, parameters={"ridge": 0.5})
