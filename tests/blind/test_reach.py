"""What the data allow of a score's figures, and the table that tells it."""

from __future__ import annotations

import json
from typing import Any

import pytest

from experiments import update_docs
from experiments.gap_blind import per_case, reach, results
from experiments.gap_blind.reach import Figure

ROOT = update_docs.ROOT
TWO = Figure("", ("two",), 0.0)


def effect(case: str, gain: float, named: bool, **changes: Any) -> dict[str, Any]:
    held = {"case": case, "kind": "two", "d_prime": 12.0, "gain": gain, "named": named, "known": True}
    return held | {"wrong_beside": False, "mix": True} | changes


def test_a_case_is_shown_where_each_of_its_effects_is() -> None:
    rows = [
        *(effect("1", gain, True) for gain in (8.0, 30.0)),
        *(effect("2", gain, True) for gain in (7.9, 30.0)),
        *(effect("3", 50.0, True, wrong_beside=True) for _ in range(2)),
        *(effect("4", 50.0, named) for named in (True, False)),
        effect("5", 50.0, True, kind="one"),
    ]
    assert reach.shown(rows, TWO) == (4, 0.75, 0.5)
    assert reach.shown(rows, TWO._replace(alone=False)) == (4, 0.75, 0.75)
    assert reach.shown(rows, TWO._replace(above=12.0)) is None


def test_a_wrong_name_near_the_truth_is_one_that_nobody_can_tell() -> None:
    rows = [effect(str(case), 50.0, True) for case in range(10)]
    wrong = [
        {"case": "0", "wrong": ["a"], "nats": 3.0},
        {"case": "1", "wrong": ["a", "b"], "nats": 8.0},
        {"case": "2", "wrong": [], "nats": 1.0},
        {"case": "elsewhere", "wrong": ["a"], "nats": 1.0},
    ]
    assert reach.wrongly_named(rows, wrong, TWO) == (10, 0.1, 0.2)
    assert reach.wrongly_named(rows, wrong, TWO, near_nats=9.0) == (10, 0.2, 0.2)
    assert reach.false_names(rows, wrong, {row["case"] for row in rows}) == (13, 1 / 13, 3 / 13)


def test_all_but_a_few_right_forms_leave_no_more() -> None:
    forms = [{"lost_nats": float(nats)} for nats in range(1001)]
    assert reach.left_by_right_forms(forms) == 1000.0 * (1.0 - reach.MISSED_FORMS)


@pytest.mark.parametrize("hidden", [0, 10, 40])
def test_hidden_unknowns_rank_as_chance_has_it(hidden: int) -> None:
    """Against the curve of scores that do so: told ones at 1, hidden ones spread as those without any."""
    n, few = 4000, 40 * hidden
    spread = [(i + 0.5) / n for i in range(n)]
    unknown = [
        effect(f"u{i}", 1.0 if i < few else 20.0, True, kind="unknown_and_known", known=False)
        for i in range(n)
    ]
    levels = [(i + 0.5) / max(few, 1) if i < few else 1.0 for i in range(n)]
    asked = [
        {"case": f"u{i}", "mix": True, "kind": "unknown_and_known", "unknown": p}
        for i, p in enumerate(levels)
    ] + [{"case": f"n{i}", "mix": True, "kind": "nothing", "unknown": p} for i, p in enumerate(spread)]
    found = reach.open_set_reach(unknown, asked, 0.0)
    assert found is not None and found.hidden == hidden / 100
    assert found.reached == pytest.approx(found.allowed, abs=0.01)


def test_the_table_that_is_kept_is_of_the_score_that_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    written = {}
    monkeypatch.setattr(results, "write_page", lambda name, page: written.update({name: page}))
    results.main()
    kept = (per_case.HERE / "results.md").read_text(encoding="utf-8")
    assert written == {"results": kept}
    shown = (ROOT / "docs" / "results-diagnosis.md").read_text(encoding="utf-8")
    page, heading = update_docs.SECTIONS["gap-blind"]
    assert (
        update_docs.table_after((ROOT / "experiments" / page).read_text(encoding="utf-8"), heading) in shown
    )


def test_each_figure_has_its_distance_and_its_best_baseline() -> None:
    values = json.loads((per_case.HERE / "score.json").read_text(encoding="utf-8"))
    diagnosis = values["methods"]["diagnosis"]
    rival = json.loads(json.dumps(diagnosis))
    worse = json.loads(json.dumps(diagnosis))
    for held, shift in ((rival, 0.125), (worse, 0.25)):
        for row in held["rows"]:
            row["value"] = 0.5 - shift if row["wanted"]["low"] is not None else 0.5 + shift
    values["methods"] = {"diagnosis": diagnosis, "worse": worse, "rival": rival, "abstain": diagnosis}
    limits, forms = (per_case.of_seed(name, values["seed"]) for name in ("limits", "forms"))
    page = results._page(values, limits, [row for case in forms for row in case])
    rows = {r["words"]: r for r in diagnosis["rows"]}
    told = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")][1:]
    assert len(told) == sum(
        r["value"] is not None and any(v is not None for v in r["wanted"].values()) for r in rows.values()
    )
    for words, *_, best in told:
        assert best.endswith("(rival)"), words
