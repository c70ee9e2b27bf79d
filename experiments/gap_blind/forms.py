"""How much of what truly acts the catalogue's best form holds: what a diagnosis loses before it begins.

The first reality has other forms of the same effects. For each known effect of a suite, the share of its
true contribution, whitened by the true noise and beside the nominal constants and ordinary sensors' errors,
that the best node of the catalogue's candidate makes with the best coefficients of its columns ::

    1 - min_b ||s - C b||^2 / ||s||^2

and what is lost, ``||s - C b||^2 / 2`` nats. The rest counts as evidence for something else.

``python -m experiments.gap_blind.forms DIR/PART`` writes ``forms-PART.json``
beside itself, and ``forms.md`` of every part of the seed that was measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.gap_blind.per_case import measure_cases, true_forms, true_frame, write_page
from fogml.blind.folders import BlindFolder
from fogml.blind.truth import read_truth
from fogml.gap.candidate_columns import candidate_columns
from fogml.gap.screening import Screening
from fogml.gap.twin_model import TwinModel
from fogml.twin.twin_file import load_twin

LEAST_D_PRIME = 6.0
"""Weaker effects are left out: of them no form is told from another."""
NATS = 3.0
Row = dict[str, Any]


def main() -> None:
    """Measure every case, write the table."""
    suite = "a suite, or a part of one; it need not be answered"
    found = measure_cases("forms", _measured, __doc__, suite).cases
    rows = [row for own in found for row in own]
    write_page("forms", _page(rows, len(found)))


def _measured(folder: BlindFolder, name: str) -> list[Row]:
    """The share of each known effect of a case that the best node holds."""
    truth = read_truth(folder.truth / f"{name}.json")
    model = TwinModel(load_twin("nominal"))
    candidates = model.candidates()
    counted = [
        i
        for i, e in enumerate(truth.effects)
        if e in truth.known and e.id in candidates and e.d_prime >= LEAST_D_PRIME
    ]
    if not counted:
        return []
    frame = true_frame(folder, truth, model)
    true_form = frame.without_constants(true_forms(folder, truth, frame))
    screening = Screening(frame, [])
    rows = []
    for i in counted:
        effect = truth.effects[i]
        true = true_form[:, i]
        least = whole = float(true @ true)
        for _, columns in candidate_columns(candidates[effect.id], frame, model.grade, screening):
            own = frame.without_constants(columns)
            left = true - own @ np.linalg.lstsq(own, true, rcond=None)[0]
            least = min(least, float(left @ left))
        rows.append(
            {"case": name, "effect": effect.id, "d_prime": effect.d_prime}
            | {"held": 1.0 - least / whole, "lost_nats": 0.5 * least}
        )
    return rows


def _page(rows: Sequence[Row], cases: int) -> str:
    held: dict[str, list[Row]] = {}
    for row in rows:
        held.setdefault(row["effect"], []).append(row)
    lines = [
        "# What the catalogue's forms hold of what truly acts",
        "",
        f"Synthetic cases of the first reality: {cases}, with {len(rows)} known effects of a d′ of "
        f"{LEAST_D_PRIME:g} or more. Share of an effect's true contribution, whitened and beside the nominal "
        "constants and ordinary sensors' errors, that the best node of the catalogue's form holds; and what "
        f"is lost with the rest. Where more than {NATS:g} nats are lost, another name may be as good.",
        "",
        "What coarse sensors (`sensor_quantisation`) truly add is taken from the first reality's own "
        "replay, whose windows of the temperature difference are not the twin's: of the gap that a "
        "diagnosis sees, the form holds more.",
        "",
        f"| effect | effects | median share held | least | median nats lost | more than {NATS:g} lost |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for id in sorted(held, key=lambda id: float(np.median([row["held"] for row in held[id]]))):
        share = np.array([row["held"] for row in held[id]])
        lost = np.array([row["lost_nats"] for row in held[id]])
        lines.append(
            f"| {id} | {len(share)} | {np.median(share):.3f} | {share.min():.2f} | {np.median(lost):.1f} | "
            f"{np.mean(lost > NATS):.0%} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
