"""Training and least squares within one process."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from experiments.benchmarks.chamber import chamber_run, four_sensor_run
from experiments.benchmarks.harness import Job, Work
from fogml.arrays import FloatArray


def _multipoint_columns(sensors: list[FloatArray]) -> FloatArray:
    """Constant, T^1..5 and rates^1..3 of each sensor, scaled; block differences of 64 samples."""
    columns = [np.ones(len(sensors[0]) - 127)]
    for sensor in sensors:
        sums = np.concatenate(([0.0], np.cumsum(sensor - sensor[0])))
        means = (sums[64:] - sums[:-64]) / 64
        rate = (means[64:] - means[:-64]) * 60 / 64
        for x, order in ((sensor[127:], 5), (rate, 3)):
            centred = (x - x.mean()) / x.std()
            columns += [centred**power for power in range(1, order + 1)]
    return np.column_stack(columns)


def _polynomial(quick: bool, folder: Path) -> Work:
    from fogml.models.names import make_model

    run = four_sensor_run(20_000 if quick else 1_000_000, seed=4)

    def ours() -> FloatArray:
        return make_model("multipoint-5-3").fit(run[:]).predict(run[:200_000])[127:]

    def plain() -> FloatArray:
        columns = _multipoint_columns([run.columns[name] for name in ("T1", "T2", "T3", "T4")])
        weights = np.linalg.lstsq(columns, run.error_deg_h[127:], rcond=None)[0]
        return columns[: 200_000 - 127] @ weights

    def check(a: FloatArray, b: FloatArray) -> str:
        short = min(len(a), len(b))
        off = float(np.sqrt(np.mean((a[:short] - b[:short]) ** 2)))
        # The plain way takes whole windows alone, fogml those as well that are filling.
        assert off < 2e-3, off
        return f"drift, rms difference {off:.0e} deg/h"

    return Work(ours, plain, check)


def _least_squares(quick: bool, folder: Path) -> Work:
    from fogml.models.linear import LinearRegressor

    run = four_sensor_run(20_000 if quick else 1_000_000, seed=5)
    columns = _multipoint_columns([run.columns[name] for name in ("T1", "T2", "T3", "T4")])[:, 1:]
    target = run.gyro[127:]

    def ours() -> FloatArray:
        return LinearRegressor().fit(columns, target).coef_

    def plain() -> FloatArray:
        from sklearn.linear_model import LinearRegression

        return np.asarray(LinearRegression().fit(columns, target).coef_)

    def check(a: FloatArray, b: FloatArray) -> str:
        off = float(np.max(np.abs(columns[:10_000] @ (a - b) - np.mean(columns[:10_000] @ (a - b)))))
        assert off < 1e-6, off
        return f"values to {off:.0e} deg/h"

    return Work(ours, plain, check)


def _rbf(quick: bool, folder: Path) -> Work:
    from fogml.models.rbf import RBFRegressor

    rng = np.random.default_rng(6)
    run = chamber_run(10_000 if quick else 100_000, seed=6)
    t = run.columns["T_in"]
    sums = np.concatenate((np.zeros(64), np.cumsum(t)))
    means = (sums[64:] - sums[:-64]) / np.minimum(np.arange(1, len(t) + 1), 64)
    rate = np.concatenate((np.zeros(64), (means[64:] - means[:-64]) * 60 / 64))
    inputs = np.column_stack((t, rate, t * rate))
    truth = np.tanh(t / 20.0) + 0.3 * np.sin(t / 8.0) + 0.2 * rate + 0.004 * t * rate
    target = truth + 0.05 * rng.standard_normal(len(t))
    centres = 16 if quick else 64

    def ours() -> FloatArray:
        return RBFRegressor(centres=centres).fit(inputs, target).predict(inputs)

    def plain() -> FloatArray:
        from sklearn.kernel_approximation import Nystroem
        from sklearn.linear_model import Ridge
        from sklearn.model_selection import GridSearchCV, KFold
        from sklearn.pipeline import make_pipeline
        from sklearn.preprocessing import StandardScaler

        network = make_pipeline(
            StandardScaler(), Nystroem(n_components=centres, random_state=0), Ridge(alpha=1e-6)
        )
        widths = {"nystroem__gamma": [0.03, 0.1, 0.3, 1.0, 3.0]}
        return np.asarray(GridSearchCV(network, widths, cv=KFold(3)).fit(inputs, target).predict(inputs))

    def check(a: FloatArray, b: FloatArray) -> str:
        errors = [float(np.sqrt(np.mean((values - truth) ** 2))) for values in (a, b)]
        assert errors[0] < 0.05, errors
        return f"rms error against the truth {errors[0]:.4f} ours, {errors[1]:.4f} plain (noise 0.05)"

    return Work(ours, plain, check)


NUMERIC_JOBS = (
    Job(
        "rbf",
        "RBF training, 100,000 × 3, 64 centres, tuning included",
        "RBFRegressor",
        "scikit-learn: Nystroem of 64 and Ridge, five widths by 3-fold GridSearchCV",
        _rbf,
        limit_s=3.0,
        limit_mb=1000.0,
        memory=True,
    ),
    Job(
        "polynomial",
        "polynomial, 1,000,000 × 33, columns built",
        "multipoint-5-3 fitted to a run, with errors of coefficients, an interval and trained limits",
        "numpy: cumulative sums, column_stack, lstsq",
        _polynomial,
        limit_s=0.4,
        memory=True,
    ),
    Job(
        "least-squares",
        "least squares, 1,000,000 × 32, columns given",
        "LinearRegressor",
        "scikit-learn: LinearRegression",
        _least_squares,
    ),
)
