"""The score of a blind suite: every figure, what lies behind it, and limits on it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from fogml.blind.folders import SUMS, BlindFolder, check_sums
from fogml.blind.plan import check_use
from fogml.blind.relatives import relatives_of
from fogml.blind.run import Progress, check_answers_to
from fogml.blind.scoring.answers import read_answer
from fogml.blind.scoring.marks import Mark, mark
from fogml.blind.scoring.marks_file import Marks, part_of
from fogml.blind.scoring.table import BY_KEY
from fogml.blind.truth import Truth, read_truth
from fogml.errors import InputError, known_are
from fogml.processes import in_processes


def gather(
    folder: BlindFolder,
    methods: Sequence[str] | None = None,
    final: Path | None = None,
    progress: Progress | None = None,
    workers: int = 1,
) -> Marks:
    """The marks of every method's answers in a suite.

    Parameters
    ----------
    folder
        The suite.
    methods
        Which methods' answers; all that there are by default. A case without an answer is a failed
        one, for each of them.
    final
        The ledger of uses of final seeds, to be given where the suite's seed is one.
    progress
        Told each case's number.
    workers
        Processes.

    Raises
    ------
    InputError
        If the truth changed since it was hashed, cases and truths don't match, a method has no answers,
        one is to other files than its case holds, or a final seed is used without the ledger.
    """
    names = folder.names()
    count = check_sums(folder.truth)
    if count != len(names):
        raise InputError(f"{folder.path}: {len(names)} cases, but {count} truths; make the cases anew")
    truths = [read_truth(folder.truth / f"{name}.json") for name in names]
    seeds = sorted({truth.seed for truth in truths})
    if len(seeds) != 1:
        raise InputError(f"{folder.truth}: cases of several seeds ({seeds}); a suite has one")
    check_use(seeds[0], final)
    methods = folder.methods() if methods is None else methods
    if not methods:
        raise InputError(f"{folder.path}: holds no answers; run a method first (fogml blind run)")
    for method in methods:
        if not folder.answers(method).is_dir():
            others = folder.methods()
            which = f", or score what is there: {known_are(method, others, 'answered')}" if others else ""
            raise InputError(f"{folder.answers(method)}: no such folder; run the method first{which}")
    return Marks(
        seed=seeds[0],
        sample_s=tuple(sorted({truth.sample_s for truth in truths})),
        parts=(part_of(truths, hashlib.sha256((folder.truth / SUMS).read_bytes()).hexdigest()),),
        truths=tuple(truths),
        methods=marks_of(folder, methods, truths, progress, workers),
    )


def marks_of(
    folder: BlindFolder,
    methods: Sequence[str],
    truths: Sequence[Truth],
    progress: Progress | None = None,
    workers: int = 1,
) -> dict[str, list[Mark]]:
    """Each method's answers held against the truths, in their order."""
    marks_of_case = partial(_marks_of_case, folder, tuple(methods))
    found: dict[str, list[Mark]] = {method: [] for method in methods}
    for truth, marks in zip(truths, in_processes(marks_of_case, truths, workers, ordered=True)):
        for method, one in zip(methods, marks):
            found[method].append(one)
        if progress:
            progress(truth.case)
    return found


def _marks_of_case(folder: BlindFolder, methods: tuple[str, ...], truth: Truth) -> list[Mark]:
    # What is a relative does not depend on who names it: it is worked out once for all methods.
    relative = relatives_of(folder, truth)
    for method in methods:
        check_answers_to(folder.answers(method) / truth.case, folder.cases / truth.case)
    return [mark(truth, read_answer(folder.answers(m) / truth.case), relative) for m in methods]


def gate(values: dict[str, Any], gates: Mapping[str, float], method: str) -> list[dict[str, Any]]:
    """Hold figures of a method against limits: ``{"key", "limit", "value", "met"}`` each.

    A figure of which more is wanted must reach the limit, another one must not exceed it; one with
    both a lower and an upper bound wanted must reach it. One without a value fails.

    Raises
    ------
    InputError
        For a figure that there is none of.
    """
    reached = {row["key"]: row["value"] for row in values["methods"][method]["rows"]}
    found = []
    for key, limit in gates.items():
        if key not in BY_KEY:
            raise InputError(f"--gate: no figure '{key}'; {known_are(key, BY_KEY, 'figures')}")
        value, more = reached[key], _more_is_better(key)
        met = value is not None and (value >= limit if more else value <= limit)
        found.append({"key": key, "limit": limit, "at_least": more, "value": value, "met": met})
    return found


def wanted_gates() -> dict[str, float]:
    """A gate at what is wanted of every figure."""
    limits = {key: figure.high if figure.low is None else figure.low for key, figure in BY_KEY.items()}
    return {key: limit for key, limit in limits.items() if limit is not None}


def _more_is_better(key: str) -> bool:
    figure = BY_KEY[key]
    if figure.low is None and figure.high is None:
        return key.endswith(("exact", "strict", "right"))
    return figure.low is not None
