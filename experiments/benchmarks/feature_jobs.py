"""Features beside plain numpy and pandas."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from experiments.benchmarks.chamber import chamber_run
from experiments.benchmarks.harness import Job, Work
from fogml.arrays import FloatArray

TEXT = "T, dT, T*dT, T_in-T_out, d(T_in-T_out)"
_WINDOW = 64


def pandas_rate(x: FloatArray) -> FloatArray:
    """Mean of the newest 64 samples less that of the 64 before, per minute at 1 Hz; pandas."""
    import pandas

    means = pandas.Series(x).rolling(_WINDOW).mean()
    return np.asarray((means - means.shift(_WINDOW)) * 60.0 / _WINDOW)


def numpy_rate(x: FloatArray) -> FloatArray:
    """The same by cumulative sums."""
    sums = np.concatenate(([0.0], np.cumsum(x - x[0])))
    means = (sums[_WINDOW:] - sums[:-_WINDOW]) / _WINDOW
    rate = np.full(len(x), np.nan)
    rate[2 * _WINDOW - 1 :] = (means[_WINDOW:] - means[:-_WINDOW]) * 60.0 / _WINDOW
    return rate


PLAIN = {"pandas": pandas_rate, "numpy": numpy_rate}
WORDS = {"pandas": "pandas: rolling means", "numpy": "numpy: cumulative sums"}


def _work(rate: Callable[[FloatArray], FloatArray], samples: int, quick: bool, folder: Path) -> Work:
    from fogml.features.features import Features

    run = chamber_run(20_000 if quick else samples, seed=3)

    def ours() -> FloatArray:
        # A fresh view, so that nothing kept with a run from the turn before helps.
        return Features(TEXT).transform(run[:])

    def plain() -> FloatArray:
        inner = run.columns["T_in"]
        gradient = inner - run.columns["T_out"]
        slope = rate(inner)
        return np.column_stack((inner, slope, inner * slope, gradient, rate(gradient)))

    def check(a: FloatArray, b: FloatArray) -> str:
        full = slice(2 * _WINDOW, None)
        # The plain way's cumulative sums lose digits as they grow.
        np.testing.assert_allclose(a[full], b[full], atol=max(1e-7, 1e-13 * len(a)))
        return f"{a.shape[1]} columns to {np.max(np.abs(a[full] - b[full])):.0e}"

    return Work(ours, plain, check)


def _job(size: str, plain: str) -> Job:
    samples = int(float(size))
    name = "features" + ("" if size == "1e6" else f"-{size}") + ("" if plain == "pandas" else f"-{plain}")
    return Job(
        name,
        f"features, {samples:,} samples: T, dT, T*dT, gradient and its rate",
        "Features.transform",
        WORDS[plain],
        partial(_work, PLAIN[plain], samples),
        limit_s=0.1 if name == "features" else None,
    )


FEATURE_JOBS = tuple(_job(size, plain) for size in ("1e6", "1e7") for plain in PLAIN)
