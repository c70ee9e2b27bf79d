"""Residual against chamber hours for a new unit, with and without the constants of its fleet.

Run ``python -m experiments.shared_knowledge``; it writes ``results.json`` and ``results.md`` beside
itself. All runs are synthetic: the units' constants are drawn from normal distributions, those of
odd units from ones three or six times as wide. No unit of `FRESH` was looked at before the check for
odd units was fixed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from experiments.results import write_results
from experiments.shared_knowledge.ideal import nats_for_odd
from experiments.shared_knowledge.page import page
from experiments.shared_knowledge.units import SAMPLE_S, TEST_RATE, TRAIN_RATE, run, unit
from fogml.arrays import BoolArray, FloatArray
from fogml.fleet.constants import FORM, FleetConstants, UnitConstants, fleet_constants
from fogml.fleet.shared import SharedModel, shared_model
from fogml.models.mixed_effects_model import MixedEffectsModel
from fogml.models.names import make_model
from fogml.validation.judge import judge

HERE = Path(__file__).parent
AVERAGING_S = 100.0
FLEET = 24
FRESH = range(9100, 9104)
HOURS = (1.5, 2.0, 4.0, 8.0)
WIDTHS = (1.0, 3.0, 6.0)


class Unchecked(SharedModel):
    """A model drawn to the fleet whatever its run tells."""

    def _why_alone(self, covered: float) -> str:
        return ""


def left_where(error: FloatArray, where: BoolArray) -> float:
    """Standard deviation of averages of an error [deg/h] that lie wholly where a mask says."""
    width = round(AVERAGING_S / SAMPLE_S)
    count = len(error) // width
    whole = where[: count * width].reshape(count, width).all(axis=1)
    means = error[: count * width].reshape(count, width).mean(axis=1)
    return float(means[whole].std(ddof=1))


def case(fleet: FleetConstants, seed: int, hours: float, far: float) -> dict[str, Any]:
    """What is left of another run with a model of the first hours of one, with and without the fleet."""
    world = unit(seed, far)
    train, test = run(world, 2 * seed, TRAIN_RATE, hours), run(world, 2 * seed + 1, TEST_RATE)
    drawn = shared_model(fleet).fit(train)
    left = any("left to its own runs" in note for note in drawn.card_.notes)
    alone = MixedEffectsModel(FORM).fit(train)
    anyway = Unchecked(fleet.features, fleet.prior.as_dict(), fleet.box, fleet.own, fleet.noise).fit(train)
    models = (alone, drawn, anyway, make_model("auto").fit(train))
    judged = [judge(model, train, test, averaging_s=AVERAGING_S).test[0] for model in models]
    seen, with_fleet = alone.evaluate(test), anyway.evaluate(test)
    shown = seen.full & ~seen.outside
    errors = [test.gyro - drift for drift in (seen.drift, drawn.predict(test))]
    half = test.gyro - 0.5 * (seen.drift + with_fleet.drift)
    row = {
        "seed": seed,
        "far": far,
        "hours": hours,
        "left": left,
        "told": bool(drawn.from_fleet_),
        "agreement": anyway.agreement_,
        "nats": {f"{width:g}": round(nats_for_odd(train, hours, width), 3) for width in WIDTHS[1:]},
        "before": judged[0].before.bias_stability,
        "alone": judged[0].after.bias_stability,
        "drawn": judged[1].after.bias_stability,
        "anyway": judged[2].after.bias_stability,
        "auto": judged[3].after.bias_stability,
        "rms_alone": judged[0].after.rms,
        "rms_drawn": judged[1].after.rms,
        "half": left_where(half, seen.full),
        "shown_alone": left_where(errors[0], shown),
        "shown_drawn": left_where(errors[1], shown),
        "floor": judged[0].floor,
    }
    return {key: float(f"{value:.6g}") if isinstance(value, float) else value for key, value in row.items()}


def main() -> None:
    """Run every case and write the results."""
    fleet = fleet_constants([UnitConstants.of([run(unit(seed), seed, TRAIN_RATE)]) for seed in range(FLEET)])
    rows = [case(fleet, seed, hours, far) for far in WIDTHS for seed in FRESH for hours in HOURS]
    write_results(HERE, rows, page(rows, fleet=FLEET, averaging_s=AVERAGING_S))


if __name__ == "__main__":
    main()
