"""What the models are trained on and judged on: real recordings, and twin runs of the source programmes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise, permutations

import numpy as np

from fogml.arrays import FloatArray
from fogml.runs.run import Run
from fogml.twin.twin import Twin

PROGRAMMES = (
    "multi-point-cycle",
    "joint-staircase",
    "ten-degrees-per-hour-down",
    "ten-degrees-per-hour-up",
    "four-positions",
)
"""The programmes of the five source methods."""
NO_RAMP = "four-positions"
TRAINED = {"one rate": (1.0,), "three rates": (0.5, 1.0, 2.0)}
TESTED = {"slower": 0.7, "faster": 1.5}
"""Factors on the ramp rates that the programme states."""
STRETCHES = 3
TWIN = "tactical"


@dataclass(frozen=True)
class Case:
    """One training and one test.

    Attributes
    ----------
    group
        Which table it belongs to.
    labels
        What tells it from the others of its group.
    train, test
        Runs.
    averaging_s
        Of the figures [s].
    noise
        The noise in the test run [deg/h], shape (n,), where it is known.
    """

    group: str
    labels: dict[str, str]
    train: tuple[Run, ...]
    test: Run
    averaging_s: float
    noise: FloatArray | None = None


def thermal_cycle(quick: bool = False) -> Iterator[Case]:
    """Every leg of the real thermal cycle (MEMS) against every other, three axes."""
    from fogml.runs.shipped import shipped_run

    for axis in "x" if quick else "xyz":
        runs = {leg: shipped_run(f"thermal-cycle-{leg}-{axis}") for leg in "123"}
        for train, test in list(permutations(runs, 2))[: 1 if quick else None]:
            labels = {"axis": axis, "train": train, "test": test}
            averaging_s = 20.0 * runs[test].sample_s
            yield Case("thermal cycle", labels, (runs[train],), runs[test], averaging_s)


def cold_start(quick: bool = False) -> Iterator[Case]:
    """Each third of the real cold start (MEMS) left out of training in turn, three axes."""
    from fogml.runs.shipped import shipped_run

    for axis in "z" if quick else "xyz":
        run = shipped_run(f"cold-start-{axis}")
        edges = np.searchsorted(run.time, run.time[0] + run.span_s * np.arange(1, STRETCHES) / STRETCHES)
        bounds = [0, *edges.tolist(), len(run)]
        parts = [run[a:b] for a, b in pairwise(bounds)]
        for held in range(1 if quick else STRETCHES):
            train = tuple(part for i, part in enumerate(parts) if i != held)
            yield Case("cold start", {"axis": axis, "test": f"third {held + 1}"}, train, parts[held], 30.0)


def quiet_twin_runs(quick: bool = False) -> Iterator[Case]:
    """As `twin_runs`, with white noise only: flicker, random walk and quantisation off."""
    return twin_runs(quick, slow_noise=False)


def twin_runs(quick: bool = False, *, slow_noise: bool = True) -> Iterator[Case]:
    """Source programmes on the tactical twin, trained at one rate and at three, judged at two others."""
    from fogml.twin.twin_file import load_twin

    twin = load_twin(TWIN)
    if not slow_noise:
        twin = twin.with_noise(B=0.0, K=0.0, Q=0.0)
    sample_s = 20.0 if quick else 5.0
    for name in PROGRAMMES[:1] if quick else PROGRAMMES:
        if name == NO_RAMP:
            continue
        tests = {
            label: _simulated(name, twin, factor, 100 + i, sample_s)
            for i, (label, factor) in enumerate(TESTED.items())
        }
        for trained, factors in list(TRAINED.items())[: 1 if quick else None]:
            train = tuple(_simulated(name, twin, factor, i, sample_s)[0] for i, factor in enumerate(factors))
            for label, (run, noise) in tests.items():
                yield Case(
                    "twin", {"programme": name, "trained": trained, "test": label}, train, run, 100.0, noise
                )


def _simulated(name: str, twin: Twin, factor: float, seed: int, sample_s: float) -> tuple[Run, FloatArray]:
    """A run of a programme with its ramp rates times a factor, and the noise in it [deg/h]."""
    from fogml.twin.programme import load_programme
    from fogml.twin.simulate import simulate
    from fogml.twin.steps import Ramp

    programme = load_programme(name)
    steps = [
        replace(step, rate=factor * step.rate) if isinstance(step, Ramp) else step for step in programme.steps
    ]
    made = simulate(
        replace(programme, steps=tuple(steps)),
        twin,
        sample_s=sample_s,
        seed=seed,
        columns=("T_in", "T_out", "rate"),
        truth=True,
    )
    assert made.truth is not None
    return made.run, made.truth.noise
