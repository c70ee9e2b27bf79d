"""Cases of the drift track: legs of the recordings that ship, and synthetic units of every reality."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from fogml.benchmark.design import RoundDesign
from fogml.blind.folders import BlindFolder, case_files
from fogml.blind.make import make_cases
from fogml.blind.plan import MIX
from fogml.blind.truth import read_truth
from fogml.runs.reading import read_run
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run
from fogml.runs.writing import write_run
from fogml.signals.averages import block_averages


@dataclass(frozen=True)
class DriftCase:
    """One training and one test.

    Attributes
    ----------
    group, label
        Which data it is of, and what tells it from the others of its group.
    train, test
        Runs.
    averaging_s
        Of its figures [s].
    """

    group: str
    label: str
    train: tuple[Run, ...]
    test: Run
    averaging_s: float


def real_cases(design: RoundDesign) -> Iterator[DriftCase]:
    """Legs of the thermal cycle and thirds of the cold start, three axes of MEMS units each."""
    for axis in "xyz":
        runs = {leg: shipped_run(f"thermal-cycle-{leg}-{axis}") for leg in "123"}
        for train, test in design.cycle_pairs:
            label = f"{axis}, {' + '.join(train)} → {test}"
            averaging_s = design.cycle_averaging_rows * runs[test].sample_s
            yield DriftCase(
                "thermal cycle, MEMS", label, tuple(runs[k] for k in train), runs[test], averaging_s
            )
    for axis in "xyz":
        run = _averaged(shipped_run(f"cold-start-{axis}"), design.cold_sample_s)
        edges = np.linspace(0, len(run), 4).astype(int)
        thirds = [run[low:high] for low, high in pairwise(edges.tolist())]
        for parts, held in design.cold_pairs:
            label = f"{axis}, thirds {' + '.join(str(k + 1) for k in parts)} → {held + 1}"
            trained = tuple(thirds[k] for k in parts)
            yield DriftCase("cold start, MEMS", label, trained, thirds[held], design.cold_averaging_s)


def _averaged(run: Run, window_s: float) -> Run:
    names = [name for name in run.columns if name != "time"]
    means = block_averages(run.time, *(run.columns[name] for name in names), window_s=window_s)
    return Run(run.name, {"time": means.time_s, **dict(zip(names, means.values))}, run.facts)


def synthetic_cases(
    count: int, seed: int, scratch: Path, workers: int, design: RoundDesign
) -> Iterator[DriftCase]:
    """Units of the realities in turn, with the causes that the design tells."""
    if not count:
        return
    make_cases(
        scratch,
        count,
        seed,
        design.sample_s,
        workers,
        design.drift_kinds,
        of=MIX,
        d_prime=(design.drift_d_prime,),
    )
    suite = BlindFolder(scratch)
    for name in suite.names():
        reality = read_truth(suite.truth / f"{name}.json").reality
        files = case_files(suite.cases / name)
        train = tuple(read_run(path) for path in files.fit)
        yield DriftCase(
            f"synthetic, {reality} reality", name, train, read_run(files.held_out[0]), design.averaging_s
        )


def write_case(case: DriftCase, handout: Path, kept: Path) -> None:
    """Write the runs of a case; the test run without its output into `handout`, whole into `kept`."""
    for folder in (handout, kept):
        folder.mkdir(parents=True)
    for number, run in enumerate(case.train, start=1):
        write_run(run, handout / f"fit-{number}.csv")
    write_run(case.test.with_columns(gyro=np.zeros(len(case.test))), handout / "held-out-1.csv")
    write_run(case.test, kept / "held-out-1.csv")
