"""What is kept of a run: against known truths, whatever the blocks."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.models.names import make_model
from fogml.models.saved import load_model
from fogml.monitor.record import FIGURES, record_run
from fogml.runs.reading import read_run
from fogml.signals import large
from tests.monitor.service import write_model, write_run


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return load_model(write_model(tmp_path_factory.mktemp("model")))


def test_figures_are_those_of_what_is_left(model, tmp_path):
    run = read_run(write_run(tmp_path, 3, bias=5.2, slope=0.052, noise=1e-4))
    record = record_run(model, run)
    left = run.gyro_deg_h - model.predict(run)
    assert record.level == pytest.approx(left.mean(), abs=2e-3)
    usual = record_run(model, read_run(write_run(tmp_path, 4, noise=1e-4)))
    assert record.temperature_slope - usual.temperature_slope == pytest.approx(0.002, rel=0.02)
    assert record.scatter == pytest.approx(usual.scatter, abs=0.3)
    assert record.started == "2026-03-03T08:00:00+00:00"
    assert np.isnan(record.scale_factor)
    assert np.isnan(record.beyond_interval)


@pytest.mark.parametrize("piece", [97, 251])
def test_pieces_of_a_long_run_and_names_make_no_difference(model, tmp_path, monkeypatch, piece):
    """Also where the table begins to turn with a piece's first row: that change was not cut."""
    path = write_run(tmp_path, 5, rate=10.0)
    whole = record_run(model, read_run(path))
    assert np.flatnonzero(read_run(path).rate)[0] == 251
    with monkeypatch.context() as short:
        short.setattr(large, "HELD_VALUES", 64)
        short.setattr(large, "PIECE", piece)
        parts = record_run(model, read_run(path))
    assert whole.key == parts.key
    for name in (*FIGURES, *(f"{name}_se" for name in FIGURES), "samples"):
        assert getattr(parts, name) == pytest.approx(getattr(whole, name), rel=1e-6), name
    assert whole.scale_factor == pytest.approx(50.0, abs=3.0)
    other = path.rename(tmp_path / "other.csv")
    path.with_suffix(".yaml").rename(tmp_path / "other.yaml")
    assert record_run(model, read_run(other)).key == whole.key
    assert record_run(model, read_run(write_run(tmp_path, 6))).key != whole.key


def test_a_run_whose_temperature_stays_tells_no_slopes(model, tmp_path):
    run = read_run(write_run(tmp_path, 7))
    still = run.with_columns(T=np.full(len(run), 20.0) + 1e-3 * np.sin(run.time))
    record = record_run(model, still)
    assert np.isnan(record.temperature_slope)
    assert np.isnan(record.rate_slope)
    # The level rests on what the model states of the slope.
    assert record.level_se > record_run(model, run).level_se


@pytest.mark.parametrize("half_period_s", [350.0, 1000.0])
def test_a_table_that_seldom_rests_tells_bias_and_scale_factor_apart(model, tmp_path, half_period_s):
    """Else the bias holds turns that do not cancel, and the scale factor the bias, both told as certain."""
    run = read_run(write_run(tmp_path, 14))
    table = np.where((run.time // half_period_s) % 2 > 0.5, 10.0, -10.0)
    turned = run.with_columns(rate=table, gyro=run.gyro + 1.0 + 3600.0 * table * (1.0 + 50e-6))
    told, rested = record_run(model, turned), record_run(model, run)
    assert told.level - rested.level == pytest.approx(1.0, abs=3.0 * told.level_se)
    assert told.scale_factor == pytest.approx(50.0, abs=3.0 * told.scale_factor_se)
    assert told.level_se < 0.1 and told.scale_factor_se < 3.0
    # One way throughout, a bias of 1 deg/h looks as 28 ppm do.
    one_way = run.with_columns(rate=np.full(len(run), 10.0), gyro=run.gyro + 36000.0)
    neither = record_run(model, one_way)
    assert np.isnan(neither.level) and np.isnan(neither.scale_factor)
    assert neither.scatter == pytest.approx(rested.scatter, abs=0.01)


def test_a_slope_that_changed_is_no_scale_factor(model, tmp_path):
    """Where the table turns it is 20 degC off the middle: 0.02 deg/h/degC looked as 11 ppm."""
    run = read_run(write_run(tmp_path, 15, slope=0.07, noise=1e-3, rate=10.0))
    assert record_run(model, run).scale_factor == pytest.approx(50.0, abs=1.0)


def test_standard_errors_are_those_of_repeated_runs(model, tmp_path):
    run = read_run(write_run(tmp_path, 10, noise=0.0))
    records = []
    for seed in range(10):
        noise = 0.05 * np.random.default_rng((11, seed)).normal(size=len(run))
        records.append(record_run(model, run.with_columns(gyro=run.gyro + noise)))
    for name in ("level", "temperature_slope", "rate_slope", "scatter"):
        values = np.array([getattr(record, name) for record in records])
        stated = np.array([getattr(record, f"{name}_se") for record in records])
        # The deviation of 10 values is told to a quarter; stated errors hold that the noise may be slow.
        assert 0.2 < np.std(values) / np.sqrt(np.mean(stated**2)) < 1.4, name


def test_what_lies_outside_training_tells_nothing(model, tmp_path):
    run = read_run(write_run(tmp_path, 12))
    hot = run.with_columns(T=run.temperature() + np.where(run.time > 2000.0, 60.0, 0.0))
    plain, told = record_run(model, run), record_run(model, hot)
    assert told.outside_training > 0.1
    assert abs(told.level - plain.level) < 5.0 * told.level_se
    # A run of nothing else tells its level, about as badly as the model's interval out there says.
    far = record_run(model, run.with_columns(T=run.temperature() + 60.0))
    assert far.level_se > 5.0 * plain.level_se
    assert far.level_se == pytest.approx(far.half_width / 1.645, rel=0.5)
    assert np.isnan(far.scatter) and np.isnan(far.temperature_slope)


def test_what_the_unit_compensated_itself_is_taken_as_it_is(model, tmp_path):
    run = read_run(write_run(tmp_path, 8))
    plain = record_run(model, run)
    done = run.with_columns(gyro=run.gyro - model.predict(run))
    done = done.with_facts(run.facts.model_copy(update={"compensated": True}))
    assert record_run(model, done).level == pytest.approx(plain.level, abs=1e-9)


def test_earth_rate_counts_where_the_model_knows_it(model, tmp_path):
    """A side file that states the attitude moves no bias: before, the run's was off by Earth rate."""
    run = read_run(write_run(tmp_path, 11))
    up = run.with_facts(run.facts.model_copy(update={"latitude": 39.9, "input_axis": "up"}))
    assert record_run(model, up).level == record_run(model, run).level
    knows = make_model("polynomial", None, 0, {})
    knows.fit([up])
    earth = 15.041067 * np.sin(np.radians(39.9))
    assert record_run(knows, up).level == pytest.approx(0.0, abs=1e-3)
    moved = up.with_columns(gyro=run.gyro + earth)
    assert record_run(knows, moved).level == pytest.approx(earth, abs=1e-3)
    with pytest.raises(InputError, match="latitude and input_axis"):
        record_run(knows, run)


def test_a_run_that_is_too_short_is_refused(model, tmp_path):
    run = read_run(write_run(tmp_path, 9))
    with pytest.raises(InputError, match="16 are needed"):
        record_run(model, run[:150])
    with pytest.raises(InputError, match="a sample every 4 s makes no averages over 1 s"):
        record_run(model, run, averaging_s=1.0)
    assert record_run(model, run, averaging_s=4.0).averaging_s == 4.0
    with pytest.raises(InputError, match="no samples"):
        record_run(model, run[:0])


def test_what_a_model_s_memory_hides_of_a_run_is_told_as_that(tmp_path):
    """No averaging time mends it: the room's temperature never moves a wide play from end to end."""
    run = read_run(write_run(tmp_path, 9))
    warmth = run.temperature("T")
    half = 0.4 * np.ptp(warmth)
    remembers = make_model("polynomial", f"T, play(T, {half:g} degC)", 0, {}).fit([run])
    mild = run.with_columns(T=warmth.mean() + 0.5 * (warmth - warmth.mean()))
    with pytest.raises(InputError, match=r"most samples come before .*twice its half width"):
        record_run(remembers, mild)


def test_an_output_that_is_not_the_gyro_s_is_not_kept(model, tmp_path):
    run = read_run(write_run(tmp_path, 13))
    gyro, half = run.gyro, len(run) // 2
    stuck, turned, brief = gyro.copy(), gyro.copy(), gyro.copy()
    stuck[half:] = stuck[half]
    turned[100:200] += 36000.0
    brief[half : half + 6] = brief.max()  # no more than a hundredth
    for output, why in (
        (stuck, "may be stuck|in every sample"),
        (turned, "did the table turn"),
        (np.clip(gyro, *np.quantile(gyro, [0.1, 0.9])), "may saturate"),
    ):
        with pytest.raises(InputError, match=f"({why}).*it is not kept"):
            record_run(model, run.with_columns(gyro=output))
    assert record_run(model, run.with_columns(gyro=brief)).samples == len(run)
    with pytest.raises(InputError, match=r"kelvin.*it is not kept"):
        record_run(model, run.with_columns(T=run.columns["T"] + 273.15))
