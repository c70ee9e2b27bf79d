"""Sizes by run: whether they agree, and whether they grow."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from fogml.gap.cards import _step, card_of
from fogml.gap.causes import _by_run, agree, growth, since
from fogml.gap.field import Field, Member
from fogml.gap.frame import with_form_errors
from fogml.gap.how_far import Foretold
from fogml.gap.inference import foreseen
from fogml.gap.model import TwinModel
from fogml.gap.result import Estimate, Onset, RunAmplitude
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


def test_what_began_neither_grows_nor_disagrees_by_that():
    sizes, scene = _sizes(0.0, 0.02, 1.0, 1.02), _scene([0.0, 10.0, 20.0, 30.0])
    scene.in_time = range(4)
    for one in scene.runs:
        one.time_s = np.array([30.0, 90.0])
    assert not agree(sizes) and growth(scene, sizes) > 0.0
    size = Estimate(1.0, 0.01, "deg/h")
    acting = since(scene, sizes, Onset("r2", 30.0, 50.0, size))
    assert acting == sizes[2:] and agree(acting) and growth(scene, acting) is None
    # Of a run in which it began a part alone shows it.
    assert since(scene, sizes, Onset("r1", 90.0, 50.0, size)) == sizes[2:]
    assert since(scene, sizes, None) == sizes


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


def test_a_size_from_one_run_is_the_weighed_one_beside_all_else_that_acts():
    """Against dense generalised least squares; a second cause and errors of the form beside it."""
    time = 30.0 * np.arange(800)
    runs = [
        Run.from_columns(
            f"r{i}",
            time=time,
            gyro=np.zeros(800),
            T=25.0 + hot * np.sin(time / 4000.0) + 10.0 * np.sin(time / 1500.0 + i),
        )
        for i, hot in enumerate((20.0, 30.0))
    ]
    search = foreseen(TwinModel(load_twin("nominal")), runs, NoiseModel(0.005, 0.0, 0.0), STANDARD)
    held = search.field
    setting = with_form_errors(held.setting, NoiseModel(0.005, 0.0, 0.0), 500.0)
    held = Field(setting, held.columns, NoiseModel(0.005, 0.0, 0.0))
    first, second = (
        next(i for i, n in enumerate(held.columns.nodes) if held.columns.families[n.family].id == id)
        for id in ("thermal_hysteresis", "polarization_nonreciprocity")
    )
    own, other = (Member(held.columns.nodes[i].family, i, 300.0) for i in (first, second))
    form = np.random.default_rng(1).standard_normal(held.block(first).shape[1])
    course, beside = held.block(first) @ form, held.block(second) @ np.array([2.0, 1.0])
    factor = np.repeat([1.0, 1.4], [len(r) for r in setting.scene.fit])
    noise = np.random.default_rng(2).standard_normal(len(course))
    held.base = replace(held.base, data=100.0 * factor * course + 200.0 * beside + noise)
    found = SimpleNamespace(field=held, scene=setting.scene, setting=setting)
    every = Foretold.of(found, (own, other))
    sizes = _by_run(found, every, SimpleNamespace(members=(own,)), 0.2)
    ends = np.cumsum([held.fixed.shape[1], held.block(first).shape[1]])
    told = 300.0 * held.block(first) @ every.posterior.mean[ends[0] : ends[1]]
    for size, span in zip(sizes, setting.spans, strict=True):
        rest = np.concatenate([held.fixed[span], 300.0 * held.block(second)[span]], axis=1)
        weights = np.linalg.inv(np.eye(len(rest)) + rest @ rest.T)
        square = told[span] @ weights @ told[span]
        scale = told[span] @ weights @ held.base.data[span] / square
        assert size.value == pytest.approx(0.2 * scale, rel=1e-6)
        assert size.se == pytest.approx(0.2 * np.hypot(square**-0.5, STANDARD.form_error * scale), rel=1e-6)
    ratio = sizes[1].value / sizes[0].value
    assert ratio == pytest.approx(1.4, abs=3.0 * np.hypot(sizes[0].se, sizes[1].se) / sizes[0].value)
