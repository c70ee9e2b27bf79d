"""One floor for one run: against what the noise leaves in that very run, and whether it moves by rows."""

from __future__ import annotations

from typing import Any

import numpy as np

from experiments.real_files.section import Section, table
from fogml.runs.run import Run
from fogml.signals.averages import block_averages
from fogml.twin.simulate import simulate
from fogml.validation.floors import floor_of_run

RUNS, QUICK_RUNS = 200, 2
AVERAGING_S = 100.0
DROPPED = (0, 50, 120, 127, 130, 150)
"""Rows dropped at the beginning."""


def figures(runs: int) -> dict[str, Any]:
    """Floors of thermal cycles of the tactical twin, of themselves and of a static run, and realised ones."""
    realised, own, static, inside, moves = [], [], [], [], []
    for seed in range(runs):
        made = simulate("multi-point-cycle", "tactical", sample_s=2.0, seed=seed, truth=True)
        assert made.truth is not None
        run, noise = made.run, made.run.gyro_deg_h - made.truth.noise_free
        realised.append(float(block_averages(run.time, noise, window_s=AVERAGING_S).values[0].std()))
        still = Run.from_columns("static", time=run.time, gyro=noise, T=np.full(len(run), 25.0))
        every = np.ones(len(run), dtype=np.bool_)
        floor = floor_of_run(run, every, run.error_deg_h, AVERAGING_S)
        own.append(floor)
        static.append(floor_of_run(run, every, run.error_deg_h, AVERAGING_S, still))
        if seed < 20:
            places = np.arange(len(run))
            found = [
                floor_of_run(run, places >= rows, run.error_deg_h, AVERAGING_S).value for rows in DROPPED
            ]
            error = (floor.upper - floor.lower) / (2.0 * 1.645)
            moves.append(float(np.ptp(found)) / error)
    truth = float(np.sqrt(np.mean(np.square(realised))))
    for floor in own:
        inside.append(floor.lower <= truth <= floor.upper)
    return {
        "runs": runs,
        "realised_rms": truth,
        "own_mean": float(np.mean([f.value for f in own])),
        "own_sd": float(np.std([f.value for f in own])),
        "own_coverage": float(np.mean(inside)),
        "static_mean": float(np.mean([f.value for f in static])),
        "static_coverage": float(np.mean([f.lower <= truth <= f.upper for f in static])),
        "largest_move_in_standard_errors": float(np.max(moves)),
    }


def section(quick: bool) -> Section:
    """The part of the page."""
    found = figures(QUICK_RUNS if quick else RUNS)
    rows = [
        ("realised, rms over runs", f"{found['realised_rms']:.4f}", ""),
        (
            "from the run itself, drift in it",
            f"{found['own_mean']:.4f} ± {found['own_sd']:.4f}",
            f"{found['own_coverage']:.3f}",
        ),
        (
            "from a static run of the same noise",
            f"{found['static_mean']:.4f}",
            f"{found['static_coverage']:.3f}",
        ),
    ]
    words = (
        f"## One floor for one run\n\nSynthetic: thermal cycles of the twin `tactical`, "
        f"2 s samples, averages over "
        f"{AVERAGING_S:g} s, {found['runs']} runs. Coverage: share of the 90 % "
        f"intervals that hold the realised rms "
        f"over all runs [deg/h]; the twin's slow random walk counts as drift in the run itself. Dropping "
        f"{', '.join(map(str, DROPPED))} rows moves a floor by "
        f"{found['largest_move_in_standard_errors']:.2f} of its standard errors at most.\n"
    )
    return Section(f"{words}\n{table(('floor [deg/h]', 'mean', 'coverage'), rows)}\n", found)
