"""Networks tuned together are those tuned one by one."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from fogml.models.rbf import RBFRegressor
from fogml.models.rbf.objective import Objective, Shape
from fogml.models.rbf.stacked import Stack, values_together
from fogml.models.rbf.together import fit_together

NOISE = 0.02


def rows(seed: int, count: int = 400):
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 1.0, count)
    temperature = 30.0 * np.sin(2 * np.pi * time * (1 + seed % 3))
    rate = 5.0 * np.gradient(temperature)
    inputs = np.column_stack([temperature, rate, temperature * rate])
    return inputs, np.sin(temperature / 8.0) + 0.1 * rate + NOISE * rng.normal(size=count)


def fitted(seed: int, count: int = 400) -> RBFRegressor:
    return RBFRegressor(centres=6, seed=seed).fit(*rows(seed, count))


def test_networks_together_are_those_one_by_one():
    # Two lengths of run: networks of other shapes are worked out in batches of their own.
    lengths = [400, 400, 300]
    together = fit_together([partial(fitted, seed, count) for seed, count in enumerate(lengths)])
    for seed, count in enumerate(lengths):
        alone = fitted(seed, count)
        inputs, _ = rows(seed, count)
        # Products of a batch may be rounded otherwise, and a search that ends where little is left to gain
        # then ends a little apart: far below the noise, with as good an evidence.
        difference = np.abs(alone.predict(inputs) - together[seed].predict(inputs))
        assert difference.max() <= 0.1 * NOISE
        assert together[seed].sizes_tried_ == pytest.approx(alone.sizes_tried_, abs=0.5)


@pytest.mark.parametrize("evidence", [True, False])
@pytest.mark.parametrize("as_on_an_accelerator", [True, False])
def test_values_in_a_batch_are_those_of_each(evidence, as_on_an_accelerator, monkeypatch):
    import fogml.models.rbf.stacked as stacked

    if as_on_an_accelerator:
        for name in ("_misfits", "_add_products", "_dots", "_sums"):
            whole = getattr(stacked, name)
            monkeypatch.setattr(stacked, name, lambda *words, whole=whole: whole(*words[:-1], False))
    rng = np.random.default_rng(0)
    objectives, shapes = [], []
    for _ in range(4):
        inputs = rng.normal(size=(200, 3))
        linear = np.column_stack([inputs, np.ones(200)])
        objectives.append(Objective(inputs, linear, rng.normal(size=200), evidence=evidence))
        shapes.append(Shape(rng.normal(size=(5, 3)), 0.3 * rng.normal(size=(5, 3)), rng.normal()))
    values = values_together(Stack(objectives), shapes)
    for objective, shape, value in zip(objectives, shapes, values, strict=True):
        alone = objective.value(shape)
        assert value.value == pytest.approx(alone.value, rel=1e-12)
        assert value.log_ridge == pytest.approx(alone.log_ridge, rel=1e-9)
        np.testing.assert_allclose(value.centres, alone.centres, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(value.log_widths, alone.log_widths, rtol=1e-9, atol=1e-9)


def test_a_fit_that_fails_does_not_leave_the_others_waiting():
    def failing():
        raise ValueError("no rows")

    with pytest.raises(ValueError, match="no rows"):
        fit_together([partial(fitted, 0), failing, partial(fitted, 1)])
