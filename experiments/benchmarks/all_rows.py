"""Training of the kernel peers on more and more rows, up to all samples: what averaging spares them.

The tables of training average what a Gaussian process, an SVR or a KernelRidge is fitted to down to a
few hundred or thousand rows. Here two of them get more, on one unit, and their time is followed to all
samples by the exponent of the last two numbers of rows where it was not measured.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from experiments.benchmarks.harness import run_python
from experiments.benchmarks.study import Study
from experiments.benchmarks.training import OURS, RATES

SAMPLES, UNIT = 10_000, 500
ROWS = {"gaussian-process": (300, 600, 1200), "kernel-ridge": (2000, 5000, 10_000)}
QUICK_SAMPLES, QUICK_ROWS = 2_000, {"kernel-ridge": (100, 150)}
WANTED = {"gaussian-process": 15.0, "kernel-ridge": 5.0}
"""How many times as long a peer is to take as ours on all samples."""


def measure(quick: bool, repeats: int, folder: Path) -> dict[str, Any]:
    """Each training once in a process of its own; ours as often as `repeats`."""
    samples, rows = (QUICK_SAMPLES, QUICK_ROWS) if quick else (SAMPLES, ROWS)
    found: list[dict[str, Any]] = []

    def train(rates: str, model: str, *more: str) -> None:
        words = [model, str(samples), rates, str(UNIT), *more, *(["--quick"] if quick else [])]
        row = json.loads(run_python(["-m", "experiments.benchmarks.training", *words]).output)
        print(model, rates, row["rows"], round(row["seconds"], 2), file=sys.stderr, flush=True)
        found.append({"model": model, "rates": rates, **row})

    for rates in RATES:
        for _ in range(repeats):
            train(rates, OURS)
        for model, numbers in rows.items():
            for number in numbers:
                train(rates, model, "--rows", str(number))
    return {"samples": samples, "rows": found}


def at_all_samples(rows: list[Mapping[str, Any]], samples: int) -> tuple[float, float | None]:
    """Seconds of a peer on all samples, and the exponent that they were followed with, None if measured."""
    ordered = sorted(rows, key=lambda row: row["rows"])
    last = ordered[-1]
    # Blocks of even length need not come out at the very number of rows.
    if last["rows"] >= 0.95 * samples:
        return last["seconds"], None
    (before, _) = next(pairwise(ordered[-2:]))
    exponent = math.log(last["seconds"] / before["seconds"]) / math.log(last["rows"] / before["rows"])
    return last["seconds"] * (samples / last["rows"]) ** exponent, exponent


def page(found: Mapping[str, Any]) -> str:
    """A table of each training, and what all samples would take."""
    samples = found["samples"]
    lines = [
        f"**Synthetic**, one of the units above, {samples:,} samples. Kernel peers on more rows than the "
        "tables above give them, each trained once; ours on its averages, the median of its turns. Their "
        "time on all samples is measured, or followed from the last two by their exponent (\\*).",
    ]
    for rates, values in RATES.items():
        own = [row for row in found["rows"] if row["rates"] == rates]
        ours = sorted(row["seconds"] for row in own if row["model"] == OURS)
        mine = ours[len(ours) // 2]
        reference = next(row for row in own if row["model"] == OURS)["errors"]
        trained = ", ".join(f"{rate:g}" for rate in values)
        lines += [
            "",
            f"Trained at {trained} °C/min; ours {mine:.3g} s, error {reference['slower']:.4f} at the slower "
            f"and {reference['faster']:.4f} deg/h at the faster rate:",
            "",
            "| model | rows | time | ratio | error, slower | error, faster |",
            "|---|---:|---:|---:|---:|---:|",
        ]
        for model in dict.fromkeys(row["model"] for row in own if row["model"] != OURS):
            each = [row for row in own if row["model"] == model]
            lines += [
                f"| {model} | {row['rows']:,} | {row['seconds']:.3g} s | {row['seconds'] / mine:.3g} "
                f"| {row['errors']['slower']:.4f} | {row['errors']['faster']:.4f} |"
                for row in each
            ]
            seconds, exponent = at_all_samples(each, samples)
            if exponent is not None:
                lines.append(
                    f"| {model} | {samples:,} \\* | {seconds:.3g} s (rows^{exponent:.2g}) "
                    f"| {seconds / mine:.3g} | | |"
                )
            if model in WANTED:
                least = WANTED[model]
                held = "met" if seconds / mine >= least else "**not met**"
                lines.append(f"| {model} | all | | {seconds / mine:.3g}; wanted {least:g}: {held} | | |")
    return "\n".join(lines)


ALL_ROWS_STUDY = Study(
    "training-1e4-all-rows", f"training, {SAMPLES:,} samples, kernel peers on more rows", measure, page
)
