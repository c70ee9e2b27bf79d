"""Drift models and bare regressors in scikit-learn's own tools, without a scorer of one's own."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import sklearn
from sklearn.base import clone, is_regressor
from sklearn.model_selection import GridSearchCV, KFold, LeaveOneGroupOut, cross_validate
from sklearn.pipeline import Pipeline, make_pipeline
from threadpoolctl import threadpool_limits

from fogml.errors import InputError
from fogml.features.features import Features
from fogml.models.linear import LinearRegressor
from fogml.models.names import make_model
from fogml.runs.run import Run

TIME = np.arange(0.0, 7200.0, 4.0)


def run(seed: int, curved: float = 0.01) -> Run:
    noise = np.random.default_rng(seed).normal(0.0, 1.0, TIME.size)
    temperature = 30.0 - 25.0 * np.cos(2 * np.pi * TIME / 7200.0 + 0.3 * seed)
    drift = 2.0 + 0.1 * temperature + curved * temperature**2
    return Run.from_columns(f"{seed}.csv", time=TIME, gyro=drift + noise, T=temperature)


def test_the_score_is_the_share_of_the_variance_that_is_told() -> None:
    model, other = make_model("polynomial", "T^1..2").fit(run(0)), run(1)
    # 100 s averages of noise of 1 deg/h each 4 s have a variance of 1/25.
    spread = np.var(other.gyro) - 1.0
    assert is_regressor(model)
    assert model.score(other) == pytest.approx(1.0 - (1 / 25) / (spread + 1 / 25), abs=2e-3)
    assert make_model("mean").fit(run(0)).score(run(0)) == pytest.approx(0.0, abs=1e-3)
    assert model.score([other, run(2)]) < 1.0 and model.score(other, averaging_s=4.0) < model.score(other)
    with pytest.raises(InputError, match="no run fills one average of 100000 s"):
        model.score(other, averaging_s=1e5)


def test_a_grid_search_over_runs_finds_the_form() -> None:
    runs = [run(seed) for seed in range(4)]
    search = GridSearchCV(make_model("polynomial"), {"features": ["T", "T^1..2"]}, cv=KFold(2)).fit(runs)
    assert search.best_params_ == {"features": "T^1..2"}
    assert search.best_estimator_.score(run(9)) > 0.9


@pytest.mark.parametrize("name", ["mean", "polynomial", "mixed-effects"])
def test_a_model_at_the_end_of_a_pipeline_is_the_model_alone(name: str) -> None:
    pipeline = Pipeline([("model", make_model(name))]).fit([run(0), run(1)])
    alone = make_model(name).fit([run(0), run(1)])
    assert np.array_equal(pipeline.predict(run(2)), alone.predict(run(2)))
    assert pipeline.score([run(2)]) == alone.score(run(2))


@pytest.mark.parametrize("name", ["auto", "joint", "mean", "polynomial", "mixed-effects"])
def test_targets_beside_runs_are_refused(name: str) -> None:
    for call in (make_model(name).fit, make_model("mean").fit(run(0)).score):
        with pytest.raises(InputError, match="the runs' own; give runs alone"):
            call([run(0)], [1.0])


def test_features_give_the_frames_that_are_asked_for() -> None:
    one = run(0)
    plain = Features("T, dT").transform(one)
    pipeline = make_pipeline(Features("T, dT"), "passthrough").set_output(transform="pandas")
    assert isinstance(plain, np.ndarray)
    for frame in (pipeline.fit_transform(one), clone(pipeline).fit_transform(one)):
        pd.testing.assert_frame_equal(frame, pd.DataFrame(plain, columns=["T", "dT"]))
    assert Features("T, dT").set_output(transform="default").fit_transform(one).tolist() == plain.tolist()
    with sklearn.config_context(transform_output="pandas"):
        assert list(Features("T").fit_transform(one)) == ["T"]
    with pytest.raises(InputError, match="known are default, pandas, polars"):
        Features("T").set_output(transform="xarray")


def test_features_of_what_is_no_run_are_refused() -> None:
    for given in ([run(0), run(1)], one_frame := run(0).to_pandas(), one_frame.to_numpy()):
        with pytest.raises(InputError, match="needed, found"):
            Features("T").transform(given)
    with pytest.raises(InputError, match="runs are needed, found ndarray"):
        Features("T").fit(one_frame.to_numpy())


@pytest.mark.parametrize("name", ["auto", "mixed-effects", "polynomial"])
def test_threads_do_not_change_a_bit(name: str) -> None:
    told = []
    for threads in (1, 2):
        with threadpool_limits(threads, user_api="blas"):
            told.append(make_model(name).fit([run(0), run(1)]).predict(run(2)))
    assert np.array_equal(*told)


@pytest.mark.parametrize("most", [0, 1.5, -3])
def test_a_number_of_rows_is_whole(most: float) -> None:
    with pytest.raises(InputError, match=f"max_rows is {most}; a whole number"):
        make_model("polynomial", "T").set_params(max_rows=most).fit(run(0))


def test_runs_of_a_group_stay_together() -> None:
    # The second unit curves the other way: each judges the other badly.
    runs = [run(0), run(1), run(2, -0.01), run(3, -0.01)]
    model = make_model("polynomial", "T^1..2")
    told = cross_validate(model, runs, cv=LeaveOneGroupOut(), groups=[0, 0, 1, 1])["test_score"]
    assert told.shape == (2,) and np.all(told < 0.0)


def test_a_regressor_takes_frames_and_routed_folds() -> None:
    rows = np.arange(60.0)
    frame = pd.DataFrame({"T": np.sin(rows), "dT": np.cos(rows)})
    values = pd.Series(3.0 * frame["T"] - frame["dT"])
    fitted = LinearRegressor().fit(frame, values)
    assert list(fitted.feature_names_in_) == ["T", "dT"]
    assert fitted.score(frame, values) == pytest.approx(1.0)
    with sklearn.config_context(enable_metadata_routing=True):
        asked = LinearRegressor("auto").set_fit_request(folds=True)
        folds = {"folds": np.arange(60) // 12}
        assert cross_validate(asked, frame, values, params=folds)["test_score"] == pytest.approx(1.0)
