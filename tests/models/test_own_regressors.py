"""A regressor of another package, declared by an entry point, is a model as any other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.outside import in_new_process

OUTSIDE = Path(__file__).parent / "outside_package"


def said(folder: Path, point: str, code: str) -> str:
    return in_new_process(folder, OUTSIDE, f"[fogml.regressors]\n{point}\n", code)


def test_it_keeps_the_contract_and_takes_parameters(tmp_path: Path) -> None:
    code = (
        "from fogml.models.names import make_model; from fogml.testing import check_model\n"
        "check_model(make_model('trimmed'))\n"
        "print(make_model('trimmed', 'T, dT', parameters={'share': 0.2}).regressor.share)"
    )
    assert said(tmp_path, "trimmed = fogml_trimmed:TrimmedRegressor", code) == "0.2"


def test_columns_that_it_does_not_count_are_counted_for_it(tmp_path: Path) -> None:
    code = (
        "from fogml_trimmed import TrimmedRegressor as Own\n"
        "read = Own.from_saved\n"
        "def uncounted(values, arrays):\n"
        "    model = read(values, arrays); del model.n_features_in_; return model\n"
        "Own.from_saved = uncounted\n"
        "from fogml.models.names import make_model; from fogml.testing import check_model\n"
        "from fogml.models.compact import compact_regressor; from fogml.errors import InputError\n"
        "check_model(make_model('trimmed'))\n"
        "try: compact_regressor('trimmed', Own())\n"
        "except InputError as error: print(error)"
    )
    told = said(tmp_path, "trimmed = fogml_trimmed:TrimmedRegressor", code)
    assert told.endswith("its package gives one by a method 'compact' (fogml.models.compact.network_of)")


def test_spikes_do_not_move_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(OUTSIDE / "src"))
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
        (
            "trimmed = fogml.runs.run:Run",
            "is no regressor; it lacks fit, predict, to_saved, from_saved, get_params",
        ),
        ("other = fogml_trimmed:TrimmedRegressor", "model 'trimmed' is not known"),
    ],
)
def test_a_faulty_one_is_named(tmp_path: Path, point: str, message: str) -> None:
    code = (
        "from fogml.errors import InputError; from fogml.models.names import make_model\n"
        "try: make_model('trimmed')\n"
        "except InputError as error: print(error)"
    )
    assert message in said(tmp_path, point, code)


TAKEN = "'linear' is a regressor of fogml's own"
MADE = "make_model('linear')"
SAVED = "regressor_to_saved(TrimmedRegressor().fit(np.eye(3), np.ones(3)))"


@pytest.mark.parametrize("attempt", [MADE, SAVED])
def test_a_name_of_fogmls_own_is_refused(tmp_path: Path, attempt: str) -> None:
    """What was saved under it would come back as another regressor."""
    code = (
        "import numpy as np; from fogml_trimmed import TrimmedRegressor\n"
        "from fogml.errors import InputError; from fogml.models.names import make_model\n"
        "from fogml.models.regressors import regressor_to_saved\n"
        f"try: {attempt}\n"
        "except InputError as error: print(error)"
    )
    told = said(tmp_path, "linear = fogml_trimmed:TrimmedRegressor", code)
    assert told.startswith("entry point 'linear' of fogml-trimmed") and TAKEN in told


def test_compare_takes_it_among_all_and_gives_it_the_features(tmp_path: Path) -> None:
    code = (
        "from fogml.cli.compare_job import _makers; from fogml.cli.model_commands import CompareSettings\n"
        "made = _makers(CompareSettings(runs=['a.csv'], features='T, dT[60 s]'))\n"
        "print(made['trimmed']().features.text if hasattr(made['trimmed']().features, 'text') "
        "else made['trimmed']().features)"
    )
    assert said(tmp_path, "trimmed = fogml_trimmed:TrimmedRegressor", code) == "T, dT[60 s]"


def test_it_gets_the_seed_unless_one_is_stated(tmp_path: Path) -> None:
    code = (
        "from fogml_trimmed import TrimmedRegressor as Own\n"
        "class Seeded(Own):\n"
        "    def __init__(self, share=0.05, random_state=0):\n"
        "        super().__init__(share); self.random_state = random_state\n"
        "import fogml_trimmed; fogml_trimmed.Seeded = Seeded\n"
        "from fogml.models.names import make_model\n"
        "print(*(make_model('seeded', seed=7, parameters=p).regressor.random_state "
        "for p in ({}, {'random_state': 3})))"
    )
    assert said(tmp_path, "seeded = fogml_trimmed:Seeded", code) == "7 3"


def test_a_name_of_a_model_of_fogmls_own_is_refused(tmp_path: Path) -> None:
    code = (
        "from fogml.errors import InputError; from fogml.models.names import make_model\n"
        "try: make_model('polynomial')\n"
        "except InputError as error: print(error)"
    )
    told = said(tmp_path, "polynomial = fogml_trimmed:TrimmedRegressor", code)
    assert told.startswith("entry point 'polynomial' of fogml-trimmed") and "has to name another" in told


def test_sealed_processes_of_the_benchmark_may_read_it(tmp_path: Path) -> None:
    code = "from fogml.benchmark.answers import _folder_of; print(_folder_of('trimmed'), _folder_of('mean'))"
    assert said(tmp_path, "trimmed = fogml_trimmed:TrimmedRegressor", code) == f"{OUTSIDE / 'src'} None"
