"""Which tests run which lines, measured once for a package: a plugin tells coverage whose turn it is."""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from experiments.mutation.forked import ended
from experiments.mutation.mutants import Mutant

_TIMES = "FOGML_MUTATION_TIMES"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Lines that run from here on are those of this test; its time is kept."""
    import coverage

    current = coverage.Coverage.current()
    assert current is not None
    current.switch_context(item.nodeid)
    began = time.process_time()
    result = yield
    with open(os.environ[_TIMES], "a", encoding="utf-8") as file:
        file.write(json.dumps([item.nodeid, time.process_time() - began]) + "\n")
    return result


@dataclass(frozen=True)
class Covering:
    """The tests of a package, measured: their times [s], and by file and line which of them run it."""

    seconds: dict[str, float]
    lines: dict[str, dict[int, list[str]]]

    def tests_of(self, mutant: Mutant, most_s: float) -> list[str]:
        """Tests that run a changed expression, else its file, the quickest first, `most_s` of time in all."""
        by_line = self.lines.get(mutant.path, {})
        touching = {test for line in range(mutant.first, mutant.last + 1) for test in by_line.get(line, ())}
        touching = touching & self.seconds.keys() or {
            test for tests in by_line.values() for test in tests if test in self.seconds
        }
        chosen: list[str] = []
        spent = 0.0
        for test in sorted(touching, key=lambda one: (self.seconds[one], one)):
            spent += self.seconds[test]
            if chosen and spent > most_s:
                break
            chosen.append(test)
        return chosen


def measured(root: Path, package: str, work: Path) -> Covering:
    """What covers a package's files; measured if `work` does not hold it yet."""
    from coverage import CoverageData

    data, times, done = (work / f"{package}.{kind}" for kind in ("coverage", "times", "done"))
    tests = tests_of_package(root, package)
    if not tests:
        return Covering({}, {})
    if not done.exists():
        for old in (data, times):
            old.unlink(missing_ok=True)
        _measure(root, tests, data, times, work / "output.txt")
        done.touch()
    held = CoverageData(str(data))
    held.read()
    lines: dict[str, dict[int, list[str]]] = {}
    for name in held.measured_files():
        path = Path(name)
        if path.is_relative_to(root):
            lines[path.relative_to(root).as_posix()] = held.contexts_by_lineno(name)
    rows = [json.loads(line) for line in times.read_text(encoding="utf-8").splitlines()]
    return Covering(dict(rows), lines)


def tests_of_package(root: Path, package: str) -> list[str]:
    """Where a package's or module's own tests are; of what has none, those that import it."""
    tests = root / "tests"
    if (tests / package).is_dir():
        return [f"tests/{package}"]
    found = sorted(tests.glob(f"test_{package}*.py")) or [
        file for file in sorted(tests.rglob("test_*.py")) if f"fogml.{package}" in file.read_text("utf-8")
    ]
    return [file.relative_to(root).as_posix() for file in found]


def tests_that_import(root: Path, path: str) -> list[str]:
    """Test files that import a file's module, else one that imports it: kernels' lines are not measured."""

    def importing(path: str, folder: str) -> list[str]:
        *parents, name = path.removesuffix(".py").removesuffix("/__init__").split("/")
        package = re.escape(".".join(parents))
        told = re.compile(rf"from {package}\.{name} import|from {package} import (\([^)]*|.*)\b{name}\b")
        found = [file for file in (root / folder).rglob("*.py") if told.search(file.read_text("utf-8"))]
        return [file.relative_to(root).as_posix() for file in found]

    tests = importing(path, "tests") or [
        t for user in importing(path, "fogml") for t in importing(user, "tests")
    ]
    return sorted({test for test in tests if Path(test).name.startswith("test_")})


def _measure(root: Path, tests: list[str], data: Path, times: Path, log: Path) -> None:
    from coverage.cmdline import main

    # Named as a source, coverage looks into all modules that are loaded, and fails over torch's.
    options = ["--data-file", str(data), "--omit", f"{root}/tests/*,{root}/experiments/*"]
    plugin = ["-p", "experiments.mutation.covering", "-p", "no:cacheprovider", "-q", *tests]
    words = ["run", *options, "-m", "pytest", *plugin]
    log.unlink(missing_ok=True)
    if ended(root, main, words, log, variables={_TIMES: str(times)}) != 0:
        raise SystemExit(f"{', '.join(tests)}: they fail without any change ({log}); mend that first")
