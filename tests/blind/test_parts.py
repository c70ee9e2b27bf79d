"""A suite in parts: its marks kept as files, one score of several."""

from __future__ import annotations

import dataclasses
import gzip
import json
from pathlib import Path
from typing import Any

import pytest

from fogml.blind.scoring.marks import Mark, mark
from fogml.blind.scoring.marks_file import MARKS, Marks, merged, part_of, read_marks, write_marks
from fogml.blind.scoring.table import BY_KEY
from fogml.blind.scoring.values import score_values
from fogml.blind.truth import Kind, Truth
from fogml.errors import InputError
from fogml.report.blind_page import blind_page
from fogml.report.blind_tables import headline
from tests.blind.test_marks import answer, truth

WHOLE = ("schema", "version", "seed", "cases", "mix", "kinds", "strata", "fit_runs", "turning", "methods")
KINDS: tuple[tuple[Kind, tuple[str, ...]], ...] = (
    ("nothing", ()),
    ("one", ("a",)),
    ("unknown_left_out", ("b",)),
    ("two", ("a", "b")),
    ("one", ("b",)),
    ("unknown_invented", ("-new",)),
    ("unknown_and_known", ("a", "-new")),
    ("wrong_thermal", ("-structure",)),
)
OF_ONE_KIND = {
    "nothing_named", "one_top", "one_exact", "one_top_strict", "two_exact", "three_exact",
    "unknown_wrong_name", "mixed_known_kept", "mixed_false_name", "wrong_thermal_right",
}  # fmt: skip


def a_truth(number: int, mix: bool = True, seed: int = 1, sample_s: float = 10.0) -> Truth:
    """The truth of a case; kinds and strengths take turns."""
    kind, ids = KINDS[number % len(KINDS)]
    left_out = ids if kind == "unknown_left_out" else ()
    made = truth(kind, *ids, left_out=left_out, d_prime=(5.0, 8.0, 12.0, 30.0, 18.0)[number % 5])
    changed = {"case": f"{number:04d}", "mix": mix, "seed": seed, "sample_s": sample_s}
    return made.model_copy(update=changed)


def a_mark(one: Truth, code: str | None = "c0de") -> Mark:
    """Some answer, right or wrong by the case's number."""
    number = int(one.case)
    items = [("a", 0.6 + 0.03 * (number % 11)), ("b", 0.2 + 0.06 * (number % 9))][: 1 + number % 2]
    given = answer(*items, unknown=0.1 * (number % 10), verdict="explained")
    given = dataclasses.replace(given, seconds=1.0 + number / 3.0, code=code)
    return mark(one, given, relative=lambda id: number % 3 == 0)


def marks_of(numbers: range, methods: tuple[str, ...] = ("diagnosis", "bic"), **drawn: Any) -> Marks:
    truths = tuple(a_truth(number, **drawn) for number in numbers)
    found = {method: [a_mark(one) for one in truths] for method in methods}
    return Marks(truths[0].seed, (truths[0].sample_s,), (part_of(truths, "0" * 64),), truths, found)


def written(folder: Path, name: str, marks: Marks) -> Path:
    path = folder / f"{name}.json.gz"
    write_marks(path, marks)
    return path


def figures(values: dict[str, Any], method: str = "diagnosis") -> dict[str, Any]:
    return {row["key"]: row for row in values["methods"][method]["rows"]}


def test_marks_read_back_give_the_same_score(tmp_path: Path) -> None:
    marks = marks_of(range(1, 61))
    path = tmp_path / MARKS
    write_marks(path, marks)
    direct = score_values(marks)
    assert score_values(read_marks(path)) == direct
    assert figures(direct)["one_exact"]["n"] > 3 and direct["methods"]["diagnosis"]["left_out"]
    again = path.read_bytes()
    write_marks(path, read_marks(path))
    assert path.read_bytes() == again and again[4:8] == bytes(4), "no time in the header"
    stored = json.loads(gzip.decompress(again))
    assert stored["schema"] == "fogml.blind_marks/1" and stored["cases"] == len(stored["truths"]) == 60
    assert not {"segments", "closed", "nominal", "noise"} & set(stored["truths"][0])


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"schema": "fogml.blind_marks/2"}, "key 'schema'"),
        ({"seed": 2}, "another seed"),
        ({"parts": []}, "key 'parts'"),
        ({"methods": {"bic": [{"case": "0009"}]}}, r"key 'methods\.bic\.0\.case'"),
        ({"methods": {"bic": [{"case": "0001"}]}}, r"key 'methods\.bic\.0\.failure'"),
    ],
)
def test_a_broken_file_of_marks_names_its_key(tmp_path: Path, change: dict[str, Any], told: str) -> None:
    path = written(tmp_path, "a", marks_of(range(1, 4)))
    values = json.loads(gzip.decompress(path.read_bytes()))
    path.write_bytes(gzip.compress(json.dumps(values | change).encode()))
    with pytest.raises(InputError, match=told) as caught:
        read_marks(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    "content",
    [b"", b"{}", gzip.compress(b"no JSON", mtime=0), gzip.compress(b"{}", mtime=0)[:-4]],
    ids=["empty", "not compressed", "no JSON", "cut off"],
)
def test_what_is_no_file_of_marks_is_said_to_be_none(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(InputError, match="holds no marks"):
        read_marks(tmp_path / "a")
    with pytest.raises(InputError, match="no such file"):
        read_marks(tmp_path / "b")


def test_two_halves_are_the_whole(tmp_path: Path) -> None:
    halves = [written(tmp_path, "b", marks_of(range(26, 51))), written(tmp_path, "a", marks_of(range(1, 26)))]
    both, whole = merged(halves), score_values(marks_of(range(1, 51)))
    values = score_values(both)
    assert {key: values[key] for key in WHOLE} == {key: whole[key] for key in WHOLE}
    assert [(p["file"], p["first"], p["last"], p["cases"]) for p in values["parts"]] == [
        ("a.json.gz", 1, 25, 25),
        ("b.json.gz", 26, 50, 25),
    ]
    assert "b.json.gz" in blind_page(values)
    # What was merged can be merged again, in any order.
    write_marks(tmp_path / "both.json.gz", both)
    third = written(tmp_path, "c", marks_of(range(51, 61)))
    again = merged([third, tmp_path / "both.json.gz"])
    assert score_values(again) == score_values(merged([*halves, third]))


def test_a_method_counts_over_the_parts_that_it_answered(tmp_path: Path) -> None:
    one = written(tmp_path, "a", marks_of(range(1, 26), ("bic", "diagnosis")))
    other = written(tmp_path, "b", marks_of(range(26, 51), ("diagnosis",)))
    values = score_values(merged([other, one]))
    assert list(values["methods"]) == ["diagnosis", "bic"]
    assert figures(values)["failed"]["n"] == 50 and figures(values, "bic")["failed"]["n"] == 25
    alone = score_values(marks_of(range(1, 26)))
    assert figures(values, "bic") == figures(alone, "bic")
    assert "answered: diagnosis: 50; bic: 25." in blind_page(values)
    assert "The same cases and the same scorer" in blind_page(alone)


def test_parts_that_don_t_belong_together_are_refused(tmp_path: Path) -> None:
    one = written(tmp_path, "a", marks_of(range(1, 11)))
    for name, marks, told in (
        ("overlap", marks_of(range(10, 15)), "case 0010"),
        ("seed", marks_of(range(11, 15), seed=2), "seed 2"),
        ("interval", marks_of(range(11, 15), sample_s=1.0), "sampled at 1 s"),
        ("truth", marks_of(range(10, 15), ("other",), mix=False), "case 0010 is another one"),
    ):
        other = written(tmp_path, name, marks)
        with pytest.raises(InputError, match=told) as caught:
            merged([one, other])
        assert str(one) in str(caught.value) and str(other) in str(caught.value)
    with pytest.raises(InputError, match="no marks are given"):
        merged([])
    # The same cases answered by another method elsewhere do belong together.
    assert len(merged([one, written(tmp_path, "m", marks_of(range(1, 11), ("other",)))]).truths) == 10


def test_cases_outside_the_mix_move_their_own_rows_alone(tmp_path: Path) -> None:
    assert {key for key, figure in BY_KEY.items() if not figure.of_mix} == OF_ONE_KIND
    mix = written(tmp_path, "mix", marks_of(range(1, 41)))
    extra = marks_of(range(2001, 2032), mix=False)
    plain = score_values(read_marks(mix))
    more = score_values(merged([mix, written(tmp_path, "extra", extra)]))
    before, after = figures(plain), figures(more)
    for key in BY_KEY:
        if BY_KEY[key].above:
            # Of any d' are those of the mix alone: others may have been drawn by their strength.
            assert after[key]["by_kind"] == before[key]["by_kind"], key
        if key in OF_ONE_KIND - {"three_exact"}:
            assert after[key]["cases"] > before[key]["cases"] > 0, key
        else:
            assert after[key] == before[key], key
    found, held = more["methods"]["diagnosis"], plain["methods"]["diagnosis"]
    assert found["reliability"] == held["reliability"] and found["open_set"] == held["open_set"]
    assert sum(map(sum, found["confusion"]["counts"])) > sum(map(sum, held["confusion"]["counts"]))
    assert (more["cases"], more["mix"]) == (71, 40)
    assert "31 cases outside the mix" in blind_page(more)


def test_a_suite_of_chosen_kinds_alone_is_its_own_mix() -> None:
    chosen, whole = (score_values(marks_of(range(1, 41), mix=mix)) for mix in (False, True))
    assert figures(chosen) == figures(whole) and chosen["mix"] == 0
    assert "No case is drawn from the whole mix" in blind_page(chosen)
    assert "No case is drawn" not in blind_page(whole)


def test_several_states_of_the_code_are_told() -> None:
    marks = marks_of(range(1, 5), ("diagnosis",))
    assert score_values(marks)["methods"]["diagnosis"]["code"] == ["c0de"]
    assert "states of the code" not in blind_page(score_values(marks))
    mixed = dataclasses.replace(
        marks,
        methods={"diagnosis": [a_mark(one, code) for one, code in zip(marks.truths, ("1", "2", None, "1"))]},
    )
    values = score_values(mixed)
    assert values["methods"]["diagnosis"]["code"] == [None, "1", "2"]
    assert "several states of the code: diagnosis (3)" in blind_page(values)


@pytest.mark.parametrize(
    ("methods", "first"),
    [
        (("abstain", "bic", "diagnosis", "oracle"), "diagnosis"),
        (("abstain", "bic", "families"), "families"),
        (("abstain", "my.module:answer"), "my.module:answer"),
        (("abstain", "bic"), "bic"),
        (("abstain",), "abstain"),
    ],
)
def test_a_score_is_about_the_method_that_was_asked_for(methods: tuple[str, ...], first: str) -> None:
    assert headline(methods) == headline(methods[::-1]) == first
