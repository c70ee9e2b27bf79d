from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest

from fogml.errors import InputError
from fogml.signals.noise_fit import NoisePrior, _curvature, _glance, _log_likelihood, _moments, fit_noise
from fogml.signals.noise_fit_data import fit_data
from fogml.signals.noise_model import NoiseModel
from fogml.signals.random_noise import flicker_noise, random_walk, white_noise
from fogml.signals.whitening import Whitener

TRUTH = NoiseModel(N=0.003, B=0.03, K=0.1)


def drawn(rng: np.random.Generator, count: int, sample_s: float, model: NoiseModel = TRUTH) -> np.ndarray:
    noise = white_noise(rng, count, sample_s, 60 * model.N) + flicker_noise(rng, count, model.B)
    return noise + random_walk(rng, count, sample_s, model.K / 60)


def scores(fit, truth: NoiseModel = TRUTH) -> np.ndarray:
    logs = np.log([fit.model.N / truth.N, fit.model.B / truth.B, fit.model.K / truth.K])
    return logs / fit.standard_errors


@pytest.mark.parametrize(("count", "sample_s"), [(1000, 10.0), (36_000, 1.0)])
def test_constants_come_back_within_their_errors(count, sample_s):
    time = sample_s * np.arange(count)
    found = []
    for seed in range(20):
        y = 7.0 + drawn(np.random.default_rng(seed), count, sample_s)
        found.append(scores(fit_noise([time], [y], prior=NoisePrior(TRUTH, 3.0), most=1200)))
    z = np.array(found)
    assert np.all(np.abs(z) < 4.0)
    assert np.all(np.abs(z.mean(axis=0)) < 3.0 / np.sqrt(20))
    # Not wider than they need be either; K is known from its prior, mostly.
    assert np.all(z.std(axis=0)[:2] > 0.5) and np.all(z.std(axis=0) < 1.5)


def test_errors_cover_constants_drawn_from_the_prior():
    prior, rng = NoisePrior(NoiseModel(N=0.003, B=0.02, K=0.05), 2.0), np.random.default_rng(9)
    time, z = 10.0 * np.arange(700), []
    for _ in range(60):
        n, b, k = np.exp(np.log([0.003, 0.02, 0.05]) + np.log(2.0) * rng.standard_normal(3))
        truth = NoiseModel(N=n, B=b, K=k)
        z.append(scores(fit_noise([time], [drawn(rng, 700, 10.0, truth)], prior=prior), truth))
    for column in np.array(z).T:
        assert kstest(column, "norm").pvalue > 1e-3
        assert 0.8 <= np.mean(np.abs(column) < 1.645) <= 1.0


def test_soaks_of_a_moving_run_with_columns():
    rng, z = np.random.default_rng(10), []
    for _ in range(8):
        times, series, columns = [], [], []
        constants = rng.normal(size=2) * (5.0, 300.0)
        for soak in range(4):
            t = 20_000.0 * soak + np.arange(6000.0)
            x = np.column_stack((np.exp(-(t - t[0]) / 1500), np.where(t % 400 < 200, 1.0, -1.0)))
            times.append(t)
            columns.append(x)
            series.append(drawn(rng, 6000, 1.0) + x @ constants + 10.0 * rng.normal())
        fit = fit_noise(times, series, columns, prior=NoisePrior(TRUTH, 3.0), most=512)
        z.append(scores(fit))
    assert np.all(np.abs(z) < 4.0)
    assert np.all(np.abs(np.mean(z, axis=0)) < 1.3)


def test_averages_and_differences_know_as_much_as_all_samples():
    time, prior = np.arange(8000.0), NoisePrior(TRUTH, 3.0)
    y = drawn(np.random.default_rng(11), 8000, 1.0)
    whole = fit_noise([time], [y], prior=prior, most=8000)
    split = fit_noise([time], [y], prior=prior, most=500)
    shift = np.log([split.model.N / whole.model.N, split.model.B / whole.model.B])
    assert np.all(np.abs(shift) < 0.8 * whole.standard_errors[:2])
    assert split.standard_errors == pytest.approx(whole.standard_errors, rel=0.25)


def test_likelihood_is_the_restricted_one():
    """Against the dense restricted likelihood, with a column beside the constant."""
    rng, n = np.random.default_rng(12), 150
    time = np.cumsum(rng.choice([10.0, 10.0, 45.0], n))
    y, x = rng.normal(size=n), rng.normal(size=(n, 1))
    data = fit_data([time], [y], [x], 10.0, 4096)
    design = np.column_stack((np.ones(n), x))

    def wanted(model: NoiseModel) -> float:
        c = model.covariance(time, 10.0, data.parts[0].whitener.ladder)
        inverse = np.linalg.inv(c)
        information = design.T @ inverse @ design
        residual = y - design @ np.linalg.solve(information, design.T @ inverse @ y)
        projected = y @ inverse @ residual
        return -0.5 * (projected + np.linalg.slogdet(c)[1] + np.linalg.slogdet(information)[1])

    other = NoiseModel(N=0.01, B=0.2, K=1.0)
    got = _log_likelihood(data, TRUTH) - _log_likelihood(data, other)
    assert got == pytest.approx(wanted(TRUTH) - wanted(other), rel=1e-6)


def test_without_a_prior_and_with_gaps_and_jitter():
    rng = np.random.default_rng(13)
    time = np.delete(np.arange(20_000.0), np.s_[7000:9000]) + rng.uniform(-0.01, 0.01, 18_000)
    y = Whitener(TRUTH, time).colour(rng.standard_normal(18_000))
    fit = fit_noise([time], [y - 40.0])
    assert np.all(np.abs(scores(fit)) < 4.0)
    assert fit.standard_errors[0] < 0.02 and fit.standard_errors[1] < 0.2


def test_what_the_data_do_not_show_is_left_to_the_prior():
    y = white_noise(np.random.default_rng(14), 4000, 1.0, 60 * 0.01)
    prior = NoisePrior(NoiseModel(N=0.01, B=1e-3, K=1e-3), 3.0)
    fit = fit_noise([np.arange(4000.0)], [y], prior=prior)
    assert fit.standard_errors[1:] == pytest.approx(np.log(3.0), rel=0.15)
    assert abs(np.log(fit.model.B / 1e-3)) < 0.5


def test_a_zero_centre_holds_its_coefficient():
    prior = NoisePrior(NoiseModel(N=0.003, B=0.03), 3.0)
    fit = fit_noise([np.arange(2000.0)], [drawn(np.random.default_rng(15), 2000, 1.0)], prior=prior)
    assert fit.model.K == 0.0
    assert fit.standard_errors[2] == 0.0
    assert all(model.K == 0.0 for model in fit.draw(np.random.default_rng(0), 3))


def test_draws_scatter_as_the_covariance_says():
    fit = fit_noise([np.arange(5000.0)], [drawn(np.random.default_rng(16), 5000, 1.0)])
    logs = np.log([[m.N, m.B, m.K] for m in fit.draw(np.random.default_rng(0), 4000)])
    assert np.cov(logs.T) == pytest.approx(fit.covariance, abs=0.08 * fit.covariance.max())


def test_bad_input_is_refused():
    time = np.arange(100.0)
    with pytest.raises(InputError, match="as many"):
        fit_noise([time], [])
    with pytest.raises(InputError, match="series 1"):
        fit_noise([time], [np.zeros(99)])
    with pytest.raises(InputError, match="finite"):
        fit_noise([time], [np.full(100, np.nan)])
    with pytest.raises(InputError, match="16 samples"):
        fit_noise([time[:5]], [np.zeros(5)])
    with pytest.raises(InputError, match="constant"):
        fit_noise([time], [np.ones(100)])
    with pytest.raises(InputError, match="factor"):
        NoisePrior(TRUTH, 1.0)


def test_moments_of_a_normal_posterior_are_its_own():
    """Guessed as they are, most points count; the curvature at its top is the inverse covariance."""
    mean, covariance = np.array([0.3, -1.0]), np.array([[0.5, 0.2], [0.2, 0.3]])
    inverse = np.linalg.inv(covariance)

    def loss(x):
        return 0.5 * float((x - mean) @ inverse @ (x - mean)) + 7.0

    centre, spread, matter = _moments(loss, mean, covariance, 7.0)
    assert centre == pytest.approx(mean, abs=0.05) and spread == pytest.approx(covariance, rel=0.2, abs=0.02)
    assert 32.0 < matter <= 64.0
    away, steps = np.array([2.0, 1.0]), np.array([1e-2, 2e-2])
    assert _curvature(loss, away, steps) == pytest.approx(inverse, rel=1e-6)


@pytest.mark.parametrize(("name", "factor"), [("N", 1.0), ("K", 0.5)])
def test_the_prior_at_a_glance_is_about_the_noise_where_it_reigns(name, factor):
    rng = np.random.default_rng(3)
    makes = {
        "N": lambda: white_noise(rng, 64, 10.0, 60 * TRUTH.N),
        "K": lambda: random_walk(rng, 64, 10.0, TRUTH.K / 60),
    }
    series = [makes[name]() for _ in range(60)]
    centre = _glance(fit_data([10.0 * np.arange(64)] * 60, series, None, None, 512)).centre
    assert getattr(centre, name) == pytest.approx(factor * getattr(TRUTH, name), rel=0.15)


def test_one_coefficient_is_told_as_its_posterior_integrates():
    """A normal prior of ln N beside n - 1 squares of white noise about their mean."""
    count, centre, factor = 16, 0.003, 1.2
    y = 3.0 * white_noise(np.random.default_rng(2), count, 10.0, 60 * centre)
    fit = fit_noise([10.0 * np.arange(count)], [y], prior=NoisePrior(NoiseModel(centre, 0.0, 0.0), factor))
    off = np.linspace(-2.0, 2.0, 4001)
    sigma = 60.0 * centre * np.exp(off) / np.sqrt(10.0)
    squares = float(np.sum((y - y.mean()) ** 2))
    log = -0.5 * (off / np.log(factor)) ** 2 - (count - 1) * np.log(sigma) - 0.5 * squares / sigma**2
    share = np.exp(log - log.max()) / np.exp(log - log.max()).sum()
    mean = float(share @ off)
    assert np.log(fit.model.N / centre) == pytest.approx(mean, abs=5e-3)
    assert fit.standard_errors[0] == pytest.approx(np.sqrt(share @ (off - mean) ** 2), rel=0.03)
