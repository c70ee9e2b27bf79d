"""Models weighed by restricted likelihood, against the density of contrasts that no column reaches."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import null_space

from fogml.arrays import FloatArray
from fogml.signals.restricted import absent_or_not, weighed_models

N = 12
COLUMNS = np.column_stack((np.ones(N), np.arange(float(N))))


def covariances(rng: np.random.Generator) -> FloatArray:
    roots = rng.standard_normal((20, N, N))
    return np.asarray(roots @ roots.transpose(0, 2, 1) + np.eye(N))


def test_weights_are_the_contrasts_densities_and_the_line_that_of_least_squares() -> None:
    rng = np.random.default_rng(0)
    given, values = covariances(rng), rng.standard_normal(N)
    found = weighed_models(given, COLUMNS, values, np.zeros(20))
    contrasts = null_space(COLUMNS.T)
    # Normal contrasts of a covariance whose factor s^2 may be of any size, integrated over d(s^2) / s^2.
    inner = [contrasts.T @ one @ contrasts for one in given]
    seen = contrasts.T @ values
    densities = [
        np.linalg.det(one) ** -0.5 * (seen @ np.linalg.solve(one, seen)) ** (-0.5 * len(seen))
        for one in inner
    ]
    np.testing.assert_allclose(found.weights, np.array(densities) / np.sum(densities), rtol=1e-9)
    for one, constant, scale in zip(given, found.constants, found.scales, strict=True):
        inverse = np.linalg.inv(one)
        errors = np.linalg.inv(COLUMNS.T @ inverse @ COLUMNS)
        line = errors @ COLUMNS.T @ inverse @ values
        left = values - COLUMNS @ line
        assert constant == pytest.approx(line[1])
        assert scale == pytest.approx(np.sqrt(left @ inverse @ left / (N - 2) * errors[1, 1]))


def test_values_given_by_their_squares_count_as_if_they_were_there() -> None:
    rng = np.random.default_rng(1)
    variances, values = rng.uniform(0.5, 2.0, (20, N + 3)), rng.standard_normal(N + 3)
    columns = np.vstack((COLUMNS, np.zeros((3, 2))))
    whole = weighed_models(variances, columns, values, np.arange(20.0))
    apart = weighed_models(
        variances[:, :N],
        COLUMNS,
        values[:N],
        np.arange(20.0),
        squares=(1.0 / variances[:, N:]) @ values[N:] ** 2,
        log_determinants=np.log(variances[:, N:]).sum(axis=1),
        freedom=3.0,
    )
    full = weighed_models(variances[:, :, None] * np.eye(N + 3), columns, values, np.arange(20.0))
    for other in (apart, full):
        for name in ("weights", "variances", "constants", "scales", "freedom"):
            np.testing.assert_allclose(getattr(other, name), getattr(whole, name), rtol=1e-9, err_msg=name)


def test_each_part_is_as_likely_absent_as_there() -> None:
    ratios = np.array([(a, b) for a in (0.0, 1.0, 2.0) for b in (0.0, 1.0, 2.0, 4.0)])
    prior = np.exp(absent_or_not(ratios))
    assert prior[ratios[:, 0] == 0.0].sum() == pytest.approx(0.5 * prior.sum())
    assert prior[ratios[:, 1] == 0.0].sum() == pytest.approx(0.5 * prior.sum())
