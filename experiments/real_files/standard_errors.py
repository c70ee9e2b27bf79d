"""Standard errors of coefficients against their scatter over simulated runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from experiments.real_files.section import Section, table
from fogml.models.names import make_model
from fogml.twin.simulate import simulate

RUNS, QUICK_RUNS = 200, 3


def figures(runs: int) -> dict[str, Any]:
    """Root mean square of errors over standard errors, and coverage of 90 % intervals, by coefficient."""
    errors, stated, white = [], [], []
    names: list[str] = []
    for seed in range(runs):
        made = simulate("multi-point-cycle", "tactical", sample_s=5.0, seed=1000 + seed, truth=True)
        assert made.truth is not None
        fitted = make_model("polynomial").fit(made.run)
        clean = make_model("polynomial").fit(made.run.with_columns(gyro=made.truth.noise_free))
        names = ["1", *fitted.feature_names]
        pairs = [fitted.describe()["coefficients"], clean.describe()["coefficients"]]
        errors.append([pairs[0][name]["value"] - pairs[1][name]["value"] for name in names])
        stated.append([pairs[0][name]["se"] for name in names])
        table_of = fitted.features_.compose(fitted.features_.atom_values(made.run)[0])
        plain = type(fitted.regressor_)().fit(table_of, made.run.error_deg_h)
        white.append(plain.standard_errors())
    z = np.array(errors) / np.array(stated)
    before = np.array(errors) / np.array(white)
    return {
        name: {
            "rms_z": float(np.sqrt(np.mean(z[:, i] ** 2))),
            "coverage": float(np.mean(np.abs(z[:, i]) < 1.645)),
            "rms_z_white": float(np.sqrt(np.mean(before[:, i] ** 2))),
            "runs": runs,
        }
        for i, name in enumerate(names)
    }


def section(quick: bool) -> Section:
    """The part of the page."""
    found = figures(QUICK_RUNS if quick else RUNS)
    runs = next(iter(found.values()))["runs"]
    rows = [
        (f"`{name}`", f"{f['rms_z']:.2f}", f"{f['coverage']:.3f}", f"{f['rms_z_white']:.2f}")
        for name, f in found.items()
    ]
    words = (
        f"## Standard errors of coefficients\n\nSynthetic: thermal cycles of the twin "
        f"`tactical`, 5 s samples, "
        f"{runs} runs; the truth is the fit to the same run without noise. Coverage is "
        f"of ± 1.645 standard errors, "
        "0.90 where they hold. The constant also holds noise slower than a run.\n"
    )
    head = ("coefficient", "rms error / standard error", "coverage", "rms for white residuals")
    return Section(f"{words}\n{table(head, rows)}\n", found)
