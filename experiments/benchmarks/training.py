"""Time and memory of training, and the error it buys, at 10,000 to 1,000,000 samples.

``python -m experiments.benchmarks.training MODEL SAMPLES RATES UNIT [--rows N]`` trains one model in a
process of its own and prints what it took as JSON; the study calls it, models in turn.
"""

from __future__ import annotations

import json
import os
import statistics
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from experiments.benchmarks.harness import high_water_mb, run_python
from experiments.benchmarks.peer_model import Budget, PeerModel
from experiments.benchmarks.peers import PEERS, peer_of
from experiments.benchmarks.study import Study
from experiments.rbf_rates.__main__ import rms_error, world
from experiments.synthetic_world import programme
from fogml.arrays import FloatArray
from fogml.runs.run import Run

SIZES = {"1e4": 10_000, "1e5": 100_000, "1e6": 1_000_000}
RATES = {"one": (1.0,), "three": (0.5, 1.0, 2.0)}
TESTS = {"slower": 0.7, "faster": 1.5}
OURS = "fogml rbf"
FULL = Budget(settings=4, folds=3)
QUICK = Budget(settings=2, folds=2, most_rows=150)
QUICK_MODELS = (OURS, "cubic", "kernel-ridge")
_FIRST_UNIT = 500


def chamber(rates: Sequence[float], sample_s: float) -> FloatArray:
    """-10 to 40 to -10 degC once at each rate [degC/min], half an hour's soak at each end."""
    steps: list[tuple[str, float, float]] = [("soak", 30.0, 0.0)]
    for rate in rates:
        steps += [("ramp", 40.0, rate), ("soak", 30.0, 0.0), ("ramp", -10.0, rate), ("soak", 30.0, 0.0)]
    return programme(steps, -10.0, sample_s)


def training_run(unit: int, rates: Sequence[float], samples: int) -> Run:
    """A run of so many samples of a unit, noise of 0.05 deg/h a sample."""
    whole_s = float(len(chamber(rates, 1.0)))
    return world(unit).run(chamber(rates, whole_s / samples), whole_s / samples, unit, "train")[0]


def trained_alone(
    model: str, samples: int, rates: str, unit: int, budget: Budget, rows: int | None = None
) -> dict[str, Any]:
    """Train a model in this process: seconds, memory before and at most [MB], errors on other rates [deg/h].

    `rows` are those that a peer's training rows are averaged to at most, in place of its own number.
    """
    from fogml.models.names import make_model

    run = training_run(unit, RATES[rates], samples)
    if model == OURS:
        unfitted: Any = make_model("rbf")
    else:
        peer = peer_of(model)
        unfitted = PeerModel(peer if rows is None else replace(peer, most_rows=rows), budget)
    _warm_up(model, unit)
    before = high_water_mb(os.getpid())
    begin = time.perf_counter()
    fitted = unfitted.fit(run)
    seconds = time.perf_counter() - begin
    peak = high_water_mb(os.getpid())
    errors = {}
    for label, rate in TESTS.items():
        test, truth = world(unit).run(chamber((rate,), 2.0), 2.0, 1000 + unit, label)
        errors[label] = rms_error(fitted.predict, test, truth)
    used = fitted.rows_ if isinstance(fitted, PeerModel) else fitted.card_.rows
    return {"seconds": seconds, "before_mb": before, "peak_mb": peak, "rows": used, "errors": errors}


def _warm_up(model: str, unit: int) -> None:
    """Load and compile what a first fit loads and compiles, on a run too small to cost."""
    from fogml.models.names import make_model

    small = training_run(unit, (2.0,), 600)
    budget = Budget(settings=1, folds=2, most_rows=100)
    (make_model("rbf") if model == OURS else PeerModel(peer_of(model), budget)).fit(small)


def measure(size: str, rates: str, quick: bool, repeats: int, folder: Path) -> dict[str, Any]:
    """Every model in processes of its own, turn about; each turn is another unit."""
    samples = 2_000 if quick else SIZES[size]
    names = QUICK_MODELS[:2] if quick else (OURS, *(peer.name for peer in PEERS))
    found: list[dict[str, Any]] = []
    for turn in range(repeats):
        for name in names if turn % 2 == 0 else names[::-1]:
            words = [name, str(samples), rates, str(_FIRST_UNIT + turn), *(["--quick"] if quick else [])]
            ran = run_python(["-m", "experiments.benchmarks.training", *words])
            row = {"model": name, "rates": rates, "turn": turn, **json.loads(ran.output)}
            print(name, rates, turn, round(row["seconds"], 2), row["errors"], file=sys.stderr, flush=True)
            found.append(row)
    return {"samples": samples, "rows": found, "budget": {"settings": FULL.settings, "folds": FULL.folds}}


def summary(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One entry for each training and model: medians, ratios of the turns, mean errors."""
    rows = found["rows"]
    entries = []
    for rates in dict.fromkeys(row["rates"] for row in rows):
        own = [row for row in rows if row["rates"] == rates]
        ours = {row["turn"]: row for row in own if row["model"] == OURS}
        for name in dict.fromkeys(row["model"] for row in own):
            mine = [row for row in own if row["model"] == name]
            seconds = [row["seconds"] for row in mine]
            ratios = [row["seconds"] / ours[row["turn"]]["seconds"] for row in mine]
            errors = {label: [row["errors"][label] for row in mine] for label in TESTS}
            both = [e for values in errors.values() for e in values]
            reference = [ours[row["turn"]]["errors"][label] for label in TESTS for row in mine]
            entries.append(
                {
                    "model": name,
                    "rates": rates,
                    "seconds": statistics.median(seconds),
                    "least": min(seconds),
                    "greatest": max(seconds),
                    "ratio": statistics.median(ratios),
                    "added_mb": max(row["peak_mb"] - row["before_mb"] for row in mine),
                    "peak_mb": max(row["peak_mb"] for row in mine),
                    "rows": mine[0]["rows"],
                    **{label: _mean(values) for label, values in errors.items()},
                    "error_over_ours": _mean([a / b for a, b in zip(both, reference)]),
                }
            )
    return entries


def _mean(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(np.maximum(values, 1e-12)))))


def page(found: Mapping[str, Any]) -> str:
    """Table of one size."""
    lines = [
        f"**Synthetic** units (experiments/synthetic_world.py, noise 0.05 deg/h a sample), "
        f"{found['samples']:,} "
        f"samples; tuning included ({found['budget']['settings']} settings, {found['budget']['folds']} "
        f"folds of "
        "time for each peer; ours and the Gaussian process tune by their evidence). Each model in a "
        "process of "
        "its own, models in turn, each turn another unit; medians (least to greatest). Ratio: its time over "
        "ours, median of the turns. Rows: what it is fitted to, averages over blocks of time where fewer "
        "than "
        "the samples. Memory: greatest resident memory, and how much of it the training added. Error: "
        "rms from "
        "the noise-free truth at 0.7 and 1.5 °C/min [deg/h], geometric means.",
    ]
    entries = summary(found)
    for rates in dict.fromkeys(entry["rates"] for entry in entries):
        own = [entry for entry in entries if entry["rates"] == rates]
        trained = ", ".join(f"{rate:g}" for rate in RATES[rates])
        lines += [
            "",
            f"Trained at {trained} °C/min:",
            "",
            "| model | rows | time | ratio | memory (added) | error, slower | error, faster | error / ours |",
            "|---|---:|---:|---:|---:|---:|---:|---:|",
        ]
        lines += [
            f"| {e['model']} | {e['rows']:,} | {e['seconds']:.3g} s ({e['least']:.3g}–{e['greatest']:.3g}) "
            f"| {e['ratio']:.3g} | {e['peak_mb']:.0f} MB ({e['added_mb']:.0f}) | {e['slower']:.4f} "
            f"| {e['faster']:.4f} | {e['error_over_ours']:.2f} |"
            for e in own
        ]
    return "\n".join(lines)


TRAINING_STUDIES = tuple(
    Study(
        f"training-{size}-{rates}",
        f"training, {SIZES[size]:,} samples, {rates} ramp rate{'s' if len(RATES[rates]) > 1 else ''}",
        partial(measure, size, rates),
        page,
    )
    for size in SIZES
    for rates in RATES
)


def main(words: Sequence[str]) -> None:
    """Train one model and print what it took."""
    model, samples, rates, unit = words[:4]
    budget = QUICK if "--quick" in words else FULL
    rows = int(words[words.index("--rows") + 1]) if "--rows" in words else None
    print(json.dumps(trained_alone(model, int(samples), rates, int(unit), budget, rows)))


if __name__ == "__main__":
    main(sys.argv[1:])
