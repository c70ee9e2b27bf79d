"""Intervals, curves and calibration against closed forms and other libraries."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtr
from scipy.stats import binomtest
from scipy.stats import t as student
from sklearn.metrics import roc_auc_score, roc_curve

from fogml.blind.scoring.statistics import (
    calibration_error,
    mean,
    median,
    open_set,
    overlap,
    reliability,
    wilson,
)


@given(st.integers(1, 2000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_is_scipys(counts: tuple[int, int]) -> None:
    hits, n = counts
    found = wilson(hits, n)
    other = binomtest(hits, n).proportion_ci(0.95, method="wilson")
    assert (found.low, found.high) == pytest.approx((other.low, other.high), abs=1e-12)
    assert found.low <= found.value <= found.high


def test_wilson_closed_form_without_a_hit() -> None:
    z = 1.959963984540054
    assert wilson(0, 100).high == pytest.approx(z**2 / (100 + z**2), rel=1e-12)
    assert wilson(0, 0).value is None


@given(st.lists(st.tuples(st.integers(0, 6), st.booleans()), min_size=4, max_size=60))
def test_auroc_is_sklearns_with_ties(pairs: list[tuple[int, bool]]) -> None:
    scores, positive = np.array([s / 6 for s, _ in pairs]), np.array([p for _, p in pairs])
    found = open_set(scores, positive)
    if positive.all() or not positive.any():
        assert found.auroc.value is None
        return
    assert found.auroc.value == pytest.approx(roc_auc_score(positive, scores), abs=1e-12)
    false_positive, true_positive, _ = roc_curve(positive, scores, drop_intermediate=False)
    assert found.fpr95.value == pytest.approx(false_positive[true_positive >= 0.95 - 1e-12][0], abs=1e-12)
    assert np.trapezoid(found.true_positive, found.false_positive) == pytest.approx(found.auroc.value)


def test_delong_interval_covers() -> None:
    rng = np.random.default_rng(3)
    truth, covered = 0.7602499389065233, 0  # Phi(1 / sqrt 2)
    for _ in range(400):
        positive = np.arange(120) < 60
        found = open_set(rng.standard_normal(120) + positive, positive).auroc
        covered += found.low <= truth <= found.high
    assert 0.92 < covered / 400 < 0.98


@pytest.mark.parametrize("n", [2, 4, 12])
def test_mean_interval_of_few_covers(n: int) -> None:
    """By the normal law it held 70, 85 and 93 of 100."""
    rng = np.random.default_rng(5)
    found = [mean(rng.standard_normal(n)) for _ in range(1000)]
    assert np.mean([one.low <= 0.0 <= one.high for one in found]) == pytest.approx(0.95, abs=0.02)


@pytest.mark.parametrize("n", [1, 3, 5, 6, 9])
def test_median_of_few_has_an_interval_only_where_it_covers(n: int) -> None:
    rng = np.random.default_rng(6)
    found = [median(rng.exponential(size=n)) for _ in range(1000)]
    if n < 6:
        assert all(one.low is None and one.high is None for one in found)
    else:
        assert np.mean([one.low <= np.log(2.0) <= one.high for one in found]) > 0.94


@pytest.mark.parametrize("apart", [1.5, 2.5])
def test_auroc_of_few_covers_where_all_are_told_apart(apart: float) -> None:
    """DeLong's interval was 1 to 1 then, and missed the truth in each such case."""
    rng = np.random.default_rng(7)
    truth, positive, covered = ndtr(apart / np.sqrt(2.0)), np.arange(10) < 5, []
    for _ in range(2000):
        found = open_set(rng.standard_normal(10) + apart * positive, positive).auroc
        if found.value == 1.0:
            covered.append(found.low <= truth <= found.high)
    assert len(covered) > 100 and np.mean(covered) > 0.94


def test_calibration_error_by_hand() -> None:
    # Bin 0.9..1: 3 of 4 true at 0.95 stated; bin 0.5..0.6: 1 of 2 at 0.55.
    bins = reliability([0.95] * 4 + [0.55] * 2, [True, True, True, False, True, False])
    assert [(b.low, b.high, b.found.n) for b in bins] == [(0.5, 0.6, 2), (0.9, 1.0, 4)]
    assert calibration_error(bins).value == pytest.approx((4 * 0.20 + 2 * 0.05) / 6)


def test_certain_is_in_the_last_bin() -> None:
    assert reliability([1.0], [True])[0].high == 1.0


def test_median_interval_covers() -> None:
    rng = np.random.default_rng(4)
    found = [median(rng.exponential(size=41)) for _ in range(1000)]
    covered = np.mean([one.low <= np.log(2.0) <= one.high for one in found])
    assert 0.94 < covered < 0.985


def test_mean_interval_is_the_textbooks() -> None:
    found = mean([1.0, 2.0, 3.0, 4.0])
    half = student.ppf(0.975, 3) * np.sqrt(5.0 / 3.0) / 2.0
    assert (found.value, found.low, found.high) == pytest.approx((2.5, 2.5 - half, 2.5 + half))


@given(
    st.lists(st.tuples(st.integers(0, 40), st.integers(1, 20)), max_size=5),
    st.lists(st.tuples(st.integers(0, 40), st.integers(1, 20)), max_size=5),
)
def test_overlap_counts_seconds(found: list[tuple[int, int]], true: list[tuple[int, int]]) -> None:
    sets = [{s for start, length in parts for s in range(start, start + length)} for parts in (found, true)]
    intervals = [[(float(a), float(a + b)) for a, b in parts] for parts in (found, true)]
    assert overlap(*intervals) == (len(sets[0] & sets[1]), len(sets[0] | sets[1]))
