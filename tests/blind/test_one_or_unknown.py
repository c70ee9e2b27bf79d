"""What the catalogue leaves of a signal against plain least squares; an oracle's trade against counting."""

from __future__ import annotations

import json
import math
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from experiments.gap_blind import one_or_unknown, per_case, strictness
from experiments.gap_blind.catalogue_fit import CatalogueFit, Pair
from experiments.gap_blind.trade import COUNTED_AS_NAMED, best_trade, missed, trade
from fogml.gap.candidate_columns import candidate_columns
from fogml.gap.screening import Screening
from tests.gap.small_model import KINDS, SmallModel, framed, ramps

MODEL = SmallModel(("bend", "cube", "mixture"))


@pytest.fixture(scope="module")
def frame():
    return framed([ramps("a", count=150), ramps("b", count=150, turns=3)], MODEL)


def seen(frame, make):
    """A signal of each run, whitened and beside the constants."""
    rows = frame.white([make(o)[:, None] for o in frame.observations])
    return frame.without_constants(rows[:, 0])


def fitted(frame, signal):
    return CatalogueFit(frame, signal, MODEL.candidates(), MODEL.grade)


def node_columns(frame):
    """Columns of each node beside the constants, by candidate."""
    screening = Screening(frame, [])
    return {
        id: [
            frame.without_constants(columns)
            for _, columns in candidate_columns(KINDS[id], frame, MODEL.grade, screening)
        ]
        for id in MODEL.ids
    }


def least_squares(columns, signal):
    residual = signal - columns @ np.linalg.lstsq(columns, signal, rcond=None)[0]
    return 0.5 * float(residual @ residual)


def test_singles_and_the_pair_leave_what_least_squares_leave(frame) -> None:
    rng = np.random.default_rng(5)
    signal = seen(frame, lambda o: 3.0 * np.sin(o.time / 900.0) + 0.2 * rng.standard_normal(len(o)))
    fit, columns = fitted(frame, signal), node_columns(frame)

    assert fit.energy == pytest.approx(0.5 * float(signal @ signal))
    assert fit.singles() == pytest.approx(
        {id: min(least_squares(own, signal) for own in held) for id, held in columns.items()}, rel=1e-6
    )
    by_pair = {
        ids: min(
            least_squares(np.column_stack([a, b]), signal) for a in columns[ids[0]] for b in columns[ids[1]]
        )
        for ids in combinations(MODEL.ids, 2)
    }
    pair = fit.pair()
    # Found in turns, which may stop a little short of the best of all nodes.
    assert pair is not None and min(by_pair.values()) - 1e-6 <= pair.left <= 1.02 * min(by_pair.values())
    assert pair.left < min(fit.singles().values())


def test_what_two_candidates_make_leaves_nothing_of_their_pair_alone(frame) -> None:
    def made(o):
        return 2.0 * o.response("cube", {}, {}) - 1.5 * o.response("mixture", {"share": 0.4}, {})

    fit = fitted(frame, seen(frame, made))
    pair = fit.pair()
    assert pair is not None and set(pair.ids) == {"cube", "mixture"}
    assert pair.left < 1e-6 * fit.energy < 1e-2 * min(fit.singles().values())


def test_an_amplitude_out_of_its_range_costs_what_it_does_in_a_diagnosis(frame) -> None:
    """A decade above the card's range at 0.6 decades a standard deviation."""
    signal = seen(frame, lambda o: 100.0 * o.response("cube", {}, {}))
    assert fitted(frame, signal).singles()["cube"] == pytest.approx(0.5 / 0.6**2, rel=1e-2)
    assert fitted(frame, 0.1 * signal).singles()["cube"] == pytest.approx(0.0, abs=1e-6)


def row(kind: str, single: tuple[float, bool], pair: tuple[float, bool] | None = None, **more: Any) -> Any:
    held = {"kind": kind, "effect": "a", "whole": 100.0, "single": dict(zip(("left", "counts"), single))}
    return held | {"pair": None if pair is None else dict(zip(("left", "counts"), pair))} | more


ROWS = [
    row("one", (1.0, True)),
    row("one", (4.0, True)),
    row("one", (6.0, False), effect="b"),
    row("one", (30.0, True), (10.0, False), effect="c"),
    row("unknown_invented", (5.0, True)),
    row("unknown_left_out", (50.0, True), (3.0, True)),
    row("unknown_left_out", (2.0, False)),
    row("unknown_invented", (8.0, True), (1.0, True), whole=400.0),
]


def test_a_trade_is_what_counting_gives() -> None:
    never = trade(ROWS, math.inf, 0.0)
    assert never.limits.tolist() == [1.0, 2.0, 4.0, 5.0, 6.0, 8.0, 30.0, 50.0]
    assert never.first.tolist() == [0.25, 0.25, 0.5, 0.5, 0.5, 0.5, 0.75, 0.75]
    assert never.wrong.tolist() == [0.0, 0.0, 0.0, 0.25, 0.25, 0.5, 0.5, 0.75]
    assert (never.first_at(0.05), never.first_at(0.5)) == (0.5, 0.75)
    assert (never.wrong_at(0.5), never.wrong_at(0.75), never.wrong_at(0.98)) == (0.0, 0.5, 1.0)

    # With seconds from 8 nats on the pair takes the place of the third unknown's single, and of an effect's.
    two = trade(ROWS, 8.0, 0.0)
    assert two.limits.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0]
    assert (two.first_at(0.0), two.first_at(0.25), two.first_at(1.0)) == (0.25, 0.5, 0.5)

    # A share lets the strongest one leave four times as much.
    assert trade(ROWS, math.inf, 1.0).limits.tolist() == [0.01, 0.02, 0.04, 0.05, 0.06, 0.3, 0.5]


def test_effects_that_are_missed_are_those_not_named_rightly() -> None:
    assert best_trade(ROWS, math.inf)[1].first_at(0.05) == 0.5
    assert missed(ROWS, math.inf, 0.05) == {"b": 1, "c": 1}
    coarse = row("one", (99.0, False), effect=COUNTED_AS_NAMED)
    assert COUNTED_AS_NAMED not in missed([*ROWS, coarse], math.inf, 0.05)


@pytest.mark.parametrize(
    ("kind", "id", "singles", "pair", "counts"),
    [
        ("one", "a", {"a": 4.0, "b": 2.0}, ("b", "c"), (True, False)),
        ("one", "a", {"a": 6.0, "b": 2.0}, ("b", "a"), (False, True)),
        ("unknown_invented", None, {"a": 6.0}, ("a", "b"), (True, True)),
        ("unknown_left_out", "x", {"a": 6.0, "r": 1.0}, ("r", "a"), (False, True)),
        ("unknown_left_out", "x", {"a": 6.0, "r": 1.0}, ("r", "r2"), (False, False)),
    ],
)
def test_a_name_counts_where_it_is_right_or_wrong(kind, id, singles, pair, counts) -> None:
    fit = SimpleNamespace(singles=lambda: singles, pair=lambda: Pair(pair, 0.5), energy=9.0)
    truth = SimpleNamespace(kind=kind, effects=[SimpleNamespace(id=id)])
    relative = (lambda name: name.startswith("r")) if kind == "unknown_left_out" else None
    found = one_or_unknown.sets(fit, truth, relative)  # type: ignore[arg-type]
    assert (found["single"]["counts"], found["pair"]["counts"]) == counts


def test_the_kept_page_is_of_the_kept_measurements() -> None:
    seed = strictness.kept_seed()
    rows = [found for found in per_case.of_seed("one_or_unknown", seed) if found is not None]
    page = (per_case.HERE / "one_or_unknown.md").read_text(encoding="utf-8")
    assert one_or_unknown.sentence(rows) in page
    ones = sum(found["kind"] == "one" for found in rows)
    values = json.loads((per_case.HERE / "score.json").read_text(encoding="utf-8"))
    counted = {held["key"]: held["n"] for held in values["methods"]["diagnosis"]["rows"]}
    assert (ones, len(rows) - ones) == (counted["one_top"], counted["unknown_wrong_name"])


@pytest.mark.parametrize("kept", [[], ROWS[:4], ROWS[4:]])
def test_cases_of_one_kind_alone_are_told_to_say_nothing(kept) -> None:
    page = one_or_unknown._page(kept, [], {})
    assert "Only cases of both kinds" in page and "The diagnosis beside it" not in page
    assert "wanted" in one_or_unknown._figure(kept, {})
