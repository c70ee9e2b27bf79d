"""Train on one or two legs of the shipped thermal cycle (MEMS), judge on another: all pairings and axes.

Run ``python -m experiments.thermal_cycle``; it writes ``results.json`` and ``results.md`` beside itself. With
``--models auto "mixed effects"`` these alone are run again, and the others' figures are kept.
"""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Sequence
from functools import partial
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np

from experiments.results import write_results
from experiments.thermal_cycle.small_models import SMALL, SmallModel
from fogml import __version__
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run
from fogml.validation.compare import compare

HERE = Path(__file__).parent
ROWS_PER_AVERAGE = 20
LEGS = {"1": "down", "2": "up", "3": "last down"}
PROCESS = "sklearn.gaussian_process.GaussianProcessRegressor"
MACHINE = "sklearn.svm.SVR"
KERNEL_RIDGE = "sklearn.kernel_ridge.KernelRidge"
BOOSTING = "sklearn.ensemble.HistGradientBoostingRegressor"
MODELS = {
    "mean": ("mean", None),
    "cubic in T": ("polynomial", "T^1..3"),
    "M2": ("M2", None),
    "RBF, patent form": ("rbf-patent", None),
    "RBF": ("rbf", None),
    "Gaussian process": (PROCESS, "T, dT"),
    "support vectors": (MACHINE, "T, dT"),
    "kernel ridge": (KERNEL_RIDGE, "T, dT"),
    "boosting": (BOOSTING, "T, dT"),
    "GRU, 404 bytes": ("GRU", None),
    "TCN, 340 bytes": ("TCN", None),
    "KAN, 364 bytes": ("KAN", None),
    "PX4's cubic": ("PX4's cubic", None),
    "ArduPilot's cubic": ("ArduPilot's cubic", None),
    "mixed effects": ("mixed-effects", None),
    "auto": ("auto", None),
}
SINGLE = [((first,), second) for first, second in permutations(LEGS, 2)]
PAIRS = [(("1", "2"), "3"), (("1", "3"), "2"), (("2", "3"), "1")]
AXES = "xyz"


WINDOWED = "M2"
"""A model with the longest window of all, so that the rows judged are the same whichever models are run."""


def results(models: Sequence[str]) -> list[dict]:
    """One entry per axis, pairing and model: figures of 20-row averages [deg/h].

    All models of a pairing are judged on the same rows.
    """
    rows = []
    for axis in AXES:
        runs = {leg: shipped_run(f"thermal-cycle-{leg}-{axis}") for leg in LEGS}
        for train, test in (*SINGLE, *PAIRS):
            rows += pairing(axis, train, test, [runs[leg] for leg in train], runs[test], models)
    return rows


def pairing(
    axis: str,
    train: Sequence[str],
    test: str,
    train_runs: list[Run],
    test_run: Run,
    models: Sequence[str],
) -> list[dict]:
    """One entry for each model on one pairing of legs."""
    averaging_s = ROWS_PER_AVERAGE * test_run.sample_s
    makers = {
        label: partial(SmallModel, name) if name in SMALL else partial(make_model, name, features)
        for label, (name, features) in MODELS.items()
        if label in models or label == WINDOWED
    }
    with warnings.catch_warnings():
        # The process may run into the bounds of its search; that is its result here.
        warnings.simplefilter("ignore")
        compared = compare(makers, train_runs, [test_run], averaging_s=averaging_s)
    rows = []
    for label, judgement in compared.judgements.items():
        judged = judgement.test[0]
        row: dict[str, Any] = {"axis": axis, "train": "+".join(train), "test": test, "model": label}
        figures = {"rms": judged.after.rms, "bias_stability": judged.after.bias_stability}
        series = judged.series
        figures["coverage"] = float(np.mean(np.abs(series.after) <= series.upper))
        rows.append({**row, **figures, "floor": judged.floor, "averaging_s": averaging_s})
        if label == "auto":
            rows[-1]["made of"] = next(note for note in judgement.model["notes"] if "left out" in note)
    print(axis, "+".join(train), "->", test, {row["model"]: round(row["rms"], 1) for row in rows}, flush=True)
    return rows


def table(rows: list[dict], figure: str, pairings: Sequence[tuple[tuple[str, ...], str]]) -> str:
    """One figure as a Markdown table: a line per axis and pairing, a column per model, means below."""
    models = models_in(rows)
    lines = [
        "| axis | train → test | " + " | ".join(models) + " | floor |",
        "|---|---|" + "---:|" * (len(models) + 1),
    ]
    columns: dict[str, list[float]] = {label: [] for label in models}
    for axis in AXES:
        for train, test in pairings:
            found = [r for r in rows if (r["axis"], r["train"], r["test"]) == (axis, "+".join(train), test)]
            values = {r["model"]: r[figure] for r in found}
            for label in models:
                columns[label].append(values[label])
            least = min(values.values())
            cells = [f"**{v:.1f}**" if v == least else f"{v:.1f}" for v in (values[m] for m in models)]
            floor = np.median([r["floor"] for r in found])
            named = " + ".join(LEGS[leg] for leg in train)
            lines.append(f"| {axis} | {named} → {LEGS[test]} | {' | '.join(cells)} | {floor:.2f} |")
    for what, of in (("median", np.median), ("geometric mean", _geometric_mean)):
        told = {label: float(of(values)) for label, values in columns.items()}
        least = min(told.values())
        cells = [f"**{v:.1f}**" if v == least else f"{v:.1f}" for v in told.values()]
        lines.append(f"| all | {what} of {len(columns['auto'])} | {' | '.join(cells)} | |")
    return "\n".join(lines)


def models_in(rows: list[dict]) -> list[str]:
    """The models that there are figures of, in order."""
    return [label for label in MODELS if any(row["model"] == label for row in rows)]


def _geometric_mean(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(values))))


def summary(rows: list[dict]) -> str:
    """For each model and number of legs: against no compensation, against the best, harm, coverage."""
    lines = [
        "| trained on | model | rms / no compensation | rms / best | worse than none | coverage of 90 % |",
        "|---|---|---:|---:|---:|---:|",
    ]
    for told, pairings in (("one leg", SINGLE), ("two legs", PAIRS)):
        names = {("+".join(train), test) for train, test in pairings}
        cases: dict[tuple[str, str, str], dict[str, dict]] = {}
        for row in rows:
            if (row["train"], row["test"]) in names:
                cases.setdefault((row["axis"], row["train"], row["test"]), {})[row["model"]] = row
        for label in models_in(rows):
            ratios = [case[label]["rms"] / case["mean"]["rms"] for case in cases.values()]
            best = [case[label]["rms"] / min(r["rms"] for r in case.values()) for case in cases.values()]
            worse = sum(c[label]["rms"] > c["mean"]["rms"] + c[label]["floor"] for c in cases.values())
            covered = [case[label]["coverage"] for case in cases.values()]
            coverage = f"{np.mean(covered):.2f}" if any(covered) else "–"
            lines.append(
                f"| {told} | {label} | {_geometric_mean(ratios):.2f} | {_geometric_mean(best):.2f} | "
                f"{worse} of {len(cases)} (at most × {max(ratios):.1f}) | {coverage} |"
            )
    return "\n".join(lines)


def page(rows: list[dict]) -> str:
    """The result page."""
    averaging_s = rows[0]["averaging_s"]
    return f"""# Legs of a real thermal cycle against each other

Data: the shipped thermal cycle of a **MEMS** unit (no fibre-optic gyro), 52 → −17.6 → 74 → 36 °C, legs
`down`, `up` and `last down`, three axes. Each model is fitted on one leg, or on two, and judged on another.
Averages over {ROWS_PER_AVERAGE} rows ({averaging_s:.1f} s); all in deg/h. Earth rate is not known here, so
biases are relative to the training legs' mean, and no compensation gives the same figures as `mean`. The
autopilots' cubics follow their own rules: fitted to a warm-up of 24 °C (PX4) or 10 °C (ArduPilot) at least,
held beyond its range, else nothing, as on every leg down; they state no interval. All models of a line are
judged on the same rows. `auto` and `mixed effects` were developed with these legs in view, first x and y,
then all: that a rate needs a run both ways, and that gains and skill count beyond their standard error, was
set on the nine pairings of two legs. fogml {__version__};
`python -m experiments.thermal_cycle`.

## In short

Geometric means over the pairings; *worse than none* is beyond the noise floor; coverage is that of the stated
90 % intervals by averages.

{summary(rows)}

## rms (bias included)

{table(rows, "rms", SINGLE)}

## Bias stability ({averaging_s:.1f} s)

{table(rows, "bias_stability", SINGLE)}

## Two legs in training, judged on the third: rms

{table(rows, "rms", PAIRS)}

## Why, and what helps

One leg goes one way: temperature, time, rate and direction move together in it, and every model of T, rate
or both fits it to about a degree per hour. What the unit does on the way back is not in it. Axes x and z
come back on another branch, so what was learned there does harm, whichever model learned it, and no folds
of the one leg can tell. `auto` says so in its report ("trained on temperature moving one way only"), and its
interval is as wide as the drift then.

With a leg down **and** a leg up in training, runs left out tell what a fit is worth on another run. A shift
from run to run looks like an effect of the direction there, so `auto` takes no simple form in the rate, and
takes memory only where it gains on both; where neither run confirms a fit, nothing is compensated. `down` and
`last down` together are one way still.
"""


def main() -> None:
    """Compute and write the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--models", nargs="+", choices=MODELS, default=list(MODELS))
    chosen = parser.parse_args().models
    rows = results(chosen)
    again = {row["model"] for row in rows}
    if missing := set(MODELS) - again:
        before = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
        rows += [row for row in before if row["model"] in missing]
    write_results(HERE, rows, page(rows))


if __name__ == "__main__":
    main()
