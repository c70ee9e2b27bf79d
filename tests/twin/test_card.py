"""Cards: what an effect shows over the rate agrees with its words."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.twin.card import SLOW_DEG_H, rate_curves
from fogml.twin.registry import effect, effects


def test_dead_zone_and_saturation_show_where_they_act() -> None:
    fast, slow = rate_curves(effect("deadband"))
    zone = effect("deadband").amplitude.typical()
    # All of the rate within the zone, and w_d**2 / (2 w) far from it.
    within = np.abs(slow.rate) < zone
    assert slow.change[within] == pytest.approx(-slow.rate[within])
    assert np.abs(fast.change[np.abs(fast.rate) > 1.0]).max() < zone**2 / 2.0 / 3600.0
    (saturated,) = rate_curves(effect("rate_range"))
    most = effect("rate_range").default_shape()["range"]
    beyond = np.abs(saturated.rate) > most
    assert not saturated.change[~beyond].any() and saturated.unit == "deg/s"
    wanted = -3600.0 * np.sign(saturated.rate) * (np.abs(saturated.rate) - most)
    assert saturated.change[beyond] == pytest.approx(wanted[beyond])


@pytest.mark.parametrize("id", [id for id, held in effects().items() if held.stage == "scale_factor"])
def test_scale_factor_effects_vanish_at_rest_and_have_a_curve(id: str) -> None:
    curves = rate_curves(effect(id))
    for curve in curves:
        assert abs(np.interp(0.0, curve.rate, curve.change)) < 1e-9
    # What needs a past, such as a dose or a way back, has none at rest.
    assert bool(curves) == (id not in ("radiation", "sf_hysteresis"))


def test_bias_has_no_curve_over_the_rate() -> None:
    assert rate_curves(effect("shupe_pure")) == () and SLOW_DEG_H == 1.0
