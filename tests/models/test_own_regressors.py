"""A regressor of another package, declared by an entry point, is a model as any other."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

OUTSIDE = Path(__file__).parent / "outside_package" / "src"


def in_new_process(folder: Path, points: str, code: str) -> str:
    """What a program says where a package with these entry points is installed."""
    info = folder / "fogml_trimmed-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: fogml-trimmed\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[fogml.regressors]\n{points}\n")
    search = os.pathsep.join([str(folder), str(OUTSIDE), *filter(None, sys.path)])
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": search}
    )
    assert answer.returncode == 0, answer.stderr
    return answer.stdout.strip()


def test_it_keeps_the_contract_and_takes_parameters(tmp_path: Path) -> None:
    code = (
        "from fogml.models.names import make_model; from fogml.testing import check_model\n"
        "check_model(make_model('trimmed'))\n"
        "print(make_model('trimmed', 'T, dT', parameters={'share': 0.2}).regressor.share)"
    )
    assert in_new_process(tmp_path, "trimmed = fogml_trimmed:TrimmedRegressor", code) == "0.2"


def test_spikes_do_not_move_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(OUTSIDE))
    from fogml_trimmed import TrimmedRegressor

    x = np.linspace(-1.0, 1.0, 200)[:, None]
    y = 2.0 * x[:, 0]
    y[::40] += 50.0
    np.testing.assert_allclose(TrimmedRegressor().fit(x, y).predict(x), 2.0 * x[:, 0], atol=1e-8)


@pytest.mark.parametrize(
    ("point", "message"),
    [
        (
            "trimmed = fogml_trimmed:Nothing",
            "entry point 'trimmed' of fogml-trimmed in group 'fogml.regressors' does not load",
        ),
        ("trimmed = fogml.runs.run:Run", "is no regressor; it lacks fit, predict, to_saved, from_saved"),
        ("other = fogml_trimmed:TrimmedRegressor", "model 'trimmed' is not known"),
    ],
)
def test_a_faulty_one_is_named(tmp_path: Path, point: str, message: str) -> None:
    code = (
        "from fogml.errors import InputError; from fogml.models.names import make_model\n"
        "try: make_model('trimmed')\n"
        "except InputError as error: print(error)"
    )
    assert message in in_new_process(tmp_path, point, code)
