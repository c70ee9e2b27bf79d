"""The score of the diagnosis track, by the marks of the check on withheld effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

from fogml.benchmark.rounds import TrackFolder
from fogml.blind.folders import OUTCOME, check_sums
from fogml.blind.score import marks_of
from fogml.blind.scoring.answers import NAMED, read_answer
from fogml.blind.scoring.by_reality import each_kept, mass_on_true, within_one
from fogml.blind.scoring.marks import Mark
from fogml.blind.scoring.statistics import Estimate, mean, median, proportion
from fogml.blind.scoring.table import case_ratio, false_names, pooled
from fogml.blind.truth import read_truth
from fogml.errors import InputError

ALL = "all"


def _told_unknown(m: Mark) -> bool:
    """Whether a cause that no candidate stands for was called unknown, and nothing wrong was named."""
    return m.unknown >= NAMED and not m.wrong_name


def _mass(marks: Sequence[Mark]) -> Estimate:
    return within_one(mean([mass_on_true(m) for m in marks if len(m.truth.effects) == 1]))


FIGURES: dict[str, tuple[str, Callable[[Sequence[Mark]], Estimate]]] = {
    "found": ("known causes that are named, by class", each_kept),
    "false": ("named causes that are false", pooled(false_names)),
    "unknown": (
        "cases with an unknown cause: told as unknown, no wrong name",
        lambda marks: proportion([_told_unknown(m) for m in marks if m.truth.unknown]),
    ),
    "quiet": (
        "cases with nothing missing: nothing named",
        lambda marks: proportion([not m.wrong_name for m in marks if not m.truth.effects]),
    ),
    "mass_on_true": ("mean probability on the true cause, one cause (as DX 2025)", _mass),
    "closed": ("closed over what the true causes close (median)", case_ratio),
    "seconds": ("time per case [s] (median)", lambda marks: median([m.seconds for m in marks if m.seconds])),
}
"""Words and measure of each figure."""


def diagnosis_marks(folder: TrackFolder, entries: Sequence[str], workers: int = 1) -> dict[str, list[Mark]]:
    """Every entry's marks, in the order of the cases.

    Raises
    ------
    InputError
        If an entry lacks a case, or an answer breaks the schema of ``gap.json`` or is not finite.
    """
    check_sums(folder.truth)
    truths = [read_truth(folder.truth / f"{name}.json") for name in folder.names()]
    for name in entries:
        for truth in truths:
            place = folder.answers(name) / truth.case
            answer = read_answer(place)
            # One that our own run tells as failed is an answer; one that is not there is none.
            if answer.gap is None and (not (place / OUTCOME).is_file() or "gap.json" in answer.failure):
                raise InputError(f"{place}: {answer.failure}; every case needs a sound gap.json")
    return marks_of(folder, list(entries), truths, workers=workers)


def diagnosis_figures(marks: Sequence[Mark]) -> dict[str, Any]:
    """An entry's figures, of all cases and of each reality."""
    groups = {ALL: list(marks)}
    for one in marks:
        groups.setdefault(one.truth.reality, []).append(one)
    return {
        name: {
            "cases": len(own),
            "failed": sum(bool(m.failure) for m in own),
            **{key: asdict(measure(own)) for key, (_, measure) in FIGURES.items()},
        }
        for name, own in groups.items()
    }
