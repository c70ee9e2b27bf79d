"""The two-step practice and the figures of a run with turns, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.lab.joint import run_figures, scale_factors, two_step
from fogml.models.joint import JointModel
from fogml.models.saved import load_model, save_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run

EARTH_AT_30_DEG = 15.041067 / 2
FACTS = Facts(unit="u", axis="x", latitude=30.0, input_axis="up")
SCALE = np.array([1.0 + 80e-6, 3e-6, 2e-8])


def bias(temperature):
    return 0.5 + 0.01 * temperature


def soaks(temperatures=(-40.0, -10.0, 20.0, 50.0), rate=10.0, turns=True, seed=None):
    """Soaks of 20 min with a turn each way, a linear ramp of 30 min to each next one; 1 Hz."""
    parts, table = [], []
    for k, temperature in enumerate(temperatures):
        if k:
            parts.append(np.linspace(temperatures[k - 1], temperature, 1800))
            table.append(np.zeros(1800))
        parts.append(np.full(1200, temperature))
        spin = np.zeros(1200)
        if turns:
            spin[600:660], spin[660:720] = -rate, rate
        table.append(spin)
    temperature, spin = np.concatenate(parts), np.concatenate(table)
    reference = 3600.0 * spin + EARTH_AT_30_DEG
    gyro = reference * np.polynomial.polynomial.polyval(temperature, SCALE) + bias(temperature)
    if seed is not None:
        gyro = gyro + np.random.default_rng(seed).normal(scale=0.3, size=len(gyro))
    columns = {"T_in": temperature, "T_out": temperature}
    return Run.from_columns("soaks", facts=FACTS, time=np.arange(len(spin)), gyro=gyro, rate=spin, **columns)


def test_scale_factors_are_exact_without_noise():
    found = scale_factors(soaks())
    np.testing.assert_allclose(found.temperature, [-40.0, -10.0, 20.0, 50.0], atol=1e-9)
    np.testing.assert_allclose(
        found.factor, np.polynomial.polynomial.polyval(found.temperature, SCALE), 1e-12
    )


def test_one_sense_keeps_the_bias_in_the_scale_factor():
    found = scale_factors(soaks(), one_sense=True)
    true = np.polynomial.polynomial.polyval(found.temperature, SCALE)
    # Bias over the rate of the first sense, Earth rate included.
    wrong = bias(found.temperature) / (EARTH_AT_30_DEG - 36000.0)
    np.testing.assert_allclose(found.factor - true, wrong, rtol=1e-6)


def test_two_steps_restore_the_rate():
    train, test = soaks(), soaks(temperatures=(40.0, 0.0, -30.0), rate=20.0)
    for base in (None, soaks(turns=False)):
        model = two_step(train, base)
        rate, full = model.rate(test)
        np.testing.assert_allclose(rate[full], test.reference_deg_h[full], atol=2e-4)
        figures = run_figures(test, rate, full)
        assert figures.rms < 1e-4 and figures.scale_factor_error_largest < 1e-3


def test_order_is_lowered_and_temperature_held_where_turns_are_few():
    model = two_step(soaks(temperatures=(0.0, 30.0)))
    assert len(model.scale) == 2 and model.span == pytest.approx((0.0, 30.0))
    at_end = np.polynomial.polynomial.polyval(30.0, model.scale)
    hot = soaks(temperatures=(30.0, 60.0), turns=False)
    rate, _ = model.rate(hot)
    slope = model.bias.describe()["coefficients"]["T"]["value"]
    assert rate[-1] == pytest.approx(hot.gyro[-1] / at_end - model.bias.predict(hot)[-1])
    assert slope == pytest.approx(0.01, rel=0.1)


def test_turns_at_one_temperature_tell_no_slope():
    model = two_step(soaks(temperatures=(20.0, 20.0)), soaks(turns=False))
    np.testing.assert_allclose(model.scale, [np.polynomial.polynomial.polyval(20.0, SCALE)], 1e-9)


def test_figures_tell_bias_and_scale_factor_apart():
    run = soaks()
    full = np.ones(len(run), dtype=bool)
    figures = run_figures(run, run.reference_deg_h + 0.25, full)
    assert figures.rms == pytest.approx(0.25, abs=1e-9)
    assert figures.scale_factor_error == pytest.approx(0.0, abs=1e-9)
    figures = run_figures(run, run.reference_deg_h + 50e-6 * 3600.0 * run.rate, full)
    assert figures.rms == pytest.approx(0.0, abs=1e-9)
    assert figures.scale_factor_error_largest == pytest.approx(50.0, rel=1e-6)


def test_a_run_at_rest_is_refused():
    with pytest.raises(InputError, match="no turns"):
        scale_factors(soaks(turns=False))


def test_window_of_the_joint_rate_is_kept(tmp_path):
    run = soaks(seed=1)
    model = JointModel(rate_window_s=16.0).fit(run)
    assert model.window_s == 32.0 and "dT[block, 16 s]" in model.column_names
    save_model(model, tmp_path / "model")
    again = load_model(tmp_path / "model")
    assert again.rate_window_s == 16.0
    np.testing.assert_array_equal(again.predict(run), model.predict(run))
    with pytest.raises(InputError, match="must be positive"):
        JointModel(rate_window_s=0.0).fit(run)


def test_the_interval_of_a_run_that_turns_as_it_warms_is_of_what_is_left() -> None:
    """Turns of 50 deg/s either way while T moves by 3 degC a minute: averages of both make none of T D."""
    rng, time = np.random.default_rng(2), np.arange(0.0, 24_000.0, 2.0)
    temperature = 30.0 * np.sin(2.0 * np.pi * time / 4_000.0)
    rate = 50.0 * np.array([0.0, 1.0, -1.0])[(time // 60.0).astype(int) % 3]
    scale, white = 1.0 + 8e-6 * temperature, 0.2 * rng.standard_normal(len(time))
    columns = {"time": time, "gyro": 3600.0 * rate * scale + 0.02 * temperature + white, "T": temperature}
    run = Run("warming", {**columns, "rate": rate}, Facts())
    model = JointModel().fit(run)
    left = model.compensate(run).compensated - 3600.0 * rate
    averages = np.abs(left.reshape(-1, 50).mean(axis=1))
    half = model.intervals_.half_width(0.9)
    assert np.mean(averages <= half) > 0.85 and half < 3.0 * np.quantile(averages, 0.9)
