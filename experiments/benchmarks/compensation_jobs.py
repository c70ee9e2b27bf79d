"""Jobs over a Parquet file too large for memory: ``fogml compensate`` beside numpy and pyarrow."""

from __future__ import annotations

import atexit
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from experiments.benchmarks.chamber import chamber_run
from experiments.benchmarks.harness import Job, Timed, Work, run_python
from fogml.arrays import FloatArray

_ROWS = 100_000_000
_QUICK_ROWS = 200_000
_GROUP = 1_000_000
_PLAIN_SHARE = 20
"""The plain way streams, so its time goes with the rows; at full size it is timed on this part of them."""
_COMMAND = "import sys; from fogml.cli.main import main; sys.argv[0] = 'fogml'; main()"


@cache
def _folder() -> Path:
    """Where long runs lie until the process ends."""
    folder = tempfile.TemporaryDirectory(prefix="fogml-long-run-")
    atexit.register(folder.cleanup)
    return Path(folder.name)


@cache
def _long_run(rows: int) -> Path:
    """A run of `rows` at 100 Hz, group by group: one chamber run after another on a running clock.

    It is made once for all jobs of a process: that takes longer than compensating it.
    """
    import pyarrow as pa
    import pyarrow.parquet as parquet

    # A length that joins smoothly: the ten-hour cycle begins and ends in the same soak.
    cycle = chamber_run(min(rows, 3_600_000), seed=7, sample_s=0.01)
    schema = pa.schema([(name, pa.float64()) for name in ("time [s]", "gyro [deg/h]", "T [degC]")])
    path = _folder() / f"run-{rows}.parquet"
    # Values hardly repeat: looking for a dictionary of them takes four times as long as writing them.
    with parquet.ParquetWriter(path, schema, use_dictionary=False) as writer:
        for first in range(0, rows, _GROUP):
            index = np.arange(first, min(first + _GROUP, rows))
            place = index % len(cycle)
            values = (0.01 * index, cycle.gyro[place], cycle.columns["T_in"][place])
            writer.write_table(pa.table(dict(zip(schema.names, values)), schema=schema))
    return path


def _plain(source: Path, target: Path, value: Callable[[FloatArray], FloatArray], most: int) -> int:
    """Stream up to `most` rows: T, block difference of 64 s, product, `value` of them, subtract, write."""
    import pyarrow as pa
    import pyarrow.parquet as parquet

    window = 6400
    before = np.empty(0)
    rows = 0
    file = parquet.ParquetFile(source)
    schema = pa.schema(
        [*file.schema_arrow, ("drift [deg/h]", pa.float64()), ("gyro_compensated [deg/h]", pa.float64())]
    )
    with parquet.ParquetWriter(target, schema) as writer:
        for batch in file.iter_batches(_GROUP):
            clock, gyro, temperature = (column.to_numpy() for column in batch.columns)
            joined = np.concatenate((before, temperature))
            sums = np.concatenate(([0.0], np.cumsum(joined - joined[0])))
            means = (sums[window:] - sums[:-window]) / window
            rate = np.zeros(len(joined))
            if len(joined) >= 2 * window:
                rate[2 * window - 1 :] = (means[window:] - means[:-window]) * 60 / 64
            rate = rate[len(before) :]
            drift = value(np.column_stack((temperature, rate, temperature * rate)))
            columns = [clock, gyro, temperature, drift, gyro - drift]
            writer.write_batch(pa.record_batch([pa.array(c) for c in columns], schema=schema))
            before = joined[-2 * window :]
            rows += len(clock)
            if rows >= most:
                break
    return rows


def _cubic(x: FloatArray) -> FloatArray:
    t = x[:, 0]
    return np.asarray(((4e-7 * t - 3e-5) * t + 4e-3) * t + 0.2 + 0.12 * x[:, 1] + 1.5e-3 * x[:, 2])


def _network(x: FloatArray) -> FloatArray:
    rng = np.random.default_rng(8)
    scale = np.array([30.0, 1.0, 30.0])
    centres, weights = rng.standard_normal((64, 3)), rng.standard_normal(64)
    scaled = x / scale
    out = np.empty(len(x))
    for first in range(0, len(x), 16_384):
        part = scaled[first : first + 16_384]
        distances = (part**2).sum(axis=1)[:, None] - 2 * part @ centres.T + (centres**2).sum(axis=1)
        out[first : first + 16_384] = np.exp(-distances) @ weights
    return out


def _compensate(name: str, value: Callable[[FloatArray], FloatArray], quick: bool, folder: Path) -> Work:
    import pyarrow.parquet as parquet

    from fogml.models.names import make_model
    from fogml.models.saved import save_model
    from fogml.runs.run import Run

    rows = _QUICK_ROWS if quick else _ROWS
    plain_rows = rows if quick else rows // _PLAIN_SHARE
    source, target = _long_run(rows), folder / "compensated.parquet"
    trained = chamber_run(36_000, seed=7)
    features = "T^1..3, dT, T*dT" if name == "polynomial" else "T, dT, T*dT"
    run = Run.from_columns("train", None, time=trained.time, gyro=trained.gyro, T=trained.columns["T_in"])
    model = make_model(name, features=features).fit(run)
    save_model(model, folder / "model")

    def ours() -> Timed:
        words = ["compensate", str(source), "--model", str(folder / "model"), "-o", str(target), "--quiet"]
        ran = run_python(["-c", _COMMAND, *words], watch_memory=True)
        return Timed(ran.seconds, None, ran.peak_mb)

    def plain() -> Timed:
        begin = time.perf_counter()
        done = _plain(source, folder / "plain.parquet", value, plain_rows)
        return Timed((time.perf_counter() - begin) * rows / done, done)

    def check(a: None, b: int) -> str:
        written = parquet.ParquetFile(target)
        assert written.metadata.num_rows == rows and b == plain_rows
        names = ["time [s]", "gyro [deg/h]", "T [degC]", "drift [deg/h]"]
        head = next(written.iter_batches(50_000, columns=names))
        clock, gyro, temperature, drift = (column.to_numpy() for column in head.columns)
        start = Run.from_columns("start", run.facts, time=clock, gyro=gyro, T=temperature)
        np.testing.assert_allclose(drift, model.predict(start), atol=1e-4)
        timed = "" if plain_rows == rows else f"; the plain way was timed on {plain_rows} rows"
        return f"{rows} rows written; the first 50,000 as predict gives them{timed}"

    return Work(ours, plain, check)


def _polynomial(quick: bool, folder: Path) -> Work:
    return _compensate("polynomial", _cubic, quick, folder)


def _rbf(quick: bool, folder: Path) -> Work:
    return _compensate("rbf", _network, quick, folder)


COMPENSATION_JOBS = (
    Job(
        "compensate-polynomial",
        "compensate, Parquet of 100,000,000 rows, polynomial",
        "fogml compensate, from starting Python to its end",
        "pyarrow and numpy in batches: block difference, cubic, write",
        _polynomial,
        limit_s=15.0,
        limit_mb=1000.0,
        memory=True,
        big=True,
    ),
    Job(
        "compensate-rbf",
        "compensate, Parquet of 100,000,000 rows, RBF",
        "fogml compensate, from starting Python to its end",
        "pyarrow and numpy in batches: block difference, 64 Gaussians, write",
        _rbf,
        limit_s=25.0,
        limit_mb=1000.0,
        memory=True,
        big=True,
    ),
)
