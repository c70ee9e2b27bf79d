"""The same model judged on rows drawn at random, and on another run (MEMS): how far a random split flatters.

Run ``python -m experiments.leakage``; it writes ``results.json`` and ``results.md`` beside itself.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from experiments.results import write_results
from fogml import __version__
from fogml.arrays import FloatArray
from fogml.features.parse import parse_features
from fogml.models.table import averaged_table, run_rows
from fogml.runs.shipped import shipped_run

HERE = Path(__file__).parent
FEATURES = "T, dT[exp, 40 s]"
AVERAGING_S = 10.0
SEED = 0
MODELS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "nearest neighbours": ("sklearn.neighbors", "KNeighborsRegressor", {"n_neighbors": 3}),
    "random forest": ("sklearn.ensemble", "RandomForestRegressor", {"random_state": SEED}),
    "support vectors": ("sklearn.svm", "SVR", {"C": 100.0}),
    "straight line": ("sklearn.linear_model", "LinearRegression", {}),
}


def rows_of(axis: str, leg: str) -> tuple[FloatArray, FloatArray]:
    """Features and output [deg/h] of a leg's averages over `AVERAGING_S`."""
    features = parse_features(FEATURES)
    table = averaged_table(
        [run_rows(shipped_run(f"thermal-cycle-{leg}-{axis}"), features)], features.compose, AVERAGING_S
    )
    return table.X, table.y


def figures(axis: str) -> list[dict]:
    """For each model the rms on rows drawn at random from the leg it is fitted to, and on another leg."""
    X, y = rows_of(axis, "2")
    other, told = rows_of(axis, "3")
    drawn = np.random.default_rng(SEED).permutation(len(y))
    fitted, held = drawn[: len(y) // 2], drawn[len(y) // 2 :]
    rows = []
    for label, (module, name, parameters) in MODELS.items():
        model = make_pipeline(StandardScaler(), getattr(import_module(module), name)(**parameters))
        model.fit(X[fitted], y[fitted])
        at_random = float(np.sqrt(np.mean((y[held] - model.predict(X[held])) ** 2)))
        elsewhere = float(np.sqrt(np.mean((told - model.predict(other)) ** 2)))
        none = float(np.sqrt(np.mean((told - y.mean()) ** 2)))
        rows.append(
            {"axis": axis, "model": label, "random split": at_random, "other run": elsewhere, "none": none}
        )
    return rows


def page(rows: list[dict]) -> str:
    """The result page."""
    lines = [
        "| axis | model | on rows drawn at random | on another run | no compensation there |",
        "|---|---|---:|---:|---:|",
        *(
            f"| {r['axis']} | {r['model']} | "
            + " | ".join(f"{r[name]:.1f}" for name in ("random split", "other run", "none"))
            + " |"
            for r in rows
        ),
    ]
    table = "\n".join(lines)
    return f"""# What a random split promises, and what another run keeps

Data: the shipped thermal cycle of a **MEMS** unit (no fibre-optic gyro), averages of {AVERAGING_S:g} s of T
and its rate. Each model is fitted to half of the averages of the leg `up`, drawn at random, and judged on
the other half and on the leg `last down`. rms in deg/h, bias included. fogml {__version__};
`python -m experiments.leakage`.

{table}

Neighbouring averages share temperature, rate, time and what the gyro did then, so a row held out at random is
told by the rows beside it. fogml never draws rows at random: it leaves out runs, and of one run whole parts.
"""


def main() -> None:
    """Compute and write the results."""
    rows = [row for axis in "xyz" for row in figures(axis)]
    write_results(HERE, rows, page(rows))


if __name__ == "__main__":
    main()
