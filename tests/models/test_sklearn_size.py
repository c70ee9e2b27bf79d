"""Numbers and bytes that scikit-learn's regressors predict from, against scikit-learn's own counts."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.compose import TransformedTargetRegressor
from sklearn.ensemble import HistGradientBoostingRegressor, RandomForestRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import LinearRegression
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVR

from fogml.models.regressors import parameter_count, weight_bytes
from fogml.models.sklearn_compact import network_of_sklearn

X = np.random.default_rng(0).normal(size=(60, 3))
Y = X @ [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("regressor", "numbers"),
    [
        (LinearRegression(), lambda r: 3 + 1),
        (KernelRidge(), lambda r: 60 * 3 + 60),
        (SVR(gamma=0.5, epsilon=0.5), lambda r: 4 * len(r.support_) + 1),
        (MLPRegressor(hidden_layer_sizes=(5,), solver="lbfgs"), lambda r: 3 * 5 + 5 + 5 + 1),
        (RandomForestRegressor(2), lambda r: 2 * sum(tree.tree_.node_count for tree in r.estimators_)),
    ],
    ids=lambda each: type(each).__name__,
)
def test_numbers_are_those_of_the_formula(regressor, numbers) -> None:
    assert parameter_count(regressor.fit(X, Y)) - numbers(regressor) in (0, 1)  # the kernel's width


def test_what_a_fit_went_through_does_not_count() -> None:
    process = GaussianProcessRegressor().fit(X, Y)
    assert process.L_.nbytes == 8 * 60 * 60  # for standard errors alone
    assert 8 * (60 * 3 + 60) <= weight_bytes(process) < 8 * (60 * 3 + 60) + 100


def test_boosting_is_as_large_as_its_trees() -> None:
    small, large = (HistGradientBoostingRegressor(max_iter=n, max_depth=2).fit(X, Y) for n in (1, 50))
    nodes = sum(len(trees[0].nodes) for trees in large._predictors)
    assert nodes <= parameter_count(large) < nodes + 20
    size = large._predictors[0][0].nodes.itemsize
    assert weight_bytes(large) - weight_bytes(small) == size * (nodes - len(small._predictors[0][0].nodes))


def test_a_pipeline_is_as_large_as_what_it_is_made_of() -> None:
    inside = make_pipeline(StandardScaler(), LinearRegression())
    wrapped = TransformedTargetRegressor(inside, transformer=StandardScaler()).fit(X, Y)
    assert parameter_count(wrapped) == parameter_count(LinearRegression().fit(X, Y)) == 3 + 1
    assert weight_bytes(wrapped) == 8 * (3 + 1)


@pytest.mark.parametrize(
    "kernel",
    [
        RBF(1.3),
        DotProduct(1.5),
        RBF([0.7, 1.0, 3.0]) + DotProduct(1.5) + ConstantKernel(0.3) + WhiteKernel(0.1),
    ],
    ids=str,
)
def test_a_process_is_the_network_that_it_is_exported_as(kernel) -> None:
    process = GaussianProcessRegressor(kernel, optimizer=None, alpha=1e-3, normalize_y=True)
    scaled = TransformedTargetRegressor(
        make_pipeline(StandardScaler(), process), transformer=StandardScaler()
    )
    scaled.fit(X, np.exp(0.3 * Y))
    np.testing.assert_allclose(network_of_sklearn(scaled)(X), scaled.predict(X), atol=1e-9)
