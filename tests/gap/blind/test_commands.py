"""``fogml blind run`` and ``make`` as commands: what they print, refuse and record."""

from __future__ import annotations

import json
from pathlib import Path

import yaml
from typer.testing import CliRunner

from fogml.cli.main import app
from fogml.gap.blind.folders import BlindFolder
from fogml.gap.blind.truth import check_sums, read_truth
from tests.gap.blind.suites import HandMade, make_suite

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
    made = RUNNER.invoke(
        app,
        [
            "blind",
            "make",
            str(tmp_path / "s"),
            "-n",
            "3",
            "--leave-one-out",
            "--sample",
            "30",
            "--workers",
            "1",
        ],
    )
    assert made.exit_code == 0, made.output
    folder = BlindFolder(tmp_path / "s")
    assert check_sums(folder.truth) == 3
    truths = [read_truth(folder.truth / f"{name}.json") for name in folder.names()]
    assert {truth.kind for truth in truths} == {"unknown_left_out"}
    left = [truth.unknown[0].name for truth in truths]
    assert len(set(left)) == 3
    for truth in truths:
        assert truth.left_out and truth.unknown[0].id in truth.left_out
