"""Units per second of RBF networks trained one by one and in one tensor program.

Run ``python -m experiments.batched_training [--device cuda]``; it writes ``results.json`` and
``results.md`` beside itself, for an accelerator ``results-cuda.*``. Rows are synthetic.
"""

from __future__ import annotations

import argparse
import json
import time
from functools import partial
from pathlib import Path

import numpy as np

from experiments.results import write_results
from fogml import __version__
from fogml.models.rbf import RBFRegressor
from fogml.models.rbf.together import fit_together

HERE = Path(__file__).parent
UNITS = (1, 16, 256, 1024)
ALONE = 16
ROWS, CENTRES = 200, 8


def rows(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Synthetic rows of a unit: T, dT, T*dT over one cycle; a bent drift and white noise."""
    rng = np.random.default_rng(seed)
    cycle = np.linspace(0.0, 1.0, ROWS)
    temperature = 30.0 * np.sin(2 * np.pi * cycle * (1 + seed % 3))
    rate = 5.0 * np.gradient(temperature)
    inputs = np.column_stack([temperature, rate, temperature * rate])
    drift = np.sin(temperature / 8.0 + rng.normal()) + rng.normal() * 0.1 * rate
    return inputs, drift + 0.02 * rng.normal(size=ROWS)


def fitted(seed: int, device: str) -> RBFRegressor:
    """The network of one unit."""
    return RBFRegressor(centres=CENTRES, tune=False, device=device).fit(*rows(seed))


def measure(device: str) -> list[dict]:
    """Units per second for each size of fleet, and the largest difference from one by one."""
    fitted(0, device)
    began = time.perf_counter()
    alone = [fitted(seed, device) for seed in range(ALONE)]
    one_by_one = ALONE / (time.perf_counter() - began)
    found = []
    for count in UNITS:
        began = time.perf_counter()
        together = fit_together([partial(fitted, seed, device) for seed in range(count)])
        spent = time.perf_counter() - began
        differences = [
            np.abs(one.predict(rows(seed)[0]) - other.predict(rows(seed)[0])).max()
            for seed, (one, other) in enumerate(zip(alone, together))
        ]
        found.append(
            {
                "units": count,
                "device": device,
                "one_by_one_per_s": one_by_one,
                "together_per_s": count / spent,
                "ratio": count / spent / one_by_one,
                "largest_difference": float(max(differences)),
            }
        )
    return found


def page(found: list[dict]) -> str:
    """The result page."""
    lines = [
        "# Networks of many units in one tensor program",
        "",
        f"fogml {__version__}, {found[0]['device']}. **Synthetic** rows: {ROWS} of three inputs a unit, "
        f"{CENTRES} centres, shared widths tuned from every start. One by one over {ALONE} units; "
        "ratios were taken while other work shared the machine's cores. The difference is the largest of any "
        "prediction on the training rows, deg/h. (`python -m experiments.batched_training`)",
        "",
        "| units | one by one, units/s | together, units/s | ratio | largest difference |",
        "|---:|---:|---:|---:|---:|",
    ]
    for row in found:
        lines.append(
            f"| {row['units']} | {row['one_by_one_per_s']:.2f} | {row['together_per_s']:.2f} | "
            f"{row['ratio']:.2f} | {row['largest_difference']:.1e} |"
        )
    return "\n".join([*lines, ""])


def main() -> None:
    """Measure and write the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cpu")
    device = parser.parse_args().device
    found = measure(device)
    if device == "cpu":
        write_results(HERE, found, page(found))
        return
    (HERE / f"results-{device}.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    (HERE / f"results-{device}.md").write_text(page(found), encoding="utf-8")


if __name__ == "__main__":
    main()
