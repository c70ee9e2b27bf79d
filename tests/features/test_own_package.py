"""Operators of another package, by entry points that name them or their module."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.outside import in_new_process

DECLARED = """
from fogml.features.own import Function, declare

bend = declare(Function(name="bend", parameters=("x",), function=lambda x, w: w * x / (w + abs(x))))
number = 3
"""
CODE = """
from fogml.errors import InputError
from fogml.features.parse import parse_features
for _ in range(2):
    try:
        print(parse_features("bend(T, 30 degC)").text)
    except InputError as error:
        print(str(error).splitlines()[0])
"""


@pytest.mark.parametrize(
    ("place", "told"),
    [
        ("fogml_bends", "bend(T, 30 degC)"),
        ("fogml_bends:bend", "bend(T, 30 degC)"),
        (
            "fogml_bends:number",
            "entry point 'mine' of fogml-bends in group 'fogml.operators': fogml_bends:number is no",
        ),
        ("fogml_bends:none", "entry point 'mine' of fogml-bends in group 'fogml.operators' does not load"),
    ],
)
def test_an_entry_point_names_an_operator_or_its_module(tmp_path: Path, place: str, told: str) -> None:
    source = tmp_path / "package" / "src"
    source.mkdir(parents=True)
    (source / "fogml_bends.py").write_text(DECLARED)
    said = in_new_process(
        tmp_path, tmp_path / "package", f"[fogml.operators]\nmine = {place}\n", CODE
    ).splitlines()
    # Asked again it says the same, and not that the operator is not known.
    assert len(said) == 2 and all(line.startswith(told) for line in said)
