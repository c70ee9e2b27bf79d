"""What a known effect adds where something unknown acts beside it, for one who does not know the unknown.

`limits` asks what the true form of a known effect adds beside the true form of the unknown one. Nobody has
that: in its place stands whatever may act, the diagnosis's dictionary of the unknown, each of its groups at
every length with its prior probability. For each known effect of a case with an unknown one ::

    gain = log p(runs | effect + unknown) - log p(runs | unknown)

whose effect has its true form and an amplitude about as large as it is, beside the nominal constants and the
errors of ordinary sensors, under the true noise. From `SHOWN_NATS` on one may name it, as in `limits`.

``python -m experiments.gap_blind.beside_unknown DIR/PART`` writes ``beside_unknown-PART.json`` beside
itself, and ``beside_unknown.md`` of every part of the seed that was measured.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from experiments.gap_blind.limits import GAIN_EDGES
from experiments.gap_blind.per_case import measure_cases, of_seed, true_frame, write_page
from experiments.gap_blind.reach import SHOWN_NATS, Figure, shown
from experiments.gap_blind.strictness import kept_marks, kept_seed, named_from
from fogml.gap.basis import build_basis
from fogml.gap.blind.folders import BlindFolder, case_files
from fogml.gap.blind.scoring.table import BY_KEY
from fogml.gap.blind.truth import read_contributions, read_truth
from fogml.gap.dictionary import unknown_groups
from fogml.gap.events import event_groups
from fogml.gap.evidence import Field, Term, log_sum_exp
from fogml.gap.near_library import near_library
from fogml.gap.priors import LENGTH_WEIGHTS
from fogml.gap.twin_model import TwinModel
from fogml.twin.twin_file import load_twin

KIND, KEY = "unknown_and_known", "mixed_known_kept"
BOTH = Figure("", (KIND,), 0.0, alone=False)
LEAST = 0.5
"""Probability from which a name would be given at the earliest."""
Row = dict[str, Any]


def main() -> None:
    """Measure every case, write the page."""
    found = measure_cases("beside_unknown", _measured, __doc__, "a suite, or a part of one")
    write_page("beside_unknown", _page([row for own in found for row in own], of_seed("limits", kept_seed())))


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
    given = read_contributions(folder.truth / f"{name}.npz")
    rows = []
    for i, effect in enumerate(truth.effects):
        if effect not in truth.known:
            continue
        white = frame.white([o.averaged(given[o.run.name, i])[:, None] for o in frame.observations])
        # An amplitude about as large as it is.
        form = Term(field.append(white), 1.0)
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
    true_forms = shown([row | {"mix": True} for case in limits for row in case["effects"]], BOTH)
    marks, figure = kept_marks(), BY_KEY[KEY]
    answers = (marks, named_from(LEAST, marks))
    kept, at_most = (figure.measure(figure.chosen(held)).value for held in answers)
    share = np.mean([row["gain"] >= SHOWN_NATS for row in rows])
    assert true_forms is not None and kept is not None and at_most is not None
    return (
        f"Of {len(rows)} known effects beside an unknown one, {true_forms.allowed:.1%} add {SHOWN_NATS:g} "
        f"nats or more beside the unknown's true form, {share:.1%} beside what an unknown may be; {kept:.1%} "
        f"are kept, {at_most:.1%} if every name of {LEAST:.0%} were given (`beside_unknown.md`)."
    )


def _page(rows: Sequence[Row], limits: Sequence[Row]) -> str:
    held = {
        (row["case"], row["effect"]): row
        for case in limits
        for row in case["effects"]
        if row["kind"] == KIND and row["known"]
    }
    lines = [
        "# A known effect beside an unknown one",
        "",
        f"Synthetic cases of the second reality with a known effect and an unknown one, {len(rows)} in all. "
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
    true = [(found["gain"], found["named"]) for found in held.values()]
    blind = [(row["gain"], held[row["case"], row["effect"]]["named"]) for row in rows]
    for low, high in pairwise(GAIN_EDGES):
        label = f"under {high:g}" if low == -np.inf else f"{low:g} to {high:g}"
        label = f"over {low:g}" if high == np.inf else label
        cells = []
        for found in (true, blind):
            named = [kept for gain, kept in found if low <= gain < high]
            cells += [str(len(named)), f"{np.mean(named):.0%}" if named else "–"]
        lines.append(f"| {label} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
