"""Smooth courses of readings: how free they are, what they leave, and differences of means over them."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.signals.smoothing import PENALTIES, Smoothness, smoothed, window_difference


def generalised_score(values: np.ndarray, penalty: float) -> tuple[float, float]:
    """The score of generalised cross-validation and the noise, of a dense smoother."""
    n = len(values)
    third = np.diff(np.eye(n), 3, axis=0)
    smoother = np.linalg.inv(np.eye(n) + penalty * third.T @ third)
    square = float(np.sum((values - smoother @ values) ** 2))
    left = n - float(np.trace(smoother))
    return n * square / left**2, np.sqrt(square / left)


@pytest.mark.parametrize("noise", [0.02, 0.3])
def test_the_penalty_is_that_of_a_dense_smoother(noise: float) -> None:
    """Waves stand for the smoother's own vectors: a few per cent of the freedom of a short series."""
    time = np.arange(80.0)
    for seed in range(5):
        values = np.sin(time / 6.0) + noise * np.random.default_rng(seed).standard_normal(80)
        _, found = smoothed(values)
        scores = [generalised_score(values, penalty)[0] for penalty in PENALTIES]
        assert generalised_score(values, found.penalty)[0] <= 1.02 * min(scores)
        assert found.noise == pytest.approx(generalised_score(values, found.penalty)[1], rel=0.02)


@pytest.mark.parametrize("share", [1.0, 0.05])
def test_courses_are_those_of_a_dense_smoother_with_a_share_of_the_penalty(share: float) -> None:
    values = np.sin(np.arange(80.0) / 6.0) + 0.1 * np.random.default_rng(1).standard_normal(80)
    smooth, found = smoothed(values, share)
    third = np.diff(np.eye(80), 3, axis=0)
    expected = np.linalg.solve(np.eye(80) + share * found.penalty * third.T @ third, values)
    np.testing.assert_allclose(smooth, expected, atol=1e-8)


@pytest.mark.parametrize("penalty", [0.0, 1.0, 1e3, 1e6])
def test_errors_of_a_course_are_those_of_a_dense_smoother_at_its_ends_too(penalty: float) -> None:
    """Modes of which a tenth passes are left out: several per cent of the variance."""
    third = np.diff(np.eye(120), 3, axis=0)
    dense = 0.3**2 * np.linalg.inv(np.eye(120) + penalty * third.T @ third)
    errors = Smoothness(0.3, penalty).errors(120)
    told = errors @ errors.T
    assert np.diagonal(told) == pytest.approx(np.diagonal(dense), rel=0.15)
    left = np.linalg.eigvalsh(dense - told)
    assert left.min() > -1e-8 and left.max() < 0.1 * 0.3**2 + 1e-8


def test_a_difference_of_windows_is_that_of_their_means() -> None:
    """Of a parabola, and with what came before held at the first value."""
    time = np.arange(0.0, 200.0, 2.0)
    found = window_difference(time, 3.0 + 0.1 * time**2, 20.0)
    # Means a window apart, each the middle's value and the same curvature's share.
    assert found[30:] == pytest.approx(0.1 * ((time[30:] - 10.0) ** 2 - (time[30:] - 30.0) ** 2))
    early = window_difference(time, 3.0 + 0.1 * time**2, 1e4)
    assert early == pytest.approx(0.1 * time**3 / 3.0 / 1e4)
    assert window_difference(time, np.full(100, 3.0), 20.0) == pytest.approx(np.zeros(100), abs=1e-12)
