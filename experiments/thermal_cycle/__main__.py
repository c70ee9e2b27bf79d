"""Train on one leg of the shipped thermal cycle (MEMS), judge on another: all pairings and axes.

Run ``python -m experiments.thermal_cycle``; it writes ``results.json`` and ``results.md`` beside itself.
"""

from __future__ import annotations

import json
import warnings
from itertools import permutations
from pathlib import Path

import numpy as np

from fogml import __version__
from fogml.models.names import make_model
from fogml.outputs import whole_file
from fogml.runs.shipped import shipped_run
from fogml.validation.judge import judge

HERE = Path(__file__).parent
ROWS_PER_AVERAGE = 20
LEGS = {"1": "down", "2": "up", "3": "last down"}
PROCESS = "sklearn.gaussian_process.GaussianProcessRegressor"
MACHINE = "sklearn.svm.SVR"
MODELS = {
    "mean": ("mean", None),
    "cubic in T": ("polynomial", "T^1..3"),
    "M2": ("M2", None),
    "RBF, patent form": ("rbf-patent", None),
    "RBF": ("rbf", None),
    "Gaussian process": (PROCESS, "T, dT"),
    "support vectors": (MACHINE, "T, dT"),
    "auto": ("auto", None),
}
FIGURES = ("rms", "bias_stability")


def results() -> list[dict]:
    """One entry per axis, pairing and model: rms and bias stability of 20-row averages [deg/h]."""
    rows = []
    for axis in "xyz":
        runs = {leg: shipped_run(f"thermal-cycle-{leg}-{axis}") for leg in LEGS}
        for train, test in permutations(LEGS, 2):
            for label, (name, features) in MODELS.items():
                with warnings.catch_warnings():
                    # The process may run into the bounds of its search; that is its result here.
                    warnings.simplefilter("ignore")
                    model = make_model(name, features=features).fit(runs[train])
                averaging_s = ROWS_PER_AVERAGE * runs[test].sample_s
                judged = judge(model, runs[train], runs[test], averaging_s=averaging_s).test[0]
                rows.append(
                    {
                        "axis": axis,
                        "train": train,
                        "test": test,
                        "model": label,
                        "chosen": model.describe()["features"] if label == "auto" else None,
                        "rms": judged.after.rms,
                        "bias_stability": judged.after.bias_stability,
                        "floor": judged.floor,
                        "averaging_s": averaging_s,
                    }
                )
                print(f"{axis} {train}->{test} {label}: {judged.after.rms:.2f} deg/h", flush=True)
    return rows


def table(rows: list[dict], figure: str) -> str:
    """One figure as a Markdown table: a line per axis and pairing, a column per model, medians below."""
    lines = [
        "| axis | train → test | " + " | ".join(MODELS) + " | floor |",
        "|---|---|" + "---:|" * (len(MODELS) + 1),
    ]
    columns: dict[str, list[float]] = {label: [] for label in MODELS}
    for axis in "xyz":
        for train, test in permutations(LEGS, 2):
            found = [r for r in rows if (r["axis"], r["train"], r["test"]) == (axis, train, test)]
            values = {r["model"]: r[figure] for r in found}
            for label in MODELS:
                columns[label].append(values[label])
            least = min(values.values())
            cells = [f"**{v:.1f}**" if v == least else f"{v:.1f}" for v in (values[m] for m in MODELS)]
            floor = np.median([r["floor"] for r in found])
            lines.append(f"| {axis} | {LEGS[train]} → {LEGS[test]} | {' | '.join(cells)} | {floor:.2f} |")
    medians = {label: float(np.median(values)) for label, values in columns.items()}
    least = min(medians.values())
    cells = [f"**{v:.1f}**" if v == least else f"{v:.1f}" for v in medians.values()]
    lines.append(f"| all | median of 18 | {' | '.join(cells)} | |")
    return "\n".join(lines)


def page(rows: list[dict]) -> str:
    """The result page."""
    auto = {(r["axis"], r["train"], r["test"]): r for r in rows if r["model"] == "auto"}
    mean = {(r["axis"], r["train"], r["test"]): r for r in rows if r["model"] == "mean"}
    worse = [key for key in auto if auto[key]["rms"] > mean[key]["rms"] + auto[key]["floor"]]
    listed = "; ".join(f"{a}, {LEGS[i]} → {LEGS[j]}" for a, i, j in worse) or "none"
    averaging_s = rows[0]["averaging_s"]
    return f"""# One leg of a real thermal cycle against another

Data: the shipped thermal cycle of a **MEMS** unit (no fibre-optic gyro), 52 → −17.6 → 74 → 36 °C, legs
`down`, `up` and `last down`, three axes. Each model is fitted on one leg and judged on another.
Averages over {ROWS_PER_AVERAGE} rows ({averaging_s:.1f} s); all in deg/h. Earth rate is not known here, so
biases are relative to the training leg's mean, and `none` gives the same figures as `mean`, the no-model
baseline.
fogml {__version__}; `python -m experiments.thermal_cycle`.

## rms (bias included)

{table(rows, "rms")}

## Bias stability ({averaging_s:.1f} s)

{table(rows, "bias_stability")}

Pairings where `auto` is worse than `mean` by more than the noise floor ({len(worse)} of 18): {listed}.
"""


def main() -> None:
    """Compute and write the results."""
    rows = results()
    with whole_file(HERE / "results.json") as partial:
        partial.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    with whole_file(HERE / "results.md") as partial:
        partial.write_text(page(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
