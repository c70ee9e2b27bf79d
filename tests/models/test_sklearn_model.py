"""Scikit-learn's regressors as drift models."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.models.names import make_model
from fogml.models.sklearn_model import SklearnModel
from fogml.models.table import training_table
from fogml.testing import check_model
from fogml.testing.models import synthetic_run


@pytest.fixture(scope="module")
def train():
    return synthetic_run("train", 2.0)


@pytest.mark.parametrize(
    "name",
    ["sklearn.linear_model.Ridge", "sklearn.svm.SVR", "sklearn.ensemble.HistGradientBoostingRegressor"],
)
def test_contract(name, train):
    options = {"max_iter": 10} if "Boosting" in name else None
    model = SklearnModel(name, options=options, max_rows=150)
    check_model(model, [train], synthetic_run("other", 1.0, seed=1)[:3000])


@pytest.mark.parametrize(
    "name",
    [
        "os.system",
        "sklearn.svm.Nothing",
        "sklearn.nowhere.SVR",
        "sklearn.preprocessing.StandardScaler",
        "sklearn.svm.SVC",
        "sklearn.metrics.r2_score",
        "sklearn.ensemble.VotingRegressor",
        "numpy.linalg.lstsq",
        "sklearn.base.RegressorMixin",
    ],
)
def test_only_scikit_learns_regressors(name):
    with pytest.raises(InputError, match=r"sklearn\.svm\.SVR"):
        make_model(name)


def test_settings_are_in_standard_deviations(train):
    """Drift and features are standardised: in other units the same model gives the same drift."""
    model = SklearnModel("sklearn.svm.SVR", "T, dT").fit(train)
    small = train.with_columns(gyro=train.reference_deg_h + 1e-3 * train.error_deg_h)
    np.testing.assert_allclose(
        1e3 * SklearnModel("sklearn.svm.SVR", "T, dT").fit(small).predict(train),
        model.predict(train),
        atol=1e-3,
    )


def test_rows_are_averaged_down(train):
    assert SklearnModel("sklearn.linear_model.Ridge", max_rows=200).fit(train).card_.rows <= 200


def test_options_and_seed_reach_the_regressor(train):
    model = SklearnModel(
        "sklearn.ensemble.RandomForestRegressor", options={"n_estimators": 3}, seed=7, max_rows=100
    )
    forest = model.fit(train).regressor_.regressor_[-1]
    assert len(forest.estimators_) == 3 and forest.random_state == 7
    with pytest.raises(InputError, match="no parameter 'trees'"):
        SklearnModel("sklearn.ensemble.RandomForestRegressor", options={"trees": 3}).fit(train)


def test_gaussian_process_is_tuned_once_and_useful(train):
    model = SklearnModel("sklearn.gaussian_process.GaussianProcessRegressor", "T, dT", max_rows=120).fit(
        train
    )
    process = model.regressor_.regressor_[-1]
    assert process.kernel_ != process.kernel
    left = train.error_deg_h - model.predict(train)
    assert left[127:].std() < 0.6 * train.error_deg_h[127:].std()
    half = training_table([train], model.features_, 120)
    again = model._refitted(half.take(np.arange(0, len(half), 2))).regressor_[-1]
    np.testing.assert_allclose(again.kernel_.theta, process.kernel_.theta, rtol=1e-12)
    assert len(again.X_train_) == (len(half) + 1) // 2


def test_warnings_of_convergence_go_to_the_card(train):
    model = SklearnModel(
        "sklearn.neural_network.MLPRegressor",
        options={"max_iter": 2, "hidden_layer_sizes": (4,)},
        max_rows=60,
    )
    model.fit(train)
    assert any("iteration" in note.lower() for note in model.card_.notes)


def test_whatever_an_estimator_raises_is_told(train):
    # Its own check takes any container for the sizes of layers; fitting then compares text with a number.
    options = {"hidden_layer_sizes": {"a": 1}, "max_iter": 2}
    model = SklearnModel("sklearn.neural_network.MLPRegressor", options=options, max_rows=60)
    with pytest.raises(InputError, match=r"MLPRegressor: can't be fitted to these runs: ufunc"):
        model.fit(train)


def test_what_only_applying_an_estimator_tells_is_told(train):
    model = SklearnModel("sklearn.neighbors.KNeighborsRegressor", options={"n_jobs": 0})
    with pytest.raises(InputError, match="can't be applied to these runs: n_jobs == 0"):
        model.fit(train)
