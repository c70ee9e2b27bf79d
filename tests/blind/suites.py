"""Small suites made by hand, from the twin itself: for checks of run and score, not of the diagnosis."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fogml.blind.folders import BlindFolder, write_sums
from fogml.blind.truth import Amount, Kind, Runs, Segment, TrueClosed, TrueEffect, Truth, write_truth
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from fogml.twin.twin_file import load_twin

SAMPLE_S = 30.0
N, B = 0.002, 0.002


@dataclass
class HandMade:
    """A case to make: effects by id with amplitude and shape, and which of them are left out."""

    kind: Kind
    effects: dict[str, tuple[float, dict[str, float]]] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    d_prime: float = 30.0


def cycle(hours: float = 4.0, warm: float = 50.0) -> Run:
    """A chamber cycle without a gyro: a ramp up, a soak, a ramp down, inside lagging outside."""
    time = np.arange(0.0, 3600.0 * hours, SAMPLE_S)
    corners = 3600.0 * hours * np.array([0.0, 0.1, 0.35, 0.5, 0.8, 1.0])
    outside = np.interp(time, corners, [20.0, 20.0, warm, warm, -10.0, -10.0])
    inside = np.interp(time - 120.0, corners, [20.0, 20.0, warm, warm, -10.0, -10.0])
    zeros = np.zeros_like(time)
    return Run.from_columns("cycle", time=time, gyro=zeros, T_in=inside, T_out=outside)


def make_suite(path: Path, cases: list[HandMade], seed: int = 1) -> BlindFolder:
    """Cases and truths in a folder; signals are the twin's, noise is white."""
    folder = BlindFolder(path)
    folder.truth.mkdir(parents=True)
    for number, case in enumerate(cases, start=1):
        _make_case(folder, f"{number:04d}", case, np.random.default_rng([seed, number]), seed)
    write_sums(folder.truth)
    return folder


def _make_case(folder: BlindFolder, name: str, case: HandMade, rng: np.random.Generator, seed: int) -> None:
    target = folder.cases / name
    target.mkdir(parents=True)
    runs = {"fit-1.csv": cycle(), "fit-2.csv": cycle(5.0, 40.0), "held-out-1.csv": cycle(4.5, 45.0)}
    constants = {"b0": 1.0, "b1": 0.03, "m": 0.5}
    nominal = load_twin("nominal").with_nominal(**constants)
    contributions, sigma = {}, N / np.sqrt(SAMPLE_S / 3600.0)
    for file, run in runs.items():
        gyro = nominal.replay(run) + sigma * rng.standard_normal(len(run))
        for place, (id, (amplitude, shape)) in enumerate(case.effects.items()):
            added = nominal.with_effect(id, amplitude, **shape).replay(run, only=id)
            contributions[file, place] = added
            gyro = gyro + added
        write_run(run.with_columns(gyro=gyro), target / file)
    still = np.arange(0.0, 7200.0, SAMPLE_S)
    noise = sigma * rng.standard_normal(len(still))
    static = Run.from_columns("static", time=still, gyro=noise, T_in=np.full(len(still), 25.0))
    write_run(static, target / "static.csv")
    (target / "options.json").write_text(json.dumps({"without": list(case.left_out)}))
    truth = Truth(
        case=name,
        seed=seed,
        kind=case.kind,
        runs=Runs(fit=("fit-1.csv", "fit-2.csv"), held_out=("held-out-1.csv",), noise="static.csv"),
        sample_s=SAMPLE_S,
        turning=False,
        effects=tuple(
            TrueEffect(
                id=id,
                name=id,
                stage="bias",
                amplitude=Amount(value=amplitude, unit="deg/h"),
                d_prime=case.d_prime,
            )
            for id, (amplitude, _) in case.effects.items()
        ),
        left_out=case.left_out,
        d_prime=case.d_prime if case.effects else 0.0,
        segments=(Segment(run="fit-1.csv", from_s=2000.0, to_s=6000.0),) if case.effects else (),
        closed=(
            TrueClosed(
                run="held-out-1.csv", averaging_s=100.0, recalibrated=0.1, after=0.02, floor=0.02, closed=1.0
            ),
        )
        if case.effects
        else (),
        noise={"N": Amount(value=N, unit="deg/sqrt(h)")},
        nominal=constants,
    )
    write_truth(folder.truth, truth, contributions)
