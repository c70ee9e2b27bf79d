"""False readings within what training showed of heat can do no more than is stated, in C as in batch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.export.c_program import CProgram
from fogml.export.c_source import c_source
from fogml.export.check import c_difference
from fogml.export.false_readings import false_reading_error, false_reading_lines, false_readings
from fogml.export.fixed_bound import _LARGEST, _STEEPEST, _TWICE, fixed_point_error, fixed_point_lines
from fogml.export.plan import Plan
from fogml.export.self_test import sensor_range
from fogml.models.compensation import compensate_blocks
from fogml.models.names import make_model
from fogml.models.saved import load_model, save_model
from fogml.runs.dropouts import RULE, read_thermometer
from fogml.runs.run import Run
from fogml.runs.thermometers import LIMITS, trained_limits
from tests.export.conftest import training_run
from tests.export.test_c_code import QUICK, disturbed, fast_run, needs_cc, outputs

RATE = 4.0 / 60.0


def ramps(noise=0.0):
    """Two hours of ramps at 4 degC/min between -20 and 60 degC, 0.01 deg/h/degC and 0.3 deg/h/(degC/min)."""
    time = np.arange(7200.0)
    T = -20.0 + np.abs((RATE * time) % 160.0 - 80.0)
    T += noise * np.random.default_rng(1).choice([-1.0, 1.0], len(time))
    return Run("ramps", {"time": time, "gyro": 0.01 * T + 0.3 * 60.0 * np.gradient(T, time), "T": T})


def test_limits_are_those_of_training():
    rule = trained_limits([ramps()], ["T"])
    np.testing.assert_allclose(rule.rate_degC_s, LIMITS.rate_margin * RATE, rtol=1e-6)
    assert rule.jump_degC == LIMITS.least_step_degC
    noisy = trained_limits([ramps(0.5)], ["T"])
    np.testing.assert_allclose(noisy.jump_degC, LIMITS.step_margin * 1.0, rtol=0.05)
    slow = Run("slow", {"time": np.arange(99.0), "gyro": np.zeros(99), "T": np.full(99, 20.0)})
    assert trained_limits([slow], ["T"]).rate_degC_s == LIMITS.least_rate_degC_s
    assert read_thermometer(ramps(0.5).time, ramps(0.5).columns["T"], noisy).bad is None


def test_the_stated_error_against_closed_forms():
    model = make_model("polynomial", features="T, dT").fit(ramps())
    plan = Plan.of(model)
    off = plan.thermometer.off_degC(1.0)
    slope, per_rate = (abs(float(value)) for value in plan.arrays["linear"])
    one = false_reading_error(plan, spell=False)
    np.testing.assert_allclose(one, off * (slope + per_rate * 60.0 / 64.0 / 64.0), rtol=1e-9)
    spell = false_reading_error(plan, spell=True)
    np.testing.assert_allclose(spell, off * (slope + per_rate * 2.0 * 60.0 / 64.0), rtol=1e-9)
    told = false_readings(plan)
    assert told["largest_error"][0]["one_deg_h"] == one and abs(told["rate_degC_s"] - 3.0 * RATE) < 1e-9
    assert false_readings(Plan.of(make_model("mean").fit(ramps()))) is None


def test_false_readings_of_a_gyro_that_turns_move_its_scale_factor_too(model_of):
    """By what the thermometer is off times the steepest slope of the scale factor, beside the bias."""
    plan = Plan.of(model_of("joint"))
    _, s1, s2 = scale = plan.arrays["scale"]
    off, output = plan.thermometer.off_degC(plan.sample_s), 36_000.0 / scale[0]
    low, high = float(plan.limits.box_low[0]), float(plan.limits.box_high[0])
    steepest = max(abs(s1 + s2 * (2.0 * low + off)), abs(s1 + s2 * (2.0 * high - off)))
    told = false_readings(plan)["largest_error"][0]
    more = told["one_turning_deg_h"] - told["one_deg_h"]
    np.testing.assert_allclose(more, off * steepest * output, rtol=1e-6)
    assert more > told["one_deg_h"]
    assert "turning at 10 deg/s" in "\n".join(false_reading_lines(false_readings(plan)))
    assert "turning" not in "\n".join(false_reading_lines(false_readings(Plan.of(model_of("polynomial")))))


def with_offsets(run: Run, seed: int, most: float) -> tuple[Run, np.ndarray]:
    """The run with spells in which a thermometer is off by up to `most` degC, and where."""
    rng = np.random.default_rng(seed)
    columns, fault = dict(run.columns), np.zeros(len(run), dtype=bool)
    names = [name for name in columns if name.startswith("T")]
    for place in range(200, len(run) - 100, 150):
        spell = slice(place, place + int(rng.choice([1, 3, 30])))
        name = str(rng.choice(names))
        columns[name] = columns[name].copy()
        columns[name][spell] += rng.uniform(-most, most)
        fault[spell] = True
    return Run("faulty", columns), fault


@needs_cc
@pytest.mark.parametrize("dtype", ["float32", "q31", "q15"])
@pytest.mark.parametrize("cycle", [None, (300, 0), (300, 36_000_000_000)])
def test_a_thermometer_is_believed_again_after_any_change(tmp_path, dtype, cycle):
    time = np.arange(12_000.0)
    T = 10.0 - 50.0 * np.cos(np.pi * time / 6000.0)
    slow = Run("slow", {"time": time, "gyro": 0.01 * T, "T": T})
    source = c_source(Plan.of(make_model("polynomial", features="T, dT").fit(slow)), dtype, [])
    # Cut off for three hours, or the unit off for ten or for an unknown time, while it warms by 98 degC.
    shown, cut_off = np.repeat([-39.0, -127.0, 59.0], 300), np.zeros(900)
    if cycle is None:
        cut_off[300] = 10_800.0
    else:
        shown[300:600], cut_off[300] = 59.0, cycle[1] * 1e-6
    stamps = np.arange(900.0) + np.cumsum(cut_off)
    program = CProgram(source, tmp_path, flags=QUICK)
    unit = source.numbers["fixed"]["temperature_value"] if source.numbers["fixed"] else 1.0
    _, flag = program.steps(stamps, np.round(shown / unit)[:, None], np.zeros(900), cycle)
    assert flag[299] == 0 and flag[300] == 2 and flag[-1] == 0


@needs_cc
@pytest.mark.parametrize(("name", "dtype"), [("memory", "float64"), ("polynomial", "q31")])
def test_c_takes_offsets_as_batch_does(model_of, tmp_path, name, dtype):
    model = model_of(name)
    run, _ = with_offsets(disturbed(5), 3, 4.0)
    source = c_source(Plan.of(model), dtype, [])
    out, flag = outputs(CProgram(source, tmp_path, flags=QUICK), source, run)
    expected = model.compensate(run)
    assert np.mean(flag != expected.flag) < (1e-9 if dtype == "float64" else 2e-3)
    same = flag == expected.flag
    np.testing.assert_allclose(
        out[same], expected.compensated[same], atol=2e-6 if dtype == "float64" else 5e-3
    )
    blocks = [run[low : low + 90] for low in range(0, len(run), 90)]
    parts = [part for _, part in compensate_blocks(model, blocks)]
    np.testing.assert_array_equal(np.concatenate([part.flag for part in parts]), expected.flag)


def test_no_error_at_flag_0_exceeds_what_is_stated(tmp_path):
    model = make_model("polynomial", features="T, dT").fit(ramps())
    save_model(model, tmp_path / "model")
    model = load_model(tmp_path / "model")
    clean = ramps()
    run, fault = with_offsets(clean, 4, 4.0)
    stated = false_reading_error(Plan.of(model), spell=True)
    found, expected = model.compensate(run), model.compensate(clean)
    good = found.flag == 0
    assert np.count_nonzero(good & fault) > 3  # what is within a step of training passes
    largest = np.abs(found.drift - expected.drift)[good].max()
    assert largest < stated
    # Any thermometer's rule lets more through than that.
    model.features_.thermometer = RULE
    loose = model.compensate(run)
    assert np.abs(loose.drift - expected.drift)[loose.flag == 0].max() > 2.0 * largest


@needs_cc
@pytest.mark.parametrize(
    ("name", "dtype", "factor"),
    [("polynomial", "q31", 10), ("polynomial", "q15", 10), ("memory", "q31", 10), ("joint", "q15", 10)],
)
def test_fixed_point_stays_within_its_proven_bound(model_of, tmp_path, name, dtype, factor):
    plan = Plan.of(model_of(name))
    source = c_source(plan, dtype, [])
    proven = fixed_point_error(plan, source.layout, dtype)
    program = CProgram(source, tmp_path, flags=QUICK)
    found = [c_difference(plan, source, program, seed) for seed in (0, 1)]
    largest = max(one.inside for one in found)
    assert largest <= proven < factor * largest
    # Of a turn, what a scale factor in whole numbers loses is far from what it corrects.
    assert all((one.scale_ppm is None) == (name != "joint") for one in found)
    assert all(0.0 < one.scale_ppm < 1.0 for one in found if name == "joint")


@needs_cc
@pytest.mark.parametrize(("name", "least"), [("none", 2.0**-13), ("polynomial", 1.9 * 2.0**-13)])
def test_what_whole_steps_of_outputs_lose_on_the_way_in_is_counted(model_of, tmp_path, name, least):
    """Half a step of 2^-12 deg/h where an output is taken, and half a step where it is given."""
    plan = Plan.of(model_of(name))
    source = c_source(plan, "q31", [])
    found = c_difference(plan, source, CProgram(source, tmp_path, flags=QUICK), 0)
    assert 0.99 * least < found.inside <= fixed_point_error(plan, source.layout, "q31") < 1.3 * 2.0**-12


@needs_cc
def test_a_coefficient_between_two_whole_numbers_stays_within_the_proven_bound(tmp_path):
    """Half a unit of 2^-22 of 60 degC, which a slope of 2000 deg/h/degC shows."""
    steep = Run("steep", ramps().columns | {"gyro": 1000.0 * ramps().columns["T"]})
    plan = Plan.of(make_model("polynomial", features=f"{0.5 + 2.0**-23!r}*T").fit(steep))
    source = c_source(plan, "q31", [])
    program = CProgram(source, tmp_path, flags=QUICK)
    assert c_difference(plan, source, program, 1).inside <= fixed_point_error(plan, source.layout, "q31")


@needs_cc
@pytest.mark.parametrize(
    ("features", "times"),
    [("T_in, dT_in[slope, 60 s], diff(T_in)[slope, 40 s]", 1.0), ("dT_in[block, 60 s]", 1000.0)],
)
def test_windows_over_bins_stay_within_their_proven_bound(tmp_path, features, times):
    trained = training_run()
    trained = Run("steep", trained.columns | {"gyro": times * trained.columns["gyro"]}, trained.facts)
    plan = Plan.of(make_model("polynomial", features=features).fit(trained), 0.05)
    run, found = fast_run(0.05), {}
    for dtype in ("float64", "q31"):
        source = c_source(plan, dtype, [])
        assert source.layout.binned
        found[dtype], flag = outputs(CProgram(source, tmp_path, flags=QUICK), source, run)
    off = np.abs(found["q31"] - found["float64"])[flag == 0].max()
    proven = fixed_point_error(plan, source.layout, "q31")
    assert off <= proven < 100.0 * off
    first, more = fixed_point_lines(proven, plan, source.layout)
    assert f"at most {proven:.3g} deg/h" in first and "beside what bins of samples make" in more
    single = fixed_point_lines(proven, plan, c_source(replace(plan, sample_s=2.0), "q31", []).layout)
    assert single == [first]


def test_a_window_that_tells_nothing_yet_is_not_beyond_the_trained_rates():
    time = np.arange(3600.0)
    T = 20.0 + time / 60.0 + 2.0 * np.sin(time / 300.0)
    plan = Plan.of(
        make_model("polynomial", "T, dT[slope, 60 s]").fit(Run("up", {"time": time, "gyro": T, "T": T}))
    )
    assert plan.limits.box_low[1] > 0.1
    atoms = np.array([[50.0, 0.0], [50.0, 0.0]])
    limited, outside = plan.limited(atoms, np.array([False, True]))
    assert outside.tolist() == [False, True]
    assert limited[0].tolist() == atoms[0].tolist()


def test_extremes_of_a_gaussian_are_where_they_are():
    z = np.linspace(0.0, 4.0, 100_001)
    value = np.exp(-(z**2))
    assert np.abs(np.diff(value) / np.diff(z)).max() == pytest.approx(_STEEPEST, rel=1e-6)
    assert ((z * value).max(), (2.0 * z**2 * value).max()) == pytest.approx((_LARGEST, _TWICE), rel=1e-6)


def test_a_column_that_no_rate_is_told_of_crosses_its_range_in_a_quarter_of_an_hour():
    run = training_run()
    volts = 5.0 + 0.2 * np.sin(run.time / 700.0)
    model = make_model("polynomial", features="T_in, supply").fit(run.with_columns(supply=volts))
    low, high, fastest = sensor_range(Plan.of(model), "supply")
    assert (low, high) == pytest.approx((volts.min(), volts.max()), abs=0.02)
    assert fastest * 15.0 == pytest.approx(high - low)


@pytest.mark.parametrize("features", ["T, dT", "T, diff(T)[300 s]", "T, diff(T)[first]"])
def test_the_fastest_rate_of_training_is_told_however_a_feature_takes_it(features):
    plan = Plan.of(make_model("polynomial", features=features).fit(ramps()))
    assert sensor_range(plan, "T") == pytest.approx((-20.0, 60.0, 4.0))
