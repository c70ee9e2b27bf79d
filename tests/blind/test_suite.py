"""A hand-made suite through baselines, oracle, relatives, score, page and command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fogml.blind.baselines.learners import abstain, gp_discrepancy, oracle
from fogml.blind.baselines.regression import Regression, bic, bic_fixed_nominal
from fogml.blind.folders import BlindFolder, case_files
from fogml.blind.methods import METHODS, load_method
from fogml.blind.relatives import relatives_of
from fogml.blind.score import gate, gather, wanted_gates
from fogml.blind.scoring.table import BY_KEY
from fogml.blind.scoring.values import score_values
from fogml.blind.truth import read_truth
from fogml.cli.main import app
from fogml.errors import InputError
from fogml.report.blind_page import blind_page
from tests.blind.suites import HandMade, make_suite

HYSTERESIS = {"thermal_hysteresis": (0.06, {"half_width": 9.0})}
RELAXATION = {"stress_relaxation": (0.004, {"time_constant": 3000.0})}
CASES = [
    HandMade("nothing"),
    HandMade("one", HYSTERESIS),
    HandMade("unknown_left_out", HYSTERESIS, ("thermal_hysteresis",)),
    HandMade("unknown_and_known", HYSTERESIS | RELAXATION, ("thermal_hysteresis",)),
]


@pytest.fixture(scope="module")
def suite(tmp_path_factory: pytest.TempPathFactory) -> BlindFolder:
    folder = make_suite(tmp_path_factory.mktemp("blind") / "suite", CASES)
    for name in folder.names():
        case = case_files(folder.cases / name)
        for method, function in (("abstain", abstain), ("bic", bic)):
            out = folder.answers(method) / name
            out.mkdir(parents=True)
            function(case, out)
        out = folder.answers("oracle") / name
        out.mkdir(parents=True)
        oracle(folder, read_truth(folder.truth / f"{name}.json"), out)
    return folder


def answer(suite: BlindFolder, method: str, name: str) -> dict:
    return json.loads((suite.answers(method) / name / "gap.json").read_text())


def named(gap: dict) -> list[str]:
    return [item["effect"] for item in gap["which"] if item["probability"] >= 0.5]


def test_forward_selection_finds_an_effect_of_the_twin_itself(suite: BlindFolder) -> None:
    assert named(answer(suite, "bic", "0001")) == []
    gap = answer(suite, "bic", "0002")
    assert named(gap) == ["thermal_hysteresis"]
    fitted = gap["which"][0]["amplitude"]
    assert fitted["value"] == pytest.approx(0.06, rel=0.1) and fitted["unit"] == "deg/h"
    assert gap["how_far"][0]["closed"] == pytest.approx(1.0, abs=0.1)


def test_constants_held_fixed_name_what_is_not_there(suite: BlindFolder, tmp_path: Path) -> None:
    bic_fixed_nominal(case_files(suite.cases / "0001"), tmp_path)
    assert named(json.loads((tmp_path / "gap.json").read_text()))


def test_least_squares_weigh_columns_once(suite: BlindFolder) -> None:
    """Without rows of priors, weighed columns are as long as plain ones: they were weighed again."""
    for free in (True, False):
        problem = Regression(case_files(suite.cases / "0002"), free=free, grid=False)
        one = problem.columns[:, [0]]
        found = problem.fit(one)
        design = np.concatenate([problem.constants, one], axis=1)
        wanted = np.linalg.lstsq(design / np.linalg.norm(design, axis=0), problem.target, rcond=None)[0]
        wanted /= np.linalg.norm(design, axis=0)
        assert found.amplitudes == pytest.approx(wanted[-1:], rel=1e-6)


def test_a_process_over_the_twin_says_unknown_where_there_is_more_than_noise(
    suite: BlindFolder, tmp_path: Path
) -> None:
    for name, missing in (("0001", False), ("0003", True)):
        out = tmp_path / name
        out.mkdir()
        gp_discrepancy(case_files(suite.cases / name), out, most_rows=120)
        gap = json.loads((out / "gap.json").read_text())
        assert named(gap) == []
        assert (gap["unknown"]["probability"] > 0.99) is missing, gap["unknown"]


def test_left_out_is_not_offered(suite: BlindFolder) -> None:
    assert "thermal_hysteresis" not in named(answer(suite, "bic", "0003"))


def test_a_method_without_answers_is_no_failed_one(suite: BlindFolder) -> None:
    with pytest.raises(InputError, match=r"answers-abstein: no such folder.* did you mean 'abstain'\?"):
        gather(suite, ["abstein"])


def test_oracle_tells_the_known_from_the_unknown(suite: BlindFolder) -> None:
    assert answer(suite, "oracle", "0001")["verdict"] == "no_gap"
    assert named(answer(suite, "oracle", "0002")) == ["thermal_hysteresis"]
    assert answer(suite, "oracle", "0003")["verdict"] == "unknown"
    mixed = answer(suite, "oracle", "0004")
    assert named(mixed) == ["stress_relaxation"] and mixed["verdict"] == "partly_explained"


def test_relatives_are_those_of_like_signature(suite: BlindFolder) -> None:
    assert relatives_of(suite, read_truth(suite.truth / "0002.json")) is None
    relative = relatives_of(suite, read_truth(suite.truth / "0003.json"))
    assert relative is not None
    # The true form is the twin's own here: it must find itself, off its grid of shapes.
    assert relative("thermal_hysteresis")
    assert not relative("bias_polynomial") and not relative("no_such_effect")


def test_score_page_and_gates(suite: BlindFolder) -> None:
    values = score_values(gather(suite))
    assert set(values["methods"]) == {"abstain", "bic", "oracle"}
    assert values["cases"] == 4 and values["kinds"]["one"] == 1
    figures = {row["key"]: row["value"] for row in values["methods"]["oracle"]["rows"]}
    assert figures["one_exact"] == figures["auroc"] == 1.0 and figures["nothing_named"] == 0.0
    assert [g["met"] for g in gate(values, {"one_exact": 0.95, "nothing_named": 0.02}, "oracle")] == [
        True,
        True,
    ]
    assert not gate(values, {"one_exact": 0.95}, "abstain")[0]["met"]
    with pytest.raises(InputError, match="no figure"):
        gate(values, {"some": 1.0}, "bic")
    assert set(wanted_gates()) == {k for k, f in BY_KEY.items() if f.low is not None or f.high is not None}
    page = blind_page(values).replace("<wbr>", "")
    assert "://" not in page.split("<script>")[0]
    assert all(row["words"].split(",")[0] in page for row in values["methods"]["bic"]["rows"])


def test_the_command_ends_with_1_where_a_gate_fails(suite: BlindFolder, tmp_path: Path) -> None:
    base = ["blind", "score", str(suite.path), "--method", "bic", "--out", str(tmp_path)]
    base += ["--workers", "1", "-q"]
    runner = CliRunner()
    assert runner.invoke(app, [*base, "--gate", "one_exact=0.9"]).exit_code == 0
    assert json.loads((tmp_path / "score.json").read_text())["schema"] == "fogml.blind_score/1"
    assert runner.invoke(app, [*base, "--gate", "auroc=1.1"]).exit_code == 1
    assert runner.invoke(app, [*base, "--gate", "nonsense"]).exit_code == 2
    assert runner.invoke(app, [*base, "--final"]).exit_code == 2


def test_a_truth_that_changed_is_not_scored(tmp_path: Path) -> None:
    folder = make_suite(tmp_path / "suite", CASES[:1])
    path = folder.truth / "0001.json"
    path.write_text(path.read_text().replace('"nothing"', '"one"'))
    with pytest.raises(InputError, match="changed since"):
        gather(folder, ["abstain"])


@pytest.mark.parametrize("name", METHODS)
def test_every_method_loads(name: str) -> None:
    assert callable(load_method(name))
