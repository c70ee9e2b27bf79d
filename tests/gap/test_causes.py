"""Sizes by run: whether they agree, and whether they grow."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from fogml.gap.cards import _step, card_of
from fogml.gap.causes import agree, growth
from fogml.gap.inference import foreseen
from fogml.gap.model import TwinModel
from fogml.gap.result import RunAmplitude
from fogml.gap.settings import STANDARD
from fogml.runs.run import Run
from fogml.runs.steps import to_steps
from fogml.signals.noise_model import NoiseModel
from fogml.twin.twin_file import load_twin


def _sizes(*values, se=0.1):
    return tuple(RunAmplitude(f"r{i}", value, se) for i, value in enumerate(values))


def _scene(days):
    runs = [SimpleNamespace(run=SimpleNamespace(name=f"r{i}")) for i in range(len(days))]
    return SimpleNamespace(runs=runs, begun_s=tuple(86400.0 * d for d in days), order_known=True)


def test_sizes_disagree_from_the_chance_that_is_stated_on():
    apart = np.sqrt(2.0 * chi2.isf(STANDARD.reported.disagree, 1)) * 0.1
    assert agree(_sizes(1.0, 1.0 + 0.99 * apart))
    assert not agree(_sizes(1.0, 1.0 + 1.01 * apart))
    assert agree(_sizes(1.0))


def test_growth_is_the_slope_of_least_squares():
    days, values = [0.0, 10.0, 20.0, 40.0], [1.0, 1.5, 2.1, 2.9]
    expected = np.polyfit(days, values, 1)[0]
    assert growth(_scene(days), _sizes(*values)) == pytest.approx(expected)


def test_a_slope_within_its_error_is_no_growth():
    error = 0.1 / np.sqrt(2.0) / 5.0  # of the slope of two sizes ten days apart
    least = STANDARD.reported.grows * 10.0 * error
    assert growth(_scene([0.0, 10.0]), _sizes(1.0, 1.0 + 0.99 * least)) is None
    assert growth(_scene([0.0, 10.0]), _sizes(1.0, 1.0 + 1.01 * least)) is not None


def test_a_step_of_the_sensors_is_read_off_their_records():
    run = SimpleNamespace(temperature_columns=("T_in", "T_out"), columns={})
    course = 20.0 + 5.0 * np.sin(np.linspace(0.0, 6.0, 500))
    run.columns = {"T_in": to_steps(course, 0.0361), "T_out": to_steps(course, 0.01)}
    step, se = _step([SimpleNamespace(run=run)], 0.001, 0.002)
    assert step == pytest.approx(0.0361, abs=3.0 * se) and se < 0.01 * step
    # A record that shows none leaves what was fitted.
    run.columns = {"T_in": course, "T_out": course}
    assert _step([SimpleNamespace(run=run)], 0.001, 0.002) == (0.001, 0.002)


def test_a_form_that_the_runs_cannot_show_has_no_share_in_a_size():
    """With the table at rest the sine of its angle is rounding: the cosine alone tells the size."""
    time = 10.0 * np.arange(600)
    temperature = 25.0 + 20.0 * np.sin(2.0 * np.pi * time / time[-1])
    gyro = 0.1 * np.random.default_rng(1).standard_normal(600)
    run = Run.from_columns(
        "a", time=time, gyro=gyro, T_in=temperature, T_out=temperature + 0.4 * (time > 3e3)
    )
    field = foreseen(TwinModel(load_twin("nominal")), [run], NoiseModel(0.005, 0.0, 0.0), STANDARD).field
    card = card_of("azimuthal_gradient", field, field.base, {})
    column = field.made(field.setting.scene.candidates["azimuthal_gradient"], 1.0, {"phase": 0.0})
    size = float(field.base.fits(column[:, None])[0] / field.base.gram(column[:, None])[0, 0])
    assert card.value.amplitude == pytest.approx(abs(size), rel=1e-3)
    # How much more is across is not known: half of all directions are within 41 % more, two in three twice.
    assert card.shape_se["phase"] == 180.0
    assert card.amplitude_se == pytest.approx(
        np.hypot(size, field.base.gram(column[:, None])[0, 0] ** -0.5), rel=0.05
    )
