"""Means over blocks against NumPy's, block by block."""

import numpy as np
import pytest

from fogml.gap.block_means import BlockMeans


@pytest.mark.parametrize(
    "edges",
    [
        [(3, 8), (8, 13), (13, 18)],
        [(0, 4), (4, 8), (8, 10), (15, 19), (19, 22)],
        [(i * i, i * i + i + 1) for i in range(1, 80)],
    ],
    ids=["alike", "with gaps", "all unlike"],
)
@pytest.mark.parametrize("even", [True, False])
def test_means_are_those_of_each_block(edges, even):
    starts, stops = np.array(edges).T
    rng = np.random.default_rng(0)
    values, counts = rng.normal(size=6500), np.ones(6500, np.intp) if even else rng.integers(1, 5, 6500)
    expected = [np.average(values[a:b], weights=counts[a:b]) for a, b in edges]
    np.testing.assert_allclose(BlockMeans(starts, stops, counts)(values), expected, rtol=1e-12)


def test_what_no_block_holds_plays_no_part():
    values = np.array([np.nan, 1.0, 3.0, 5.0, 7.0, np.inf])
    means = BlockMeans(np.array([1, 3]), np.array([3, 5]), np.ones(6, np.intp))
    np.testing.assert_array_equal(means(values), [2.0, 6.0])
