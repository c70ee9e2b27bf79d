"""Linear least squares against closed forms, exact arithmetic and scikit-learn."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.preprocessing import StandardScaler

from fogml.errors import InputError
from fogml.models import tall_least_squares
from fogml.models.folds import dealt_folds
from fogml.models.linear import RIDGE_GRID, LinearRegressor
from fogml.models.tall_least_squares import Part
from tests.models.contract import with_scikit_learns_checks


@with_scikit_learns_checks(
    [LinearRegressor(), LinearRegressor(ridge=0.1), LinearRegressor(fit_intercept=False)]
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@with_scikit_learns_checks([LinearRegressor(ridge="auto")])
def test_scikit_learn_contract_with_automatic_ridge(estimator, check):
    check(estimator)


def powers(temperature, highest):
    return temperature[:, None] ** np.arange(1, highest + 1)


def drift(n, seed=0):
    rng = np.random.default_rng(seed)
    temperature = np.linspace(-40.0, 70.0, n) + rng.normal(scale=0.1, size=n)
    return temperature, 0.3 + 0.01 * temperature + rng.normal(scale=0.05, size=n)


def exact_least_squares(columns, y):
    """Least squares with an intercept in rational numbers."""
    rows = [[Fraction(1), *map(Fraction, row)] for row in columns.tolist()]
    k = len(rows[0])
    system = [
        [sum(row[i] * row[j] for row in rows) for j in range(k)]
        + [sum(row[i] * Fraction(value) for row, value in zip(rows, y.tolist()))]
        for i in range(k)
    ]
    for i in range(k):
        system[i] = [value / system[i][i] for value in system[i]]
        for other in range(k):
            if other != i:
                factor = system[other][i]
                system[other] = [a - factor * b for a, b in zip(system[other], system[i])]
    return np.array([float(row[-1]) for row in system])


def test_seventh_power_agrees_with_rational_arithmetic():
    temperature, y = drift(60)
    columns = powers(temperature, 7)
    exact = exact_least_squares(columns, y)
    model = LinearRegressor().fit(columns, y)
    assert model.rank_ == 7
    np.testing.assert_allclose(model.predict(columns), columns @ exact[1:] + exact[0], atol=1e-10)
    np.testing.assert_allclose(model.coef_, exact[1:], rtol=1e-7)


def test_tall_ways_agree_and_do_not_depend_on_threads(monkeypatch):
    temperature, y = drift(60_000)
    columns = powers(temperature, 5)
    quick = LinearRegressor().fit(columns, y)
    monkeypatch.setattr(tall_least_squares, "available_cores", lambda: 1)
    alone = LinearRegressor().fit(columns, y)
    assert np.array_equal(quick.coef_, alone.coef_) and quick.intercept_ == alone.intercept_
    monkeypatch.setattr(tall_least_squares, "_TALL_ROWS", 10**9)
    safe = LinearRegressor().fit(columns, y)
    np.testing.assert_allclose(quick.predict(columns), safe.predict(columns), atol=1e-11)
    np.testing.assert_allclose(quick.covariance_, safe.covariance_, rtol=1e-6)
    assert quick.residual_std_ == pytest.approx(safe.residual_std_, rel=1e-12)


def test_each_fold_of_tall_rows_is_condensed_by_itself():
    temperature, y = drift(60_000)
    columns = powers(temperature, 3)
    folds = np.arange(len(y)) * 4 // len(y)
    held = tall_least_squares.condense([Part(y, columns.__getitem__, folds)], 4)
    rows = np.column_stack((np.ones(len(y)), (columns - held.shift) / held.scale, y - held.y_shift))
    assert held.counts.tolist() == np.bincount(folds).tolist()
    for fold in range(4):
        of_fold = rows[folds == fold]
        factor = held.factors[fold]
        np.testing.assert_allclose(factor.T @ factor, of_fold.T @ of_fold, rtol=1e-9, atol=1e-9 * len(y))


def test_columns_seen_by_few_rows_are_not_lost():
    """A column that is zero in the sample of rows, and almost everywhere, still gets its coefficient."""
    n = 80_000
    temperature, y = drift(n)
    rare = np.zeros(n)
    rare[12_345:12_352] = 1.0
    model = LinearRegressor().fit(np.column_stack((temperature, rare)), y + 5.0 * rare)
    assert model.coef_[1] == pytest.approx(5.0, abs=0.1)
    assert model.rank_ == 2


def test_close_fit_keeps_its_small_residual():
    """With y almost in the columns' span nothing cancels: the residual is the noise put in."""
    rng = np.random.default_rng(3)
    temperature = np.linspace(-40.0, 70.0, 60_000)
    noise = rng.normal(scale=1e-9, size=len(temperature))
    model = LinearRegressor().fit(powers(temperature, 3), 1e3 + 2.0 * temperature + noise)
    assert model.residual_std_ == pytest.approx(1e-9, rel=0.05)


def test_repeated_column_shares_the_coefficient():
    temperature, y = drift(500)
    single = LinearRegressor().fit(temperature[:, None], y)
    double = LinearRegressor().fit(np.column_stack((temperature, 2.0 * temperature)), y)
    assert double.rank_ == 1
    np.testing.assert_allclose(double.coef_, [single.coef_[0] / 2, single.coef_[0] / 4], rtol=1e-9)
    constant = LinearRegressor().fit(np.column_stack((temperature, np.full(500, 20.3))), y)
    assert constant.rank_ == 1 and constant.coef_[1] == 0.0


def test_covariance_is_the_textbook_one():
    temperature, y = drift(300)
    columns = powers(temperature, 2)
    model = LinearRegressor().fit(columns, y)
    design = np.column_stack((np.ones(300), columns))
    residual = y - model.predict(columns)
    expected = residual @ residual / (300 - 3) * np.linalg.inv(design.T @ design)
    np.testing.assert_allclose(model.covariance_, expected, rtol=1e-6)


def test_standard_errors_match_the_scatter_of_repeated_fits():
    rng = np.random.default_rng(0)
    temperature = np.linspace(-40.0, 70.0, 200)
    columns = powers(temperature, 2)
    fits = [LinearRegressor().fit(columns, rng.normal(scale=0.05, size=200)) for _ in range(400)]
    scatter = np.std([[fit.intercept_, *fit.coef_] for fit in fits], axis=0)
    told = np.mean([fit.standard_errors() for fit in fits], axis=0)
    np.testing.assert_allclose(told, scatter, rtol=0.12)


@pytest.mark.parametrize("ridge", [1e-4, 0.3])
def test_ridge_is_scikit_learns_on_standardised_columns(ridge):
    temperature, y = drift(400)
    columns = powers(temperature, 5)
    scaled = StandardScaler().fit_transform(columns)
    expected = Ridge(alpha=ridge * len(y), solver="svd").fit(scaled, y).predict(scaled)
    np.testing.assert_allclose(
        LinearRegressor(ridge=ridge).fit(columns, y).predict(columns), expected, atol=1e-9
    )


def test_automatic_ridge_is_the_best_of_plain_refits():
    temperature, y = drift(400, seed=2)
    columns = powers(temperature, 5)
    folds = dealt_folds(400)
    model = LinearRegressor(ridge="auto").fit(columns, y)
    errors = {}
    for ridge in RIDGE_GRID:
        left = 0.0
        for fold in range(5):
            held = folds == fold
            refit = LinearRegressor(ridge=ridge).fit(columns[~held], y[~held])
            left += np.sum((y[held] - refit.predict(columns[held])) ** 2)
        errors[ridge] = left / len(y)
    assert model.ridge_ == min(errors, key=errors.get)
    np.testing.assert_allclose(list(model.cross_validation_.values()), list(errors.values()), rtol=1e-6)


def test_folds_in_any_order_are_the_same_folds():
    temperature, y = drift(600)
    columns = powers(temperature, 4)
    labels = np.random.default_rng(0).integers(0, 3, size=600)
    order = np.argsort(labels, kind="stable")
    mixed = LinearRegressor(ridge="auto").fit(columns, y, folds=labels)
    sorted_ = LinearRegressor(ridge="auto").fit(columns[order], y[order], folds=labels[order])
    assert mixed.ridge_ == sorted_.ridge_
    np.testing.assert_allclose(mixed.coef_, sorted_.coef_, rtol=1e-6)


def test_without_intercept_the_line_goes_through_zero():
    temperature, y = drift(500)
    columns = powers(temperature, 2)
    model = LinearRegressor(fit_intercept=False).fit(columns, y)
    expected = np.linalg.lstsq(columns, y, rcond=None)[0]
    np.testing.assert_allclose(model.coef_, expected, rtol=1e-8)
    assert model.intercept_ == 0.0 and model.parameter_count == 2


def test_rows_built_piece_by_piece_are_the_same_rows():
    temperature, y = drift(5_000)
    pieces = []

    def columns(rows):
        pieces.append(rows)
        return powers(temperature[rows], 3)

    parts = [
        Part(y[:2_000], lambda rows: columns(slice(*rows.indices(2_000))), dealt_folds(2_000)),
        Part(y[2_000:], lambda rows: powers(temperature[2_000:][rows], 3), dealt_folds(3_000)),
    ]
    found = LinearRegressor().fit_parts(parts)
    whole = LinearRegressor().fit(powers(temperature, 3), y)
    np.testing.assert_allclose(found.coef_, whole.coef_, rtol=1e-9)
    assert max(len(range(*rows.indices(2_000))) for rows in pieces) <= tall_least_squares.PIECE_ROWS


def test_more_columns_than_rows():
    rng = np.random.default_rng(0)
    columns, y = rng.normal(size=(5, 9)), rng.normal(size=5)
    model = LinearRegressor().fit(columns, y)
    np.testing.assert_allclose(model.predict(columns), y, atol=1e-10)


@pytest.mark.parametrize("ridge", [-1.0, "some", float("nan")])
def test_bad_ridge_is_told(ridge):
    with pytest.raises(InputError, match="ridge"):
        LinearRegressor(ridge=ridge).fit(np.arange(10.0)[:, None], np.arange(10.0))


def test_folds_of_another_length_are_told():
    with pytest.raises(InputError, match="10 rows"):
        LinearRegressor(ridge="auto").fit(np.arange(10.0)[:, None], np.arange(10.0), folds=[0, 1])
