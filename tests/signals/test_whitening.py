from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.signals.noise_model import NoiseModel
from fogml.signals.random_noise import flicker_noise, random_walk, white_noise
from fogml.signals.whitening import Whitener

RNG = np.random.default_rng(5)
TIMES = {
    "regular": np.arange(250.0),
    "slow": 10.0 * np.arange(250),
    "gaps": np.concatenate((np.arange(90.0), 5000.0 + np.arange(100), 5103.0 + np.arange(60))),
    "irregular": np.cumsum(RNG.uniform(0.2, 2.2, 250)),
    "clock noise": np.arange(250.0) + 1e-9 * RNG.uniform(-1, 1, 250),
}
MODELS = {
    "all": NoiseModel(N=0.003, B=0.05, K=0.4),
    "quantised": NoiseModel(N=0.003, B=0.05, K=0.4, Q=3e-5),
    "white": NoiseModel(N=0.003),
    "walk": NoiseModel(N=0.003, K=2.0),
    "flicker": NoiseModel(N=1e-5, B=0.05),
}


@pytest.mark.parametrize("times", TIMES)
@pytest.mark.parametrize("which", MODELS)
def test_whitening_is_the_inverse_cholesky_factor(times, which):
    time, model = TIMES[times], MODELS[which]
    whitener = Whitener(model, time)
    covariance = model.covariance(time, whitener.averaging_s[0], whitener.ladder)
    lower = np.linalg.cholesky(covariance)
    values = np.random.default_rng(6).normal(size=(len(time), 3))
    wanted = np.linalg.solve(lower, values)
    np.testing.assert_allclose(whitener.whiten(values), wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())
    np.testing.assert_allclose(whitener.whiten(values[:, 0]), wanted[:, 0], atol=1e-6 * np.abs(wanted).max())
    assert whitener.log_det == pytest.approx(0.5 * np.linalg.slogdet(covariance)[1], rel=1e-6)
    np.testing.assert_allclose(whitener.colour(wanted), values, atol=1e-6)
    product = whitener.colour(whitener.colour_adjoint(values))
    np.testing.assert_allclose(product, covariance @ values, atol=1e-6 * np.abs(product).max())


def test_averaging_times_of_their_own():
    """Averages of one, two and four samples are whitened as the averages that they are."""
    rng = np.random.default_rng(7)
    counts = rng.choice([1, 2, 4], 60)
    edges = np.concatenate(([0], np.cumsum(counts)))
    model, fine = NoiseModel(N=0.003, B=0.05, K=0.4), np.arange(1.0, edges[-1] + 1)
    whitener = Whitener(model, edges[1:], counts.astype(float))
    mean = np.zeros((60, len(fine)))
    for i, (a, b) in enumerate(pairwise(edges)):
        mean[i, a:b] = 1 / (b - a)
    covariance = mean @ model.covariance(fine, 1.0, whitener.ladder) @ mean.T
    values = rng.normal(size=60)
    wanted = np.linalg.solve(np.linalg.cholesky(covariance), values)
    np.testing.assert_allclose(whitener.whiten(values), wanted, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize(("sample_s", "white"), [(1.0, 0.003), (10.0, 0.001), (0.01, 0.0005)])
def test_noise_of_an_independent_generator_comes_out_white(sample_s, white):
    model, n = NoiseModel(N=white, B=0.02, K=0.05), 30_000
    rng = np.random.default_rng(8)
    noise = white_noise(rng, n, sample_s, 60 * model.N) + flicker_noise(rng, n, model.B)
    noise += random_walk(rng, n, sample_s, model.K / 60)
    e = Whitener(model, sample_s * np.arange(n)).whiten(noise - noise[:10].mean())[10:]
    assert e.var() == pytest.approx(1.0, abs=0.03)
    for lag in (1, 2, 5, 20, 100):
        assert abs(e[lag:] @ e[:-lag]) / n < 0.03


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    columns=st.integers(1, 150),
    scale=st.floats(-1e6, 1e6),
)
def test_linear_and_column_by_column(seed, columns, scale):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.choice([1.0, 1.0, 1.0, 7.5], 120))
    whitener = Whitener(MODELS["quantised"], time)
    x, y = rng.normal(size=(2, 120, columns))
    white = whitener.whiten(x)
    together = whitener.whiten(scale * x + y)
    expected = scale * white + whitener.whiten(y)
    np.testing.assert_allclose(together, expected, rtol=0, atol=1e-10 * (1 + np.abs(expected).max()))
    one = int(rng.integers(columns))
    np.testing.assert_array_equal(whitener.whiten(x[:, one]), white[:, one])
    np.testing.assert_array_equal(whitener.whiten(np.asfortranarray(x)), white)


def test_what_came_after_does_not_count():
    time = TIMES["gaps"]
    values = np.random.default_rng(9).normal(size=len(time))
    whole = Whitener(MODELS["all"], time)
    part = Whitener(MODELS["all"], time[:120], 1.0, whole.ladder)
    np.testing.assert_array_equal(whole.whiten(values)[:120], part.whiten(values[:120]))


def test_memory_is_a_few_numbers_a_sample():
    """Linear cost: constants once per distinct step, gains once per sample."""
    small, large = (Whitener(MODELS["all"], np.arange(float(n)), 1.0) for n in (1000, 100_000))
    assert len(small._decay) == len(large._decay) <= 2
    assert large._gains.shape[0] == 100_000
    assert large._gains.shape[1] <= 12


def test_input_stays_as_it_was():
    values = np.ones((250, 2))
    Whitener(MODELS["all"], TIMES["regular"]).whiten(values)
    assert np.all(values == 1.0)


@pytest.mark.parametrize("which", ["white", "all"])
@pytest.mark.parametrize("row", [0, 17, 249])
def test_a_value_that_is_not_finite_is_refused(which, row):
    values = np.zeros((250, 2))
    values[row, 1] = np.nan
    with pytest.raises(InputError, match="not finite"):
        Whitener(MODELS[which], TIMES["regular"]).whiten(values)


def test_bad_input_is_refused():
    model = MODELS["all"]
    with pytest.raises(InputError, match="row 2"):
        Whitener(model, [0.0, 1.0, 1.0])
    with pytest.raises(InputError, match="positive"):
        Whitener(model, [0.0, 1.0], 0.0)
    with pytest.raises(InputError, match="single sample"):
        Whitener(model, [0.0])
    with pytest.raises(InputError, match="expected"):
        Whitener(model, [0.0, 1.0]).whiten(np.zeros(3))
