"""Evidence, conditioning and prediction against dense normal densities."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fogml.gap.linear_gaussian import (
    LinearGaussian,
    Posterior,
    left_out_log_density,
    log_evidence,
    prior_factor,
    sign_gains,
    size_gains,
    wide_gains,
)


def _made(n=30, seed=1):
    rng = np.random.default_rng(seed)
    fixed, block, other = (rng.standard_normal((n, k)) for k in (3, 4, 2))
    data = 3.0 * block[:, 0] + fixed @ [1.0, -2.0, 0.5] + rng.standard_normal(n)
    return data, fixed, block, other


def _dense(data, *blocks):
    """Log density by its definition, less that of unit noise at zero."""
    covariance = np.eye(len(data)) + sum(b @ b.T for b in blocks)
    return multivariate_normal.logpdf(data, cov=covariance) + 0.5 * len(data) * np.log(2.0 * np.pi)


def test_evidence_is_the_density_of_the_data():
    data, fixed, block, other = _made()
    held = LinearGaussian.of(data).beside(fixed).beside(block, 2.0).beside(other, 0.3)
    assert held.log_evidence == pytest.approx(_dense(data, fixed, 2.0 * block, 0.3 * other), abs=1e-9)


@pytest.mark.parametrize("width", [1, 2, 4, 30])
def test_gains_at_sizes_are_differences_of_densities(width):
    rng = np.random.default_rng(2)
    data, fixed, *_ = _made(80)
    block = rng.standard_normal((80, width))
    held = LinearGaussian.of(data).beside(fixed)
    sizes = np.array([0.5, 3.0])
    gains = size_gains(held.gram(block)[None], held.fits(block)[None], sizes)[0]
    expected = [_dense(data, fixed, s * block) - _dense(data, fixed) for s in sizes]
    np.testing.assert_allclose(gains, expected, atol=1e-8)
    np.testing.assert_allclose(size_gains(held.gram(block), held.fits(block), sizes), expected, atol=1e-8)


@pytest.mark.parametrize(("width", "beside"), [(12, 0), (12, 3), (5, 9)])
def test_a_wide_block_gains_beside_others_as_by_the_densities(width, beside):
    rng = np.random.default_rng(3)
    data, fixed, *_ = _made(60)
    block, other = rng.standard_normal((60, width)), rng.standard_normal((60, beside))
    held = LinearGaussian.of(data).beside(fixed)
    both = held.beside(other)
    own = both.basis[:, held.basis.shape[1] :]
    sizes = np.array([0.5, 3.0])
    gains = wide_gains(*np.linalg.eigh(held.gram(block)), block.T @ own, both.fits(block), sizes)
    expected = [_dense(data, fixed, other, s * block) - _dense(data, fixed, other) for s in sizes]
    np.testing.assert_allclose(gains, expected, atol=1e-8)


def test_a_sign_that_is_known_is_a_prior_on_half_the_space():
    """By a sum over the plane of coefficients."""
    rng = np.random.default_rng(4)
    fixed, block = rng.standard_normal((40, 2)), rng.standard_normal((40, 2))
    data = 0.3 * block[:, 0] + rng.standard_normal(40)
    held = LinearGaussian.of(data).beside(fixed)
    gram, fits, size = held.gram(block), held.fits(block), 0.7
    grid = np.linspace(-6.0, 6.0, 1201)
    c = size * np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1)
    log_density = c @ fits - 0.5 * np.einsum("...i,ij,...j->...", c, gram, c) - 0.5 * (c**2).sum(-1) / size**2
    held_half = np.where(grid > 0.0, 1.0, np.where(grid == 0.0, 0.5, 0.0))[:, None]
    expected = np.log(2.0 * (held_half * np.exp(log_density)).sum() / np.exp(log_density).sum())
    found = sign_gains(gram[None], fits[None], np.array([[size]]))
    assert found[0, 0] == pytest.approx(expected, abs=1e-4)


def test_leaving_parts_out_is_conditioning():
    data, fixed, block, _ = _made()
    design = np.concatenate([fixed, block], axis=1)
    covariance = np.eye(30) + design @ design.T
    parts = [slice(0, 12), slice(12, 30)]
    expected = 0.0
    for part in parts:
        own = np.zeros(30, bool)
        own[part] = True
        gain = covariance[np.ix_(own, ~own)] @ np.linalg.inv(covariance[np.ix_(~own, ~own)])
        left = covariance[np.ix_(own, own)] - gain @ covariance[np.ix_(~own, own)]
        expected += multivariate_normal.logpdf(data[own], gain @ data[~own], left)
    found = left_out_log_density(design, data, parts) - 0.5 * 30 * np.log(2.0 * np.pi)
    assert found == pytest.approx(expected, abs=1e-8)


def test_the_posterior_is_that_of_the_joint_density():
    data, fixed, *_ = _made()
    found = Posterior.of(fixed, data)
    gain = fixed.T @ np.linalg.inv(np.eye(30) + fixed @ fixed.T)
    np.testing.assert_allclose(found.mean, gain @ data, atol=1e-10)
    np.testing.assert_allclose(found.covariance, np.eye(3) - gain @ fixed, atol=1e-10)
    alone = log_evidence(fixed.T @ fixed, fixed.T @ data, float(data @ data))
    assert alone == pytest.approx(_dense(data, fixed), abs=1e-9)


def test_columns_far_greater_than_the_noise_have_a_factor() -> None:
    """As of a temperature that jumps by 50 degC in a sample: products round by more than the prior."""
    rng = np.random.default_rng(4)
    columns = 1e12 * rng.normal(size=(60, 5)) @ rng.normal(size=(5, 40))
    gram = columns.T @ columns
    factor = prior_factor(gram)
    assert np.linalg.norm(factor @ factor.T - gram) < 1e-12 * np.linalg.norm(gram)
    assert np.all(np.triu(factor, 1) == 0.0) and np.all(np.diagonal(factor) > 0.0)
    # What is left of columns beside others may be negative by far more than its own rounding.
    below = np.diag([1e6, -1e3, 2.0])
    np.testing.assert_allclose(np.diagonal(prior_factor(below)) ** 2, [1e6 + 1.0, 1.0, 3.0], rtol=1e-12)
    small = 1e-3 * rng.normal(size=(60, 40))
    np.testing.assert_allclose(
        prior_factor(small.T @ small),
        np.linalg.cholesky(np.eye(40) + small.T @ small),
        rtol=1e-12,
        atol=1e-15,
    )


def test_blocks_that_nothing_is_left_of_gain_nothing_at_any_size() -> None:
    gram, fits = np.diag([-1e-9, -1e-9]), np.zeros(2)
    np.testing.assert_allclose(size_gains(gram, fits, np.array([1.0, 1e6])), 0.0, atol=1e-12)
    np.testing.assert_allclose(size_gains(gram[:1, :1], fits[:1], np.array([1.0, 1e6])), 0.0, atol=1e-12)
