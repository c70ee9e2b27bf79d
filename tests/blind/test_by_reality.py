"""The table by reality and by distance of form, against hand-made answers counted by hand."""

from __future__ import annotations

from typing import Any

import pytest

from fogml.blind.scoring.by_reality import by_form, by_reality, mass_on_true
from fogml.blind.scoring.marks import Mark, mark
from fogml.blind.truth import Kind
from fogml.report.blind_tables import by_form_table, by_reality_table
from tests.blind.test_marks import answer, truth


def marked(
    kind: Kind, ids: str, given: Any, d_prime: float = 30.0, cosine: float | None = None, of: str = "first"
) -> Mark:
    """A case of a reality with its answer."""
    held = truth(kind, *ids.split(), d_prime=d_prime, left_out=("z",))
    effects = tuple(e.model_copy(update={"cosine": cosine}) for e in held.effects)
    return mark(held.model_copy(update={"effects": effects, "reality": of}), given)


MARKS = [
    marked("one", "a", answer(("b|a", 0.9)), cosine=0.7),
    marked("one", "a", answer(("b", 0.9), unknown=0.1), cosine=0.85),
    marked("one", "a", answer(unknown=0.9, verdict="unknown"), cosine=0.7, of="second"),
    marked("one", "a", answer(("a", 0.4)), 9.0, cosine=0.97, of="second"),
    marked("one", "a", answer(("a", 0.8), ("c", 0.6)), cosine=0.97, of="second"),
    marked("two", "a b", answer(("a", 0.9), ("b", 0.8))),
    marked("two", "a b", answer(("a", 0.9)), 12.0, of="second"),
    marked("unknown_invented", "-new", answer(unknown=0.8, verdict="unknown")),
    marked("unknown_and_known", "a -new", answer(("a", 0.7), ("c", 0.7), unknown=0.3)),
    marked("nothing", "", answer(verdict="no_gap"), of="second"),
    marked("nothing", "", answer(("c", 0.5), verdict="explained"), of="second"),
]


@pytest.mark.parametrize(
    ("key", "reality", "hits", "cases"),
    [
        ("one_strong_right", "all", 2, 4),
        ("one_strong_right", "first", 1, 2),
        ("one_strong_exact", "all", 1, 4),
        ("one_weak_right", "second", 0, 1),
        ("one_far_right", "all", 1, 3),
        ("one_far_right", "second", 0, 1),
        ("pair_exact", "all", 1, 2),
        ("each_kept", "all", 3, 4),
        ("unknown_misnamed", "all", 0, 1),
        ("known_kept", "all", 1, 1),
        ("beside_unknown_false", "all", 1, 1),
        ("nothing_named", "second", 1, 2),
        ("nothing_no_gap", "second", 1, 2),
        ("false_names", "all", 4, 10),
    ],
)
def test_each_figure_is_what_one_counts(key: str, reality: str, hits: int, cases: int) -> None:
    row = next(row for row in by_reality(MARKS)[reality] if row["key"] == key)
    assert (row["n"], row["value"]) == (cases, pytest.approx(hits / cases))
    assert 0.0 <= row["low"] <= row["value"] <= row["high"] <= 1.0


def test_figures_over_several_kinds_rest_on_the_even_cases_alone() -> None:
    """One kind with more cases than planned would weigh on what is counted over all of them."""
    found = {row["key"]: row for row in by_reality(MARKS, MARKS[:7])["all"]}
    assert (found["false_names"]["n"], found["each_kept"]["n"], found["mass_on_true"]["n"]) == (7, 4, 4)
    assert (found["nothing_named"]["n"], found["unknown_misnamed"]["n"], found["known_kept"]["n"]) == (
        2,
        1,
        1,
    )


def test_the_mass_on_the_true_cause_is_shared_in_a_class_and_scaled_to_one() -> None:
    first, wrong, missed, *_ = MARKS
    assert mass_on_true(first) == pytest.approx(0.45)
    assert mass_on_true(wrong) == mass_on_true(missed) == 0.0
    assert mass_on_true(MARKS[4]) == pytest.approx(0.8 / 1.4)
    assert mass_on_true(MARKS[7]) == pytest.approx(0.8)


def test_a_far_form_called_by_its_name_is_right_and_called_unknown_a_miss() -> None:
    cells = {(c["reality"], c["form"], c["d_prime"][0]): c for c in by_form(MARKS)}
    assert cells["first", "under 0.8", 20.0]["right"]["value"] == 1.0
    far = cells["second", "under 0.8", 20.0]
    assert (far["right"]["value"], far["unknown"]["value"]) == (0.0, 1.0)
    assert cells["second", "over 0.95", 8.0]["right"]["n"] == 1
    assert len(by_form_table(by_form(MARKS)).rows) == len(cells)


def test_the_page_has_a_column_for_each_reality() -> None:
    table = by_reality_table(by_reality(MARKS))
    assert [column[0] for column in table.columns] == ["Figure", "Wanted", "all", "first", "second"]
    assert len(by_reality_table(by_reality(MARKS[:2])).columns) == 3
