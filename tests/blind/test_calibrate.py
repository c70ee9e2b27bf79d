"""Constants of confidence from files of marks: what stands in one is what the answers stated."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.gap_blind import calibrate
from fogml.blind.scoring.answers import Answer, Gap
from fogml.blind.scoring.marks import Mark, mark
from fogml.blind.scoring.marks_file import Marks, part_of, read_marks, write_marks
from fogml.blind.truth import Kind
from fogml.errors import InputError
from fogml.gap.confidence import LARGEST_LOG_ODDS, Support
from tests.blind.test_marks import answer, truth


def listed(effect: str, margin: float, **support: Any) -> dict[str, Any]:
    return {"effect": effect, "class": [effect], "probability": 0.9, "margin": margin, **support}


def a_mark(number: int, kind: Kind, effect: str, which: list[dict[str, Any]], log_odds: float) -> Mark:
    unknown = {"probability": 0.2, "log_odds": log_odds}
    gap = Gap.model_validate({"verdict": "explained", "which": which, "unknown": unknown})
    return mark(truth(kind, effect).model_copy(update={"case": f"{number:04d}"}), Answer(gap))


def a_file(path: Path, marks: list[Mark], seed: int = 1) -> Path:
    truths = tuple(m.truth.model_copy(update={"seed": seed}) for m in marks)
    write_marks(path, Marks(seed, (10.0,), (part_of(truths, "0" * 64),), truths, {"diagnosis": marks}))
    return path


def test_a_file_of_marks_holds_what_supports_a_name(tmp_path: Path) -> None:
    stated = {"form_share": 0.1, "rest": 0.3, "length": 12.5, "outside": 1, "joint": 9.5, "others": 2.5}
    found = a_mark(1, "one", "a", [listed("a", 7.25, **stated), listed("b", 1.0)], log_odds=-3.5)
    (again,) = read_marks(a_file(tmp_path / "marks.json.gz", [found])).methods["diagnosis"]
    assert [item.support for item in again.items] == [
        Support(7.25, 0.1, 0.3, 12.5, 1, 9.5, 2.5),
        Support(1.0),
    ]
    assert again.log_odds == -3.5


def test_methods_without_a_margin_have_no_support() -> None:
    found = mark(truth("one", "a"), answer(("a", 0.9)))
    assert found.items[0].support is None and found.log_odds is None


def test_the_share_of_right_names_comes_back_from_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # Of names with one and the same support 3 of 4 are right: the line goes through log 3 there.
    # Those at no margin, all wrong here, don't count.
    marks = []
    for number in range(1, 401):
        kind: Kind = "one" if number % 4 else "unknown_invented"
        which = [listed("a", 2.0, length=5.0), listed("c", 0.0)]
        true = "a" if number % 4 else "-new"
        marks.append(a_mark(number, kind, true, which, log_odds=-20.0 if number % 4 else 20.0))
    path = a_file(tmp_path / "marks.json.gz", marks)
    monkeypatch.setattr(sys, "argv", ["calibrate", str(path)])
    calibrate.main()
    named, unknown = capsys.readouterr().out.splitlines()
    assert named.endswith("from 400 findings") and unknown.endswith("from 400 findings")
    constants = [float(c) for c in named.split("(")[1].split(")")[0].split(",")]
    odds_of_one = constants[0] + float(np.dot(constants[1:], Support(2.0, length=5.0).features))
    assert odds_of_one == pytest.approx(np.log(3.0), abs=0.02)
    odds = [float(c) for c in unknown.split("(")[1].split(")")[0].split(",")]
    assert odds[1] * LARGEST_LOG_ODDS > 2.0


def test_marks_that_cannot_be_learned_from_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(path: Path, told: str, *more: str) -> None:
        monkeypatch.setattr(sys, "argv", ["calibrate", str(path), *more])
        with pytest.raises(InputError, match=told):
            calibrate.main()

    found = a_mark(1, "one", "a", [listed("a", 7.0)], log_odds=-3.0)
    refused(a_file(tmp_path / "kept.json.gz", [found], seed=1_999_999), "kept for final figures")
    alone = a_file(tmp_path / "one.json.gz", [found])
    refused(alone, "not both right and wrong")
    refused(alone, "no marks of 'bic'", "--answers", "bic")
    bare = mark(truth("one", "a"), answer(("a", 0.9)))
    refused(a_file(tmp_path / "bare.json.gz", [bare]), "0001 has names without support")
    refused(tmp_path, "no answers")
