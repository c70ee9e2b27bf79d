"""The networks as scikit-learn regressors: its contract, options, saving, refitting, repeating."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from fogml.errors import InputError
from fogml.models.rbf import PatentRBFRegressor, RBFRegressor, search
from tests.models.contract import with_scikit_learns_checks

NOISE = 0.05


@with_scikit_learns_checks(
    [RBFRegressor(), RBFRegressor(centres=4, objective="validation"), PatentRBFRegressor()]
)
def test_contract_of_scikit_learn(estimator: Any, check: Any) -> None:
    check(estimator)


def rows(seed: int, count: int = 6000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inputs moving slowly in time, noisy values, and the truth."""
    time = np.arange(count) / count
    inputs = np.column_stack([np.sin(14.0 * time), np.cos(23.0 * time + 1.0)])
    truth = np.tanh(3.0 * inputs[:, 0]) + 0.3 * np.sin(4.0 * inputs[:, 0]) + 0.5 * inputs[:, 1]
    return inputs, truth + NOISE * np.random.default_rng(seed).normal(size=count), truth


OPTIONS: list[dict[str, Any]] = [
    {},
    {"centres": 12},
    {"centres": (8, 24)},
    {"centre_choice": "ols", "centres": 16},
    {"objective": "validation", "centres": 16},
    {"tune": False, "centres": 32},
    {"ridge": 1e-3, "centres": 16},
    {"dtype": "float32", "centres": 16},
    {"threads": 2, "centres": 8, "tune": False},
    {"average_rows": 600, "centres": 16},
]


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_every_option_finds_the_truth(options: dict[str, Any]) -> None:
    inputs, target, truth = rows(0)
    regressor = RBFRegressor(**options).fit(inputs, target)
    error = np.sqrt(np.mean((regressor.predict(inputs) - truth) ** 2))
    assert error < 0.3 * NOISE
    assert regressor.noise_std_ == pytest.approx(NOISE, rel=0.1)
    count = len(regressor.network_.weights)
    assert regressor.parameter_count == count * (2 + 2 + 1) + 2 + 1
    if isinstance(options.get("centres"), int):
        assert count <= options["centres"]


@pytest.mark.parametrize("kind", [RBFRegressor, PatentRBFRegressor])
def test_the_same_rows_and_seed_give_the_same_bits(kind: Any) -> None:
    inputs, target, _ = rows(1)
    first, second = (kind(seed=3).fit(inputs, target).predict(inputs) for _ in range(2))
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("kind", [RBFRegressor(centres=16), PatentRBFRegressor()])
def test_saved_is_what_predicts(kind: Any) -> None:
    inputs, target, _ = rows(2)
    fitted = kind.fit(inputs, target)
    values, arrays = fitted.to_saved()
    again = type(kind).from_saved(json.loads(json.dumps(values)), arrays)
    np.testing.assert_array_equal(again.predict(inputs), fitted.predict(inputs))
    assert again.get_params() == fitted.get_params()
    assert again.parameter_count == fitted.parameter_count and again.weight_bytes == fitted.weight_bytes
    assert again.describe() == fitted.describe()
    with pytest.raises(InputError, match="standard deviation"):
        again.predict(inputs, return_std=True)
    np.testing.assert_array_equal(
        again.refitted(inputs, target).predict(inputs), fitted.refitted(inputs, target).predict(inputs)
    )


def test_a_typical_network_takes_a_few_hundred_bytes_within_its_stated_error() -> None:
    inputs, target, _ = rows(3)
    fitted = RBFRegressor(centres=16).fit(inputs, target)
    assert fitted.weights_dtype_ == "float32"
    assert fitted.weight_bytes == 4 * fitted.parameter_count < 400
    exact = fitted.solution_.network(inputs)
    assert np.max(np.abs(fitted.predict(inputs) - exact)) <= 1.5 * fitted.rounding_error_ + 1e-12
    assert fitted.rounding_error_ <= 1e-3 * NOISE


def test_rows_without_noise_are_saved_in_double_precision() -> None:
    inputs, _, truth = rows(4)
    fitted = RBFRegressor(centres=16).fit(inputs, truth)
    assert fitted.weights_dtype_ == "float64"
    assert np.max(np.abs(fitted.predict(inputs) - truth)) < 1e-3


def test_cut_arrays_are_refused() -> None:
    inputs, target, _ = rows(5, 500)
    values, arrays = RBFRegressor(centres=4).fit(inputs, target).to_saved()
    with pytest.raises(InputError, match=r"'centres' .* was expected"):
        RBFRegressor.from_saved(values, {**arrays, "centres": arrays["centres"][:-1]})
    with pytest.raises(InputError, match=r"'linear' .* was expected"):
        RBFRegressor.from_saved(values, {**arrays, "linear": arrays["linear"][1:]})


def test_refit_keeps_the_shape_and_solves_the_weights() -> None:
    inputs, target, truth = rows(6)
    fitted = RBFRegressor(centres=16).fit(inputs, target)
    other = fitted.refitted(inputs[::2], 2.0 * truth[::2])
    np.testing.assert_array_equal(other.network_.centres, fitted.network_.centres)
    assert np.sqrt(np.mean((other.predict(inputs) - 2.0 * truth) ** 2)) < 0.02
    assert other.ridge_ == pytest.approx(fitted.ridge_ / 2.0)


def test_standard_deviation_covers_the_error_of_the_value() -> None:
    shares = []
    for seed in range(5):
        inputs, target, truth = rows(100 + seed, 2000)
        values, spread = RBFRegressor(centres=16).fit(inputs, target).predict(inputs, return_std=True)
        shares.append(np.mean(np.abs(values - truth) < 2.0 * spread))
    assert 0.85 < np.mean(shares) <= 1.0


def test_slow_noise_is_fitted_less_than_if_it_were_white(monkeypatch: pytest.MonkeyPatch) -> None:
    memory = np.exp(-1.0 / 60.0)

    def errors() -> list[float]:
        found = []
        for seed in range(2):
            inputs, target, truth = rows(seed)
            draw = np.random.default_rng(50 + seed).normal(size=len(target))
            slow = lfilter([0.1 * np.sqrt(1.0 - memory**2)], [1.0, -memory], draw)
            fitted = RBFRegressor(centres=16).fit(inputs, target + slow)
            shares.append(fitted.independent_share_)
            found.append(float(np.sqrt(np.mean((fitted.predict(inputs) - truth) ** 2))))
        return found

    shares: list[float] = []
    heeded = errors()
    assert max(shares) < 0.2
    monkeypatch.setattr(search, "independent_share", lambda residuals: 1.0)
    white = errors()
    assert np.mean(heeded) < 0.9 * np.mean(white), (heeded, white)


@pytest.mark.parametrize("kind", [RBFRegressor(), PatentRBFRegressor()])
def test_a_straight_line_needs_no_network(kind: Any) -> None:
    inputs = np.linspace(-1.0, 1.0, 300)[:, None]
    fitted = kind.fit(inputs, 3.0 * inputs[:, 0] + 1.0)
    np.testing.assert_allclose(fitted.predict(inputs), 3.0 * inputs[:, 0] + 1.0, atol=2e-2)
    if isinstance(kind, RBFRegressor):
        assert len(fitted.network_.weights) == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"centres": "some"}, "centres"),
        ({"centres": -1}, "centres"),
        ({"ridge": -1.0}, "ridge"),
        ({"ridge": "auto"}, "ridge"),
        ({"centre_choice": "random"}, "kmeans"),
        ({"objective": "loss"}, "objective"),
        ({"dtype": "float16"}, "dtype"),
        ({"network_inputs": [2]}, "inputs 0 to 1"),
        ({"average_rows": 1}, "average_rows"),
    ],
)
def test_bad_parameters_are_told(options: dict[str, Any], message: str) -> None:
    inputs, target, _ = rows(8, 100)
    with pytest.raises(InputError, match=message):
        RBFRegressor(**options).fit(inputs, target)


def test_patent_form_has_one_width_no_slope_and_a_size_chosen_on_folds() -> None:
    inputs, target, truth = rows(9)
    fitted = PatentRBFRegressor().fit(inputs, target)
    network = fitted.network_
    widths = network.widths / inputs.std(axis=0)
    np.testing.assert_allclose(widths, fitted.width_, rtol=1e-6)
    assert np.all(network.linear == 0.0)
    scaled = (inputs - inputs.mean(axis=0)) / inputs.std(axis=0)
    centres = (network.centres - inputs.mean(axis=0)) / inputs.std(axis=0)
    nearest = np.sqrt(((centres[:, None] - scaled[None]) ** 2).sum(axis=2)).min(axis=1)
    assert nearest.max() < 1e-6  # centres are training rows
    assert np.sqrt(np.mean((fitted.predict(inputs) - truth) ** 2)) < 0.5 * NOISE
    assert 0.8 * NOISE**2 < fitted.held_out_mse_ < 2.0 * NOISE**2


def test_patent_goal_stops_at_a_smaller_network() -> None:
    inputs, target, _ = rows(10)
    best = PatentRBFRegressor().fit(inputs, target)
    goal = 4.0 * NOISE**2
    early = PatentRBFRegressor(goal=goal).fit(inputs, target)
    assert early.held_out_mse_ <= goal
    assert len(early.network_.weights) < len(best.network_.weights)
    assert PatentRBFRegressor(goal=1e-9).fit(inputs, target).held_out_mse_ == best.held_out_mse_
    # A constant beside the target, however large, costs no digits.
    moved = PatentRBFRegressor(goal=goal).fit(inputs, target + 1e6)
    assert moved.held_out_mse_ == pytest.approx(early.held_out_mse_, rel=1e-4)
    assert len(moved.network_.weights) == len(early.network_.weights)


@pytest.mark.parametrize("centres", [16, 64])
def test_a_smooth_drift_takes_few_centres(centres: int) -> None:
    """One bump beside a line: a handful of centres, as good against the truth as all of them."""
    random = np.random.default_rng(6)
    inputs = np.linspace(-3.0, 3.0, 800)[:, None]
    truth = 0.4 * inputs[:, 0] + np.exp(-(inputs[:, 0] ** 2) / 0.5)
    target = truth + 0.2 * random.normal(size=800)
    errors = {}
    for prune in (0.0, 1.1):
        regressor = RBFRegressor(centres=centres, prune=prune).fit(inputs, target)
        errors[prune] = np.sqrt(np.mean((regressor.predict(inputs) - truth) ** 2))
        if prune:
            assert 1 <= len(regressor.network_.weights) <= 8
        else:
            assert len(regressor.network_.weights) == centres
    # The standard error of a value known from 800 rows by ten numbers or so.
    assert errors[1.1] <= errors[0.0] + 0.2 * np.sqrt(10 / 800)
