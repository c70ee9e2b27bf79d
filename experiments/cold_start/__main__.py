"""A shipped cold start (MEMS) by thirds: each model fitted on one third or two, judged on another.

Run ``python -m experiments.cold_start``; it writes ``results.json`` and ``results.md`` beside itself.
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from experiments.results import write_results
from fogml import __version__
from fogml.models.names import make_model
from fogml.runs.shipped import shipped_run
from fogml.validation.compare import compare

HERE = Path(__file__).parent
AVERAGING_S = 20.0
MODELS = {
    "mean": ("mean", None),
    "cubic in T": ("polynomial", "T^1..3"),
    "kernel ridge": ("sklearn.kernel_ridge.KernelRidge", "T, dT"),
    "mixed effects": ("mixed-effects", None),
    "auto": ("auto", None),
}
PAIRINGS: list[tuple[tuple[int, ...], int]] = [((a,), b) for a in range(3) for b in range(3) if a != b]
PAIRINGS += [((0, 1), 2), ((0, 2), 1), ((1, 2), 0)]


def results() -> list[dict]:
    """One entry per axis, pairing and model."""
    rows = []
    makers = {label: partial(make_model, name, features) for label, (name, features) in MODELS.items()}
    for axis in "xyz":
        run = shipped_run(f"cold-start-{axis}")
        edges = np.linspace(0, len(run), 4).astype(int)
        thirds = [run[low:high] for low, high in pairwise(edges)]
        for train, test in PAIRINGS:
            compared = compare(makers, [thirds[i] for i in train], [thirds[test]], averaging_s=AVERAGING_S)
            for label, judgement in compared.judgements.items():
                judged, series = judgement.test[0], judgement.test[0].series
                coverage = float(np.mean(np.abs(series.after) <= series.upper))
                place = {"axis": axis, "train": "+".join(str(i + 1) for i in train), "test": str(test + 1)}
                told = {"rms": judged.after.rms, "coverage": coverage, "floor": judged.floor}
                rows.append({**place, "model": label, **told})
    return rows


def page(rows: list[dict]) -> str:
    """The result page."""
    cases: dict[tuple[str, str, str], dict[str, dict]] = {}
    for row in rows:
        cases.setdefault((row["axis"], row["train"], row["test"]), {})[row["model"]] = row
    head = [
        "| axis | thirds | " + " | ".join(MODELS) + " | floor |",
        "|---|---|" + "---:|" * (len(MODELS) + 1),
    ]
    lines = [
        f"| {axis} | {train} → {test} | "
        + " | ".join(f"{case[m]['rms']:.1f}" for m in MODELS)
        + f" | {case['auto']['floor']:.1f} |"
        for (axis, train, test), case in cases.items()
    ]
    means = [
        float(np.exp(np.mean([np.log(c[m]["rms"] / c["mean"]["rms"]) for c in cases.values()])))
        for m in MODELS
    ]
    coverages = [float(np.mean([c[m]["coverage"] for c in cases.values()])) for m in MODELS]
    last = [
        "| all | rms / no compensation, geometric mean | " + " | ".join(f"{v:.2f}" for v in means) + " | |",
        "| all | coverage of 90 % intervals | " + " | ".join(f"{v:.2f}" for v in coverages) + " | |",
    ]
    table = "\n".join([*head, *lines, *last])
    return f"""# A real cold start, part against part

Data: the shipped cold start of a **MEMS** unit (no fibre-optic gyro), die 10 to 29 °C in 36 min, cut into
thirds of equal length. rms of {AVERAGING_S:g} s averages in deg/h, bias included, relative to the training
thirds' mean; all models of a line on the same rows. It warms up all the way, so each third lies beyond the
box of the others in temperature, and no training part moves both ways. fogml {__version__};
`python -m experiments.cold_start`.

{table}
"""


def main() -> None:
    """Compute and write the results."""
    rows = results()
    write_results(HERE, rows, page(rows))


if __name__ == "__main__":
    main()
