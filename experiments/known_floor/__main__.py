"""Two synthetic 10 h runs with a known truth: what is left on run B over the noise realised in it.

Run ``python -m experiments.known_floor``; it writes ``results.json`` and ``results.md`` beside itself.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from experiments.results import write_results
from experiments.synthetic_world import World, cycle
from fogml import __version__
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.signals.averages import block_averages
from fogml.validation.judge import judge

HERE = Path(__file__).parent
AVERAGING_S = 100.0
HOURS = 10.0
RIGHT = "T^1..3, T_in-T_out, dT, T*dT"
MODELS = {
    "polynomial with the right features": ("polynomial", RIGHT, 1.05),
    "RBF network of the same inputs": ("rbf", "T, dT, T*dT, T_in-T_out", 1.10),
    "auto": ("auto", None, None),
    "cubic in T": ("polynomial", "T^1..3", None),
}


def world(seed: int) -> World:
    """A unit drawn from a seed: cubic static curve, gradient, block-differenced rate and T times rate."""
    draw = np.random.default_rng([seed, 7])
    return World(
        polynomial=tuple(draw.normal(0.0, 1.0, 4) * [0.3, 5e-3, 5e-5, 5e-7]),
        gradient=float(draw.normal(0.0, 0.08)),
        rate=float(draw.normal(0.0, 0.15)),
        product=float(draw.normal(0.0, 2e-3)),
        noise=0.3,
    )


def realised_floor(run: Run, drift: np.ndarray, skip_s: float) -> float:
    """Bias stability of the noise alone in the averages that a judgement makes [deg/h]."""
    rows = run.time >= run.time[0] + skip_s
    noise = (run.gyro - drift)[rows]
    return float(block_averages(run.time[rows], noise, window_s=AVERAGING_S).values[0].std())


def case(seed: int) -> list[dict]:
    """Figures of each model on one unit: run A at 1 degC/min, run B at 0.8 degC/min."""
    unit = world(seed)
    train, _ = unit.run(cycle(1.0, 1.0, HOURS), 1.0, 2 * seed, "a.csv")
    test, drift = unit.run(cycle(0.8, 1.0, HOURS), 1.0, 2 * seed + 1, "b.csv")
    rows = []
    for label, (name, features, limit) in MODELS.items():
        model = make_model(name, features=features).fit(train)
        judged = judge(model, train, test, averaging_s=AVERAGING_S).test[0]
        floor = realised_floor(test, drift, float(test.time[model.evaluate(test).full][0]))
        rows.append(
            {
                "seed": seed,
                "model": label,
                "before": judged.before.bias_stability,
                "after": judged.after.bias_stability,
                "realised_floor": floor,
                "estimated_floor": judged.floor,
                "ratio": judged.after.bias_stability / floor,
                "limit": limit,
            }
        )
    return rows


def page(rows: list[dict]) -> str:
    """The result page."""
    lines = [
        "| model | before, median | after, median | realised floor, median | after / floor, median | "
        "after / floor, largest | wanted |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for label, (_, _, limit) in MODELS.items():
        found = [r for r in rows if r["model"] == label]
        ratio = [r["ratio"] for r in found]
        cells = [f"{np.median([r[key] for r in found]):.4f}" for key in ("before", "after", "realised_floor")]
        wanted = f"≤ {limit:.2f}" if limit else ""
        lines.append(
            f"| {label} | {' | '.join(cells)} | {np.median(ratio):.3f} | {max(ratio):.3f} | {wanted} |"
        )
    estimated = np.median([r["estimated_floor"] / r["realised_floor"] for r in rows])
    units = len({r["seed"] for r in rows})
    return f"""# Residual over a known floor

Data: **synthetic** ({units} units drawn by `experiments/synthetic_world.py`): cubic static curve, gradient,
block-differenced rate and T·dT in the truth, white noise of 0.3 deg/h a sample, 1 Hz, 10 h. Run A at
1 °C/min, run B at 0.8 °C/min. Figures are bias stability of {AVERAGING_S:.0f} s averages on run B [deg/h];
the floor is that of the noise realised in that very run. fogml {__version__};
`python -m experiments.known_floor`.

{chr(10).join(lines)}

The floor that fogml estimates from the output alone is {estimated:.3f} times the realised one (median).
"""


def main(seeds: int = 6) -> None:
    """Compute and write the results."""
    rows = [row for seed in range(seeds) for row in case(seed)]
    write_results(HERE, rows, page(rows))
    print(page(rows))


if __name__ == "__main__":
    main()
