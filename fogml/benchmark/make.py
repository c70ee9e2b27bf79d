"""Making a round: cases (legs of recordings that ship, synthetic units), what is kept, the hashes between."""

from __future__ import annotations

import hashlib
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np

import fogml
from fogml.benchmark.rounds import (
    DESIGN,
    RULES,
    SCHEMA,
    SEED,
    TRACKS,
    RoundDesign,
    Track,
    TrackFolder,
    commitment,
)
from fogml.blind.folders import BlindFolder, case_files
from fogml.blind.make import make_cases
from fogml.blind.plan import MIX
from fogml.blind.relatives import leave_out_relatives
from fogml.blind.run import case_stamp
from fogml.blind.truth import read_truth
from fogml.errors import InputError
from fogml.json_files import write_json
from fogml.outputs import scratch_folder, whole_folder
from fogml.runs.reading import read_run
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run
from fogml.runs.writing import write_run
from fogml.settings_check import check_whole
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


_APART = 7
"""Of the drift track's seed from the diagnosis track's, whose held-out runs are handed out whole."""
_SECRET_BITS = 62
"""Of a drawn seed: as large as a number of JSON may be; each guess would take the making of a case."""


def make_round(
    directory: str | Path,
    *,
    seed: int = SEED,
    closed: bool = False,
    drift: int = 12,
    diagnosis: int = 12,
    real: bool = True,
    design: RoundDesign = DESIGN,
    workers: int = 2,
    step: Callable[[str], None] = lambda words: None,
) -> dict[str, Any]:
    """Make a round in a folder; what its ``round.json`` holds.

    Parameters
    ----------
    directory
        Folder that holds no round yet.
    seed
        Of all synthetic cases, where the round is open.
    closed
        Draw seed and salt from the system instead: they stand in ``kept/key.json`` alone.
    drift, diagnosis
        Synthetic cases of each track.
    real
        Whether the drift track has the real legs.
    design
        What cases are drawn from.
    workers
        Processes.
    step
        Told what is being made.

    Raises
    ------
    InputError
        If a number is not possible, or the folder holds a round.
    """
    for number, name in ((drift, "drift"), (diagnosis, "diagnosis"), (seed, "seed")):
        check_whole(name, number)
    check_whole("workers", workers, 1)
    if drift < (not real) or diagnosis < 1:
        raise InputError("a round needs a case of each track at least: --drift, --diagnosis, --real")
    _check_free(Path(directory))
    if closed:
        seed = secrets.randbits(_SECRET_BITS)
    with scratch_folder() as scratch:
        step("drift cases")
        made = list(synthetic_cases(drift, seed + _APART, scratch / "drift", workers, design))
        step("diagnosis cases")
        suite = BlindFolder(scratch / "diagnosis")
        least = design.least_d_prime
        make_cases(suite.path, diagnosis, seed, design.sample_s, workers, None, least_d_prime=least, of=MIX)
        leave_out_relatives(suite, workers)
        drawn = chain(real_cases(design) if real else (), made)
        return write_round(directory, drawn, suite, seed, closed=closed, design=design)


def write_round(
    directory: str | Path,
    drift: Iterable[DriftCase],
    suite: BlindFolder,
    seed: int,
    *,
    closed: bool = False,
    design: RoundDesign = DESIGN,
) -> dict[str, Any]:
    """Write a round of any drift cases, a laboratory's own among them, and a blind suite of any reality.

    Parameters
    ----------
    directory
        Folder that holds no round yet.
    drift
        Cases of the drift track.
    suite
        Cases and truths of the diagnosis track; they are copied.
    seed
        Stated where the round is open.
    closed
        Whether seed and salt are kept.
    design
        What the cases are of; the scorer reads ``settling_s`` from it.

    Raises
    ------
    InputError
        If the folder holds a round.
    """
    home = Path(directory)
    _check_free(home)
    salt = (
        secrets.token_hex(32) if closed else hashlib.sha256(f"fogml open round {seed}".encode()).hexdigest()
    )
    with whole_folder(home) as staging:
        folders = {track: TrackFolder(staging, track) for track in TRACKS}
        told: dict[Track, dict[str, Any]] = {"drift": {}, "diagnosis": {}}
        for number, case in enumerate(drift, start=1):
            name = f"{number:04d}"
            write_case(case, folders["drift"].cases / name, folders["drift"].truth / name)
            about = {"group": case.group, "label": case.label, "averaging_s": case.averaging_s}
            told["drift"][name] = about
        for source, target in (
            (suite.cases, folders["diagnosis"].cases),
            (suite.truth, folders["diagnosis"].truth),
        ):
            shutil.copytree(source, target)
        for name in suite.names():
            told["diagnosis"][name] = {"group": read_truth(suite.truth / f"{name}.json").reality}
        for track, folder in folders.items():
            for name, values in told[track].items():
                values["files_sha256"] = case_stamp(folder.cases / name)
                values["answer_sha256"] = commitment(salt, folder.kept(name))
        values = {
            "schema": SCHEMA,
            "version": fogml.__version__,
            "seed": None if closed else seed,
            "closed": closed,
            "rules": list(RULES),
            "design": design.stated(),
            "tracks": told,
        }
        write_json(staging / "handout" / "round.json", values, indent=1)
        write_json(staging / "kept" / "key.json", {"seed": seed, "salt": salt}, indent=1)
    return values


def _check_free(home: Path) -> None:
    if (home / "handout").exists():
        raise InputError(f"{home}: holds a round already; choose another folder")
