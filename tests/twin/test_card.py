"""Cards: what an effect shows over the rate agrees with its words."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.twin.pictures import SLOW_DEG_H, allan_curve, pictures, prose, rate_curves
from fogml.twin.registry import effect, effects
from fogml.twin.scenes import scene_names


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


def test_every_effect_names_a_scene() -> None:
    assert {declared.shown_on for declared in effects().values()} <= set(scene_names())


def test_allan_deviations_have_the_slopes_and_sizes_that_the_words_state() -> None:
    """sqrt(3) Q / tau, N / sqrt(tau), 0.664 B, K sqrt(tau / 3), R tau / sqrt(2); humps of line and decay."""
    second = 1.0 / 3600.0
    sizes = {
        "quantisation": (-1.0, np.sqrt(3.0) * 1e-6 * np.degrees(1.0) / second),
        "angle_random_walk": (-0.5, 1.0 / np.sqrt(second)),
        "bias_instability": (0.0, np.sqrt(2.0 * np.log(2.0) / np.pi)),
        "rate_random_walk": (0.5, np.sqrt(second / 3.0)),
        "rate_ramp": (1.0, second / np.sqrt(2.0)),
    }
    for id, (slope, at_1_s) in sizes.items():
        found = allan_curve(effect(id))
        short = found.taus_s <= 100.0
        wanted = effect(id).amplitude.typical() * at_1_s * found.taus_s[short] ** slope
        # Samples of a walk or of flicker are means, or stand for them, at one sample not yet at the law.
        assert found.adev[short][found.taus_s[short] >= 4.0] == pytest.approx(
            wanted[found.taus_s[short] >= 4.0], rel=0.12
        ), id
    line, decay = allan_curve(effect("sinusoidal")), allan_curve(effect("gauss_markov"))
    period = 1.0 / effect("sinusoidal").default_shape()["frequency"]
    assert line.taus_s[line.adev.argmax()] == pytest.approx(0.371 * period, abs=0.5)
    assert line.adev[line.taus_s == period] < 1e-9 * line.adev.max() and line.has_dips
    correlation = effect("gauss_markov").default_shape()["time_constant"]
    q_c = effect("gauss_markov").amplitude.typical() / np.sqrt(correlation / 2.0)
    assert decay.adev.max() == pytest.approx(0.437 * q_c * np.sqrt(correlation), rel=0.15)
    assert decay.taus_s[decay.adev.argmax()] == pytest.approx(1.89 * correlation, rel=0.4)
    assert allan_curve(effect("shupe_pure")) is None and allan_curve(effect("vibration_noise")) is None


def test_pictures_agree_with_the_words() -> None:
    def shown(id: str) -> tuple[np.ndarray, np.ndarray]:
        (found,) = pictures(effect(id))
        return found.hours, found.values

    for id in ("table_wobble", "magnetic", "input_axis_misalignment"):
        # Once a turn, and back: a cosine over the angle about its mean, but for the sample of the reversal.
        hours, values = (part[np.arange(1800) != 900] for part in shown(id))
        if id == "input_axis_misalignment":
            loss = np.cos(1e-3 * effect(id).amplitude.typical()) - 1.0
            values = values - loss * np.where(hours < 1.0, 360.0, -360.0)
        angle = np.minimum(hours, 2.0 - hours) * 2.0 * np.pi
        size = 0.5 * np.ptp(values)
        assert values == pytest.approx(values.mean() + size * np.cos(angle), abs=0.03 * size), id
    hours, values = shown("g_sensitivity")
    assert values == pytest.approx(values[0] * np.cos(2.0 * np.pi * hours), abs=0.01 * abs(values[0]))
    hours, values = shown("slew_limit")
    fading = (hours > 0.012 / 3600.0) & (hours < 0.0195 / 3600.0)
    slew = effect("slew_limit").default_shape()["slew"]
    assert np.diff(values[fading]) / np.diff(hours[fading] * 3600.0) == pytest.approx(3600.0 * slew)
    hours, values = shown("radiation")
    assert not values[hours < 2.0].any() and hours[values.argmax()] == pytest.approx(4.0, abs=0.03)
    assert 0.0 < values[-1] < 0.9 * values.max()
    (heated,) = pictures(effect("self_heating"))
    last = {place: change[heated.hours < 0.95][-1] for place, change in heated.places.items()}
    assert heated.unit == "degC" and last["T_electronics"] == pytest.approx(
        effect("self_heating").amplitude.typical(), rel=0.1
    )
    assert last["T_electronics"] > last["T_in"] > last["T_out"] > last["T_case"] > 0.0


def test_a_class_without_a_docstring_has_its_title_on_its_card():
    # With Python's -OO no class has one; that of a base class is no card of this effect.
    class Plain(type(effect("sensor_lag"))):
        title = "A lag of its own"

    assert prose(Plain.__new__(Plain)).summary == "A lag of its own"
