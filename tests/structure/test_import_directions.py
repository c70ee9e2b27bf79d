"""The house's arrows: which package may import which, read from the source itself."""

from __future__ import annotations

import ast
import importlib
import re
from functools import cache
from graphlib import TopologicalSorter
from importlib.util import find_spec
from pathlib import Path

import pytest

import fogml

ROOT = Path(fogml.__file__).parent
GROUND = {"signals", "runs"}
FIRST = GROUND | {"features"}
# For each package, the packages it may import besides itself.
ALLOWED = {
    "signals": set(),
    "readers": set(),
    "runs": {"signals", "readers"},
    "features": GROUND,
    "models": FIRST,
    "validation": FIRST | {"models"},
    "twin": GROUND,
    "gap": GROUND | {"twin"},
    "blind": GROUND | {"twin", "gap"},
    "benchmark": FIRST | {"models", "validation", "blind"},
    "tuning": FIRST | {"models", "validation"},
    "export": FIRST | {"models", "validation"},
    "lab": FIRST | {"models", "validation", "twin"},
    "fleet": FIRST | {"models", "validation", "tuning", "twin", "gap"},
    "monitor": FIRST | {"models"},
    "report": FIRST
    | {"models", "validation", "twin", "gap", "blind", "benchmark", "tuning", "export", "lab", "fleet"}
    | {"monitor"},
    "app": set(),
    "testing": FIRST | {"models", "validation", "twin", "gap"},
}
ALLOWED["cli"] = set(ALLOWED) - {"testing"}


def imported_packages(path: Path) -> set[str]:
    """The fogml packages that one file imports, inside functions too."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        for name in names:
            parts = name.split(".")
            if parts[0] == "fogml" and len(parts) > 1 and (ROOT / parts[1]).is_dir():
                found.add(parts[1])
    return found


def packages() -> list[str]:
    return sorted(p.name for p in ROOT.iterdir() if p.is_dir() and any(p.glob("*.py")))


@cache
def edges() -> dict[str, set[str]]:
    return {
        package: set().union(*(imported_packages(f) for f in (ROOT / package).rglob("*.py"))) - {package}
        for package in packages()
    }


@pytest.mark.parametrize("package", packages())
def test_imports_follow_the_arrows(package: str) -> None:
    assert package in ALLOWED, f"fogml/{package} has no place in the house"
    assert edges()[package] <= ALLOWED[package]


def test_there_are_no_circles() -> None:
    tuple(TopologicalSorter(edges()).static_order())


def test_every_file_is_short_enough_to_read() -> None:
    long = {
        str(path.relative_to(ROOT)): count
        for path in ROOT.rglob("*.py")
        if (count := len(path.read_text(encoding="utf-8").splitlines())) > 330
    }
    assert not long


def test_temporary_files_with_a_name_go_even_where_their_process_is_killed() -> None:
    """Those of `scratch_folder` do; an upload lies in the app's own folder, which it clears at its start."""
    named = re.compile(r"TemporaryDirectory|mkdtemp|NamedTemporaryFile")
    others = {"outputs.py", "app/handlers.py", "testing/models.py"}
    sources = {str(path.relative_to(ROOT)): path.read_text() for path in ROOT.rglob("*.py")}
    assert {name for name, text in sources.items() if named.search(text)} <= others


def test_every_name_that_the_experiments_take_from_the_package_is_there():
    """Also within functions, which no import of theirs meets."""
    lacking = []
    for path in sorted((ROOT.parent / "experiments").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom) or (node.module or "").partition(".")[0] != "fogml":
                continue
            module = importlib.import_module(node.module)
            for name in (alias.name for alias in node.names):
                inside = hasattr(module, "__path__") and find_spec(f"{node.module}.{name}")
                if not (hasattr(module, name) or inside):
                    lacking.append(f"{path.name}, line {node.lineno}: {node.module}.{name}")
    assert lacking == []
