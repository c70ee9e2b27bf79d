"""Jobs within one process: Allan deviation, reading, features, training."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.benchmarks.chamber import chamber_run, four_sensor_run
from experiments.benchmarks.harness import Job, Work

FloatArray = NDArray[np.float64]


def _allan(taus: FloatArray | None, samples: int) -> Work:
    from fogml.signals.allan import allan_deviation

    rng = np.random.default_rng(1)
    x = 15.0 + rng.standard_normal(samples)
    # The longest of 10 million samples is a third of them; allantools gives no value of one difference.
    times = None if taus is None else taus[taus < samples / 3]

    def ours() -> tuple[FloatArray, FloatArray]:
        found = allan_deviation(x, 1.0, times)
        return found.taus_s, found.adev

    def plain() -> tuple[FloatArray, FloatArray]:
        import allantools

        taus_s, adev, _, _ = allantools.oadev(
            x, rate=1.0, data_type="freq", taus="octave" if times is None else times
        )
        return taus_s, adev

    def check(a: tuple[FloatArray, FloatArray], b: tuple[FloatArray, FloatArray]) -> str:
        np.testing.assert_array_equal(a[0], b[0])
        np.testing.assert_allclose(a[1], b[1], rtol=1e-9)
        return f"{len(a[0])} deviations to {np.max(np.abs(a[1] / b[1] - 1)):.1e}"

    return Work(ours, plain, check)


def _allan_octaves(quick: bool, folder: Path) -> Work:
    return _allan(None, 50_000 if quick else 10_000_000)


def _allan_200(quick: bool, folder: Path) -> Work:
    return _allan(np.geomspace(1, 3.3e6, 200), 50_000 if quick else 10_000_000)


def _csv(quick: bool, folder: Path) -> Work:
    import pyarrow as pa
    import pyarrow.csv

    from fogml.runs.reading import read_run

    run = chamber_run(20_000 if quick else 1_000_000, seed=2)
    columns = {
        "time [s]": run.time,
        "gyro [deg/h]": np.round(run.gyro, 5),
        "T_in [degC]": np.round(run.columns["T_in"], 4),
        "T_out [degC]": np.round(run.columns["T_out"], 4),
        "rate [deg/s]": np.zeros(len(run)),
        "power [W]": np.round(5.0 + 0.01 * run.columns["T_in"], 3),
    }
    path = folder / "run.csv"
    options = pyarrow.csv.WriteOptions(quoting_style="none")
    pyarrow.csv.write_csv(pa.table(columns), path, options)

    def ours() -> FloatArray:
        return read_run(path).gyro

    def plain() -> FloatArray:
        import pandas

        return np.asarray(pandas.read_csv(path)["gyro [deg/h]"])

    def check(a: FloatArray, b: FloatArray) -> str:
        np.testing.assert_array_equal(a, b)
        return f"gyro, {len(a)} rows, digit by digit"

    return Work(ours, plain, check)


def _features(text: str, quick: bool) -> Work:
    from fogml.features.features import Features

    run = chamber_run(20_000 if quick else 1_000_000, seed=3)

    def ours() -> FloatArray:
        # A fresh view, so that nothing kept with a run from the turn before helps.
        return Features(text).transform(run[:])

    def plain() -> FloatArray:
        import pandas

        inner = pandas.Series(run.columns["T_in"])
        means = inner.rolling(64).mean()
        rate = np.asarray((means - means.shift(64)) / (64.0 / 60.0))
        gradient = pandas.Series(run.columns["T_in"] - run.columns["T_out"])
        means = gradient.rolling(64).mean()
        gradient_rate = np.asarray((means - means.shift(64)) / (64.0 / 60.0))
        t = run.columns["T_in"]
        return np.column_stack((t, rate, t * rate, gradient, gradient_rate))

    def check(a: FloatArray, b: FloatArray) -> str:
        full = slice(128, None)
        np.testing.assert_allclose(a[full], b[full], atol=1e-8)
        return f"{a.shape[1]} columns to {np.max(np.abs(a[full] - b[full])):.0e}"

    return Work(ours, plain, check)


def _features_default(quick: bool, folder: Path) -> Work:
    return _features("T, dT, T*dT, T_in-T_out, d(T_in-T_out)", quick)


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
        assert off < 1e-3, off
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
        "multipoint-5-3 fitted to a run",
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
    Job(
        "csv",
        "CSV, 1,000,000 rows × 6",
        "read_run, with every check",
        "pandas.read_csv",
        _csv,
        limit_s=0.5,
    ),
    Job(
        "features",
        "features, 1,000,000 samples: T, dT, T*dT, gradient and its rate",
        "Features.transform",
        "pandas: rolling means",
        _features_default,
        limit_s=0.1,
    ),
    Job(
        "allan-octaves",
        "Allan deviation, 10,000,000 samples, octaves",
        "allan_deviation, with intervals",
        "allantools.oadev",
        _allan_octaves,
        least_ratio=6.0,
        memory=True,
    ),
    Job(
        "allan-200",
        "Allan deviation, 10,000,000 samples, 200 times",
        "allan_deviation, with intervals",
        "allantools.oadev",
        _allan_200,
        least_ratio=6.0,
    ),
)
