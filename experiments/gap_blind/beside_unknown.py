"""What a known effect adds where something unknown acts beside it, for one who does not know the unknown.

`limits` asks what the true form of a known effect adds beside the true form of the unknown one. Nobody has
that: in its place stands whatever may act, the diagnosis's dictionary of the unknown, each of its groups at
every length with its prior probability. For each known effect of a case with an unknown one ::

    gain = log p(runs | effect + unknown) - log p(runs | unknown)

whose effect has its true form and an amplitude about as large as it is, beside the nominal constants and the
errors of ordinary sensors, under the true noise. From `SHOWN_NATS` on one may name it, as in `limits`.

``python -m experiments.gap_blind.beside_unknown DIR/PART`` writes ``beside_unknown-PART.json`` beside
itself, and ``beside_unknown.md`` of every part of the seed that `limits` measured as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.gap_blind.limits import gain_bins
from experiments.gap_blind.per_case import measure_cases, of_seed, true_forms, true_frame, write_page
from experiments.gap_blind.reach import SHOWN_NATS
from fogml.blind.folders import BlindFolder, case_files
from fogml.blind.truth import read_truth
from fogml.gap.basis import build_basis
from fogml.gap.dictionary import unknown_groups
from fogml.gap.events import event_groups
from fogml.gap.evidence import Field, Term, log_sum_exp
from fogml.gap.near_library import near_library
from fogml.gap.priors import LENGTH_WEIGHTS
from fogml.gap.twin_model import TwinModel
from fogml.report.words import MISSING
from fogml.twin.twin_file import load_twin

KIND = "unknown_and_known"
Row = dict[str, Any]


def main() -> None:
    """Measure every case, write the page."""
    seed, found = measure_cases("beside_unknown", _measured, __doc__, "an answered suite, or a part of one")
    rows = [row for own in found for row in own]
    write_page("beside_unknown", _page(rows, of_seed("limits", seed)))


def _measured(folder: BlindFolder, name: str) -> list[Row]:
    """What each known effect of a case adds beside an unknown that may be anything."""
    truth = read_truth(folder.truth / f"{name}.json")
    if truth.kind != KIND:
        return []
    model = TwinModel(load_twin("nominal"), case_files(folder.cases / name).without)
    frame = true_frame(folder, truth, model)
    near = near_library(frame.observations, model.candidates(), frame.values, model.grade)
    groups = (*unknown_groups(frame.observations), *near, *event_groups(frame))
    field = Field(build_basis(frame, {}, groups, model.grade))
    rows = []
    for effect, white in zip(truth.effects, true_forms(folder, truth, frame).T):
        if effect not in truth.known:
            continue
        # An amplitude about as large as it is.
        form = Term(field.append(white[:, None]), 1.0)
        gain = _with_unknown(field, [form]) - _with_unknown(field, [])
        rows.append({"case": name, "effect": effect.name, "gain": round(gain, 4)})
    return rows


def _with_unknown(field: Field, terms: Sequence[Term]) -> float:
    """Log evidence of the runs with terms and an unknown, averaged over its groups and lengths."""
    held = field.condition(terms)
    prices = np.array([field.basis.kinds[name].price for name in field.basis.groups])
    weights = np.log(LENGTH_WEIGHTS) - prices[:, None] - math.log(len(prices))
    return held.log_evidence + log_sum_exp(held.group_gains + weights)


def sentence(rows: Sequence[Row], limits: Sequence[Row]) -> str:
    """What of known effects beside unknown ones is within reach, with the unknown's form and without."""
    both = _both(rows, limits)
    if not both:
        return ""
    true, blind = (np.mean([row[which] >= SHOWN_NATS for row in both]) for which in (0, 1))
    kept = np.mean([row[2] for row in both])
    return (
        f"Of {len(both)} known effects beside an unknown one, {true:.1%} add {SHOWN_NATS:g} nats or more "
        f"beside the unknown's true form, {blind:.1%} beside what an unknown may be; {kept:.1%} are kept "
        "(`beside_unknown.md`)."
    )


def _both(rows: Sequence[Row], limits: Sequence[Row]) -> list[tuple[float, float, bool]]:
    """What each effect adds beside the true unknown and beside what may act, and whether it was named."""
    held = {(r["case"], r["effect"]): r for case in limits for r in case["effects"] if r["kind"] == KIND}
    found = [(held.get((row["case"], row["effect"])), row["gain"]) for row in rows]
    return [(row["gain"], gain, row["named"]) for row, gain in found if row is not None]


def _page(rows: Sequence[Row], limits: Sequence[Row]) -> str:
    both = _both(rows, limits)
    lines = [
        "# A known effect beside an unknown one",
        "",
        f"Synthetic cases of the first reality with a known effect and an unknown one, {len(both)} in all. "
        "What the known effect's true form adds to the evidence of the runs: beside the true form of the "
        "unknown, as one has it who knows everything (`limits.md`), and beside the diagnosis's dictionary of "
        "the unknown, as one has it who knows the effect's true form alone.",
        "",
        sentence(rows, limits),
        "",
        "| nats added | beside the true unknown: effects | of them kept | beside what may act: effects | "
        "of them kept |",
        "|---|---:|---:|---:|---:|",
    ]
    for label, low, high in gain_bins():
        cells = []
        for which in (0, 1):
            kept = [row[2] for row in both if low <= row[which] < high]
            cells += [str(len(kept)), f"{np.mean(kept):.0%}" if kept else MISSING]
        lines.append(f"| {label} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
