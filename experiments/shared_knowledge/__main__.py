"""Residual against chamber hours for a new unit, with and without the constants of its fleet.

Run ``python -m experiments.shared_knowledge``; it writes ``results.json`` and ``results.md`` beside
itself. All runs are synthetic: the units' constants are drawn from normal distributions, those of
odd units from ones three or six times as wide. No unit of `FRESH` was looked at before the check for
odd units was fixed; its level was chosen on those of `TRIED`.
"""

from __future__ import annotations

from functools import lru_cache
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
FLEET = 24
TRIED, FRESH = range(3000, 3060), range(5000, 5040)
HOURS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
FAR = {1.0: "like the fleet", 3.0: "odd, 3 times", 6.0: "odd, 6 times"}
NOISE = 1.05
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


@lru_cache(maxsize=8)
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
        "far": far,
        "hours": hours,
        "left": any("left to its own runs" in note for note in drawn.card_.notes),
        "agreement": getattr(drawn.regressor_, "agreement_", None),
        "before": judged[0].before.bias_stability,
        "alone": judged[0].after.bias_stability,
        "drawn": judged[1].after.bias_stability,
        "floor": judged[0].floor,
    }


def page(rows: list[dict]) -> str:
    """The result page."""
    units = len({row["seed"] for row in rows})
    lines = [
        "# Chamber hours that a new unit needs, with and without its fleet",
        "",
        f"fogml {__version__}. **Synthetic**: {FLEET} units of a fleet with a full cycle of 11 h each; then "
        f"{units} new units like them (seeds {min(FRESH)} to {max(FRESH)}), and as many odd ones whose "
        "constants are drawn 3 and 6 times as far out. "
        "Each is trained on the first hours of a cycle at 1 degC/min and judged on a full cycle at "
        f"0.8 degC/min: bias stability of {AVERAGING_S:g} s averages, deg/h. `alone` is a polynomial with "
        f"`{FORM}` and cross-validated ridge, `drawn` the same form with the fleet as its prior; `left` is "
        "the share of units that were left to their own run, as odd or as too short. "
        "(`python -m experiments.shared_knowledge`)",
        "",
        f"Whether a unit is odd is told by its training rows alone. The level of that check was chosen on "
        f"other units (seeds {min(TRIED)} to {max(TRIED)}); those of this page were first looked at with it "
        "fixed.",
        "",
        "| units | hours | before, median | alone, median | drawn, median | drawn / alone, median | "
        f"drawn / alone, largest | above {NOISE:g} | left | floor, median |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for far, name in FAR.items():
        for hours in HOURS:
            some = [row for row in rows if row["far"] == far and row["hours"] == hours]
            middle = {
                key: np.median([row[key] for row in some]) for key in ("before", "alone", "drawn", "floor")
            }
            ratio = np.array([row["drawn"] / row["alone"] for row in some])
            lines.append(
                f"| {name} | {hours:g} | {middle['before']:.3f} | "
                f"{middle['alone']:.3f} | {middle['drawn']:.3f} | "
                f"{np.median(ratio):.2f} | {ratio.max():.2f} | {np.sum(ratio > NOISE)} of {len(ratio)} | "
                f"{np.mean([row['left'] for row in some]):.0%} | {middle['floor']:.3f} |"
            )
    lines += ["", *_said(rows), ""]
    return "\n".join(lines)


def _said(rows: list[dict]) -> list[str]:
    like = [row for row in rows if row["far"] == 1.0]

    def needed(key: str) -> float:
        medians = {h: np.median([row[key] for row in like if row["hours"] == h]) for h in HOURS}
        near = 1.1 * medians[HOURS[-1]]
        return next(h for h in HOURS if medians[h] <= near)

    said = [
        f"To come within 10 % of what the longest run leaves, the median unit needs {needed('alone'):g} h "
        f"alone and {needed('drawn'):g} h drawn to its fleet.",
        "",
    ]
    for far, name in FAR.items():
        ratio = np.array([row["drawn"] / row["alone"] for row in rows if row["far"] == far])
        said.append(
            f"- {name}: the worst that the fleet did was {ratio.max():.2f} times what the unit's own run "
            f"alone left; above {NOISE:g} in {np.sum(ratio > NOISE)} of {len(ratio)} cases, below "
            f"{1 / NOISE:.2f} in {np.sum(ratio < 1 / NOISE)}."
        )
    harmed = [row["agreement"] for row in rows if row["drawn"] > NOISE * row["alone"]]
    looked = (
        f" In the cases above {NOISE:g}, {min(harmed):.0%} to {max(harmed):.0%} of the fleet's own units "
        "would look as odd in that run, or odder."
        if harmed
        else ""
    )
    return [
        *said,
        "",
        "A unit whose rows lie where fewer than 5 % of the fleet's units would is left to its run, and so is "
        "any whose run covers less than a quarter of the fleet's temperatures. What remains are mostly units "
        "whose constants are odd only where their short run does not go, which no check of that run can tell."
        f"{looked}",
    ]


def main() -> None:
    """Run every case and write the results."""
    fleet = fleet_constants([UnitConstants.of([run(unit(seed), seed, 1.0)]) for seed in range(FLEET)])
    rows = [case(fleet, seed, hours, far) for far in FAR for seed in FRESH for hours in HOURS]
    write_results(HERE, rows, page(rows))


if __name__ == "__main__":
    main()
