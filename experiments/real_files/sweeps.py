"""A sweep's winner against the default polynomial and `auto`, on fresh runs of synthetic units."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from experiments.real_files.fleet import MEAN, SAMPLE_S, SPREAD, WHITE, flicker, temperatures
from experiments.real_files.section import Section, table
from fogml.arrays import FloatArray
from fogml.models.names import make_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.tuning.plan import Choice, Plan, Space
from fogml.tuning.sweep import run_sweep
from fogml.tuning.winner import AUTO, DEFAULT, complete, reference_choices, winner

UNITS, TRIALS, BIAS_SPREAD = 20, 10, 0.1
"""Units; trials of a sweep; spread of the bias from run to run [deg/h]."""
TRAINED, FRESH = (0.7, 1.0, 1.4), (0.85, 1.2)
"""Ramp rates of the training runs and of the fresh ones [degC/min]."""
SPACE = {
    "features": {
        "static": ["T", "T^1..3", "T^1..5"],
        "rate": ["", "dT[block, {window} s]", "dT[block, {window} s], T*dT[block, {window} s]"],
    },
    "window": {"low": 64, "high": 512, "log": True},
    "models": {"polynomial": {"ridge": {"low": 1e-8, "high": 0.1, "log": True}}},
}


def recorded(seed: int, rate: float) -> tuple[Run, FloatArray]:
    """A unit's run at a ramp rate and its true drift; the bias moves from run to run."""
    constants = MEAN + SPREAD * np.random.default_rng([seed, 11]).normal(size=6)
    random = np.random.default_rng([seed, 7, int(100 * rate)])
    coil = temperatures(rate, None)
    u, slope = coil - 25.0, np.gradient(coil, SAMPLE_S) * 60.0
    drift = np.column_stack([np.ones_like(u), u, u**2, u**3, slope, u * slope]) @ constants
    drift += BIAS_SPREAD * random.normal()
    gyro = drift + WHITE * random.normal(size=len(u)) + flicker(random, len(u))
    columns = {"time": SAMPLE_S * np.arange(len(u)), "gyro": gyro, "T": coil}
    return Run(f"{rate:g}.csv", columns, Facts(unit=f"unit {seed}", axis="x")), drift


def error(choice: Choice, runs: list[Run], seed: int) -> float:
    """Rms from the true drift about each fresh run's mean [deg/h], after a fit to the training runs."""
    made = choice.made
    model = (
        made.model
        if made is not None
        else make_model(choice.model, choice.features or None, 0, choice.parameters or None).fit(runs)
    )
    squares = []
    for rate in FRESH:
        run, drift = recorded(seed, rate)
        evaluation = model.evaluate(run)
        squares.append(np.var((drift - evaluation.drift)[evaluation.full]))
    return float(np.sqrt(np.mean(squares)))


def unit(seed: int, objective: str) -> dict[str, Any]:
    """Errors of the winner, of the default and of auto's choice for one unit."""
    runs = [recorded(seed, rate)[0] for rate in TRAINED]
    references = reference_choices(runs)
    with TemporaryDirectory() as folder:
        plan = Plan(
            "sweep",
            lambda: runs,
            Space.model_validate(SPACE),
            objectives=(objective, "bytes"),
            trials=TRIALS,
            folder=str(Path(folder)),
            references=references,
        )
        trials = complete(run_sweep(plan).get_trials())
    best = winner(trials)
    errors = {name: error(choice, runs, seed) for name, choice in references.items()}
    told = best.user_attrs
    won = references.get(told.get("reference"), Choice(told["model"], told["features"], told["parameters"]))
    errors["winner"] = error(won, runs, seed)
    return {"unit": seed, "winner": f"{won.model} of {won.features}", "error": errors}


def section(quick: bool) -> Section:
    """Errors from the truth over units."""
    found = [unit(100 + k, "bias_stability") for k in range(2 if quick else UNITS)]
    names = ("winner", DEFAULT, AUTO)
    errors = {name: np.array([one["error"][name] for one in found]) for name in names}
    rows = []
    for name in names:
        ratio = errors["winner"] / errors[name]
        worse = "–" if name == "winner" else f"{int((ratio > 1.02).sum())} of {len(found)}"
        middle = "–" if name == "winner" else f"{np.median(ratio):.3f}"
        rows.append((name, f"{np.median(errors[name]):.4f}", f"{errors[name].max():.4f}", middle, worse))
    header = (
        "model",
        "error, median [deg/h]",
        "largest",
        "winner's error over it, median",
        "winner worse by over 2 %",
    )
    text = (
        f"## Sweeps\n\n**Synthetic**: {len(found)} units, three training runs of a cycle at "
        f"{', '.join(f'{rate:g}' for rate in TRAINED)} degC/min, every {SAMPLE_S:g} s, white and flicker "
        f"noise, biases that move by {BIAS_SPREAD:g} deg/h from run to run; {TRIALS} trials, the default "
        "polynomial and what auto makes the first of them, by bias stability and bytes. The errors are rms "
        "from the true drift about the mean of fresh runs at "
        f"{' and '.join(f'{rate:g}' for rate in FRESH)} degC/min.\n\n"
    )
    return Section(text + table(header, rows), {"units": found})
