"""What is watched: a fixed small job each, and what is counted of it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from experiments.synthetic_world import World, cycle
from experiments.watch.counting import calls, modules_loaded, peak_bytes
from fogml.export.c_program import cortex_m4_size, instructions_per_sample
from fogml.export.c_source import c_source
from fogml.export.plan import Plan
from fogml.features.features import Features
from fogml.models.compensation import compensate_blocks
from fogml.models.names import make_model
from fogml.runs.reading import read_run
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from fogml.signals.allan import allan_deviation
from fogml.validation.judge import judge

FEATURES = "T^1..3, dT, T*dT"
ROWS, FEW = 40_000, 10_000
COARSE_S = 20.0
Job = Callable[[], Any]
Measure = Callable[[Path], float | None]


@dataclass(frozen=True)
class Watched:
    """One figure: what it is of, its unit, and how it is counted; None where a tool is missing."""

    words: str
    unit: str
    measure: Measure


def _modules(name: str, folder: Path) -> int:
    return modules_loaded(f"import {name}")


def unit_run(sample_s: float = 1.0, rows: int | None = None, seed: int = 1) -> Run:
    """A synthetic unit of one thermometer through a chamber cycle, held at its end up to so many rows."""
    hours = None if rows is None else rows * sample_s / 3600.0
    made, _ = World(noise=0.1).run(cycle(1.0, sample_s, hours), sample_s, seed, "run.csv")
    return Run("run.csv", {"time": made.time, "gyro": made.gyro, "T": made.columns["T_in"]})


def _bytes(run: Run) -> int:
    return sum(column.nbytes for column in run.columns.values())


def _per_byte(job: Callable[[Run], Any], folder: Path) -> float:
    """Peak over the bytes of the run's own columns."""
    run = unit_run(rows=ROWS)
    job(run)  # what is loaded or compiled once is not the job's
    fresh = unit_run(rows=ROWS)
    return peak_bytes(lambda: job(fresh)) / _bytes(fresh)


def _growth(
    of: Callable[[Callable[[], Any]], int], prepare: Callable[[int, Path], Any], folder: Path
) -> float:
    """What is counted of a job on all rows over that on a quarter of them."""
    prepare(FEW, folder)()
    few, many = (of(prepare(rows, folder)) for rows in (FEW, ROWS))
    return many / few


def _reading(rows: int, folder: Path) -> Job:
    path = folder / f"run-{rows}.csv"
    write_run(unit_run(rows=rows), path)
    return lambda: read_run(path)


def _compensating(rows: int, folder: Path) -> Job:
    model, run = _polynomial(), unit_run(rows=rows)
    blocks = [run[at : at + 4096] for at in range(0, rows, 4096)]
    return lambda: [None for _ in compensate_blocks(model, blocks)]


def _polynomial() -> Any:
    return make_model("polynomial", FEATURES).fit(unit_run(COARSE_S))


def _fitting(name: str, features: str | None, folder: Path) -> int:
    runs = [unit_run(COARSE_S, seed=seed) for seed in (1, 2)]
    make_model(name, features).fit(runs)  # loads and compiles
    again = [unit_run(COARSE_S, seed=seed) for seed in (1, 2)]
    return calls(lambda: make_model(name, features).fit(again))


def _judging(folder: Path) -> int:
    model, train, test = _polynomial(), unit_run(COARSE_S), unit_run(COARSE_S, seed=3)
    return calls(lambda: judge(model, train, test))


def _c(what: str, folder: Path) -> float | None:
    source = c_source(Plan.of(_polynomial(), 1.0), "float32", [])
    place = folder / what
    place.mkdir()
    if what == "instructions":
        return instructions_per_sample(source, place)
    sizes = cortex_m4_size(source, place)
    return None if sizes is None else float(sizes[what])


WATCHED: dict[str, Watched] = {
    "import_modules": Watched("modules that `import fogml` loads", "", partial(_modules, "fogml")),
    "program_modules": Watched(
        "modules that the program loads before a command",
        "",
        partial(_modules, "fogml.cli.main"),
    ),
    "read_growth": Watched(
        "reading CSV: calls at 40,000 rows over 10,000", "×", partial(_growth, calls, _reading)
    ),
    "read_peak": Watched(
        "reading CSV: peak memory at 40,000 rows over 10,000", "×", partial(_growth, peak_bytes, _reading)
    ),
    "compensate_growth": Watched(
        "compensating in blocks: calls at 40,000 rows over 10,000",
        "×",
        partial(_growth, calls, _compensating),
    ),
    "compensate_peak": Watched(
        "compensating in blocks: peak memory at 40,000 rows over 10,000",
        "×",
        partial(_growth, peak_bytes, _compensating),
    ),
    "features_peak": Watched(
        "features T, dT, T*dT: peak memory over the run's",
        "×",
        partial(_per_byte, lambda run: Features("T, dT, T*dT").transform(run)),
    ),
    "allan_peak": Watched(
        "Allan deviation in octaves: peak memory over the run's",
        "×",
        partial(_per_byte, lambda run: allan_deviation(run.gyro, 1.0, 2.0 ** np.arange(12))),
    ),
    "polynomial_peak": Watched(
        "training a polynomial: peak memory over the run's",
        "×",
        partial(_per_byte, lambda run: make_model("polynomial", FEATURES).fit(run)),
    ),
    "polynomial_calls": Watched(
        "training a polynomial on two runs", "calls", partial(_fitting, "polynomial", FEATURES)
    ),
    "auto_calls": Watched("training auto on two runs", "calls", partial(_fitting, "auto", None)),
    "judge_calls": Watched("judging a model on two runs", "calls", _judging),
    "c_instructions": Watched(
        "exported C, polynomial in float32: a sample on a Cortex-M4",
        "instructions",
        partial(_c, "instructions"),
    ),
    "c_flash": Watched("the same: flash", "byte", partial(_c, "flash_bytes")),
    "c_ram": Watched("the same: RAM", "byte", partial(_c, "ram_bytes")),
}
"""Every figure; more is worse in each."""


def measured() -> dict[str, float | None]:
    """Every figure of the code in force; peaks last, since tracing of memory goes on and slows the others."""
    order = sorted(WATCHED, key=lambda key: key.endswith("_peak"))
    with tempfile.TemporaryDirectory(prefix="fogml-watch-") as folder:
        found = {key: WATCHED[key].measure(Path(folder)) for key in order}
    return {key: found[key] for key in WATCHED}
