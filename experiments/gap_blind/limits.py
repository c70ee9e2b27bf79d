"""What the data of a suite allow: how far apart a wrong answer and the truth are, by a likelihood ratio.

For each wrong name, and each effect that was missed or hidden behind another, the distance between what
truly acts and what was answered is ``||r||^2 / 2`` nats: r is what the answered effects, at the shapes
stated and the best amplitudes, leave of the true contributions, both whitened by the true noise, beside
the nominal constants. It is the expected logarithm of the likelihood ratio between the two for one who
knows both forms. Under 3 nats no method can tell them; the prior of an effect among 36 alone is 4.

``python -m experiments.gap_blind.limits DIR`` writes ``limits.json`` and ``limits.md`` beside itself.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from fogml.gap.blind.folders import BlindFolder, case_files
from fogml.gap.blind.relatives import Likeness
from fogml.gap.blind.truth import Truth, read_contributions
from fogml.outputs import whole_file
from fogml.signals.noise_model import NoiseModel

HERE = Path(__file__).parent
TELLING_NATS = 3.0
"""Under so many nats two explanations are one."""
SURE_NATS = 10.0
GROUPS = ("a wrong name", "an effect missed, nothing wrong named")


def main() -> None:
    """Measure every wrong answer of the diagnosis; write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("directory", help="an answered suite")
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    given = parser.parse_args()
    folder = BlindFolder(Path(given.directory))
    found = Parallel(n_jobs=given.workers)(delayed(_measured)(folder, name) for name in folder.names())
    rows = [row for row in found if row is not None]
    with whole_file(HERE / "limits.json") as partial:
        partial.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    with whole_file(HERE / "limits.md") as partial:
        partial.write_text(_page(rows, len(found)), encoding="utf-8")


def _measured(folder: BlindFolder, name: str) -> dict[str, Any] | None:
    """A wrong answer's distance from the truth; None where the answer is right."""
    path = folder.answers() / name / "gap.json"
    if not path.is_file():
        return None
    truth = Truth.model_validate_json((folder.truth / f"{name}.json").read_text())
    known = {e.id for e in truth.known if e.id}
    gap = json.loads(path.read_text())
    named = [item for item in gap["which"] if item["probability"] >= 0.5]
    wrong = [item["effect"] for item in named if not truth.right_names & set(item["class"])]
    missed = sorted(known - {m for i in named for m in i["class"]})
    if not truth.effects or not (wrong or missed):
        return None
    return {
        "case": name,
        "kind": truth.kind,
        "d_prime": min(e.d_prime for e in truth.effects),
        "wrong": wrong,
        "missed": missed,
        "unknown": gap["unknown"]["probability"],
        "nats": _distance(folder, truth, named),
    }


def _distance(folder: BlindFolder, truth: Truth, named: list[dict[str, Any]]) -> float:
    given = read_contributions(folder.truth / f"{truth.case}.npz")
    runs = case_files(folder.cases / truth.case).fit
    total = [sum(given[run.name, i] for i in range(len(truth.effects))) for run in runs]
    value = {key: amount.value for key, amount in truth.noise.items()}
    noise = NoiseModel(value["N"], value.get("B", 0.0), value.get("K", 0.0))
    likeness = Likeness(runs, [total], noise, truth.nominal)
    shapes = {i["effect"]: {k: v["value"] for k, v in i["parameters"].items()} for i in named}
    return 0.5 * likeness.left(shapes)


def _page(rows: list[dict[str, Any]], cases: int) -> str:
    held: dict[tuple[str, str], list[float]] = defaultdict(list)
    for row in rows:
        group = GROUPS[0] if row["wrong"] else GROUPS[1]
        held[group, row["kind"]].append(row["nats"])
    lines = [
        "# What the data allow",
        "",
        f"Synthetic cases of the second reality: {cases}, of which {len(rows)} were answered with a wrong "
        "name or without an effect that acts. For each the expected logarithm of the likelihood ratio "
        "between the truth and the named effects, for one who knows both forms, the noise and the nominal "
        "constants' span (nats). Under 3 nats nobody can tell the two; a method that does not know which of "
        "36 effects or what unknown acts needs some 10 more.",
        "",
        "| answer | kind | cases | median nats | under 3 | under 10 |",
        "|---|---|---|---|---|---|",
    ]
    for (group, kind), values in sorted(held.items()):
        nats = np.array(values)
        lines.append(
            f"| {group} | {kind} | {len(nats)} | {np.median(nats):.1f} | "
            f"{np.mean(nats < TELLING_NATS):.0%} | {np.mean(nats < SURE_NATS):.0%} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
