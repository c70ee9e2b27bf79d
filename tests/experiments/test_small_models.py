"""Small models to compare with: autopilots' cubics by hand, splines against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from experiments.benchmarks import kan
from experiments.benchmarks.autopilots import RisingCubic
from fogml.models.table import TrainingTable

torch = pytest.importorskip("torch")


def table_of(T, y):
    n = len(T)
    blocks = np.zeros(n, dtype=np.intp)
    return TrainingTable(T[:, None], y, blocks, np.arange(float(n)), blocks)


def fitted(least, step, T, y):
    cubic = RisingCubic(least, step)
    cubic.fit(table_of(T, y), np.arange(len(T)))
    return lambda T: cubic.along(np.atleast_1d(T)[:, None], np.zeros(np.size(T)))


def test_what_comes_before_the_coldest_and_after_the_warmest_sample_does_not_count():
    down, up, after = np.linspace(30.0, 0.0, 50), np.linspace(0.0, 40.0, 400), np.linspace(40.0, 10.0, 50)
    truth = lambda T: 1.0 + 0.2 * T - 3e-3 * T**2 + 4e-5 * T**3  # noqa: E731
    y = np.concatenate([truth(down) + 50.0, truth(up), truth(after) - 30.0])
    model = fitted(24.0, 0.0, np.concatenate([down, up, after]), y)
    np.testing.assert_allclose(model([1.0, 20.0, 39.0]), truth(np.array([1.0, 20.0, 39.0])), atol=1e-9)
    np.testing.assert_allclose(model([-30.0, 90.0]), model([0.1, 40.0]), atol=0.03)


def test_a_rise_that_is_too_small_leaves_the_mean():
    T = np.linspace(0.0, 20.0, 300)
    y = 2.0 * T
    np.testing.assert_allclose(fitted(24.0, 0.0, T, y)([0.0, 20.0]), 20.0)
    np.testing.assert_allclose(fitted(10.0, 0.5, T, y)([2.0, 18.0]), [4.0, 36.0], atol=0.2)


def test_means_over_half_a_degree_hold_all_that_was_read_meanwhile():
    # A soak within a step is part of its mean, so the step's output moves to the soak's.
    T = np.concatenate([np.arange(0.0, 10.1, 0.1), np.full(1000, 10.1), np.arange(10.2, 20.0, 0.1)])
    y = np.where(T == 10.1, 5.0, 0.0)
    found = RisingCubic(10.0, 0.5)._rising(T, y)[1]
    assert found.max() > 4.9
    assert np.count_nonzero(found) == 1


def test_a_kans_splines_are_scipys():
    knots = np.arange(-kan.DEGREE, kan.INTERVALS + kan.DEGREE + 1.0)
    x = np.linspace(0.0, kan.INTERVALS, 41)[:-1]
    wanted = BSpline.design_matrix(x, knots, kan.DEGREE).toarray()
    found = kan._basis(torch.as_tensor(x[:, None]))[:, 0].numpy()
    np.testing.assert_allclose(found, wanted, atol=1e-9)
