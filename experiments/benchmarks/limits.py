"""How far each job is from what the machine's memory and arithmetic allow, and how its cost grows."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.benchmarks.chamber import chamber_run, four_sensor_run
from experiments.benchmarks.feature_jobs import TEXT
from experiments.benchmarks.study import Study

SIZES = (250_000, 500_000, 1_000_000, 2_000_000, 4_000_000)
QUICK_SIZES = (2_000, 4_000)
WANTED, WITHIN = 1.0, 0.1
"""Wanted exponent of cost in samples, and how far off it may be."""
FEATURES_WITHIN = 2.0
"""Features are wanted within so many times of the limit."""
_CENTRES = 64


@dataclass(frozen=True)
class Prepared:
    """A job made ready, with the least that it must do.

    Attributes
    ----------
    job
        Does it once.
    read, written
        Bytes that come from memory, and bytes of results that go there.
    flops
        Floating-point operations that products of matrices do.
    """

    job: Callable[[], Any]
    read: float
    written: float
    flops: float = 0.0


@dataclass(frozen=True)
class Step:
    """A job at any size.

    Attributes
    ----------
    name
        What is done.
    prepare
        ``prepare(samples, folder)`` makes it ready.
    bound
        What these are, in words.
    fresh
        Whether its results are new memory, which the system has to clear page by page first.
    """

    name: str
    prepare: Callable[[int, Path], Prepared]
    bound: str
    fresh: bool = False


def _features(samples: int, folder: Path) -> Prepared:
    from fogml.features.features import Features

    run = chamber_run(samples, seed=3)
    return Prepared(lambda: Features(TEXT).transform(run[:]), 8.0 * 3 * samples, 8.0 * 5 * samples)


def _allan(samples: int, folder: Path) -> Prepared:
    from fogml.signals.allan import allan_deviation

    x = np.random.default_rng(1).standard_normal(samples)
    taus = 2.0 ** np.arange(13)
    return Prepared(lambda: allan_deviation(x, 1.0, taus), 8.0 * samples, 0.0)


def _csv(samples: int, folder: Path) -> Prepared:
    from fogml.runs.reading import read_run
    from fogml.runs.writing import write_run

    path = folder / f"run-{samples}.csv"
    write_run(chamber_run(samples, seed=2), path)
    return Prepared(lambda: read_run(path), float(path.stat().st_size), 8.0 * 4 * samples)


def _parquet(samples: int, folder: Path) -> Prepared:
    from fogml.runs.reading import read_run
    from fogml.runs.writing import write_run

    path = folder / f"run-{samples}.parquet"
    write_run(chamber_run(samples, seed=2), path)
    return Prepared(lambda: read_run(path), float(path.stat().st_size), 8.0 * 4 * samples)


def _polynomial(samples: int, folder: Path) -> Prepared:
    from fogml.models.names import make_model

    run = four_sensor_run(samples, seed=4)
    # Normal equations of 33 columns: a product and a sum for each pair, by symmetry half of them.
    return Prepared(
        lambda: make_model("multipoint-5-3").fit(run[:]), 8.0 * 5 * samples, 0.0, 33.0**2 * samples
    )


def _network() -> Any:
    from fogml.models.rbf import RBFRegressor

    run = chamber_run(20_000, seed=6)
    t = run.columns["T_in"]
    X = np.column_stack((t, np.gradient(t) * 60.0, t * np.gradient(t) * 60.0))
    return RBFRegressor(centres=_CENTRES).fit(X, run.gyro), X


def _training(samples: int, folder: Path) -> Prepared:
    from fogml.models.rbf import RBFRegressor

    run = chamber_run(samples, seed=6)
    t = run.columns["T_in"]
    rate = np.gradient(t) * 60.0
    X = np.column_stack((t, rate, t * rate))
    # The exact solve on all rows, by symmetry half the products; tuning runs on averages of a fixed number.
    width = _CENTRES + 4
    return Prepared(
        lambda: RBFRegressor(centres=_CENTRES).fit(X, run.gyro),
        8.0 * 4 * samples,
        0.0,
        float(width**2 * samples),
    )


def _evaluation(samples: int, folder: Path) -> Prepared:
    from fogml.models.regressors import predict_rows

    network, X = _network()
    columns = np.resize(X, (samples, 3))
    # Distances by products of 3 and the weighted sum; the exponential is not counted.
    flops = 2.0 * (3 + 1) * _CENTRES * samples
    return Prepared(lambda: predict_rows(network, columns), 8.0 * 3 * samples, 8.0 * samples, flops)


def _simulation(samples: int, folder: Path) -> Prepared:
    from experiments.benchmarks.twin_jobs import _COLUMNS, _everything, _programme
    from fogml.twin.simulate import simulate

    programme, twin = _programme(), _everything()
    sample_s = programme.total_s / samples
    moved = 8.0 * len(twin.settings) * samples
    return Prepared(lambda: simulate(programme, twin, sample_s=sample_s, columns=_COLUMNS), moved, moved)


STEPS = (
    Step(
        "features: T, dT, T*dT, gradient and its rate",
        _features,
        "time and two columns read, five written",
        True,
    ),
    Step("Allan deviation, 13 octaves", _allan, "the series read once"),
    Step("reading CSV, 4 columns", _csv, "the file read, the columns written", True),
    Step("reading Parquet, 4 columns", _parquet, "the file read, the columns written", True),
    Step("polynomial of 33 columns", _polynomial, "normal equations as a product of matrices"),
    Step("RBF training, 64 centres", _training, "the exact solve as a product of matrices"),
    Step("RBF evaluation, 64 centres", _evaluation, "distances and weighted sum; exponentials not counted"),
    Step("simulation, every effect on", _simulation, "each effect added to the output in memory"),
)
QUICK_STEPS = STEPS[:2]


def _spent(job: Callable[[], Any], repeats: int) -> list[float]:
    job()
    spent = []
    for _ in range(repeats):
        begin = time.perf_counter()
        job()
        spent.append(time.perf_counter() - begin)
    return spent


def machine_limits(quick: bool, repeats: int) -> dict[str, float]:
    """Speeds of the machine on one core, but for products of matrices.

    Returns
    -------
    dict
        ``copy_gb_s``: bytes both ways of a copy within memory that is in use. ``fresh_gb_s``: bytes
        written to new memory, whose pages the system finds and clears first. ``gemm_gflop_s``: in
        float64.
    """
    count = 1_000_000 if quick else 32_000_000
    source = np.ones(count)
    target = np.empty_like(source)
    copied = statistics.median(_spent(lambda: np.copyto(target, source), repeats))
    filled = statistics.median(_spent(lambda: np.full(count, 1.0), repeats))
    n = 200 if quick else 1500
    a = np.random.default_rng(0).standard_normal((n, n))
    multiplied = statistics.median(_spent(lambda: a @ a, repeats))
    return {
        "copy_gb_s": 16.0 * count / copied / 1e9,
        "fresh_gb_s": 8.0 * count / filled / 1e9,
        "gemm_gflop_s": 2.0 * n**3 / multiplied / 1e9,
    }


def limit_s(work: Prepared, fresh: bool, machine: Mapping[str, float]) -> float:
    """Least time [s]: of all bytes, of new memory and of operations, whichever takes longest."""
    return max(
        (work.read + work.written) / machine["copy_gb_s"] / 1e9,
        work.written / machine["fresh_gb_s"] / 1e9 if fresh else 0.0,
        work.flops / machine["gemm_gflop_s"] / 1e9,
    )


def measure(quick: bool, repeats: int, folder: Path) -> dict[str, Any]:
    """Time each step at every size, sizes in turn."""
    sizes = QUICK_SIZES if quick else SIZES
    limits = machine_limits(quick, repeats)
    rows = []
    for step in QUICK_STEPS if quick else STEPS:
        prepared = {size: step.prepare(size, folder) for size in sizes}
        spent: dict[int, list[float]] = {size: [] for size in sizes}
        for work in prepared.values():
            work.job()
        for turn in range(repeats):
            for size in sizes if turn % 2 == 0 else sizes[::-1]:
                begin = time.perf_counter()
                prepared[size].job()
                spent[size].append(time.perf_counter() - begin)
        largest = prepared[sizes[-1]]
        rows.append(
            {
                "name": step.name,
                "bound": step.bound,
                "sizes": list(sizes),
                "seconds": [spent[size] for size in sizes],
                "bytes": largest.read + largest.written,
                "flops": largest.flops,
                "limit_s": limit_s(largest, step.fresh, limits),
            }
        )
    return {"machine_limits": limits, "rows": rows}


def exponent(sizes: list[int], seconds: list[float]) -> tuple[float, float]:
    """Slope of log time over log samples, and its standard error."""
    x, y = np.log(sizes), np.log(seconds)
    design = np.column_stack((np.ones_like(x), x))
    found, *_ = np.linalg.lstsq(design, y, rcond=None)
    left = y - design @ found
    spread = np.sum(left**2) / max(len(x) - 2, 1) / np.sum((x - x.mean()) ** 2)
    return float(found[1]), float(np.sqrt(spread))


def page(found: Mapping[str, Any]) -> str:
    """Table of the limits."""
    machine = found["machine_limits"]
    sizes = found["rows"][0]["sizes"]
    lines = [
        f"Measured here: copying within memory in use moves {machine['copy_gb_s']:.3g} GB/s (bytes read and "
        f"written); into new memory, whose pages the system has to find and clear first, go "
        f"{machine['fresh_gb_s']:.3g} GB/s (bytes written); GEMM in float64 does "
        f"{machine['gemm_gflop_s']:.3g} Gflop/s. The limit is the greatest of three times: the least bytes "
        "at the first speed; where results are new arrays, their bytes at the second; the least operations "
        f"at the third. Exponent of time in samples, fitted from {sizes[0]:,} to {sizes[-1]:,}; wanted "
        f"{WANTED:.1f} ± {WITHIN:.1f}. A fixed cost makes it smaller: that of the RBF's tuning is spent on "
        "averages whose number does not grow.",
        "",
        "| job | samples | ours | limit | ours / limit | exponent | at most linear | limit is |",
        "|---|---:|---:|---:|---:|---:|---|---|",
    ]
    for row in found["rows"]:
        medians = [statistics.median(times) for times in row["seconds"]]
        slope, error = exponent(row["sizes"], medians)
        linear = "yes" if slope <= WANTED + WITHIN else "**no**"
        lines.append(
            f"| {row['name']} | {row['sizes'][-1]:,} | {medians[-1]:.3g} s ({min(row['seconds'][-1]):.3g}–"
            f"{max(row['seconds'][-1]):.3g}) | {row['limit_s']:.3g} s | {medians[-1] / row['limit_s']:.3g} "
            f"| {slope:.2f} ± {error:.2f} | {linear} | {row['bound']} |"
        )
    features = found["rows"][0]
    ratio = statistics.median(features["seconds"][-1]) / features["limit_s"]
    met = "met" if ratio <= FEATURES_WITHIN else "**not met**"
    lines += [
        "",
        f"Features are wanted within {FEATURES_WITHIN:g} times of the limit: {ratio:.2g}, {met}. Beyond the "
        "least, each of the two rates takes eight passes within the processor's cache (a difference, six "
        "doublings to sums of 64 samples, a product), of about 0.2 ns a sample each: some 3 ns a sample, "
        "as long as 40 bytes of new memory take at 13 GB/s. The check of the grid, and the product's two "
        "columns, which have left the cache by then, take 1 to 2 ns more.",
    ]
    return "\n".join(lines)


LIMIT_STUDIES = (
    Study("limits", "distance from the machine's limits, and growth with samples", measure, page),
)
