"""Joint scale factor and bias: the known answers of the method's staircase programme."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from fogml.errors import InputError
from fogml.models.joint import JointModel
from fogml.models.linear import LinearRegressor
from fogml.models.names import make_model
from fogml.models.saved import load_model, save_model
from fogml.runs.facts import Facts, ScaleFactor
from fogml.runs.run import Run
from fogml.testing import check_model

EARTH_AT_30_DEG = 15.041067 / 2
FACTS = Facts(unit="u", axis="x", latitude=30.0, input_axis="up")
SCALE_ERROR = 80e-6, 3e-6, 2e-8
COUNT_PER_DEG_H = 12.5


def lagged(x, time_constant_s):
    gain = 1.0 - np.exp(-1.0 / time_constant_s)
    return lfilter([gain], [1.0, gain - 1.0], x, zi=[(1.0 - gain) * x[0]])[0]


def staircase(time_constants_s=(400.0, 150.0), noise=0.0, scale_error=SCALE_ERROR, facts=FACTS):
    """The patent's programme: -40 degC, then 10 degC steps to 70 degC, 10 deg/s both ways in each soak.

    Bias 0.5 + 0.01 T deg/h; the output's scale is off by e0 + e1 T + e2 T**2.
    """
    slope, table = [np.zeros(1800)], [np.zeros(1800)]

    def ramp(degrees):
        slope.append(np.full(abs(degrees) * 60, np.sign(degrees) / 60.0))
        table.append(np.zeros(abs(degrees) * 60))

    def soak(minutes, turn_at):
        rate = np.zeros(minutes * 60)
        rate[turn_at * 60 : turn_at * 60 + 60] = -10.0
        rate[turn_at * 60 + 60 : turn_at * 60 + 120] = 10.0
        slope.append(np.zeros(minutes * 60))
        table.append(rate)

    ramp(-65)
    soak(60, 50)
    for _ in range(11):
        ramp(10)
        soak(30, 20)
    chamber = 25.0 + np.cumsum(np.concatenate(slope))
    rate = np.concatenate(table)
    inside, outside = (lagged(chamber, constant) for constant in time_constants_s)
    reference = 3600.0 * rate + EARTH_AT_30_DEG
    e0, e1, e2 = scale_error
    gyro = reference * (1.0 + e0 + e1 * inside + e2 * inside**2) + 0.5 + 0.01 * inside
    gyro += np.random.default_rng(0).normal(scale=noise, size=len(gyro)) if noise else 0.0
    return Run.from_columns(
        "staircase", facts=facts, time=np.arange(len(rate)), gyro=gyro, rate=rate, T_in=inside, T_out=outside
    )


def static_residual(run, compensated):
    """Largest mean over a soak's last 5 minutes, table at rest, of compensated less reference [deg/h]."""
    at_rest = run.rate == 0.0
    error = np.where(at_rest, compensated - 3600.0 * run.rate - EARTH_AT_30_DEG, np.nan)
    soaks = [1800 + 65 * 60 + 60 * 60 + 40 * 60 * k for k in range(12)]
    return max(abs(np.nanmean(error[end - 300 : end])) for end in soaks)


def scale_factor_ppm(run, compensated):
    """Largest scale-factor error over the soaks' turns, from the difference of the two senses [ppm]."""
    plus = np.flatnonzero(np.diff(run.rate) == 20.0)
    found = []
    for start in plus:
        ahead, back = compensated[start + 20 : start + 50].mean(), compensated[start - 40 : start - 10].mean()
        found.append((ahead - back) / (2 * 36000.0) - 1.0)
    assert len(found) == 12
    return 1e6 * max(abs(error) for error in found)


@pytest.mark.parametrize("time_constants_s", [(400.0, 150.0), (900.0, 300.0), (1500.0, 900.0)])
def test_intercept_takes_the_static_residual_away(time_constants_s):
    run = staircase(time_constants_s)
    joint = JointModel().fit(run)
    with_intercept = joint.compensate(run).compensated
    assert static_residual(run, with_intercept) < 0.02
    assert scale_factor_ppm(run, with_intercept) < 1.0
    # The same columns and reference without the intercept.
    rows = joint._rows(run)
    bare = LinearRegressor(fit_intercept=False).fit(joint._columns(rows.atoms), rows.y)
    atoms = joint.features_.atom_values(run).values
    without = bare.predict(joint._columns(np.column_stack((run.gyro, atoms))))
    assert 0.12 < static_residual(run, without) < 0.74
    assert scale_factor_ppm(run, without) < 1.0


def test_patent_form_leaves_earth_rate_and_bias_but_not_scale_factor():
    run = staircase()
    model = JointModel(patent=True).fit(run)
    assert model.column_names == ["D", "T*D", "T^2*D", "T", "T_in-T_out", "diff(T)"]
    assert model.parameter_count() == 6 and model.regressor_.intercept_ == 0.0
    compensated = model.compensate(run).compensated
    assert 2.0 < static_residual(run, compensated) < 11.0
    # Rotation of the Earth that the model has no place for bends the scale factor a little.
    assert scale_factor_ppm(run, compensated) < 3.0


def test_noise_on_the_output_does_not_pull_the_scale_factor():
    run = staircase(noise=1.0)
    clean = staircase()
    model = JointModel().fit(run)
    assert scale_factor_ppm(clean, model.compensate(clean).compensated) < 1.5
    assert static_residual(clean, model.compensate(clean).compensated) < 0.05
    assert model.describe()["coefficients"]["D"]["se"] < 2e-6


def test_counts_are_taken_as_they_are():
    run = staircase()
    facts = FACTS.model_copy(update={"scale_factor": ScaleFactor(value=COUNT_PER_DEG_H)})
    counting = Run("counts", {**run.columns, "gyro": run.gyro * COUNT_PER_DEG_H}, facts, "count")
    model = JointModel().fit(counting)
    compensation = model.compensate(counting)
    assert static_residual(run, compensation.compensated) < 0.02
    np.testing.assert_allclose(compensation.drift, counting.gyro_deg_h - compensation.compensated, atol=1e-9)
    assert model.describe()["coefficients"]["D"]["value"] == pytest.approx(1 / COUNT_PER_DEG_H, rel=1e-3)
    with pytest.raises(InputError, match=r"deg/h.*count"):
        model.predict(run)


def test_run_without_turns_is_refused():
    run = staircase()
    at_rest = run.with_columns(rate=np.zeros(len(run)), gyro=run.gyro - 3600.0 * run.rate)
    with pytest.raises(InputError, match=r"staircase.*joint model needs turns"):
        JointModel().fit(at_rest)
    columns = {name: values for name, values in at_rest.columns.items() if name != "rate"}
    with pytest.raises(InputError, match="joint model needs turns"):
        JointModel().fit(replace(at_rest, columns=columns))


def test_without_outer_sensor_the_gradient_is_dropped_with_a_note():
    run = staircase()
    columns = {name: values for name, values in run.columns.items() if name != "T_out"}
    model = JointModel().fit(replace(run, columns=columns))
    assert "T_in-T_out" not in model.column_names
    assert any("T_out" in note for note in model.card_.notes)


def test_product_column_is_found():
    run = staircase()
    warming = np.gradient(run.temperature("T_in")) * 60.0
    run = run.with_columns(gyro=run.gyro + 0.02 * run.temperature("T_in") * warming)
    product = JointModel(product=True).fit(run)
    assert product.describe()["coefficients"]["T*dT"]["value"] == pytest.approx(-0.02, rel=0.1)
    with pytest.raises(InputError, match="six columns"):
        JointModel(patent=True, product=True).fit(run)


@pytest.mark.parametrize("step_s", [8, 20])
def test_an_interval_is_told_where_turns_are_too_short_for_averages(step_s):
    """What is cut about changes of the rate leaves no 50 s of a turn together, as 100 s averages need."""
    run = staircase(noise=3.0)
    count = len(run) // step_s * step_s
    means = {name: values[:count].reshape(-1, step_s).mean(axis=1) for name, values in run.columns.items()}
    intervals = JointModel().fit(Run("coarse", means, FACTS)).intervals_
    noise = 3.0 / np.sqrt(intervals.averaging_s)
    assert noise < intervals.half_width(0.9) < 3.0 * noise


def test_unknown_earth_rate_is_noted():
    model = JointModel().fit(staircase(facts=Facts()))
    assert any("Earth rate" in note for note in model.card_.notes)


@pytest.mark.parametrize("patent", [False, True])
def test_contract(patent):
    check_model(JointModel(patent=patent), turns=True)


def test_saved_with_other_columns_is_refused(tmp_path):
    model = JointModel().fit(staircase())
    save_model(model, tmp_path / "model")
    text = (tmp_path / "model" / "model.json").read_text()
    (tmp_path / "model" / "model.json").write_text(text.replace('"product": false', '"product": true'))
    with pytest.raises(InputError, match=r"model\.json"):
        load_model(tmp_path / "model")


def test_memory_of_the_bias_stands_beside_the_scale_factor(tmp_path):
    run = staircase(noise=0.05)
    node = lagged(run.columns["T_in"], 1800.0) - run.columns["T_in"]
    run = run.with_columns(gyro=run.gyro + 0.05 * node)
    plain, joint = JointModel().fit(run), make_model("joint", "lag(T, 1800 s)").fit(run)
    assert joint.column_names == [*plain.column_names, "lag(T, 1800 s)"]
    coefficients = dict(zip(joint.column_names, joint.regressor_.coef_, strict=True))
    # In the compensated rate the bias has the other sign; a scale error of 1e-4 is far below the tolerance.
    assert coefficients["lag(T, 1800 s)"] == pytest.approx(-0.05, rel=0.02)
    left = [np.std((m.compensate(run).compensated - run.reference_deg_h)[5000:]) for m in (plain, joint)]
    assert left[1] < 1.1 * 0.05 < 0.5 * left[0]
    save_model(joint, tmp_path / "model")
    again = load_model(tmp_path / "model")
    np.testing.assert_array_equal(again.compensate(run).compensated, joint.compensate(run).compensated)
    with pytest.raises(InputError, match="joint-patent"):
        make_model("joint-patent", "lag(T, 1800 s)")


def test_features_of_each_sensor_are_kept(tmp_path):
    run = staircase(noise=0.05)
    joint = make_model("joint", "lag({sensor}, 1800 s)").fit(run)
    assert joint.column_names[-2:] == ["lag(T_in, 1800 s)", "lag(T_out, 1800 s)"]
    save_model(joint, tmp_path / "model")
    again = load_model(tmp_path / "model")
    np.testing.assert_array_equal(again.compensate(run).compensated, joint.compensate(run).compensated)
