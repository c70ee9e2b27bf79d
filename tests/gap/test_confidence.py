"""Probabilities of findings: which way they go, and that their constants come back from drawn findings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.gap_blind.calibrate import Row, _fitted
from fogml.gap.confidence import (
    LEAST_NAMED_MARGIN,
    MOSTLY_FORM,
    SURE,
    SURE_BESIDE_UNKNOWN,
    UNKNOWN,
    UNSURE,
    Support,
    likely,
    named_probability,
    unknown_features,
    unknown_probability,
)

supports = st.builds(
    Support,
    margin=st.floats(-5.0, 200.0),
    form_share=st.floats(0.0, 1.0),
    rest=st.one_of(st.just(0.0), st.floats(1e-3, 50.0)),
    length=st.floats(0.0, 200.0),
    outside=st.integers(0, 4),
    joint=st.floats(-5.0, 200.0),
    others=st.floats(0.0, 200.0),
)


@given(supports, st.floats(0.0, 50.0))
def test_more_evidence_is_never_less_probable(support: Support, more: float) -> None:
    for better in (
        replace(support, margin=support.margin + more, joint=support.joint + more),
        replace(support, joint=support.joint + more),
    ):
        assert 0.0 <= named_probability(support) <= named_probability(better) <= 1.0


@given(supports, st.floats(0.0, 5.0))
def test_what_is_left_beside_a_name_never_makes_it_more_probable(support: Support, more: float) -> None:
    for worse in (
        replace(support, rest=support.rest + more if support.beside_unknown else 0.0),
        replace(support, form_share=min(support.form_share + more, 1.0)),
        replace(support, outside=support.outside + 1),
        replace(support, others=support.others + more),
    ):
        assert named_probability(worse) <= named_probability(support)


@given(supports)
def test_a_name_is_given_only_where_it_is_sure(support: Support) -> None:
    found, honest = named_probability(support), likely(support)
    assert found <= honest and (found <= UNSURE or found == honest)
    assert found <= UNSURE or found >= (SURE_BESIDE_UNKNOWN if support.rest > 0.0 else SURE)
    if support.margin < LEAST_NAMED_MARGIN:
        assert found <= UNSURE
    if support.form_share > MOSTLY_FORM:
        assert honest <= UNSURE


@given(st.floats(-40.0, 40.0), st.floats(0.0, 20.0), st.integers(0, 3))
def test_unknown_goes_with_its_evidence_and_is_rarer_beside_names(
    odds: float, more: float, names: int
) -> None:
    found = unknown_probability(odds, names)
    assert found <= unknown_probability(odds + more, names)
    assert unknown_probability(odds, names + 1) < found


def test_constants_come_back_from_findings_drawn_by_them() -> None:
    rng = np.random.default_rng(0)
    count = 40_000
    odds, names = rng.uniform(-8.0, 8.0, count), rng.integers(0, 3, count)
    right = rng.random(count) < [unknown_probability(o, n) for o, n in zip(odds, names)]
    rows: list[Row] = [(unknown_features(o, n), bool(r), 1.0) for o, n, r in zip(odds, names, right)]
    # What weighs nothing tells nothing.
    rows += [(features, not held, 0.0) for features, held, _ in rows]
    assert _fitted(rows) == pytest.approx(UNKNOWN, abs=0.1)
