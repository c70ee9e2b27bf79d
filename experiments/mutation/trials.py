"""Each change made in a copy of the project, under the tests that cover it."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from experiments.mutation.covering import Covering, measured, tests_that_import
from experiments.mutation.forked import ended
from experiments.mutation.mutants import Mutant

NOTICED, UNNOTICED, UNTESTED = "noticed", "unnoticed", "no test runs it"
_SLOWER = 5.0
"""A change that makes tests take so many times their time is noticed as well."""
_SPARE_S = 120.0
"""Processor time beside that, for imports and kernels to compile [s]."""
_FAILED = (1, 2, 4)
"""Statuses of pytest: a test failed, a module could not be loaded, and so named tests were not found."""


def copied(root: Path, work: Path) -> Path:
    """A copy of what the tests need, to be changed."""
    tree = work / "tree"
    if not tree.exists():
        partial = work / "partial"
        shutil.rmtree(partial, ignore_errors=True)
        without = shutil.ignore_patterns(".git", ".venv*", "__pycache__", "_build")
        shutil.copytree(root, partial, symlinks=True, ignore=without)
        partial.rename(tree)
    return tree


def tried(
    tree: Path, mutants: Sequence[Mutant], work: Path, most_s: float, measures: bool = True
) -> Iterator[dict[str, Any]]:
    """What became of each change, those tried before from `work`; interrupted, it goes on from there.

    Unless it `measures` what covers a package, tests are those that import a changed file.
    """
    log = work / "tried.jsonl"
    rows = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
    known = {(row["path"], *row["span"], row["after"]): row for row in map(json.loads, rows)}
    covers: dict[str, Covering] = {}
    for mutant in mutants:
        row = known.get((mutant.path, *mutant.span, mutant.after))
        if row is None:
            if mutant.package not in covers:
                covers[mutant.package] = (
                    measured(tree, mutant.package, work) if measures else Covering({}, {})
                )
            row = _trial(tree, mutant, covers[mutant.package], work, most_s)
            with log.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
        yield row


def _trial(tree: Path, mutant: Mutant, cover: Covering, work: Path, most_s: float) -> dict[str, Any]:
    covering = cover.tests_of(mutant, most_s)
    tests = covering or tests_that_import(tree, mutant.path)
    row = {
        "path": mutant.path,
        "line": mutant.first,
        "function": mutant.function,
        "before": mutant.before,
        "after": mutant.after,
        "span": mutant.span,
        "key": mutant.key,
        "tests": len(tests),
        "measured": bool(covering),
    }
    if not tests:
        return row | {"state": UNTESTED, "seconds": 0.0}
    file = tree / mutant.path
    source, kept = file.read_bytes(), file.stat()
    seconds = sum(cover.seconds.get(test, 1.0) for test in tests)
    began = time.monotonic()
    try:
        file.write_bytes(mutant.applied(source))
        status = _status(
            tree, tests, work / "output.txt", _SPARE_S + _SLOWER * seconds, kernels=b"@kernel" in source
        )
    finally:
        file.write_bytes(source)
        os.utime(file, ns=(kept.st_atime_ns, kept.st_mtime_ns))  # what was compiled of it holds again
    if status != 0 and status not in _FAILED and status > 0:
        raise SystemExit(f"{mutant.key}: pytest ended with {status} ({work / 'output.txt'})")
    state = UNNOTICED if status == 0 else NOTICED
    return row | {"state": state, "seconds": round(time.monotonic() - began, 1)}


def _status(tree: Path, tests: Sequence[str], log: Path, cpu_s: float, kernels: bool) -> int:
    """With what the tests end; negative where they took too long."""
    log.unlink(missing_ok=True)
    words = ["-x", "-q", "-p", "no:cacheprovider", *tests]
    if not kernels:
        return ended(tree, pytest.main, words, log, cpu_s=cpu_s)
    # What is kept of a kernel holds the kernels of other files that it calls.
    with tempfile.TemporaryDirectory() as empty:
        return ended(tree, pytest.main, words, log, variables={"NUMBA_CACHE_DIR": empty}, cpu_s=cpu_s)
