"""What is put off is loaded when something of it is asked for, and imported as ever afterwards."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from fogml.models.scikit_learn import put_off


@pytest.fixture
def counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A package that tells each time it is loaded."""
    folder = tmp_path / "put_off_package"
    folder.mkdir()
    (folder / "__init__.py").write_text("import builtins; builtins.put_off_loads.append(__name__); value = 3")
    (folder / "part.py").write_text("value = 4\n")
    monkeypatch.syspath_prepend(tmp_path)
    loads: list[str] = []
    monkeypatch.setattr("builtins.put_off_loads", loads, raising=False)
    for name in ("put_off_package", "put_off_package.part"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return loads


def test_a_module_is_loaded_once_when_it_is_asked_for(counted: list[str]) -> None:
    with put_off("put_off_package", "no_such_module"):
        import put_off_package as held
    assert not counted and "put_off_package" not in sys.modules and "no_such_module" not in sys.modules
    assert held.value == 3
    import put_off_package

    assert counted == ["put_off_package"] and put_off_package.value == held.value
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = held.nothing


def test_what_is_asked_for_within_is_the_module_itself(counted: list[str]) -> None:
    with put_off("put_off_package"):
        import put_off_package.part

        assert put_off_package.part.value == 4
        from put_off_package import value
    assert value == 3 and counted == ["put_off_package"]


def test_what_is_loaded_stays(counted: list[str]) -> None:
    import put_off_package

    with put_off("put_off_package"):
        assert sys.modules["put_off_package"] is put_off_package
    assert sys.modules["put_off_package"] is put_off_package and len(counted) == 1


def test_models_are_made_and_a_gap_is_looked_for_without_what_is_put_off() -> None:
    code = (
        "import sys; from fogml.models.names import make_model; make_model('polynomial')\n"
        "import fogml.gap, fogml.tuning.sweep; fogml.gap.diagnose\n"
        "print([name for name in ('scipy.stats', 'pandas', 'torch') if name in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "[]\n"
