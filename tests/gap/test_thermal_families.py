"""Columns of families against loops written by hand, and against the effects themselves."""

from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap.settings import Grids
from fogml.gap.thermal_families import polarization, transition
from fogml.signals.bases import bumps, preisach, relays
from fogml.signals.recursions import play_kernel
from fogml.signals.smoothing import smoothed, window_difference


def _course(n=300, seed=3):
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.standard_normal(n)) + 10.0 * np.sin(np.arange(n) / 30.0)


def test_relays_switch_as_relays_do():
    x, centres, half = _course(), np.linspace(-15.0, 15.0, 7), 4.0
    found = relays(x, centres, half)
    for j, centre in enumerate(centres):
        state = -1 if centre > x[0] else 1
        for i, value in enumerate(x):
            if value >= centre + half:
                state = 1
            elif value <= centre - half:
                state = -1
            inside = centre - half < value < centre + half
            assert found[i, j] == (state if inside else 0)


def test_a_plane_is_the_sum_of_its_relays():
    x, half = _course(), 3.0
    centres = np.linspace(-20.0 - half, 20.0 + half, 48)
    density = bumps(centres, -20.0 - half, 20.0 + half, 5) / 48
    expected = sum(np.outer(relays(x, centres[j : j + 1], half)[:, 0], density[j]) for j in range(48))
    np.testing.assert_allclose(preisach(x, -20.0, 20.0, half), expected, atol=1e-12)


@pytest.mark.parametrize("off", [-1e-14, 0.0, 1e-14])
def test_relays_at_the_ends_of_a_course_stay_outside_of_their_loops_whatever_rounding_makes_of_them(off):
    x, half = _course() + off, 3.1
    held = relays(x, np.linspace(_course().min() - half, _course().max() + half, 48), half)
    assert not held[:, [0, -1]].any()


def test_relays_of_one_half_width_make_the_play_operator():
    x, half = 25.0 * np.sin(np.arange(400) / 40.0), 5.0
    centres = np.linspace(-40.0, 40.0, 2001)
    # Of relays spread evenly over all centres, the loop less both branches' mean is the play's lag.
    loop = relays(x, centres, half).sum(axis=1) * (centres[1] - centres[0]) / 2.0
    lag = play_kernel(x, half, np.nan)[0] - x
    np.testing.assert_allclose(loop, lag, atol=0.05)


def test_readings_lose_their_noise_and_keep_their_course():
    rng = np.random.default_rng(5)
    time = np.arange(1200) * 30.0
    course = 30.0 * np.tanh((time - 18000.0) / 3000.0)
    smooth, left = smoothed(np.round(course + 0.03 * rng.standard_normal(1200), 2))
    assert np.std(smooth - course) < 0.012
    expected = np.sqrt(np.mean(np.sum(left.errors(1200) ** 2, axis=1)))
    assert 0.5 < expected / np.std(smooth - course) < 2.0


def test_window_differences_are_integrals():
    time = np.array([0.0, 10.0, 30.0, 40.0, 90.0, 100.0, 200.0, 300.0])
    np.testing.assert_allclose(window_difference(time, 0.5 * time, 40.0)[5:], 0.5 * 40.0)
    np.testing.assert_allclose(window_difference(time, np.full(8, 7.0), 40.0), 0.0, atol=1e-12)


def test_the_peak_of_a_transition_is_its_steps_rate():
    """d tanh(u) / dt by finite differences, per minute and width."""
    time = 2.0 * np.arange(3000)
    temperature = 25.0 + 20.0 * np.sin(time / 900.0)
    rows = SimpleNamespace(of=lambda values: values, even=SimpleNamespace(time=time))
    place = SimpleNamespace(temperature=temperature, name="coil")
    scene = SimpleNamespace(grids=Grids(), range_degc=(5.0, 45.0), coil=lambda rows: [place])
    for block in transition(rows, scene):
        step, peak = block.columns[:, 0], block.columns[:, 1]
        expected = 60.0 * np.gradient(step, time) * block.shape["width"]
        np.testing.assert_allclose(peak[1:-1], expected[1:-1], atol=2e-3 * np.abs(peak).max())


def test_waves_over_temperature_go_from_the_longest_period_on_a_step_apart():
    """Of the grid's periods the shortest may be left out, where there are more waves than are taken."""
    temperature, grids = np.linspace(5.0, 45.0, 400), Grids()
    rows = SimpleNamespace(of=lambda values: values)
    place = SimpleNamespace(temperature=temperature, name="optics", weight=0.0)
    scene = SimpleNamespace(grids=grids, span_degc=40.0, optics=lambda rows: [place])
    blocks = list(polarization(rows, scene))
    cycles = np.array([1.0 / block.shape["period"] for block in blocks])
    assert 1.0 / cycles[0] == max(grids.periods_degc) and 1.0 / cycles[-1] >= min(grids.periods_degc) - 1e-9
    assert np.diff(cycles) * 40.0 == pytest.approx(np.full(len(cycles) - 1, np.diff(cycles)[0] * 40.0))
    assert np.diff(cycles)[0] * 40.0 <= grids.cycles_apart * len(cycles) / (len(cycles) - 1) * (1.0 + 1e-9)
    for block in blocks:
        turned = 2.0 * np.pi * (temperature - 25.0) / block.shape["period"]
        np.testing.assert_allclose(np.arctan2(*block.columns.T), np.arctan2(np.sin(turned), np.cos(turned)))
