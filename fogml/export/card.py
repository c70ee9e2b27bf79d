"""What an export says of the model that it is made from."""

from __future__ import annotations

from typing import Any

from fogml.export.plan import Plan
from fogml.models.base import DriftModel


def export_card(model: DriftModel, plan: Plan, pruning: dict[str, Any] | None) -> dict[str, Any]:
    """What an export states of its model, JSON-ready."""
    card = model.card_
    return {
        "kind": plan.kind,
        "features": list(plan.names),
        "unit": card.unit,
        "axis": card.axis,
        "training_runs": [{"name": run.name, "sha256": run.sha256} for run in card.runs],
        "fogml_version": card.fogml_version,
        "box": {
            atom.text: [float(plan.limits.box_low[i]), float(plan.limits.box_high[i])]
            for i, atom in enumerate(plan.atoms)
        },
        "half_width_90_deg_h": float(model.intervals_.half_width(0.9)),
        "averaging_s": model.intervals_.averaging_s,
        "earth_known": card.earth_known,
        **({"pruned_to_bytes": pruning["bytes_asked"]} if pruning else {}),
    }


def card_lines(card: dict[str, Any], plan: Plan, dtype: str) -> list[str]:
    """The card as lines of text."""
    runs = card["training_runs"]
    lines = [
        f"gyro          {card['unit'] or 'not stated'}, axis {card['axis'] or 'not stated'}",
        *(f"trained on    {run['name']}, SHA-256 {run['sha256'][:16]}..." for run in runs),
        f"features      {', '.join(plan.names) or 'none'}",
        *(f"trained box   {name}: {low:.6g} to {high:.6g}" for name, (low, high) in card["box"].items()),
        f"accuracy      90 % of {card['averaging_s']:g} s averages within "
        f"{card['half_width_90_deg_h']:.3g} deg/h,",
        "              by parts of the training runs that were left out; not known outside the trained box",
        f"numbers       {dtype}"
        + (f", pruned to {card['pruned_to_bytes']} bytes of weights" if "pruned_to_bytes" in card else ""),
    ]
    if not card["earth_known"]:
        lines.append("earth rate    not known in training: its part along the axis is taken for drift")
    return lines
