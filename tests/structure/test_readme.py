"""What the README says of schemas and commands is what the code has."""

from __future__ import annotations

import re
from pathlib import Path

import fogml
from fogml.cli.main import app

ROOT = Path(fogml.__file__).parent
README = (ROOT.parent / "README.md").read_text(encoding="utf-8")


def test_every_schema_that_is_read_or_compared_is_named() -> None:
    named = set(re.findall(r"`(fogml\.[a-z]+/\d+)`", README))
    written = set()
    for path in ROOT.rglob("*.py"):
        written |= set(re.findall(r"\"(fogml\.[a-z]+/\d+)\"", path.read_text(encoding="utf-8")))
    assert named <= written
    for name in (
        "train/1",
        "compare/1",
        "inspect/1",
        "noise/1",
        "model/2",
        "programme/1",
        "twin/1",
        "simulate/1",
    ):
        assert f"fogml.{name}" in named


def test_commands_in_the_examples_exist() -> None:
    used = set(re.findall(r"^fogml ([a-z]+) ", README, flags=re.MULTILINE))
    assert used
    from typer.main import get_command

    group = get_command(app)
    known = set(group.list_commands(None))  # type: ignore[attr-defined, arg-type]
    assert used <= known
