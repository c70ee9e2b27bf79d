"""Residual against chamber hours for a new unit, with and without the constants of its fleet.

Run ``python -m experiments.shared_knowledge``; it writes ``results.json`` and ``results.md`` beside
itself. All runs are synthetic: the units' constants are drawn from normal distributions, those of
odd units from ones six times as wide.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from experiments.results import write_results
from experiments.synthetic_world import World, cycle
from fogml import __version__
from fogml.fleet.shared import FORM, FleetConstants, UnitConstants, fleet_constants, shared_model
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.validation.judge import judge

HERE = Path(__file__).parent
AVERAGING_S, SAMPLE_S = 100.0, 5.0
FLEET, NEW = 24, 24
HOURS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
ODD = 6.0
MEAN = {"polynomial": (0.2, 4e-3, -3e-5, 4e-7), "rate": 0.12, "product": 1.5e-3}
SPREAD = {"polynomial": (0.1, 1e-3, 1e-5, 1e-7), "rate": 0.03, "product": 4e-4}


def unit(seed: int, far: float = 1.0) -> World:
    """A unit whose constants are drawn from a seed, `far` times as far from the mean."""
    draw = np.random.default_rng([seed, 11])
    polynomial = np.array(MEAN["polynomial"]) + far * np.array(SPREAD["polynomial"]) * draw.normal(size=4)
    return World(
        polynomial=tuple(polynomial),
        gradient=0.0,
        rate=MEAN["rate"] + far * SPREAD["rate"] * draw.normal(),
        product=MEAN["product"] + far * SPREAD["product"] * draw.normal(),
        noise=0.3,
    )


def run(world: World, seed: int, rate: float, hours: float | None = None) -> Run:
    """A run of one sensor, 25 -> -40 -> 60 -> 25 degC, cut to its first hours."""
    made, _ = world.run(cycle(rate, SAMPLE_S, hours), SAMPLE_S, seed, "run.csv")
    columns = {"time": made.time, "gyro": made.gyro, "T": made.columns["T_in"]}
    return Run("run.csv", columns, made.facts)


def case(fleet: FleetConstants, seed: int, hours: float, far: float) -> dict:
    """What is left of another run with a model of the first hours of one, with and without the fleet."""
    world = unit(seed, far)
    train, test = run(world, 2 * seed, 1.0, hours), run(world, 2 * seed + 1, 0.8)
    alone = make_model("polynomial", FORM).fit(train)
    drawn = shared_model(fleet).fit(train)
    judged = [judge(model, train, test, averaging_s=AVERAGING_S).test[0] for model in (alone, drawn)]
    return {
        "seed": seed,
        "odd": far > 1.0,
        "hours": hours,
        "before": judged[0].before.bias_stability,
        "alone": judged[0].after.bias_stability,
        "drawn": judged[1].after.bias_stability,
        "floor": judged[0].floor,
    }


def page(rows: list[dict]) -> str:
    """The result page."""
    lines = [
        "# Chamber hours that a new unit needs, with and without its fleet",
        "",
        f"fogml {__version__}. **Synthetic**: {FLEET} units of a fleet with a full cycle of 11 h each; then "
        f"{NEW} new units like them and {NEW} odd ones, whose constants lie {ODD:g} times as far out. "
        f"Each is trained on the first hours of a cycle at 1 degC/min and judged on a full cycle at "
        f"0.8 degC/min: bias stability of {AVERAGING_S:g} s averages, deg/h. `alone` is a polynomial with "
        f"`{FORM}` and cross-validated ridge, `drawn` the same form with the fleet as its prior. "
        "(`python -m experiments.shared_knowledge`)",
        "",
        "| units | hours | before, median | alone, median | drawn, median | drawn / alone, median | "
        "drawn / alone, largest | floor, median |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for odd in (False, True):
        for hours in HOURS:
            some = [row for row in rows if row["odd"] == odd and row["hours"] == hours]
            middle = {
                key: np.median([row[key] for row in some]) for key in ("before", "alone", "drawn", "floor")
            }
            ratio = [row["drawn"] / row["alone"] for row in some]
            lines.append(
                f"| {'odd' if odd else 'like the fleet'} | {hours:g} | {middle['before']:.3f} | "
                f"{middle['alone']:.3f} | {middle['drawn']:.3f} | "
                f"{np.median(ratio):.2f} | {max(ratio):.2f} | "
                f"{middle['floor']:.3f} |"
            )
    lines += ["", *_said(rows), ""]
    return "\n".join(lines)


def _said(rows: list[dict]) -> list[str]:
    like = [row for row in rows if not row["odd"]]

    def needed(key: str) -> float:
        medians = {h: np.median([row[key] for row in like if row["hours"] == h]) for h in HOURS}
        near = 1.1 * medians[HOURS[-1]]
        return next(h for h in HOURS if medians[h] <= near)

    worst = max(row["drawn"] / row["alone"] for row in rows if row["odd"] and row["hours"] >= 2.0)
    return [
        f"To come within 10 % of what the longest run leaves, the median unit needs {needed('alone'):g} h "
        f"alone and {needed('drawn'):g} h drawn to its fleet. Of the odd units, the worst that the fleet did "
        f"from 2 h on was {worst:.2f} times what the unit's own run alone left. An odd unit that its run "
        "tells is left to that run, and so is any unit whose run covers less than a quarter of the fleet's "
        "temperatures.",
    ]


def main() -> None:
    """Run every case and write the results."""
    fleet = fleet_constants([UnitConstants.of([run(unit(seed), seed, 1.0)]) for seed in range(FLEET)])
    rows = [
        case(fleet, 1000 + seed, hours, far) for far in (1.0, ODD) for hours in HOURS for seed in range(NEW)
    ]
    write_results(HERE, rows, page(rows))


if __name__ == "__main__":
    main()
