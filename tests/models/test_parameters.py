"""Parameters of every estimator are checked by the table on its class, before anything is read."""

from __future__ import annotations

import inspect

import numpy as np
import pytest
from pydantic import ValidationError
from sklearn.utils import all_estimators

from fogml.errors import InputError
from fogml.models.linear import LinearRegressor
from fogml.models.names import PARAMETRIC, make_model
from fogml.models.parameters import check_parameters
from fogml.models.rbf import PatentRBFRegressor, RBFRegressor
from fogml.models.sklearn_model import sklearn_regressor_class

OWN = (LinearRegressor, RBFRegressor, PatentRBFRegressor)
NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize("kind", OWN)
def test_every_parameter_has_its_line_in_the_table_and_its_default_is_allowed(kind):
    defaults = {name: p.default for name, p in inspect.signature(kind).parameters.items()}
    assert set(kind._parameter_constraints) == set(defaults)
    check_parameters(kind, defaults)


@pytest.mark.parametrize(
    ("model", "parameters", "told"),
    [
        (
            "polynomial",
            {"ridge": INF},
            r"parameter 'ridge' is inf; it must be 'auto' or a float in the range",
        ),
        ("polynomial", {"ridge": NAN}, "parameter 'ridge' is nan"),
        ("polynomial", {"ridge": -1}, "parameter 'ridge' is -1"),
        ("polynomial", {"ridge": [1, 2]}, r"parameter 'ridge' is \[1, 2\]"),
        ("polynomial", {"ridge": True}, "parameter 'ridge' is True"),
        ("polynomial", {"ridge": "foo"}, "parameter 'ridge' is 'foo'"),
        ("polynomial", {"ridge": None}, "parameter 'ridge' is None"),
        ("polynomial", {"ridge": {}}, "parameter 'ridge' is {}"),
        ("polynomial", {"ridgee": 1.0}, "no parameter 'ridgee'; did you mean 'ridge'"),
        ("polynomial", {"fit_intercept": "no"}, "parameter 'fit_intercept'"),
        ("polynomial", {"ridge": "x" * 500}, r"is 'x+\.\.\.x+'; it"),
        ("rbf", {"centres": NAN}, "parameter 'centres' is nan"),
        ("rbf", {"centres": INF}, "parameter 'centres' is inf"),
        ("rbf", {"centres": -1}, "parameter 'centres' is -1"),
        ("rbf", {"centres": 8.0}, "parameter 'centres' is 8.0"),
        ("rbf", {"centres": True}, "parameter 'centres' is True"),
        ("rbf", {"centres": []}, "parameter 'centres'"),
        ("rbf", {"centres": [8, -8]}, "parameter 'centres'"),
        ("rbf", {"centres": [8, 1.5]}, "parameter 'centres'"),
        ("rbf", {"device": "foo"}, "parameter 'device' is 'foo'; it must be 'cpu', 'cuda' or 'cuda:N'"),
        ("rbf", {"device": "cuda:x"}, "parameter 'device'"),
        ("rbf", {"dtype": "float16"}, "parameter 'dtype'"),
        ("rbf", {"objective": 1}, "parameter 'objective'"),
        ("rbf", {"centre_choice": "dbscan"}, "parameter 'centre_choice'"),
        ("rbf", {"tune": 1.5}, "parameter 'tune'"),
        ("rbf", {"average_rows": 9}, "parameter 'average_rows'"),
        ("rbf", {"average_rows": 1e9}, "parameter 'average_rows'"),
        ("rbf", {"width_prior": 0.0}, "parameter 'width_prior'"),
        ("rbf", {"network_inputs": [-1]}, "parameter 'network_inputs'"),
        ("rbf", {"seed": -1}, "parameter 'seed'"),
        ("rbf", {"threads": 0}, "parameter 'threads'"),
        ("rbf-patent", {"max_centres": 0}, "parameter 'max_centres'"),
        ("rbf-patent", {"width": -1.0}, "parameter 'width'"),
        ("rbf-patent", {"goal": NAN}, "parameter 'goal'"),
        (
            "sklearn.svm.SVR",
            {"C": -1},
            r"sklearn.svm.SVR: parameter 'C' is -1; it must be a float in the range",
        ),
        ("sklearn.svm.SVR", {"C": INF}, "parameter 'C' is inf"),
        ("sklearn.svm.SVR", {"C": True}, "parameter 'C' is True"),
        ("sklearn.svm.SVR", {"kernel": "foo"}, "parameter 'kernel' is 'foo'; it must be 'linear' or 'poly'"),
        ("sklearn.svm.SVR", {"kernal": "rbf"}, "did you mean 'kernel'"),
        ("sklearn.ensemble.RandomForestRegressor", {"n_estimators": 2.5}, "parameter 'n_estimators'"),
        ("sklearn.ensemble.RandomForestRegressor", {"random_state": -3}, "parameter 'random_state'"),
        ("sklearn.linear_model.Ridge", {"alpha": [1.0, NAN]}, "parameter 'alpha'"),
        ("sklearn.gaussian_process.GaussianProcessRegressor", {"kernel": "RBF"}, "parameter 'kernel'"),
        ("sklearn.neighbors.KNeighborsRegressor", {"n_neighbors": 0}, "parameter 'n_neighbors'"),
        ("mean", {"ridge": 1}, "takes no parameters"),
    ],
)
def test_what_is_not_allowed_is_told_when_the_model_is_made(model, parameters, told):
    with pytest.raises(InputError, match=told):
        make_model(model, parameters=parameters)


@pytest.mark.parametrize(
    ("model", "parameters"),
    [
        ("polynomial", {"ridge": 0}),
        ("polynomial", {"ridge": 1e-4, "fit_intercept": False}),
        ("polynomial", {"ridge": np.float64(0.5)}),
        ("rbf", {"centres": 16, "device": "cuda:0", "ridge": "evidence"}),
        ("rbf", {"centres": [4, 8], "tune": False, "network_inputs": []}),
        ("rbf", {"centres": "evidence", "threads": 2}),
        ("rbf-patent", {"max_centres": 3, "width": 1, "goal": 0}),
        ("sklearn.svm.SVR", {"C": 10, "kernel": "poly", "gamma": "auto", "shrinking": False}),
        ("sklearn.ensemble.RandomForestRegressor", {"max_features": "sqrt", "max_depth": None}),
    ],
)
def test_what_is_allowed_is_taken(model, parameters):
    make_model(model, parameters=parameters)


def test_defaults_of_scikit_learns_regressors_are_allowed():
    checked = 0
    for name, kind in all_estimators(type_filter="regressor"):
        dotted = f"{kind.__module__.split('._')[0]}.{name}"
        try:
            sklearn_regressor_class(dotted)
        except InputError:
            continue
        defaults = {key: p.default for key, p in inspect.signature(kind).parameters.items()}
        make_model(dotted, parameters=defaults)
        checked += 1
    assert checked > 40


def test_what_only_the_rows_tell_is_one_message():
    from fogml.testing.models import synthetic_run

    model = make_model("sklearn.linear_model.PoissonRegressor", features="T")
    with pytest.raises(
        InputError, match=r"PoissonRegressor: can't be fitted to these runs: .*out of the valid"
    ):
        model.fit(synthetic_run("train", 2.0))


@pytest.mark.parametrize("kind", [LinearRegressor, RBFRegressor, PatentRBFRegressor])
def test_a_fit_in_python_checks_them_too(kind):
    name = next(iter(inspect.signature(kind).parameters))
    with pytest.raises(InputError, match=f"{kind.__name__}: parameter '{name}' is -1"):
        kind(**{name: -1}).fit(np.eye(20), np.arange(20.0))


def test_every_parametric_name_is_known():
    for name in PARAMETRIC:
        with pytest.raises(InputError, match="no parameter 'x'"):
            make_model(name, parameters={"x": 1})


@pytest.mark.parametrize(
    "command",
    [
        ("train", "{}/no-run.csv", "--test", "{}/no-run.csv", "--model", "rbf", "--set", "centres=-1"),
        ("fleet", "{}/units.csv", "--model", "rbf", "--set", "centres=-1"),
        ("fleet", "{}/units.csv", "--model", "sklearn.svm.SVR", "--set", "kernel=foo"),
    ],
)
def test_commands_tell_before_they_read(command, tmp_path):
    from click.testing import CliRunner

    from fogml.cli.main import app

    (tmp_path / "no-run.csv").write_text("no run")
    (tmp_path / "units.csv").write_text("unit,train,test\nA,no-run.csv,no-run.csv\n")
    result = CliRunner().invoke(app, [word.format(tmp_path) for word in command])
    assert result.exit_code == 2 and "parameter '" in result.output and "no-run.csv" not in result.output


@pytest.mark.parametrize(
    ("models", "told"),
    [
        ({"rbf": {"centres": [8, -8]}}, "parameter 'centres' is -8"),
        ({"polynomial": {"ridge": {"low": -1.0, "high": 1.0}}}, "parameter 'ridge' is -1.0"),
        ({"sklearn.svm.SVR": {"kernel": ["rbf", "foo"], "C": 1.0}}, "parameter 'kernel' is 'foo'"),
        ({"rbf": {"device": ["cpu", "foo"]}}, "parameter 'device' is 'foo'"),
    ],
)
def test_every_value_of_a_search_space_is_checked(models, told):
    from fogml.tuning.plan import Space

    with pytest.raises(InputError, match=told):
        Space.model_validate({"features": "T", "models": models}).check()


@pytest.mark.parametrize(
    "models", [{"rbf": {"centres": []}}, {"polynomial": {"ridge": {"low": 0.0, "high": INF}}}]
)
def test_a_space_without_values_or_without_ends_is_told(models):
    from fogml.tuning.plan import Space

    with pytest.raises(ValidationError):
        Space.model_validate({"features": "T", "models": models})
