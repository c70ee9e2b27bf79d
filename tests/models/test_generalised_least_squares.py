"""What rows tell with slow noise and shifts of runs counted: against dense matrices and repeated fits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fogml.models.generalised_least_squares import (
    RunsNoise,
    runs_noise,
    shift_of_runs,
    shifted,
)
from fogml.models.table import TrainingTable
from fogml.signals.noise_model import NoiseModel, flicker_ladder
from fogml.signals.random_noise import LONGEST_S

STEP_S = 60.0


def table(features: np.ndarray, target: np.ndarray, runs: int = 1) -> TrainingTable:
    """Rows of runs of equal length, a minute apart."""
    each = len(target) // runs
    index = np.repeat(np.arange(runs), each)
    return TrainingTable(features, target, index, np.tile(STEP_S * np.arange(each), runs), index)


def rows_of(rng: np.random.Generator, white: float, walk: float, count: int = 200) -> TrainingTable:
    u = 2.0 * np.sin(np.linspace(0.0, 9.0, count))
    noise = white * rng.normal(size=count) + walk * np.cumsum(rng.normal(size=count))
    return table(np.column_stack([u, u**2]), 1.0 + 0.2 * u + 0.03 * u**2 + noise)


def columns_of(rows: TrainingTable) -> np.ndarray:
    return np.column_stack([np.ones(len(rows)), rows.X])


@pytest.mark.parametrize("runs", [1, 2])
def test_equations_are_those_of_generalised_least_squares(runs: int) -> None:
    rng = np.random.default_rng(3)
    rows = table(rng.normal(size=(60, 2)), rng.normal(size=60), runs)
    model = NoiseModel(0.02, B=0.1, K=0.3)
    noise = RunsNoise(model, STEP_S, flicker_ladder(STEP_S, STEP_S * 60 / runs))
    whole = shifted(noise.triangles(rows, columns_of(rows)), 0.7)
    one = model.covariance(STEP_S * np.arange(60 // runs), STEP_S, noise.ladder) + 0.7**2
    covariance = np.kron(np.eye(runs), one)
    weight, columns = np.linalg.inv(covariance), columns_of(rows)
    np.testing.assert_allclose(whole[:, :-1].T @ whole[:, :-1], columns.T @ weight @ columns, rtol=1e-6)
    np.testing.assert_allclose(whole[:, :-1].T @ whole[:, -1], columns.T @ weight @ rows.y, rtol=1e-6)


def test_flicker_slower_than_a_run_shifts_it() -> None:
    model, length = NoiseModel(0.02, B=0.1), 7200.0
    found = RunsNoise(model, STEP_S, flicker_ladder(STEP_S, length)).unseen_shift
    slower, whole = flicker_ladder(STEP_S, length), flicker_ladder(STEP_S, LONGEST_S / 3.0)
    variances = [one.step * len(one.time_constants_s) * 0.1**2 / np.pi for one in (slower, whole)]
    assert found == pytest.approx(np.sqrt(variances[1] - variances[0]), rel=1e-6)


@pytest.mark.parametrize("walk", [0.0, 0.01])
def test_what_rows_tell_is_as_sure_as_it_says(walk: float) -> None:
    apart = []
    for seed in range(40):
        rows = rows_of(np.random.default_rng([seed, 8]), 0.05, walk)
        noise = runs_noise(rows, 0.05)
        told = shifted(noise.triangles(rows, columns_of(rows)), noise.unseen_shift)
        information = told[:, :-1].T @ told[:, :-1]
        off = np.linalg.solve(information, told[:, :-1].T @ told[:, -1]) - [1.0, 0.2, 0.03]
        apart.append(off / np.sqrt(np.diag(np.linalg.inv(information))))
    size = np.sqrt(np.mean(np.square(apart), axis=0))
    # Of 40 values, 0.65 to 1.35 are three standard errors; that no noise is slow, a run can't tell.
    assert np.all((size > (0.65 if walk else 0.3)) & (size < 1.35)), size


def test_where_rows_tell_no_noise_it_is_white() -> None:
    rows = rows_of(np.random.default_rng(0), 0.05, 0.0, count=8)
    noise = runs_noise(rows, 0.3)
    assert (noise.model.B, noise.model.K) == (0.0, 0.0)
    told = noise.triangles(rows, columns_of(rows))[0, :, :-1]
    np.testing.assert_allclose(told.T @ told, columns_of(rows).T @ columns_of(rows) / 0.3**2, rtol=1e-9)


def test_a_shift_is_weighed_by_the_likelihood_of_runs() -> None:
    """One constant: of each unit the differences of its runs' means are normal, their variances known."""
    rng = np.random.default_rng(5)
    units, means, errors = [], [], []
    for count in (2, 3, 1, 4):
        error = rng.uniform(0.05, 0.3, size=count)
        mean = rng.normal() + np.hypot(error, 0.4) * rng.normal(size=count)
        triangles = np.zeros((count, 2, 2))
        triangles[:, 0] = np.column_stack([1.0 / error, mean / error])
        units.append(triangles)
        means.append(mean)
        errors.append(error)
    sizes = 0.3 * np.exp(np.linspace(-4.0, 4.0, 2001))
    beliefs = []
    for size in sizes:
        logarithm = -0.5 * np.log(size / 0.3) ** 2
        for mean, error in zip(means, errors, strict=True):
            if len(mean) > 1:
                covariance = np.diag(error**2 + size**2)
                apart = np.diff(np.eye(len(mean)), axis=0)
                logarithm += multivariate_normal(cov=apart @ covariance @ apart.T).logpdf(apart @ mean)
        beliefs.append(np.exp(logarithm) / size)
    wanted = np.trapezoid(beliefs * sizes, sizes) / np.trapezoid(beliefs, sizes)
    assert shift_of_runs(units, 0.3, 1.0) == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize("size", [0.3, 1.0, 3.0])
def test_the_size_of_noise_as_slow_as_others_is_found(size: float) -> None:
    found = []
    others = NoiseModel(0.05 * np.sqrt(STEP_S) / 60.0, K=0.02 * np.sqrt(3600.0 / STEP_S))
    for seed in range(6):
        rows = rows_of(np.random.default_rng([seed, 9]), 0.05, 0.02 * size)
        noise = runs_noise(rows, 0.05).like_others(rows, others, 0.8)
        assert noise.model.B == 0.0
        found.append(noise.model.K / others.K)
    # 200 rows tell the size of a walk above the white noise to a sixth, six tables to a fifteenth.
    assert np.median(found) == pytest.approx(size, rel=0.3), found


def test_a_column_that_never_moves_says_nothing_of_the_noise() -> None:
    rows = rows_of(np.random.default_rng(1), 0.05, 0.02)
    beside = table(np.column_stack([rows.X, np.full(len(rows), 7.0)]), rows.y)
    others = NoiseModel(0.05 * np.sqrt(STEP_S) / 60.0, K=0.02 * np.sqrt(3600.0 / STEP_S))
    found = [runs_noise(t, 0.05).like_others(t, others, 0.8).model.K for t in (rows, beside)]
    assert found[1] == pytest.approx(found[0], rel=0.01)
