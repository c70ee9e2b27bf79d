"""What stands beside a model in a firmware file: card, formula, numbers, units, flags, tests, hashes."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from fogml.errors import InputError
from fogml.escaping import c_text
from fogml.export.number_files import EDGE, formula_of
from fogml.export.plan import Plan
from fogml.export.self_test import sensor_range
from fogml.export.static_curve import at_rest
from fogml.features.signal import unit_of
from fogml.models.base import DriftModel
from fogml.models.saved import model_hash
from fogml.numerals import ascii_number


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
        f"{ascii_number(card['half_width_90_deg_h'])} deg/h,",
        "              by parts of the training runs that were left out; not known outside the trained box",
        f"numbers       {dtype}"
        + (f", pruned to {card['pruned_to_bytes']} bytes of weights" if "pruned_to_bytes" in card else ""),
    ]
    if not card["earth_known"]:
        lines.append("earth rate    not known in training: its part along the axis is taken for drift")
    return lines


DOCUMENTATION_FILE = "fogml_model.txt"
_POINTS = (0.25, 0.5, 0.8)
"""Where in the trained box the test vectors lie, as shares of it."""
_GYRO = 20.0
"""Output that the vectors of a model with a scale factor are of, in its unit."""


def documentation(model: DriftModel, plan: Plan | None = None) -> str:
    """The block of text, in ASCII, that documents a model where its numbers are used.

    Coefficients are in full precision: read back, they are the model's. The test vectors are what the plain
    form computes of values of its inputs, windows full; `export_model` holds that form against the model.

    Parameters
    ----------
    model
        A fitted model.
    plan
        What was exported of it; the whole model by default.

    Raises
    ------
    InputError
        If the model has no compact form.
    """
    plan = plan or Plan.of(model)
    card = export_card(model, plan, None)
    lines = [
        f"gyro         {card['unit'] or 'unit not stated'}, axis {card['axis'] or 'not stated'}",
        f"model        {plan.kind}, SHA-256 {model_hash(model)}",
        *(f"trained on   {run['name']}, SHA-256 {run['sha256']}" for run in card["training_runs"]),
        f"fogml        {card['fogml_version']}",
        "",
        f"formula      {formula_of(plan)[1]}",
        *([f"             {EDGE}"] if plan.edge_columns else []),
        *([] if plan.gives_rate else ["             compensated = gyro - drift, all in deg/h"]),
        "",
        "coefficients",
        *_coefficients(plan),
        "",
        "inputs, in this order",
        *(f"  {i}  {sensor} [{unit_of(sensor) or '1'}]" for i, sensor in enumerate(plan.sensors)),
        *(["  none"] if not plan.sensors else []),
        *_atoms(plan),
        "",
        "flags",
        "  0  inside what the model was trained on",
        "  1  outside of it: the value is levelled off",
        "  2  a window is not full or a memory not settled; or a temperature is missing: the last",
        "     value is held, before any that of the middle of the trained box",
        "",
        "test vectors, windows full and memories settled",
        *_vectors(plan),
        "",
        f"accuracy     90 % of {card['averaging_s']:g} s averages within "
        f"{ascii_number(card['half_width_90_deg_h'])} deg/h on parts of the training runs that were left out",
    ]
    return "\n".join(c_text(line).rstrip() for line in lines) + "\n"


def documentation_or_none(model: DriftModel) -> str | None:
    """As `documentation`; None for a model without a compact form."""
    try:
        return documentation(model)
    except InputError:
        return None


def _coefficients(plan: Plan) -> list[str]:
    arrays = plan.arrays
    rows = [("constant", float(arrays["constant"][0]), "deg/h", "")]
    if plan.gives_rate:
        unit = f"deg/h per {plan.gyro_unit}"
        powers = ("", "/degC", "/degC^2")
        rows += [(f"scale[{i}]", float(v), unit + powers[i], "") for i, v in enumerate(arrays["scale"])]
    units = _column_units(plan)
    for k, value in enumerate(arrays.get("linear", ())):
        rows.append((f"linear[{k}]", float(value), f"deg/h{units[k]}", plan.names[k]))
    for j in range(plan.centres):
        rows.append((f"weights[{j}]", float(arrays["weights"][j]), "deg/h", ""))
        for d, k in enumerate(plan.columns):
            unit = units[k].removeprefix("/").strip("()")
            rows.append((f"centres[{j}][{d}]", float(arrays["centres"][j][d]), unit, plan.names[k]))
            rows.append((f"widths[{j}][{d}]", float(arrays["widths"][j][d]), unit, plan.names[k]))
    for r, k in enumerate(plan.edge_columns):
        unit = units[k].removeprefix("/").strip("()")
        rows += [(f"edge[{end}][{r}]", float(plan.edge[end, r]), unit, plan.names[k]) for end in (0, 1)]
    return [f"  {name:<14} {value!r:>24}  {unit:<24} {of}" for name, value, unit, of in rows]


def _column_units(plan: Plan) -> list[str]:
    """What a coefficient's unit is divided by, for each feature: ``/degC^2``, ``/(degC degC/min)``."""
    counts: list[Counter[str]] = []
    for step in plan.steps:
        own = Counter(unit for i in step.atoms if (unit := plan.atoms[i].unit))
        counts.append(own + (counts[step.column] if step.column is not None else Counter()))
    texts = []
    for count in counts:
        parts = []
        for unit in sorted(count, key=lambda unit: ("/" in unit, unit)):
            power = "" if count[unit] == 1 else f"^{count[unit]}"
            parts.append(f"({unit}){power}" if power and "/" in unit else unit + power)
        joined = " ".join(parts)
        texts.append(f"/({joined})" if len(parts) > 1 or "/" in joined else f"/{joined}" if joined else "")
    return texts


def _atoms(plan: Plan) -> list[str]:
    if not plan.atoms:
        return []
    limits = plan.limits
    lines = ["", "what is made of them, with its trained range"]
    width = len(str(len(plan.atoms) - 1))
    for i, atom in enumerate(plan.atoms):
        window = ""
        if atom.window is not None:
            window = f", {atom.window.method}" + (
                f" over {atom.window.length_s:g} s" if atom.window.length_s else ""
            )
        low, high = float(limits.box_low[i]), float(limits.box_high[i])
        lines.append(f"  {i:>{width}}  {atom.text} [{atom.unit or '1'}]{window}: {low:.9g} to {high:.9g}")
    return lines


def _vectors(plan: Plan) -> list[str]:
    names = [atom.text for atom in plan.atoms]
    shares = np.array(_POINTS)
    ends = {sensor: sensor_range(plan, sensor) for sensor in plan.sensors}
    held = {sensor: low + shares * (high - low) for sensor, (low, high, _) in ends.items()}
    atoms = np.empty((len(shares), len(names)))
    for i, atom in enumerate(plan.atoms):
        if atom.of_input_at_rest:
            atoms[:, i] = at_rest(atom, held)
        else:
            low, high = plan.limits.box_low[i], plan.limits.box_high[i]
            atoms[:, i] = low + shares * (high - low)
        if atom.operator == "sign":
            atoms[:, i] = np.sign(atoms[:, i])
    columns = plan.full_columns(atoms)
    gyro = np.full(len(atoms), _GYRO)
    values = plan.value(columns, gyro)
    lines = []
    for row, value in zip(atoms.tolist(), values.tolist(), strict=True):
        given = [f"{name} = {number!r}" for name, number in zip(names, row, strict=True)]
        if plan.gives_rate:
            given.insert(0, f"gyro = {_GYRO!r} {plan.gyro_unit}")
        result = "compensated" if plan.gives_rate else "drift"
        lines.append(f"  {', '.join(given) or 'always'}: {result} = {value!r} deg/h")
    return lines if names else lines[:1]
