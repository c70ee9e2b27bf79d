"""The experiment by reality: what its suites are, and its page of hand-made marks."""

from __future__ import annotations

import json
from dataclasses import replace

import yaml

from experiments.gap_blind import __main__ as experiment
from fogml.blind.plan import REALITIES, SAME_TWIN, is_final
from fogml.blind.scoring.marks_file import MARKS as FILE
from fogml.blind.scoring.marks_file import Marks, part_of, write_marks
from tests.blind.test_by_reality import MARKS, marked
from tests.blind.test_marks import answer

CONFIG = yaml.safe_load((experiment.HERE / "config.yaml").read_text(encoding="utf-8"))


def test_the_suites_are_of_every_reality_and_the_seeds_are_apart() -> None:
    assert tuple(CONFIG["realities"]) == REALITIES
    assert not is_final(CONFIG["seed"]) and is_final(CONFIG["final"]["seed"])
    counts = {part["name"]: CONFIG["final"]["share"] * part["count"] for part in CONFIG["parts"]}
    for name in ("one_strong", "one_weak", "two", "nothing", "unknown", "unknown_and_known"):
        assert len(REALITIES) * counts[name] >= 400, name


def test_the_page_tells_what_was_found_of_each_reality() -> None:
    own = marked("nothing", "", answer(("c", 0.6)), of=SAME_TWIN)
    values = experiment.told([*MARKS, own], ["first", "second", SAME_TWIN], 3, "diagnosis", False)
    assert values["cases"] == {"first": 5, "second": 6, SAME_TWIN: 1}
    assert json.loads(json.dumps(values)) == values
    page = experiment.page(values)
    (row,) = [line for line in page.splitlines() if line.startswith("| nothing missing, something named")]
    # What a twin's own runs give stands by itself.
    assert "| ≤ 2 % | 50.0 % " in row and row.count("; 2 |") == 2
    assert "| first | under 0.8 | 20–60 | 1 | 100 % | 100 % | 0 % |" in page
    assert "| 10 s | 1 case | 0 % (0 % … 79.3 %) | c | explained |" in page
    assert "no final figures" in page and "Figures over several kinds" not in page
    uneven = experiment.told(MARKS, ["first", "second"], 3, "diagnosis", True, even=MARKS[:7])
    assert "Figures over several kinds of case rest on 7 of them" in experiment.page(uneven)


def test_the_even_cases_are_the_first_of_each_part_by_its_planned_count(tmp_path) -> None:
    for name, marks in (("one", MARKS[:5]), ("two", MARKS[5:7]), ("every_1_s", MARKS[9:])):
        folder = tmp_path / "first" / name
        folder.mkdir(parents=True)
        held = [
            replace(m, truth=m.truth.model_copy(update={"case": f"{i:04d}"})) for i, m in enumerate(marks)
        ]
        truths = tuple(m.truth for m in held)
        whole = Marks(1, (10.0,), (part_of(truths, "0" * 64),), truths, {"diagnosis": held})
        write_marks(folder / f"diagnosis-{FILE}", whole)
    parts = [{"name": "one", "count": 4}, {"name": "two", "count": 2}]
    even = experiment.evenly(experiment._found(tmp_path, "diagnosis"), "diagnosis", parts)
    assert [(m.truth.kind, m.truth.case) for m in even] == [
        *(("one", f"{i:04d}") for i in range(4)), ("two", "0000"), ("two", "0001"),
    ]  # fmt: skip
