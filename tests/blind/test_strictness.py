"""Names at other thresholds, against counting by hand and against the score."""

from __future__ import annotations

from dataclasses import replace

import pytest

from experiments.gap_blind import strictness
from fogml.blind.scoring.marks import Judged, Mark, mark, renamed
from fogml.blind.scoring.table import rows
from fogml.blind.truth import Kind
from tests.blind.test_marks import answer, truth


def found(kind: Kind, named: tuple[str, float], suspected: tuple[str, float]) -> Mark:
    held = mark(truth(kind, "a"), answer(named))
    id, p = suspected
    return replace(held, suspected=(Judged(id, (id,), p, False, id == "a"),))


@pytest.mark.parametrize(
    ("least", "names", "exact", "top", "wrong"),
    [
        (0.5, ["a", "b"], False, True, True),
        (0.7, ["a"], True, True, False),
        (0.8, ["a"], True, True, False),
        (0.81, [], False, False, False),
    ],
)
def test_names_are_those_so_probable(
    least: float, names: list[str], exact: bool, top: bool, wrong: bool
) -> None:
    (held,) = strictness.named_from(least, [found("one", ("a", 0.8), ("b", 0.6))])
    assert [item.effect for item in held.named] == names
    assert (held.exact, held.top, held.wrong_name) == (exact, top, wrong)
    assert not held.suspected


def test_a_suspected_effect_that_is_more_probable_comes_first() -> None:
    (held,) = strictness.named_from(0.5, [found("one", ("b", 0.7), ("a", 0.8))])
    assert [item.effect for item in held.items] == ["a", "b"] and held.top


def test_a_failed_case_stays_a_failure() -> None:
    failed = mark(truth("one", "a"), replace(answer(), gap=None, failure="crashed"))
    assert strictness.named_from(0.5, [failed]) == [failed]


def test_kept_marks_stand_as_they_were_judged() -> None:
    """Judged anew by the names they have, every kept case comes out as it was scored."""
    marks = strictness.marks_of(strictness.kept_seed())
    again = [one if one.failure else renamed(one, one.items) for one in marks]
    assert again == [replace(one, suspected=()) if not one.failure else one for one in marks]


def test_the_page_has_the_score_in_its_last_row() -> None:
    marks = [found("one", ("a", 0.8), ("b", 0.6)), found("one", ("c", 0.9), ("b", 0.6))]
    last = strictness.page(marks).splitlines()[-1]
    value = next(row["value"] for row in rows(marks) if row["key"] == "one_exact")
    assert value == 0.5
    assert last.split("|")[2 + strictness.KEYS.index("one_exact")].strip() == "50.0 %"
