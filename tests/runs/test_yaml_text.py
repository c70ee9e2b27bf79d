"""YAML files: a key that is stated twice is told, where YAML alone would take the last."""

from __future__ import annotations

from pathlib import Path

import pytest

from fogml.errors import InputError
from fogml.runs.facts import read_yaml


def written(folder: Path, text: str) -> Path:
    path = folder / "a.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("text", "line"), [("a: 1\na: 2\n", 2), ("b: 1\na:\n  c: 1\n  d: 2\n  c: 3\n", 5)])
def test_a_repeated_key_is_told_with_its_line(tmp_path, text, line):
    with pytest.raises(InputError, match=f"a.yaml, line {line}: key '[ac]' is stated twice; keep one"):
        read_yaml(written(tmp_path, text))


def test_the_same_key_in_two_places_and_merges_are_fine(tmp_path):
    text = "a: &a {c: 1, d: 2}\nb:\n  <<: *a\n  c: 3\n"
    assert read_yaml(written(tmp_path, text)) == {"a": {"c": 1, "d": 2}, "b": {"c": 3, "d": 2}}
