"""Marks of several parts of a suite as those of one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fogml.blind.folders import DIAGNOSIS
from fogml.blind.scoring.marks import Mark
from fogml.blind.scoring.marks_file import Marks, read_marks
from fogml.blind.truth import Truth
from fogml.errors import InputError


def merged(paths: Sequence[Path]) -> Marks:
    """The marks in several files, whatever the files' order.

    A method that did not answer in a part counts over the others alone.

    Raises
    ------
    InputError
        If a file can't be read, parts are of several seeds or sample intervals, a method answered a
        case in two of them, or a case has two truths.
    """
    if not paths:
        raise InputError("no marks are given; name files that fogml blind score wrote")
    read = [(path, read_marks(path)) for path in paths]
    whence, first = read[0]
    truths: dict[str, tuple[Path, Truth]] = {}
    methods: dict[str, dict[str, tuple[Path, Mark]]] = {}
    for path, marks in read:
        if (marks.seed, marks.sample_s) != (first.seed, first.sample_s):
            raise InputError(
                f"{path}: is of {_words(marks)}, {whence} of {_words(first)}; merge parts of one suite"
            )
        for truth in marks.truths:
            other, held = truths.setdefault(truth.case, (path, truth))
            if held != truth:
                raise InputError(f"{path}: case {truth.case} is another one than in {other}")
        for method, found in marks.methods.items():
            own = methods.setdefault(method, {})
            for mark in found:
                other, _ = own.setdefault(mark.truth.case, (path, mark))
                if own[mark.truth.case][1] is not mark:
                    raise InputError(
                        f"{path}: holds an answer of {method} to case {mark.truth.case}, and so does "
                        f"{other}; give each case once"
                    )
    return Marks(
        seed=first.seed,
        sample_s=first.sample_s,
        parts=tuple(sorted((p for _, m in read for p in m.parts), key=lambda p: (p.first, p.file))),
        truths=tuple(truths[case][1] for case in sorted(truths, key=_number)),
        methods={
            method: [methods[method][case][1] for case in sorted(methods[method], key=_number)]
            for method in sorted(methods, key=lambda name: (name != DIAGNOSIS, name))
        },
    )


def _number(case: str) -> tuple[int, str]:
    return len(case), case


def _words(marks: Marks) -> str:
    return f"seed {marks.seed} sampled at {', '.join(f'{s:g} s' for s in marks.sample_s)}"
