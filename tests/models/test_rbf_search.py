"""The search for a network: a race on coarse rows against every start to its end on fine ones."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from fogml.models.rbf import RBFRegressor
from fogml.models.rbf.blocks import Frame, Level, average_in_blocks
from fogml.models.rbf.centres import kmeans_centres
from fogml.models.rbf.search import COARSE_ROWS, Search
from fogml.models.rbf.tuning import Descent, OwnVariables, SharedVariables, TuningSettings

ROWS, NOISE = 8000, 0.05


def rows(seed: int, count: int = ROWS) -> tuple[np.ndarray, np.ndarray]:
    """Temperature, its rate and both at once over three cycles of other speeds, and a drift of all."""
    draw = np.random.default_rng(seed)
    phase = np.cumsum(np.repeat([1.0, 2.0, 4.0], count // 3 + 1)[:count])
    temperature = 30.0 * np.sin(2.0 * np.pi * phase / phase[-1] * 3.0)
    rate = np.gradient(temperature) * 50.0
    drift = np.sin(temperature / 4.0) + 0.1 * rate + 0.003 * temperature * rate
    inputs = np.column_stack([temperature, rate, temperature * rate])
    return inputs, drift + NOISE * draw.normal(size=count)


def level(inputs: np.ndarray, target: np.ndarray, count: int) -> Level:
    averaged = average_in_blocks(inputs, target, count)
    return Level(averaged, Frame.of(inputs, target), np.arange(inputs.shape[1]), "cpu", "float64")


@pytest.mark.parametrize("seed", [0, 1])
def test_the_race_ends_where_the_best_of_all_starts_does(seed: int) -> None:
    inputs, target = rows(seed)
    settings = RBFRegressor(centres=16)._settings()
    fine, coarse = (average_in_blocks(inputs, target, count) for count in (4000, COARSE_ROWS))
    search = Search(fine, coarse, Frame.of(inputs, target), np.arange(3), settings)
    found = search.run()

    whole = level(inputs, target, 4000)
    objective, _ = whole.objective(True, found.share)
    centres = kmeans_centres(whole.inputs, 16, 0)
    ends = [
        Descent(objective, OwnVariables(centres, start, -4.0, search._tuning), learn=True).run()
        for start in search._first_widths()
    ]
    ranked = sorted(objective(end.shape).value for end in ends)
    assert ranked[-1] > ranked[0] + 30.0
    assert objective(found.shape).value < ranked[0] + 3.0


def test_a_descent_that_was_left_goes_on() -> None:
    part = level(*rows(3), 500)
    objective, _ = part.objective(True, 1.0)
    centres, start = kmeans_centres(part.inputs, 8, 0), np.zeros(3)
    settings = TuningSettings(own_steps=40)
    left = Descent(objective, OwnVariables(centres, start, -4.0, settings), learn=True)
    values = [left.run(10).value for _ in range(6)]
    assert all(later <= earlier for earlier, later in pairwise(values))
    # No step more than there are: the last two runs change nothing.
    assert values[-1] == values[-2] == values[-3] < values[-4]
    at_once = Descent(objective, OwnVariables(centres, start, -4.0, settings), learn=True).run()
    assert values[-1] == at_once.value
    np.testing.assert_array_equal(left.shape.log_widths, at_once.shape.log_widths)
    # On the same rows another descent begins where this one stands.
    np.testing.assert_array_equal(left.on(objective).shape.centres, left.shape.centres)


def test_shared_widths_leave_centres_where_they_are() -> None:
    part = level(*rows(4), 500)
    objective, _ = part.objective(True, 1.0)
    centres = kmeans_centres(part.inputs, 8, 0)
    descent = Descent(objective, SharedVariables(centres, np.zeros(3), -4.0, TuningSettings()), learn=False)
    before = objective(descent.shape).value
    descent.run()
    assert descent.value < before
    np.testing.assert_array_equal(descent.shape.centres, centres)
    assert np.ptp(descent.shape.log_widths, axis=0) == pytest.approx(0.0)
    assert descent.shape.log_ridge == -4.0


@pytest.mark.parametrize("count", [600, ROWS])
def test_a_ridge_that_is_stated_is_of_the_rows_that_were_asked_for(count: int) -> None:
    inputs, target = rows(5, count)
    fitted = RBFRegressor(centres=8, ridge=1e-3, average_rows=4000).fit(inputs, target)
    assert fitted.ridge_ == pytest.approx(1e-3 * max(count / 4000.0, 1.0), rel=1e-6)


def test_a_width_of_nothing_does_no_harm() -> None:
    part = level(*rows(6), 300)
    objective, _ = part.objective(True, 1.0)
    centres = kmeans_centres(part.inputs, 4, 0)
    narrow = SharedVariables(centres, np.full(3, -800.0), -4.0, TuningSettings())
    value = objective(narrow.shape(narrow.begin))
    assert np.isfinite(value.value) and np.isfinite(value.log_widths).all()
