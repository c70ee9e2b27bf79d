"""What the figures on names would be if a name had to be surer, or less sure, than it has to be.

``python -m experiments.gap_blind.strictness`` writes ``strictness.md`` from the marks of the seed whose
score is kept. Each row names what is at least so probable, of what was named and what was suspected, and
drops the rest: the search itself, and so everything else in an answer, is as it was.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from experiments.gap_blind.per_case import HERE, write_page
from fogml.blind.folders import DIAGNOSIS
from fogml.blind.scoring.marks import Mark, renamed
from fogml.blind.scoring.marks_file import read_marks
from fogml.blind.scoring.table import rows
from fogml.report.blind_words import value_text, wanted_text
from fogml.report.words import plural

LEAST_PROBABILITIES = (0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95)
AS_IT_DOES = "as it does"
KEYS = (
    "nothing_named",
    "unknown_wrong_name",
    "mixed_false_name",
    "false_discovery",
    "one_top",
    "one_exact",
    "two_exact",
    "mixed_known_kept",
)


def main() -> None:
    """Write the table of the seed whose score is kept."""
    write_page("strictness", page(marks_of(kept_seed())))


def kept_seed() -> int:
    """The seed whose score is kept."""
    return int(json.loads((HERE / "score.json").read_text(encoding="utf-8"))["seed"])


def marks_of(seed: int) -> list[Mark]:
    """How the diagnosis's answers were judged, of every part of a seed that is kept; none of others."""
    files = [read_marks(path) for path in sorted(HERE.glob("marks-*.json.gz"))]
    return [found for file in files if file.seed == seed for found in file.methods[DIAGNOSIS]]


def named_from(least: float, marks: Iterable[Mark]) -> list[Mark]:
    """The cases, had a name been given to all that is at least so probable and to nothing else."""
    return [found if found.failure else _named_from(least, found) for found in marks]


def _named_from(least: float, found: Mark) -> Mark:
    likely = sorted((*found.items, *found.suspected), key=lambda item: -item.probability)
    return renamed(found, tuple(replace(item, named=True) for item in likely if item.probability >= least))


def by_threshold(marks: Sequence[Mark]) -> dict[str, dict[str, dict[str, Any]]]:
    """The score's rows of the figures on names, by their keys, for each threshold and `AS_IT_DOES`."""
    tables = {f"{least:.0%}": _figures(named_from(least, marks)) for least in LEAST_PROBABILITIES}
    return tables | {AS_IT_DOES: _figures(marks)}


def page(marks: Sequence[Mark]) -> str:
    """The table as Markdown."""
    tables = {words: list(figures.values()) for words, figures in by_threshold(marks).items()}
    wanted = tables[AS_IT_DOES]
    lines = [
        "# How sure a name has to be",
        "",
        f"The diagnosis's answers to {plural(len(marks), 'synthetic case')} of the check on withheld "
        "effects, had it named all that is at least so probable; and as it does name, with another "
        "threshold beside an unknown and beside other names (`fogml/gap/confidence.py`). What is likely and "
        "not named is told as suspected.",
        "",
        f"| named from | {' | '.join(row['words'] for row in wanted)} |",
        f"|---|{'---:|' * len(wanted)}",
        f"| wanted | {' | '.join(map(wanted_text, wanted))} |",
    ]
    for words, figures in tables.items():
        values = [value_text(row["value"], row["format"]) for row in figures]
        lines.append(f"| {words} | {' | '.join(values)} |")
    return "\n".join(lines) + "\n"


def _figures(marks: Sequence[Mark]) -> dict[str, dict[str, Any]]:
    table = {row["key"]: row for row in rows(marks)}
    return {key: table[key] for key in KEYS}


if __name__ == "__main__":
    main()
