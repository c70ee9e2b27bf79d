"""The second reality knows nothing of the twin."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import fogml.gap.blind as blind

FOLDER = Path(blind.__file__).parent
MAKING = sorted(
    [*(FOLDER / "reality").rglob("*.py"), *(FOLDER / f"{n}.py" for n in ("make", "case", "plan"))]
)
MAY = ("fogml.gap.blind", "fogml.runs", "fogml.outputs", "fogml.processes", "fogml.errors")


@pytest.mark.parametrize("path", MAKING, ids=lambda path: path.stem)
def test_no_file_that_makes_cases_imports_the_twin(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            names = [str(node.module)]
        for name in names:
            assert not name.startswith("fogml") or name.startswith(MAY), f"{path.name} imports {name}"
            inside = path.is_relative_to(FOLDER / "reality")
            if inside and name.startswith("fogml"):
                assert name.startswith("fogml.gap.blind.reality"), f"{path.name} imports {name}"
