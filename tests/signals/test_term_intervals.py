from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import idct
from scipy.optimize import brentq, nnls
from scipy.stats import norm

from fogml.signals.noise_terms import noise_terms_of
from fogml.signals.term_intervals import allowed_root


@pytest.mark.parametrize("correlation", [0.3, 0.8])
def test_an_end_lies_farther_where_another_term_is_none(correlation: float) -> None:
    information = np.array([[4.0, 2.0 * correlation], [2.0 * correlation, 1.0]])

    # In the plane of unit scatter the other term is found to be none beyond a line, and the loss of what lies
    # between that line and the normal of the term's own is the distance from the truth.
    def beyond(root: float) -> float:
        sector = (np.pi / 2 - np.arccos(correlation)) / (2 * np.pi)
        return float(norm.sf(root) + sector * np.exp(-0.5 * root**2) - 0.05)

    expected = brentq(beyond, 1.0, 4.0)
    assert allowed_root(information, np.array([50.0, 0.0]), 0, 1.0, 0.9) == pytest.approx(expected, abs=0.03)
    assert allowed_root(information, np.array([50.0, 50.0]), 0, 1.0, 0.9) == pytest.approx(norm.ppf(0.95))


def test_white_noise_alone_reaches_as_far_as_what_other_terms_may_have_taken() -> None:
    n = 1 << 14
    # A spectrum of white noise without scatter: the other terms are found to be none.
    flat = idct(np.concatenate(([0.0], np.random.default_rng(5).choice([-1.0, 1.0], n - 1))), norm="ortho")
    found = noise_terms_of(flat, 1.0).terms["N"]
    # Rows of a spectrum scatter evenly about it: least squares with shapes that are not negative.
    f = (np.arange(n // 64) + 0.5) / (n // 32)
    shapes = np.column_stack((np.ones(len(f)), np.sin(np.pi * f) ** 2, 1.0 / f, 1.0 / f**2)) * np.sqrt(32.0)
    rng = np.random.default_rng(6)
    off = []
    for _ in range(1500):
        seen = np.sqrt(32.0) + rng.normal(size=len(f))
        whole, alone = nnls(shapes, seen), nnls(shapes[:, 1:], seen - np.sqrt(32.0))
        off.append(np.sign(1.0 - whole[0][0]) * np.sqrt(max(alone[1] ** 2 - whole[1] ** 2, 0.0)))
    ratio = 1.0 / (60.0 * found.upper) ** 2
    reached = np.sqrt(n * (ratio - 1.0 - np.log(ratio)))
    assert reached == pytest.approx(np.quantile(off, 0.95), abs=0.1)
    assert reached > norm.ppf(0.95) + 0.15
