"""The compiler is loaded once it would have paid, and not before."""

from __future__ import annotations

import subprocess
import sys

import pytest

from fogml.runs import compiling


def test_savings_add_up_until_loading_pays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "_missed_s", 0.0)
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    part_s = compiling.LOADING_S / 4.0
    assert [compiling.pays_by_now(part_s) for _ in range(5)] == [False, False, False, True, True]
    monkeypatch.setattr(compiling, "_missed_s", 0.0)
    monkeypatch.setitem(sys.modules, "numba", compiling)
    assert compiling.pays_by_now(0.0)


def test_one_short_run_is_read_and_written_without_it(tmp_path) -> None:
    code = (
        "import sys, numpy as np; from fogml.runs.run import Run; from fogml.runs.reading import read_run;"
        "from fogml.runs.writing import write_run; x = np.arange(1000.0);"
        f"path = {str(tmp_path / 'run.csv')!r};"
        "write_run(Run.from_columns(time=x, gyro=np.sin(x).round(3), T=x), path); read_run(path);"
        "print('numba' in sys.modules)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "False"
