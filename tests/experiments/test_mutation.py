"""Changes of the code as the experiment on them makes, draws and tries them."""

from __future__ import annotations

import ast
import shutil
from pathlib import Path

import pytest

from experiments.mutation.covering import Covering
from experiments.mutation.mutants import Mutant, drawn, mutants_of
from experiments.mutation.page import page_of
from experiments.mutation.trials import NOTICED, UNNOTICED, UNTESTED, tried

SOURCE = b'''"""A module."""
from typing import TYPE_CHECKING

if TYPE_CHECKING and 1 < 2:
    pass


class Kept:
    """A class."""

    def inside(self, x: float = 2.0) -> bool:
        """A number in text, 1 + 1, is none."""
        return not (0 <= x < 3) or f"{x + 1}" == ""
'''


def test_each_operator_and_number_is_changed_once() -> None:
    found = mutants_of("fogml/runs/kept.py", SOURCE)
    assert {(one.function, one.before, one.after) for one in found} == {
        ("Kept.inside", "2.0", "2.2"),
        ("Kept.inside", 'not (0 <= x < 3) or f"{x + 1}" == ""', "not 0 <= x < 3 and f'{x + 1}' == ''"),
        ("Kept.inside", "not (0 <= x < 3)", "0 <= x < 3"),
        ("Kept.inside", "0 <= x < 3", "0 < x < 3"),
        ("Kept.inside", "0 <= x < 3", "0 <= x <= 3"),
        ("Kept.inside", "0", "1"),
        ("Kept.inside", "3", "4"),
        ("Kept.inside", 'f"{x + 1}" == ""', "f'{x + 1}' != ''"),
    }
    for one in found:
        assert ast.dump(ast.parse(one.applied(SOURCE))) != ast.dump(ast.parse(SOURCE))
        assert len(one.applied(SOURCE).splitlines()) == len(SOURCE.splitlines())


def test_a_draw_is_repeated_and_of_every_package(tmp_path) -> None:
    root = Path(__file__).parents[2]
    for file in ("errors.py", "twin/programme.py", "signals/bases.py"):
        (tmp_path / "fogml" / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(root / "fogml" / file, tmp_path / "fogml" / file)
    every = drawn(tmp_path, 40, 7)
    assert every == drawn(tmp_path, 40, 7) and len(set(every)) == 40
    assert {one.package for one in every} >= {"twin", "signals"}


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project of one file and two tests, and what they cover."""
    tree = tmp_path / "tree"
    (tree / "fogml").mkdir(parents=True)
    (tree / "fogml" / "less.py").write_text(
        "def less(a, b):\n    return a < b\n\n\ndef other():\n    return 1\n"
    )
    (tree / "test_less.py").write_text(
        "import sys\nsys.path.insert(0, 'fogml')\nfrom less import less\n\n\n"
        "def test_far():\n    assert less(1, 2)\n\n\ndef test_equal():\n    assert not less(1, 1)\n"
    )
    lines = {2: ["test_less.py::test_far", "test_less.py::test_equal"]}
    cover = Covering(
        {"test_less.py::test_far": 0.1, "test_less.py::test_equal": 0.2}, {"fogml/less.py": lines}
    )
    monkeypatch.setattr("experiments.mutation.trials.measured", lambda *words: cover)
    return tree, cover


def test_what_tests_notice(project, tmp_path) -> None:
    tree, cover = project
    source = (tree / "fogml" / "less.py").read_bytes()
    found = {one.after: one for one in mutants_of("fogml/less.py", source)}
    strict = found["a <= b"]
    assert cover.tests_of(strict, 10.0) == [*cover.seconds]
    assert [row["state"] for row in tried(tree, [strict], tmp_path, 10.0)] == [NOTICED]
    assert (tree / "fogml" / "less.py").read_bytes() == source
    # The quickest test alone can't tell them apart; and what was tried is not tried again.
    (tmp_path / "tried.jsonl").rename(tmp_path / "before.jsonl")
    assert [row["state"] for row in tried(tree, [strict], tmp_path, 0.1)] == [UNNOTICED]
    assert [row["state"] for row in tried(tree, [strict], tmp_path, 10.0)] == [UNNOTICED]
    nowhere = Mutant("fogml/none.py", 1, 1, "", "1", "2", (0, 1))
    assert [row["state"] for row in tried(tree, [nowhere], tmp_path, 10.0)] == [UNTESTED]


def test_the_page_counts_what_is_explained_apart() -> None:
    rows = [
        {
            "path": "fogml/runs/a.py",
            "function": "f",
            "before": "a | b",
            "after": "2",
            "tests": 3,
            "measured": True,
            **more,
        }
        for more in (
            {"key": "1", "state": NOTICED},
            {"key": "2", "state": UNNOTICED},
            {"key": "3", "state": UNTESTED, "tests": 0},
        )
    ]
    page = page_of(rows, 300, 1, {"2": "the same number"})
    assert "Noticed: 1 of 3, 33.3% (6.1% to 79.2%)" in page
    assert "| runs | 3 | 1 | 1 | 1 |" in page
    assert "`a \\| b` → `2` | the same number |" in page and "| no test runs it |" in page
