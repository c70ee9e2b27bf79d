"""`import fogml` and the run type stay free of the heavy libraries."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = {"torch", "sklearn", "pandas", "matplotlib", "plotly", "onnx"}


@pytest.mark.parametrize("module", ["fogml", "fogml.errors", "fogml.runs.run", "fogml.cli.main"])
def test_import_leaves_heavy_libraries_unloaded(module: str) -> None:
    code = f"import sys, {module}; print(*sorted({HEAVY!r} & set(sys.modules)))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == ""


def test_the_words_of_a_page_leave_numerics_unloaded() -> None:
    """Every command takes them, to say no more than that a file is missing."""
    heavy = {"torch", "sklearn", "pandas", "scipy", "numba", "plotly", "numpy"}
    code = f"import sys, fogml.numerals; print(*sorted({heavy!r} & set(sys.modules)))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == ""


def test_every_public_name_resolves() -> None:
    import fogml

    for name in fogml.__all__:
        assert getattr(fogml, name) is not None


def test_packages_are_there_without_an_import_of_their_own() -> None:
    code = "import fogml; print(fogml.gap.__name__, callable(fogml.gap.diagnose))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.split() == ["fogml.gap", "True"]


def test_an_unknown_name_is_an_attribute_error() -> None:
    import fogml

    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = fogml.nonsense
