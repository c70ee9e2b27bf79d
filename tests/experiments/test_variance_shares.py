"""What explains an outcome: made outcomes whose shares are known, and the total by hand."""

from __future__ import annotations

import numpy as np

from experiments.compensation_peers.variance import NAMES, intervals, shares

PLACES = [(f"set {s}", f"set {s}, {p}") for s in range(4) for p in range(3) for _ in range(2)]


def test_effects_that_were_put_in_come_out():
    rng = np.random.default_rng(0)
    of_set, model = rng.normal(size=4), rng.normal(size=5)
    set_of_case = np.repeat(np.arange(4), 6)
    y = of_set[set_of_case][:, None] + model[None]
    found = dict(zip(NAMES, shares(y, PLACES)))
    squares = {"data set": np.var(of_set), "model": np.var(model)}
    for name, share in found.items():
        np.testing.assert_allclose(share, squares.get(name, 0.0) / sum(squares.values()), atol=1e-12)
    both = rng.normal(size=(4, 5))
    found = dict(zip(NAMES, shares(both[set_of_case], PLACES)))
    assert found["model × data set"] > 0.1
    assert found["protocol within it"] < 1e-12
    assert found["model × protocol"] < 1e-12


def test_shares_are_those_of_a_regression_on_dummies():
    y = np.random.default_rng(1).normal(size=(len(PLACES), 5))
    found = shares(y, PLACES)
    labels = [[place[0] for place in PLACES], [place[1] for place in PLACES], range(len(PLACES))]
    total = np.sum((y - y.mean()) ** 2)
    left = total
    for share, names in zip(found[:3], labels):
        dummies = np.array([[float(name == other) for other in dict.fromkeys(names)] for name in names])
        design = np.repeat(dummies, 5, axis=0)
        rest = y.ravel() - design @ np.linalg.lstsq(design, y.ravel(), rcond=None)[0]
        np.testing.assert_allclose(share, (left - rest @ rest) / total, atol=1e-12)
        left = rest @ rest
    np.testing.assert_allclose(found.sum(), 1.0)


def test_intervals_hold_the_share_of_like_sets_and_end_where_it_ends():
    rng = np.random.default_rng(2)
    y = rng.normal(size=(len(PLACES), 5)) + rng.normal(size=5)
    low, high = intervals(y, PLACES, draws=200)
    assert np.all((low >= 0.0) & (low <= high) & (high <= 1.0))
    assert low[3] < shares(y, PLACES)[3] < high[3]
