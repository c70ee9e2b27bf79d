"""Runs of a shipped twin, to be diagnosed against that same twin: nothing is missing, by construction.

No reality of its own: what it asks is whether noise and steps of thermometers at a coarse interval, or the
twin's own effects, make a diagnosis find something where a lab's twin is right.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from fogml.blind.plan import Plan
from fogml.blind.truth import Amount, Runs, Truth, write_truth
from fogml.outputs import whole_folder
from fogml.runs.facts import Facts
from fogml.runs.writing import write_run
from fogml.twin.simulate import simulate
from fogml.twin.twin_file import load_twin

TWINS = ("tactical", "navigation")
"""Shipped twins that cases take in turn."""
_COLUMNS = ("T_in", "T_out", "T_chamber", "rate")
_NOISE_UNITS = {"N": "deg/sqrt(h)", "B": "deg/h", "K": "deg/h/sqrt(h)"}


def make_same_twin(folder: Path, truth_folder: Path, plan: Plan, seed: int, sample_s: float) -> None:
    """Simulate one case and write it, with the twin's name among its options, and its truth.

    Parameters
    ----------
    folder, truth_folder
        The folders ``cases`` and ``truth``.
    plan
        Its number, how many runs, and whether there is a static one.
    seed, sample_s
        As for `fogml.blind.make.make_cases`.
    """
    rng = np.random.default_rng([seed, plan.number])
    name = TWINS[(plan.number - 1) % len(TWINS)]
    twin = load_twin(name)
    fit = tuple(f"fit-{k + 1}.csv" for k in range(plan.runs))
    programmes: dict[str, list[Any]] = {run: _cycle(rng) for run in (*fit, "held-out-1.csv")}
    if plan.static:
        programmes["static.csv"] = [{"soak at 25 degC for 6 h": []}]
    facts = Facts(unit=f"BLIND-{plan.name}", axis="x", latitude=39.9, input_axis="up", notes="simulated")
    with whole_folder(folder / plan.name) as place:
        for file, steps in programmes.items():
            own = int(rng.integers(2**31))
            made = simulate(steps, twin, sample_s=sample_s, seed=own, columns=_COLUMNS, facts=facts).run
            write_run(made, place / file)
        options = {"without": [], "twin": name}
        (place / "options.json").write_text(json.dumps(options, indent=1) + "\n", encoding="utf-8")
    truth = Truth(
        case=plan.name,
        seed=seed,
        kind=plan.kind,
        reality=plan.reality,
        runs=Runs(fit=fit, held_out=("held-out-1.csv",), noise="static.csv" if plan.static else None),
        sample_s=sample_s,
        turning=False,
        noise={key: Amount(value=getattr(twin.noise, key), unit=unit) for key, unit in _NOISE_UNITS.items()},
        thermal=f"the shipped {name} twin's",
        mix=plan.mix,
    )
    write_truth(truth_folder, truth, {})


def _cycle(rng: np.random.Generator) -> list[Any]:
    """A chamber cycle of some hours: down, up and back, soaks between, from power-on."""
    steps: list[Any] = [{f"soak at 25 degC for {rng.integers(15, 45)} min": ["power on"]}]
    ends = [int(rng.integers(-40, -5)), int(rng.integers(45, 70))]
    if rng.random() < 0.5:
        ends.reverse()
    for level in (*ends, int(rng.integers(10, 35))):
        steps.append({f"ramp to {level} degC at {rng.uniform(0.5, 2.0):.2f} degC/min": []})
        steps.append({f"soak at {level} degC for {rng.integers(30, 90)} min": []})
    return steps
