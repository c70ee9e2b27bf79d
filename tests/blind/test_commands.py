"""``fogml blind run``, ``make`` and ``merge`` as commands: what they print, refuse and record."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import yaml
from click.testing import CliRunner

from fogml.blind.folders import BlindFolder, check_sums
from fogml.blind.methods import code_state
from fogml.blind.plan import FINAL_FROM, uses
from fogml.blind.scoring.marks_file import MARKS
from fogml.blind.truth import read_truth
from fogml.cli.blind_job import link_reports
from fogml.cli.main import app
from tests.blind.suites import SAMPLE_S, HandMade, make_suite
from tests.blind.test_parts import WHOLE, marks_of, written

RUNNER = CliRunner()


def test_run_answers_once_and_says_so(tmp_path: Path) -> None:
    folder = make_suite(tmp_path / "suite", [HandMade("nothing"), HandMade("nothing")])
    command = ["blind", "run", str(folder.path), "--method", "abstain", "--method", "oracle", "--json"]
    first = RUNNER.invoke(app, [*command, "--workers", "1"])
    assert first.exit_code == 0, first.output
    told = json.loads(first.stdout)
    both = {"answered": 2, "failed": 0}
    assert told == {"abstain": both, "oracle": both}
    again = json.loads(RUNNER.invoke(app, command).stdout)
    assert again["abstain"]["answered"] == again["oracle"]["answered"] == 0
    written = yaml.safe_load((folder.answers("abstain") / "run.yaml").read_text())
    assert written["directory"] == str(folder.path) and written["workers"] == 2
    sealed = json.loads((folder.answers("abstain") / "0001" / "outcome.json").read_text())["sealed_by"]
    assert "audit" in sealed
    oracle = json.loads((folder.answers("oracle") / "0001" / "outcome.json").read_text())["sealed_by"]
    assert oracle.startswith("not sealed")


def test_wrong_usage_ends_with_2(tmp_path: Path) -> None:
    for arguments in (
        ["run"],
        ["run", str(tmp_path)],
        ["run", str(tmp_path), "--shard", "3"],
        ["score", str(tmp_path)],
        ["make", str(tmp_path / "s"), "--kind", "nonsense", "-n", "1"],
        ["make", str(tmp_path / "s"), "--kind", "one", "--leave-one-out"],
    ):
        result = RUNNER.invoke(app, ["blind", *arguments])
        assert result.exit_code == 2, (arguments, result.output)


def test_leave_one_out_takes_each_effect_in_turn(tmp_path: Path) -> None:
    options = ["-n", "2", "--leave-one-out", "--sample", "30", "--workers", "1"]
    made = RUNNER.invoke(app, ["blind", "make", str(tmp_path / "s"), *options])
    assert made.exit_code == 0, made.output
    folder = BlindFolder(tmp_path / "s")
    assert check_sums(folder.truth) == 2
    truths = [read_truth(folder.truth / f"{name}.json") for name in folder.names()]
    assert {truth.kind for truth in truths} == {"unknown_left_out"}
    left = [truth.unknown[0].name for truth in truths]
    assert len(set(left)) == 2
    for truth in truths:
        assert truth.left_out and truth.unknown[0].id in truth.left_out


def test_make_takes_a_part_of_strong_cases(tmp_path: Path) -> None:
    options = ["-n", "1", "--first", "7", "--kind", "one", "--least-d-prime", "20", "--sample", "30"]
    made = RUNNER.invoke(app, ["blind", "make", str(tmp_path / "s"), *options, "--workers", "1", "-q"])
    assert made.exit_code == 0, made.output
    truth = read_truth(tmp_path / "s" / "truth" / "0007.json")
    assert truth.kind == "one" and truth.d_prime > 19.8 and not truth.mix
    assert yaml.safe_load((tmp_path / "s" / "make.yaml").read_text())["first"] == 7
    weak = RUNNER.invoke(app, ["blind", "make", str(tmp_path / "t"), "-n", "1", "--least-d-prime", "50"])
    assert weak.exit_code == 2 and "no stratum" in weak.output


def test_scored_parts_are_merged(tmp_path: Path) -> None:
    suite = make_suite(tmp_path / "suite", [HandMade("nothing")] * 2)
    for arguments in (["run", "--method", "abstain"], ["score"]):
        command = ["blind", arguments[0], str(suite.path), *arguments[1:], "--workers", "1", "-q"]
        done = RUNNER.invoke(app, command)
        assert done.exit_code == 0, done.output
    outcome = json.loads((suite.answers("abstain") / "0001" / "outcome.json").read_text())
    assert outcome["code"] == code_state("abstain")
    out, file = tmp_path / "page", suite.path / MARKS
    for wrong in ([str(file)], ["--out", str(out)], [str(file), str(file), "--out", str(out)]):
        result = RUNNER.invoke(app, ["blind", "merge", *wrong])
        assert result.exit_code == 2 and not out.exists(), result.output
    other = written(tmp_path, "other", marks_of(range(11, 15), ("abstain",), sample_s=SAMPLE_S))
    merged = RUNNER.invoke(app, ["blind", "merge", str(other), str(file), "--out", str(out), "--json"])
    assert merged.exit_code == 0, merged.output
    told = json.loads(merged.stdout)
    assert told == json.loads((out / "score.json").read_text())
    assert told["cases"] == 6 and [part["file"] for part in told["parts"]] == [MARKS, "other.json.gz"]
    assert told["methods"]["abstain"]["code"] == sorted(["c0de", outcome["code"]])
    assert {path.name for path in out.iterdir()} == {"score.json", "score.html", "score.yaml", MARKS}
    # One part alone is what it was.
    again = RUNNER.invoke(app, ["blind", "merge", str(file), "--out", str(out), "--json"])
    direct = json.loads((suite.path / "score.json").read_text())
    assert {key: json.loads(again.stdout)[key] for key in (*WHOLE, "parts")} == {
        key: direct[key] for key in (*WHOLE, "parts")
    }
    assert (out / MARKS).read_bytes() == file.read_bytes()


def test_worst_cases_link_to_what_lies_there(tmp_path: Path) -> None:
    parts = [tmp_path / "a", tmp_path / "b", tmp_path / "elsewhere"]
    for file in ("a/answers/0001/gap.json", "b/reports/0002/gap.html", "b/answers/0002/gap.json"):
        (tmp_path / file).parent.mkdir(parents=True)
        (tmp_path / file).touch()
    worst: list[dict[str, Any]] = [{"case": case} for case in ("0001", "0002", "0003")]
    link_reports({"methods": {"diagnosis": {"worst": worst}}}, parts, tmp_path / "a" / "page")
    told = [case["report"] for case in worst]
    assert told == ["../answers/0001/gap.json", "../../b/reports/0002/gap.html", None]


def test_merging_a_final_seed_is_a_use_of_it(tmp_path: Path) -> None:
    path = written(tmp_path, "a", marks_of(range(1, 6), seed=FINAL_FROM))
    base = ["blind", "merge", str(path), "--out", str(tmp_path / "page"), "-q"]
    assert RUNNER.invoke(app, base).exit_code == 2
    ledger = tmp_path / "uses.json"
    final = RUNNER.invoke(app, [*base, "--final", "--ledger", str(ledger)])
    assert final.exit_code == 0, final.output
    assert [use["cases"] for use in uses(ledger)] == [5]
    values = json.loads((tmp_path / "page" / "score.json").read_text())
    assert values["final"] and len(values["final_uses"]) == 1
    assert {case["report"] for case in values["methods"]["diagnosis"]["worst"]} == {None}
    assert "gap.json" not in (tmp_path / "page" / "score.html").read_text()
