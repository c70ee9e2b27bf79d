"""Drift in navigation: closed form against integration of the linear and of the full equations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fogml.errors import InputError
from fogml.lab.navigation import (
    AXES,
    EARTH_RADIUS_M,
    EARTH_RATE_RAD_S,
    GRAVITY_M_S2,
    constant_drift,
    drift_series,
    error_matrices,
    gyrocompass_error_deg,
)

HOURS = np.array([1.0, 2.0, 4.0, 8.0, 12.0, 24.0])


def mechanised(drift_rad_s: np.ndarray, latitude: float, times: np.ndarray) -> np.ndarray:
    """A navigator at rest with drifting gyros: attitude, velocity, place, nothing linearised."""
    level = np.array([0.0, 0.0, -GRAVITY_M_S2])
    sensed = EARTH_RATE_RAD_S * np.array([np.cos(latitude), 0.0, -np.sin(latitude)]) + drift_rad_s

    def cross(v: np.ndarray) -> np.ndarray:
        return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])

    def slope(_: float, x: np.ndarray) -> np.ndarray:
        attitude, (north, east), place = x[:9].reshape(3, 3), x[9:11], x[11]
        earth = EARTH_RATE_RAD_S * np.array([np.cos(place), 0.0, -np.sin(place)])
        transport = np.array([east, -north, -east * np.tan(place)]) / EARTH_RADIUS_M
        turning = attitude @ cross(sensed) - cross(earth + transport) @ attitude
        force = attitude @ level - cross(2 * earth + transport) @ np.array([north, east, 0.0])
        moving = [north / EARTH_RADIUS_M, east / (EARTH_RADIUS_M * np.cos(place))]
        return np.concatenate([turning.ravel(), force[:2], moving])

    start = np.concatenate([np.eye(3).ravel(), [0.0, 0.0, latitude, 0.0]])
    solved = solve_ivp(slope, (0.0, times[-1]), start, t_eval=times, rtol=1e-10, atol=1e-13, method="DOP853")
    return np.asarray(solved.y)


@pytest.mark.parametrize("axis", AXES)
def test_constant_drift_is_what_the_full_equations_give(axis: str) -> None:
    latitude, drift = 40.0, 1e-4
    rates = np.zeros(3)
    rates[AXES.index(axis)] = np.radians(drift) / 3600.0
    times = 3600.0 * HOURS[:4]
    y = mechanised(rates, np.radians(latitude), times)
    told = constant_drift(drift, HOURS[:4], latitude, axis)
    np.testing.assert_allclose(told.north_m, (y[11] - np.radians(latitude)) * EARTH_RADIUS_M, atol=2e-3)
    east = y[12] * EARTH_RADIUS_M * np.cos(np.radians(latitude))
    np.testing.assert_allclose(told.east_m, east, atol=2e-3)
    np.testing.assert_allclose(told.heading_deg, np.degrees(np.arctan2(y[3], y[0])), atol=1e-8)
    np.testing.assert_allclose(told.velocity_m_s, np.hypot(y[9], y[10]), atol=1e-6)
    np.testing.assert_allclose(told.tilt_deg, np.degrees(np.hypot(y[2], y[5])), atol=1e-9)
    assert told.position_m.max() > 10.0


@pytest.mark.parametrize("axis", AXES)
def test_closed_form_against_integration(axis: str) -> None:
    f, b = error_matrices(40.0, axis)
    # In units of the Earth's radius and of its first cosmic speed the equations are well scaled.
    scale = np.array([1, 1, 1, *[np.sqrt(GRAVITY_M_S2 * EARTH_RADIUS_M)] * 2, 1, 1, 1])
    f, b = f * scale / scale[:, None], b / scale
    solved = solve_ivp(
        lambda t, x: f @ x + 0.01 * b,
        (0.0, 86400.0),
        np.zeros(8),
        t_eval=3600.0 * HOURS,
        rtol=1e-12,
        atol=1e-18,
        method="DOP853",
    )
    told = constant_drift(0.01, HOURS, 40.0, axis)
    np.testing.assert_allclose(told.heading_deg, -np.degrees(solved.y[2]), atol=1e-9)
    np.testing.assert_allclose(told.north_m, EARTH_RADIUS_M * solved.y[5], atol=1e-4)
    east = EARTH_RADIUS_M * np.cos(np.radians(40.0)) * solved.y[6]
    np.testing.assert_allclose(told.east_m, east, atol=1e-4)


def test_a_series_is_exact_at_its_steps() -> None:
    constant = constant_drift(0.02, [0.5, 5.0, 24.0], -33.0, "north")
    series = drift_series(np.full(864, 0.02), 100.0, -33.0, "north")
    places = [18, 180, 864]
    np.testing.assert_allclose(series.position_m[places], constant.position_m, rtol=1e-9)
    np.testing.assert_allclose(series.heading_deg[places], constant.heading_deg, rtol=1e-9)
    assert series.position_m[0] == 0.0 and len(series.position_m) == 865


def test_a_series_superposes() -> None:
    rng = np.random.default_rng(4)
    a, b = rng.normal(size=(2, 300))
    parts = [drift_series(x, 60.0, 50.0, "east").heading_deg for x in (a, b, a + 2.0 * b)]
    np.testing.assert_allclose(parts[2], parts[0] + 2.0 * parts[1], atol=1e-12)


def test_periods_are_schuler_s_and_a_day() -> None:
    f, _ = error_matrices(45.0, "north")
    rates = np.sort(np.abs(np.linalg.eigvals(f[:7, :7]).imag))[::-1]
    schuler = np.sqrt(GRAVITY_M_S2 / EARTH_RADIUS_M)
    split = EARTH_RATE_RAD_S * np.sin(np.radians(45.0))
    wanted = [schuler + split] * 2 + [schuler - split] * 2 + [EARTH_RATE_RAD_S] * 2
    np.testing.assert_allclose(rates[:6], wanted, rtol=2e-3)
    assert 2 * np.pi / schuler / 60.0 == pytest.approx(84.4, abs=0.1)


def test_up_is_down_reversed_and_gyrocompass() -> None:
    up, down = (constant_drift(0.01, [3.0], 30.0, axis) for axis in ("up", "down"))
    assert up.heading_deg == pytest.approx(-down.heading_deg)
    assert gyrocompass_error_deg(0.01, 60.0) == pytest.approx(np.degrees(0.01 / (15.041067 * 0.5)))


def test_bad_settings_are_refused() -> None:
    for latitude in (89.1, 90.0, float("nan")):
        with pytest.raises(InputError, match="from -89 to 89 is needed"):
            constant_drift(0.01, [1.0], latitude)
    assert np.isfinite(constant_drift(0.01, [1.0], -89.0).heading_deg).all()
    with pytest.raises(InputError, match="axis"):
        constant_drift(0.01, [1.0], 30.0, "x")
    with pytest.raises(InputError, match="not finite"):
        drift_series(np.array([0.1, np.nan]), 10.0, 30.0)
    with pytest.raises(InputError, match="step"):
        drift_series(np.array([0.1]), 0.0, 30.0)
