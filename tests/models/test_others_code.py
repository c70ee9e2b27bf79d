"""Regressors of others are held to their contract, with a message that names them."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sklearn.base import BaseEstimator
from sklearn.linear_model import Ridge
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from fogml.errors import InputError
from fogml.models.compact import affine, network_of
from fogml.models.feature_model import FeatureModel
from fogml.models.others_code import saved_by
from fogml.models.parameters import arrays_from_bytes, arrays_to_bytes
from fogml.models.regressors import fit_regressor, parameter_count, predict_rows
from fogml.models.saved import load_model, save_model
from fogml.models.table import TrainingTable
from fogml.testing.models import _check_compact, synthetic_run
from fogml.validation.judge import judge

X = np.random.default_rng(0).normal(size=(20, 2))
Y = X @ [1.0, 2.0] + 3.0


class Plain(BaseEstimator):  # type: ignore[misc]
    """Least squares."""

    def fit(self, X: Any, y: Any) -> Any:
        self.coef_ = np.linalg.lstsq(np.column_stack([X, np.ones(len(X))]), y, rcond=None)[0]
        self.n_features_in_ = X.shape[1]
        return self

    def predict(self, X: Any) -> Any:
        return X @ self.coef_[:-1] + self.coef_[-1]

    def to_saved(self) -> Any:
        return {}, {"coef": self.coef_}

    def compact(self) -> Any:
        return affine(self.coef_[:-1], self.coef_[-1])


def changed(**methods: Any) -> Any:
    return type("Odd", (Plain,), methods)()


def table() -> TrainingTable:
    zero = np.zeros(len(Y), dtype=np.intp)
    return TrainingTable(X.copy(), Y.copy(), zero, np.arange(float(len(Y))), zero)


def test_a_sound_one_fits_and_predicts() -> None:
    fitted = fit_regressor(Plain(), table())
    np.testing.assert_allclose(predict_rows(fitted, X), Y, atol=1e-12)
    network = network_of(fitted)
    assert network is not None
    np.testing.assert_allclose(network(X), Y, atol=1e-12)


def emptied(self: Any, X: Any, y: Any) -> Any:
    y -= y.mean()
    return self


@pytest.mark.parametrize(
    ("fit", "message"),
    [
        (emptied, "Odd: can't be fitted to these runs: .*read-only"),
        (lambda self, X, y: None, "Odd: its fit has to give itself, with a predict, not None"),
        (lambda self, X, y: {}["key"], r"Odd: can't be fitted to these runs: KeyError \('key'\)"),
    ],
)
def test_a_fit_that_raises_or_writes_to_its_rows_is_named(fit: Any, message: str) -> None:
    rows = table()
    with pytest.raises(InputError, match=message):
        fit_regressor(changed(fit=fit), rows)
    assert np.array_equal(rows.y, Y) and rows.y.flags.writeable


@pytest.mark.parametrize(
    ("predict", "message"),
    [
        (lambda self, X: np.zeros(len(X) - 1), r"each of 20 rows was expected, not shape \(19,\)"),
        (lambda self, X: np.zeros((len(X), 2)), r"not shape \(20, 2\)"),
        (lambda self, X: 3.0, r"not shape \(\)"),
        (lambda self, X: np.zeros(len(X), dtype=complex), "not complex numbers"),
        (lambda self, X: np.full(len(X), np.nan), "predicts nan"),
        (lambda self, X: X.sort(), "read-only"),
        (lambda self, X: X.nothing, r"can't be applied to these runs: AttributeError"),
    ],
)
def test_a_prediction_that_is_no_number_for_each_row_is_refused(predict: Any, message: str) -> None:
    fitted = fit_regressor(changed(predict=predict), table())
    with pytest.raises(InputError, match=f"Odd: .*{message}"):
        predict_rows(fitted, X)


@pytest.mark.parametrize(
    ("saved", "message"),
    [
        ({"coef": 1.0}, "does not give values and arrays"),
        (({"form": "rbf"}, {}), "a name that fogml keeps for itself"),
        (({"x": object()}, {}), "values that JSON does not hold"),
        (({"x": float("nan")}, {}), "nan"),
        (({}, {"coef": np.array([None])}), "array 'coef' of object, not of numbers"),
    ],
)
def test_what_can_not_be_stored_is_named(saved: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        saved_by(changed(to_saved=lambda self: saved))


@pytest.mark.parametrize(
    ("compact", "message"),
    [
        (lambda self: {}, "its compact gives {}"),
        (lambda self: affine([1.0], 0.0), "of 1 columns, and it was fitted to 2"),
        (lambda self: self.nothing, "its compact gives nothing: AttributeError"),
    ],
)
def test_a_compact_form_of_another_shape_is_refused(compact: Any, message: str) -> None:
    fitted = fit_regressor(changed(compact=compact), table())
    with pytest.raises(InputError, match=message):
        network_of(fitted)


def test_a_count_that_is_none_is_named() -> None:
    with pytest.raises(InputError, match="its parameter_count is no number"):
        parameter_count(changed(parameter_count="many"))


@pytest.mark.parametrize("off", [0.0, 0.01])
def test_a_compact_form_that_is_not_what_it_predicts_is_found(off: float) -> None:
    made = changed(compact=lambda self: affine(self.coef_[:-1], self.coef_[-1] + off))
    model = FeatureModel("T, dT", made).fit(synthetic_run("train", 2.0))
    held = pytest.raises(AssertionError, match=r"compact: up to 0.01 deg/h") if off else nullcontext()
    with held:
        _check_compact(model, synthetic_run("other", 3.0))


class Uncounted(BaseEstimator):  # type: ignore[misc]
    """Least squares that saves nothing and counts no columns, as one that is tried out."""

    def fit(self, X: Any, y: Any) -> Any:
        self.coef = np.linalg.lstsq(np.column_stack([X, np.ones(len(X))]), y, rcond=None)[0]
        return self

    def predict(self, X: Any) -> Any:
        return X @ self.coef[:-1] + self.coef[-1]


def test_one_that_is_only_tried_out_is_judged() -> None:
    train, other = synthetic_run("train", 2.0), synthetic_run("other", 3.0)
    model = FeatureModel("T, dT", Uncounted()).fit(train)
    plain = FeatureModel("T, dT", changed()).fit(train)
    judged, beside = (judge(one, train, other).test[0].after.rms for one in (model, plain))
    assert judged == pytest.approx(beside, rel=1e-9)
    assert (model.parameter_count(), model.weight_bytes()) == (3, 24)


def test_a_pipeline_of_scikit_learns_is_saved_and_read(tmp_path: Path) -> None:
    train = synthetic_run("train", 2.0)
    model = FeatureModel("T, dT", make_pipeline(StandardScaler(), Ridge())).fit(train)
    save_model(model, tmp_path / "model")
    np.testing.assert_array_equal(load_model(tmp_path / "model").predict(train), model.predict(train))


def test_a_number_comes_back_as_the_number_that_was_saved() -> None:
    arrays = {"one": np.float64(3.0), "columns": np.asfortranarray(np.arange(6.0).reshape(2, 3))}
    found = arrays_from_bytes(arrays_to_bytes(arrays))
    assert {name: array.shape for name, array in found.items()} == {"one": (), "columns": (2, 3)}
    assert all(np.array_equal(array, arrays[name]) for name, array in found.items())
