"""Allan deviation beside allantools and avar."""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path

import numpy as np

from experiments.benchmarks.harness import Job, Work
from experiments.benchmarks.needs import needs
from fogml.arrays import FloatArray

Deviations = tuple[FloatArray, FloatArray]
_QUICK = 50_000
LEAST_RATIO = 10.0


def _allantools(x: FloatArray, taus: FloatArray | None) -> Deviations:
    import allantools

    asked = "octave" if taus is None else taus
    taus_s, adev, _, _ = allantools.oadev(x, rate=1.0, data_type="freq", taus=asked)
    return taus_s, adev


def _avar(x: FloatArray, taus: FloatArray | None) -> Deviations:
    import avar

    if taus is None:
        counts = 2 ** np.arange(int(np.log2(len(x) / 2)) + 1)
    else:
        counts = np.unique(np.round(taus).astype(int))
    with redirect_stdout(io.StringIO()):  # It draws a progress bar.
        found = avar.variance(x, counts)
    return counts.astype(float), np.sqrt(found)


PLAIN = {"allantools": _allantools, "avar": _avar}


def _work(
    plain: Callable[[FloatArray, FloatArray | None], Deviations],
    samples: int,
    times: int | None,
    quick: bool,
    folder: Path,
) -> Work:
    from fogml.signals.allan import allan_deviation

    count = min(samples, _QUICK) if quick else samples
    x = 15.0 + np.random.default_rng(1).standard_normal(count)
    # The longest is a third of the run; allantools gives no value of one difference.
    taus = None if times is None else np.geomspace(1, samples / 3.03, times)
    if taus is not None:
        taus = taus[taus < count / 3]

    def ours() -> Deviations:
        found = allan_deviation(x, 1.0, taus)
        return found.taus_s, found.adev

    # avar sums the samples with their mean, so it loses some digits of long series.
    tolerance = 1e-7 if plain is _avar else 1e-9

    def check(a: Deviations, b: Deviations) -> str:
        shared, at_a, at_b = np.intersect1d(a[0], b[0], return_indices=True)
        assert len(shared) >= len(a[0]) - 1, (len(shared), len(a[0]))
        np.testing.assert_allclose(a[1][at_a], b[1][at_b], rtol=tolerance)
        return f"{len(shared)} deviations to {np.max(np.abs(a[1][at_a] / b[1][at_b] - 1)):.1e}"

    return Work(ours, lambda: plain(x, taus), check)


def _job(plain: str, size: str, times: int | None) -> Job:
    samples = int(float(size))
    name = f"allan-{'octaves' if times is None else times}"
    name += ("" if size == "1e7" else f"-{size}") + ("" if plain == "allantools" else f"-{plain}")
    large = size == "1e7" and plain == "allantools"
    return Job(
        name,
        f"Allan deviation, {samples:,} samples, {'octaves' if times is None else f'{times} times'}",
        "allan_deviation, with intervals",
        f"{plain}.{'oadev' if plain == 'allantools' else 'variance'}",
        partial(_work, PLAIN[plain], samples, times),
        least_ratio=LEAST_RATIO if large else None,
        memory=large and times is None,
        missing=needs(plain),
    )


ALLAN_JOBS = tuple(
    _job(plain, size, times) for size in ("1e7", "1e5") for plain in PLAIN for times in (None, 200)
)
