"""`import fogml` and the run type stay free of the heavy libraries."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

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


def test_a_page_s_words_leave_figures_unloaded() -> None:
    """Commands print by them, and pages without figures are made by them."""
    code = (
        "import sys, fogml.report.page, fogml.report.tables, fogml.report.verdict; "
        f"print(*sorted({HEAVY!r} & set(sys.modules)))"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == ""


def test_a_name_of_the_pages_is_its_function_whatever_was_imported_first() -> None:
    code = (
        "import fogml.report.noise_page, fogml.report\n"
        "from fogml.report.noise_page import noise_page as first\n"
        "from fogml.report import certificate, noise_page\n"
        "assert noise_page is first is fogml.report.noise_page\n"
        "assert all(callable(getattr(fogml.report, name)) for name in fogml.report.__all__)\n"
        "assert set(fogml.report.__all__) <= set(dir(fogml.report))\n"
        "import fogml.report.style\n"
        "print(fogml.report.style.__name__, certificate.__name__)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.split() == ["fogml.report.style", "certificate"]


def test_what_is_not_there_is_told_before_anything_heavy_loads(tmp_path: Path) -> None:
    """What a job computes with and draws with takes longer to load than the message to write."""
    (tmp_path / "there.csv").write_text("time [s],gyro [deg/h]\n0,1\n")
    commands = (
        ["train", "none.csv", "--test", "there.csv"],
        ["train", "there.csv", "--test", "none.csv"],
        ["compare", "there.csv", "--test", "none.csv"],
        ["compensate", "none.csv", "--model", "none"],
        ["compensate", "there.csv", "--model", "none", "--out", "out.csv"],
        ["compensate", "there.csv", "--model", "there.csv"],
        ["export", "none"],
        ["export"],
        ["monitor", "none"],
        ["train", "there.csv"],
        ["train", "there.csv", "--test", "there.csv", "--from-diagnosis", "none"],
        ["lab", "misalignment", "none.csv"],
        ["lab", "misalignment"],
        ["lab", "north", "--positions", "none.csv"],
        ["lab", "north"],
        ["lab", "rate"],
        ["lab", "acceptance", "there.csv", "--limits", "none.yaml"],
        ["lab", "batch", "none"],
        ["benchmark", "run", "none", "--method", "auto"],
        ["benchmark", "run", "."],
        ["blind", "make"],
        ["blind", "merge", "there.csv"],
        ["effects", "shupe_pur"],
        ["simulate"],
        ["diagnose"],
        ["noise", "none.csv"],
        ["diagnose", "there.csv", "--held-out", "none.csv"],
        ["lab", "rate", "none.csv"],
        ["replay", "tactical", "none.csv", "-o", "out.csv"],
        ["fleet", "none.yaml"],
        ["blind", "score", "none"],
        ["benchmark", "score", "none"],
    )
    code = (
        "import sys\nfrom fogml.cli.main import app\n"
        f"for words in {commands!r}:\n"
        "    try:\n        app(words)\n"
        "    except SystemExit as end:\n        assert end.code == 2, words\n"
        f"    print(*sorted({HEAVY | {'scipy', 'numba', 'jinja2'}!r} & set(sys.modules)))"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    messages = answer.stderr.strip().splitlines()
    assert len(messages) == len(commands) and all(
        ": no " in m or ": give " in m or "there is no" in m for m in messages
    ), messages
    assert answer.stdout.split() == []


def test_effects_are_listed_without_what_computes_them() -> None:
    code = (
        "import sys\nfrom fogml.cli.main import app\n"
        "for words in (['effects', '--quiet'], ['effects', 'thermal_hysteresis', '--quiet']):\n"
        "    try:\n        app(words)\n"
        "    except SystemExit as end:\n        assert not end.code\n"
        f"print(*sorted({HEAVY | {'scipy', 'numba', 'jinja2'}!r} & set(sys.modules)))"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.split() == []


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
