"""The full suite's parts as they are set, and a small one of them from end to end."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
import yaml

from experiments.gap_blind import __main__ as full
from fogml.blind.plan import plans
from fogml.blind.scoring.marks_file import write_marks
from fogml.blind.scoring.table import ENOUGH, FIGURES
from fogml.blind.seeds import is_final, uses
from fogml.cli.blind import MakeSettings
from tests.blind.test_parts import marks_of

CONFIG = yaml.safe_load((full.HERE / "config.yaml").read_text(encoding="utf-8"))


def test_the_parts_never_meet_and_give_every_wanted_row_enough() -> None:
    assert is_final(CONFIG["final"]["seed"]) and not is_final(CONFIG["development"]["seed"])
    assert CONFIG["final"]["parts"] == CONFIG["development"]["parts"]
    numbers: list[int] = []
    drawn = []
    for part in CONFIG["final"]["parts"]:
        settings = MakeSettings(**{key: part[key] for key in part.keys() - {"name", "methods"}})
        first = settings.first - 1
        chosen = plans(first + settings.count, 1, settings.kinds or None, settings.least_d_prime)[first:]
        numbers += [plan.number for plan in chosen]
        drawn += chosen
    assert len(set(numbers)) == len(numbers)
    assert sum(plan.mix for plan in drawn) >= 1000
    for figure in FIGURES:
        if figure.key.startswith("seconds") or (figure.low is None and figure.high is None):
            continue
        # Strata are drawn alike, and of several effects the weakest one decides.
        cases = sum(
            (sum(low >= figure.above for low, _ in plan.strata) / len(plan.strata))
            ** (plan.known + (plan.first is not None))
            for plan in drawn
            if plan.kind in figure.kinds and (plan.mix or not figure.of_mix)
        )
        assert cases >= ENOUGH, (figure.key, cases)


def test_a_part_is_scored_with_the_marks_that_are_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    home, seed = tmp_path / "home", 1_999_999
    home.mkdir()
    parts = [{"name": "mix", "count": 2}, {"name": "one", "first": 2001, "count": 5, "kinds": ["one"]}]
    suite = {"seed": seed, "parts": parts}
    config = {"development": suite, "final": suite, "sample": 30.0, "limit": 60.0, "methods": ["stlsq"]}
    (home / "config.yaml").write_text(yaml.safe_dump(config))
    write_marks(home / "marks-old.json.gz", marks_of(range(1, 5), seed=3))
    monkeypatch.setattr(full, "HERE", home)
    monkeypatch.setattr(full, "LEDGER", str(home / "final_uses.json"))
    for name in ("one", "mix"):
        arguments = [str(tmp_path / "suite"), "--final", "--part", name, "--workers", "1", "--count", "1"]
        monkeypatch.setattr(sys, "argv", ["gap_blind", *arguments])
        full.main()
    assert "marks-old.json.gz is left out: it is of seed 3" in capsys.readouterr().out
    values = json.loads((home / "score.json").read_text())
    assert [(p["file"], p["first"], p["cases"]) for p in values["parts"]] == [
        ("marks-mix.json.gz", 1, 1),
        ("marks-one.json.gz", 2001, 1),
    ]
    assert (values["seed"], values["cases"], values["mix"]) == (seed, 2, 1)
    # Each part once when it is scored, and what is made of those that are there.
    assert [use["cases"] for use in uses(home / "final_uses.json")] == [1, 1, 1, 2]
    assert (tmp_path / "suite" / "mix" / "score.html").is_file()
    # What is kept has no links to where the cases lie; the page there has.
    worst = values["methods"]["stlsq"]["worst"]
    assert "2001" in [case["case"] for case in worst] and {case["report"] for case in worst} == {None}
    assert "reports lie with the suite" in (home / "score.html").read_text()
    report = "one/answers-stlsq/2001/gap.json"
    assert f'href="{report}"' in (tmp_path / "suite" / "score.html").read_text()
    assert (tmp_path / "suite" / report).is_file()
    assert sorted(path.name for path in home.glob("*marks*")) == [
        "marks-mix.json.gz",
        "marks-old.json.gz",
        "marks-one.json.gz",
    ]
