"""The order in which training runs are given decides nothing of a model, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.models.names import make_model
from fogml.runs.run import Run


def cycle(seed: int) -> Run:
    rng, rows = np.random.default_rng(seed), 500 + 20 * seed
    time = 10.0 * np.arange(rows)
    inside, outside = (25.0 + 18.0 * np.sin(time / 900.0 + seed + ahead) for ahead in (0.0, 0.2))
    rate = np.select([time // 300.0 % 10 == 3, time // 300.0 % 10 == 4], [10.0, -10.0], 0.0)
    drift = 0.5 + 0.02 * inside + 1e-3 * inside**2 + 0.1 * rng.standard_normal(rows)
    columns = {"time": time, "gyro": 3600.0 * rate * (1.0 + 2e-6 * inside) + drift, "rate": rate}
    return Run.from_columns(f"cycle {seed}", **columns, T_in=inside, T_out=outside)


@pytest.mark.parametrize("name", ["mean", "M2", "rbf-patent", "mixed-effects", "joint"])
def test_order_of_training_runs(name: str) -> None:
    *runs, held = (cycle(seed) for seed in range(4))
    first, *others = (make_model(name).fit(order) for order in (runs, runs[::-1], [*runs[1:], runs[0]]))
    told = first.evaluate(held)
    for other in others:
        assert np.array_equal(other.evaluate(held).drift, told.drift)
        assert other.card_ == first.card_
        assert (
            other.intervals_.half_width(0.9, told.excess).tolist()
            == first.intervals_.half_width(0.9, told.excess).tolist()
        )
