"""Slopes of an effect's own form where an unknown is at the end of what it can be."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap.card_form import Form
from fogml.twin.effects.loop import Deadband

RATES_DEG_H = np.array([-2.0, -0.5, 0.0, 0.0, 0.7, 3.0])


class Zone(Form):
    """A dead zone of a unit's width, from none to five, on stated rates."""

    def __init__(self) -> None:
        self.declared = SimpleNamespace(in_proportion=False)
        self.limits = np.array([[0.0, 5.0]])

    def on(self, run: int, unknowns: np.ndarray) -> np.ndarray:
        return Deadband().apply(RATES_DEG_H, None, float(unknowns[0]))


@pytest.mark.parametrize("width", [0.0, 1e-9, 5e-5, 0.3])
def test_slopes_stay_within_the_limits(width: float) -> None:
    """Below no zone at all there is none: the root of what is left of a rate of zero is no number there."""
    (slopes,) = Zone().slopes_on(0, np.array([width])).T
    beyond = np.abs(RATES_DEG_H) > width
    left = np.sqrt(np.maximum(RATES_DEG_H**2 - width**2, 1e-300))
    closed = np.where(beyond, -np.sign(RATES_DEG_H) * width / left, 0.0)
    np.testing.assert_allclose(slopes, closed, atol=5e-4)
