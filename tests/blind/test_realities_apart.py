"""Realities know nothing of the twin, of the diagnosis, or of each other."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import fogml.blind as blind
from fogml.blind.plan import REALITIES

FOLDER = Path(blind.__file__).parent
HOME = "fogml.blind"
TYPES = "fogml.arrays"
MAY = (
    HOME,
    TYPES,
    *(f"fogml.{name}" for name in ("runs", "outputs", "processes", "errors", "json_files", "settings_check")),
)


def imported(path: Path) -> set[str]:
    """Modules of fogml that a file imports."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            found.add(str(node.module))
    return {name for name in found if name.startswith("fogml")}


@pytest.mark.parametrize("part", ["frame", *REALITIES])
def test_a_reality_imports_itself_and_the_frame_alone(part: str) -> None:
    files = sorted((FOLDER / part).rglob("*.py"))
    assert files
    for path in files:
        for name in imported(path):
            assert name.startswith((f"{HOME}.{part}", f"{HOME}.frame", TYPES)), f"{path} imports {name}"


@pytest.mark.parametrize("name", ["make", "plan"])
def test_no_file_that_makes_cases_imports_the_twin(name: str) -> None:
    for module in imported(FOLDER / f"{name}.py"):
        assert module.startswith(MAY), f"{name}.py imports {module}"
