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
Prepared = tuple[Callable[[], Any], float, float]


@dataclass(frozen=True)
class Step:
    """A job at any size.

    Attributes
    ----------
    name
        What is done.
    prepare
        ``prepare(samples, folder)`` gives the job and the least that it must do: bytes moved to and
        from memory, and floating-point operations that products of matrices do.
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
    return lambda: Features(TEXT).transform(run[:]), 8.0 * (2 + 5) * samples, 0.0


def _allan(samples: int, folder: Path) -> Prepared:
    from fogml.signals.allan import allan_deviation

    x = np.random.default_rng(1).standard_normal(samples)
    taus = 2.0 ** np.arange(13)
    return lambda: allan_deviation(x, 1.0, taus), 8.0 * samples, 0.0


def _csv(samples: int, folder: Path) -> Prepared:
    from fogml.runs.reading import read_run
    from fogml.runs.writing import write_run

    path = folder / f"run-{samples}.csv"
    write_run(chamber_run(samples, seed=2), path)
    return lambda: read_run(path), float(path.stat().st_size + 8 * 4 * samples), 0.0


def _parquet(samples: int, folder: Path) -> Prepared:
    from fogml.runs.reading import read_run
    from fogml.runs.writing import write_run

    path = folder / f"run-{samples}.parquet"
    write_run(chamber_run(samples, seed=2), path)
    return lambda: read_run(path), float(path.stat().st_size + 8 * 4 * samples), 0.0


def _polynomial(samples: int, folder: Path) -> Prepared:
    from fogml.models.names import make_model

    run = four_sensor_run(samples, seed=4)
    # Normal equations of 33 columns: a product and a sum for each pair, by symmetry half of them.
    return lambda: make_model("multipoint-5-3").fit(run[:]), 8.0 * 5 * samples, 33.0**2 * samples


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
    return (
        lambda: RBFRegressor(centres=_CENTRES).fit(X, run.gyro),
        8.0 * 4 * samples,
        float(width**2 * samples),
    )


def _evaluation(samples: int, folder: Path) -> Prepared:
    from fogml.models.regressors import predict_rows

    network, X = _network()
    columns = np.resize(X, (samples, 3))
    # Distances by products of 3 and the weighted sum; the exponential is not counted.
    return lambda: predict_rows(network, columns), 8.0 * 4 * samples, 2.0 * (3 + 1) * _CENTRES * samples


def _simulation(samples: int, folder: Path) -> Prepared:
    from experiments.benchmarks.twin_jobs import _COLUMNS, _everything, _programme
    from fogml.twin.simulate import simulate

    programme, twin = _programme(), _everything()
    sample_s = programme.total_s / samples
    bytes_moved = 16.0 * len(twin.settings) * samples
    return lambda: simulate(programme, twin, sample_s=sample_s, columns=_COLUMNS), bytes_moved, 0.0


STEPS = (
    Step("features: T, dT, T*dT, gradient and its rate", _features, "two columns read, five written", True),
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
    """Bandwidth of a copy into used and into new memory [GB/s], bytes both ways; GEMM, float64 [Gflop/s]."""
    count = 1_000_000 if quick else 32_000_000
    source = np.ones(count)
    target = np.empty_like(source)
    copied = statistics.median(_spent(lambda: np.copyto(target, source), repeats))
    renewed = statistics.median(_spent(source.copy, repeats))
    n = 200 if quick else 1500
    a = np.random.default_rng(0).standard_normal((n, n))
    multiplied = statistics.median(_spent(lambda: a @ a, repeats))
    return {
        "copy_gb_s": 16.0 * count / copied / 1e9,
        "fresh_gb_s": 16.0 * count / renewed / 1e9,
        "gemm_gflop_s": 2.0 * n**3 / multiplied / 1e9,
    }


def measure(quick: bool, repeats: int, folder: Path) -> dict[str, Any]:
    """Time each step at every size, sizes in turn."""
    sizes = QUICK_SIZES if quick else SIZES
    limits = machine_limits(quick, repeats)
    rows = []
    for step in QUICK_STEPS if quick else STEPS:
        prepared = {size: step.prepare(size, folder) for size in sizes}
        spent: dict[int, list[float]] = {size: [] for size in sizes}
        for job, _, _ in prepared.values():
            job()
        for turn in range(repeats):
            for size in sizes if turn % 2 == 0 else sizes[::-1]:
                begin = time.perf_counter()
                prepared[size][0]()
                spent[size].append(time.perf_counter() - begin)
        _, moved, flops = prepared[sizes[-1]]
        bandwidth = limits["fresh_gb_s" if step.fresh else "copy_gb_s"]
        rows.append(
            {
                "name": step.name,
                "bound": step.bound,
                "sizes": list(sizes),
                "seconds": [spent[size] for size in sizes],
                "bytes": moved,
                "flops": flops,
                "limit_s": max(moved / bandwidth, flops / limits["gemm_gflop_s"]) / 1e9,
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
    lines = [
        f"Measured here: copying moves {machine['copy_gb_s']:.3g} GB/s (bytes read and written), into new "
        f"memory {machine['fresh_gb_s']:.3g} GB/s, which counts where the results are new arrays; GEMM in "
        f"float64 "
        f"does {machine['gemm_gflop_s']:.3g} Gflop/s. The limit is the greater of the least bytes and the "
        f"least "
        f"operations at these speeds. Exponent of time in samples, fitted from "
        f"{found['rows'][0]['sizes'][0]:,} to "
        f"{found['rows'][0]['sizes'][-1]:,}; wanted {WANTED:.1f} ± {WITHIN:.1f}. A fixed cost makes it "
        f"smaller: that "
        "of the RBF's tuning is spent on averages whose number does not grow.",
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
        f"Features are wanted within {FEATURES_WITHIN:g} times of the limit: {ratio:.2g}, {met}. They "
        f"pass over "
        "the data several times: sums, two window means, gaps and full windows, then products column by "
        "column.",
    ]
    return "\n".join(lines)


LIMIT_STUDIES = (
    Study("limits", "distance from the machine's limits, and growth with samples", measure, page),
)
