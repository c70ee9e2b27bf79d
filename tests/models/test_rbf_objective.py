"""The tuning objective: its value against the Gaussian density, its gradient against differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fogml.models.rbf.objective import LINEAR_PRECISION, Objective, Shape

ROWS, CENTRES, INPUTS = 60, 4, 2


def problem() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    draw = np.random.default_rng(0)
    inputs = draw.normal(size=(ROWS, INPUTS))
    target = np.sin(2.0 * inputs[:, 0]) + inputs[:, 1] + 0.1 * draw.normal(size=ROWS)
    return inputs, np.column_stack([inputs, np.ones(ROWS)]), target


def shape(seed: int) -> Shape:
    draw = np.random.default_rng(seed)
    return Shape(
        draw.normal(size=(CENTRES, INPUTS)), 0.3 * draw.normal(size=(CENTRES, INPUTS)), draw.normal()
    )


def basis(inputs: np.ndarray, at: Shape) -> np.ndarray:
    steps = (inputs[:, None] - at.centres) / np.exp(at.log_widths)
    return np.exp(-(steps**2).sum(axis=2))


def log_density(at: Shape) -> float:
    """Log density of the target at the noise variance that makes it largest."""
    inputs, linear, target = problem()
    columns = basis(inputs, at)
    spread = np.eye(ROWS) + columns @ columns.T / np.exp(at.log_ridge) + linear @ linear.T / LINEAR_PRECISION
    variance = target @ np.linalg.solve(spread, target) / ROWS
    return float(multivariate_normal(np.zeros(ROWS), variance * spread).logpdf(target))


def test_value_is_minus_the_log_density_up_to_a_constant() -> None:
    objective = Objective(*problem())
    sums = [objective(at).value + log_density(at) for at in map(shape, range(5))]
    np.testing.assert_allclose(sums, sums[0], atol=1e-4)


@pytest.mark.parametrize(("evidence", "share"), [(True, 1.0), (True, 0.3), (False, 1.0)])
def test_gradient_is_that_of_differences(evidence: bool, share: float) -> None:
    objective = Objective(*problem(), evidence=evidence)
    objective.share = share
    at, step = shape(1), 1e-6
    found = objective(at)
    for name in ("centres", "log_widths"):
        for index in np.ndindex(CENTRES, INPUTS):
            ends = []
            for sign in (1.0, -1.0):
                moved = {"centres": at.centres.copy(), "log_widths": at.log_widths.copy()}
                moved[name][index] += sign * step
                ends.append(objective(Shape(**moved, log_ridge=at.log_ridge)).value)
            expected = (ends[0] - ends[1]) / (2.0 * step)
            assert getattr(found, name)[index] == pytest.approx(expected, rel=1e-5, abs=1e-6), (name, index)
    if evidence:
        ends = [objective(Shape(at.centres, at.log_widths, at.log_ridge + s)).value for s in (step, -step)]
        assert found.log_ridge == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-5)


def test_weights_solve_the_penalised_least_squares() -> None:
    inputs, linear, target = problem()
    at = shape(2)
    columns = np.hstack([basis(inputs, at), linear])
    penalty = np.r_[np.full(CENTRES, np.exp(at.log_ridge)), np.full(linear.shape[1], LINEAR_PRECISION)]
    stacked = np.vstack([columns, np.diag(np.sqrt(penalty))])
    expected = np.linalg.lstsq(stacked, np.r_[target, np.zeros(len(penalty))], rcond=None)[0]
    objective = Objective(inputs, linear, target)
    np.testing.assert_allclose(objective.weights(at), expected, rtol=1e-8, atol=1e-9)
    left = target - columns @ expected
    np.testing.assert_allclose(objective.residuals(at), left, atol=1e-9)
    assert objective.mean_square(at, expected) == pytest.approx(np.mean(left**2))


def test_leaving_out_centres_costs_what_the_evidence_says() -> None:
    """The closed form of each loss against the objective worked out anew, and no smaller set missed."""
    random = np.random.default_rng(4)
    inputs = random.normal(size=(200, 2))
    linear = np.column_stack([inputs, np.ones(200)])
    target = np.exp(-np.sum((inputs - 0.5) ** 2, axis=1) / 0.3) + 0.05 * random.normal(size=200)
    objective = Objective(inputs, linear, target - target.mean())
    objective.share = 0.7
    shape = Shape(np.vstack([[0.5, 0.5], random.normal(size=(4, 2)), [[50.0, 50.0]]]), np.zeros((6, 2)), -4.0)

    def without(kept: np.ndarray) -> Shape:
        return Shape(shape.centres[kept], shape.log_widths[kept], shape.log_ridge)

    kept = objective.fewest_centres(shape, 0.0)
    assert 0 in kept and 5 not in kept
    best = objective(without(kept)).value
    assert best <= objective(shape).value
    for j in kept:
        assert objective(without(np.setdiff1d(kept, [j]))).value > best
    assert len(objective.fewest_centres(shape, 1e9)) == 0
