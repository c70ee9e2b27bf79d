"""Columns of a matrix, long or wide, are its samples along the longer side."""

import numpy as np
import pytest

from fogml.readers.stored import MatrixColumn

LONG = np.arange(12.0).reshape(6, 2)


@pytest.mark.parametrize("matrix", [LONG, LONG.T])
def test_a_part_of_a_column_is_of_the_longer_side(matrix):
    column = MatrixColumn(matrix, 1)
    assert column.shape == (6,) and column.dtype == matrix.dtype
    np.testing.assert_array_equal(column[(slice(1, 4),)], LONG[1:4, 1])
