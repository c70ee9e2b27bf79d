"""RBF networks trained on this machine's processor and on an accelerator: time, and how far they differ.

``python -m experiments.devices [--device cuda]`` writes ``results.json`` and ``results.md`` beside itself.
Needs an accelerator that torch finds. Runs are synthetic; both devices take the same ones, in one process.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from experiments.results import write_results
from fogml.arrays import FloatArray
from fogml.models.rbf import RBFRegressor

HERE = Path(__file__).parent
ROWS = (200, 2_000, 20_000, 200_000)
CENTRES = 12
NOISE = 0.05
REPEATS = 3


def run_of(rows: int) -> tuple[FloatArray, FloatArray]:
    """Inputs T, dT and T·dT over three cycles of a chamber; a bent drift under white noise [deg/h]."""
    phase = np.linspace(0.0, 6.0 * np.pi, rows)
    temperature = 30.0 * np.sin(phase) + 5.0 * np.sin(0.37 * phase)
    rate = np.gradient(temperature, phase)
    drift = np.sin(temperature / 8.0) + 0.1 * rate
    noise = NOISE * np.random.default_rng(0).standard_normal(rows)
    return np.column_stack([temperature, rate, temperature * rate]), drift + noise


def measured(rows: int, device: str) -> tuple[float, FloatArray]:
    """Seconds of a fit, the least of some, and what the network then predicts at its rows."""
    inputs, drift = run_of(rows)
    spent = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        network = RBFRegressor(centres=CENTRES, tune=False, device=device).fit(inputs, drift)
        spent.append(time.perf_counter() - began)
    return min(spent), network.predict(inputs)


def page(name: str, found: list[dict[str, float]]) -> str:
    """The result page."""
    return "\n".join(
        [
            "# RBF networks on an accelerator",
            "",
            f"{name} beside one core of the processor of its machine. **Synthetic** runs: three inputs, "
            f"{CENTRES} centres, white noise of {NOISE:g} deg/h; the least of {REPEATS} fits. The difference "
            "is the largest of any prediction, deg/h. (`python -m experiments.devices`)",
            "",
            "| rows | processor, s | accelerator, s | ratio | largest difference, deg/h |",
            "|---:|---:|---:|---:|---:|",
            *(
                f"| {r['rows']:,} | {r['cpu_s']:.3f} | {r['device_s']:.3f} "
                f"| {r['cpu_s'] / r['device_s']:.2f} | {r['largest_difference']:.1e} |"
                for r in found
            ),
            "",
        ]
    )


def main() -> None:
    """Measure and write the results."""
    import torch

    parser = argparse.ArgumentParser(prog="python -m experiments.devices", description=__doc__)
    parser.add_argument("--device", default="cuda")
    device = parser.parse_args().device
    torch.set_num_threads(1)
    for place in ("cpu", device):
        measured(ROWS[0], place)
    found = []
    for rows in ROWS:
        (cpu_s, here), (device_s, there) = measured(rows, "cpu"), measured(rows, device)
        apart = float(np.abs(here - there).max())
        found.append({"rows": rows, "cpu_s": cpu_s, "device_s": device_s, "largest_difference": apart})
    name = torch.cuda.get_device_name(device) if device.startswith("cuda") else device
    write_results(HERE, {"device": name, "fits": found}, page(name, found))


if __name__ == "__main__":
    main()
