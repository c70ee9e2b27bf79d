from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.signals.averages import block_averages
from fogml.signals.noise_expectation import Fitted, expected_mean_square, floor_square, mean_square_draws
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener

MODEL = NoiseModel(N=0.003, B=0.03, K=0.05)
TIME = np.concatenate((100.0 * np.arange(1, 60), 9000.0 + 100.0 * np.arange(1, 60)))
COLUMNS = np.column_stack((np.ones(len(TIME)), TIME / 1e4, np.sin(TIME / 700)))


def dense() -> np.ndarray:
    return MODEL.covariance(TIME, 100.0, Whitener(MODEL, TIME, 100.0).ladder)


def test_without_a_fit_it_is_the_mean_variance():
    assert expected_mean_square(MODEL, TIME, 100.0) == pytest.approx(np.trace(dense()) / len(TIME))


def test_after_ordinary_least_squares():
    q = np.linalg.qr(COLUMNS)[0]
    left = np.eye(len(TIME)) - q @ q.T
    wanted = np.trace(left @ dense() @ left) / len(TIME)
    fitted = Fitted(COLUMNS, ordinary=True)
    assert expected_mean_square(MODEL, TIME, 100.0, fitted=fitted) == pytest.approx(wanted)


@pytest.mark.parametrize("deviations", [None, (0.01, 0.02, np.inf)])
def test_after_generalised_least_squares(deviations):
    """Residuals of the posterior mean, constants drawn from their priors."""
    c = dense()
    precision = np.linalg.inv(c)
    prior = np.zeros(3) if deviations is None else 1 / np.square(deviations)
    v = np.linalg.inv(COLUMNS.T @ precision @ COLUMNS + np.diag(prior))
    wanted = np.trace(c - COLUMNS @ v @ COLUMNS.T) / len(TIME)
    fitted = Fitted(COLUMNS, deviations)
    assert expected_mean_square(MODEL, TIME, 100.0, fitted=fitted) == pytest.approx(wanted)


@pytest.mark.parametrize(
    "fitted", [None, Fitted(COLUMNS), Fitted(COLUMNS, ordinary=True)], ids=["none", "gls", "ols"]
)
def test_draws_have_it_as_their_mean(fitted):
    draws = mean_square_draws(MODEL, TIME, 100.0, 3000, np.random.default_rng(1), fitted=fitted)
    wanted = expected_mean_square(MODEL, TIME, 100.0, fitted=fitted)
    assert abs(draws.mean() - wanted) < 4 * draws.std() / np.sqrt(3000)
    assert draws.std() > 0.01 * wanted


def test_averages_of_samples_have_the_mean_square_of_averages():
    """The model at 100 s is that of means of the model's samples at 1 s."""
    time, rng = np.arange(1.0, 6001.0), np.random.default_rng(2)
    noise = Whitener(MODEL, time).colour(rng.standard_normal((len(time), 400)))
    averages = block_averages(time, noise, window_s=100.0)
    ends = time[averages.stops - 1]
    fitted = Fitted(np.ones(len(ends)), ordinary=True)
    values = averages.values[0]
    got = np.mean((values - values.mean(axis=0)) ** 2)
    assert got == pytest.approx(expected_mean_square(MODEL, ends, 100.0, fitted=fitted), rel=0.05)


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="rows"):
        expected_mean_square(MODEL, TIME, 100.0, fitted=Fitted(np.ones(3)))
    with pytest.raises(InputError, match="deviations"):
        expected_mean_square(MODEL, TIME, 100.0, fitted=Fitted(COLUMNS, (1.0, -1.0, 1.0)))


@pytest.mark.parametrize("window_s", [100.0, 333.0])
def test_one_average_about_its_own_mean_leaves_nothing(window_s: float) -> None:
    for seed in range(20):
        n, b, k = np.random.default_rng(seed).uniform(0.0, 1.0, 3)
        found = floor_square(NoiseModel(n, b, k), np.array([window_s]), window_s)
        assert 0.0 <= found < 1e-12
