"""Drift models by name: the contract, and what each of them recovers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sklearn.base import clone

from fogml.errors import InputError
from fogml.features.parse import parse_features
from fogml.models.feature_model import FeatureModel, resolve_features, shared_sensors
from fogml.models.linear import LinearRegressor
from fogml.models.names import MODEL_NAMES, PRESETS, make_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.testing import check_model
from fogml.testing.models import synthetic_run
from fogml.validation.judge import judge

PLAIN = ["none", "mean", "polynomial", *PRESETS]


@pytest.fixture(scope="module")
def train():
    return synthetic_run("train", 1.0)


@pytest.fixture(scope="module")
def other():
    return synthetic_run("other", 2.0, seed=1)


@pytest.mark.parametrize("name", PLAIN)
def test_contract(name, train, other):
    check_model(make_model(name), [train], other)


@pytest.mark.parametrize("name", ["polynomial", "mean"])
def test_contract_on_several_runs(name, train, other):
    check_model(make_model(name), [train, synthetic_run("b", 0.5, seed=2), other[:9000]], other)


@pytest.mark.parametrize("name", PLAIN)
def test_names_are_kinds(name):
    assert make_model(name).kind == name


def test_every_name_is_made():
    for name in MODEL_NAMES:
        assert make_model(name).kind == name


def test_unknown_name_gets_a_hint():
    with pytest.raises(InputError, match=r"did you mean 'polynomial'\?.*sklearn"):
        make_model("polynomal")


@pytest.mark.parametrize("name", ["none", "mean", "M1", "multipoint-5-3", "joint-patent"])
def test_features_are_refused_where_the_model_has_its_own(name):
    with pytest.raises(InputError, match="its own columns"):
        make_model(name, features="T, dT")


@pytest.mark.parametrize("name", ["polynomial", "rbf", "sklearn.svm.SVR"])
def test_features_are_taken_and_faults_told_at_once(name):
    assert make_model(name, features="T, dT").get_params(deep=False)["features"] == "T, dT"
    with pytest.raises(InputError):
        make_model(name, features="T, d(")


def test_right_features_recover_the_truth(train, other):
    """Fitted at 1 degC/min with the right features, a run at 2 degC/min is left with its noise."""
    text = "T^1..2, dT, T_in-T_out, T*dT"
    truth = np.array([0.01, -1e-4, 0.3, 0.05, 0.004])

    def known(run, seed):
        noise = np.random.default_rng(seed).normal(scale=0.05, size=len(run))
        return run.with_columns(
            gyro=run.reference_deg_h + 0.4 + parse_features(text).transform(run) @ truth + noise
        )

    other = known(other, 1)
    model = make_model("polynomial", features=text).fit(known(train, 0))
    for name, value in zip(text_names(text), truth, strict=True):
        told = model.describe()["coefficients"][name]
        assert abs(told["value"] - value) < 5.0 * told["se"]
    evaluation = model.evaluate(other)
    assert (evaluation.flag == 1).mean() > 0.1
    left = (other.error_deg_h - evaluation.drift)[evaluation.full]
    assert left.std() == pytest.approx(0.05, rel=0.05)
    assert abs(left.mean()) < 0.01


def text_names(text):
    return parse_features(text).names()


def test_mean_is_the_mean_of_all_training_rows(train, other):
    model = make_model("mean").fit([train, other])
    expected = np.concatenate((train.error_deg_h, other.error_deg_h)).mean()
    np.testing.assert_allclose(model.predict(other), expected)
    assert model.describe()["bytes"] == 8


def test_none_leaves_the_output_alone(train, other):
    compensation = make_model("none").fit(train).compensate(other)
    assert np.array_equal(compensation.compensated, other.gyro_deg_h)
    assert (compensation.flag == 0).all()


def test_multipoint_takes_whatever_sensors_are_recorded(train):
    columns = {name: values for name, values in train.columns.items() if not name.startswith("T")}
    sensors = {f"T{k}": train.columns["T_in"] + k for k in (1, 2, 3, 4)}
    four = replace(train, columns={**columns, **sensors})
    model = make_model("multipoint-5-3").fit(four)
    assert model.parameter_count() == 33
    assert model.describe()["bytes"] == 33 * 8
    assert make_model("multipoint-2-1").fit(four).parameter_count() == 13
    assert make_model("multipoint-2-1").fit(train).feature_names == [
        "T_in",
        "T_in^2",
        "dT_in",
        "T_out",
        "T_out^2",
        "dT_out",
    ]


def test_sensors_shared_by_all_runs(train):
    time = np.arange(10.0)
    two = Run.from_columns("two", time=time, gyro=time, T1=time, T2=time)
    one = Run.from_columns("one", time=time, gyro=time, T1=time, T=time)
    only = Run.from_columns("only", time=time, gyro=time, T=time)
    assert shared_sensors([two]) == ["T1", "T2"]
    assert shared_sensors([two, one]) == ["T1"]
    assert shared_sensors([one, only]) == ["T"]
    assert shared_sensors([train]) == ["T_in", "T_out"]
    with pytest.raises(InputError, match="share no coil temperature"):
        shared_sensors([two, only])


def test_sensor_terms_are_written_out(train):
    features = resolve_features("T, dT[slope, 60 s], {sensor}^1..2, d({sensor})[exp, 90 s]", [train])
    assert features.names() == [
        "T",
        "dT[slope, 60 s]",
        "T_in",
        "T_in^2",
        "dT_in[exp, 90 s]",
        "T_out",
        "T_out^2",
        "dT_out[exp, 90 s]",
    ]


def test_a_start_goes_from_the_static_part_to_the_whole(train):
    model = FeatureModel("T, dT").fit(train)
    drift, full = model.predict(train), model.evaluate(train).full
    coefficients = model.describe()["coefficients"]
    static = coefficients["1"]["value"] + coefficients["T"]["value"] * train.temperature()
    assert (model.compensate(train).flag[:127] == 2).all()
    np.testing.assert_allclose(drift[0], static[0], atol=1e-9)
    assert full.tolist() == [False] * 16 + [True] * (len(train) - 16)
    rate = model.features_.atom_values(train).values[:, 1]
    np.testing.assert_allclose(drift, static + coefficients["dT"]["value"] * rate, atol=1e-9)
    assert rate[1:127].any()


def test_outside_the_box_the_drift_levels_off(train):
    model = make_model("M1").fit(train)
    low, high = model.card_.box["T"]
    n = 400
    temperature = np.linspace(low, high + 100.0, n)
    time = np.arange(float(n))
    beyond = Run.from_columns("beyond", time=time, gyro=np.zeros(n), T=temperature)
    evaluation = model.evaluate(beyond)
    inside = temperature <= high
    assert (evaluation.flag[inside] == 0).all() and (evaluation.flag[temperature > high + 2] == 1).all()
    top = model.predict(beyond)[inside].max()
    assert np.abs(evaluation.drift).max() < 2.0 * np.abs(top) + 1.0
    np.testing.assert_allclose(evaluation.excess[-1], 100.0 / (high - low), rtol=1e-6)


def test_clone_of_a_fitted_model_is_unfitted(train):
    model = make_model("M2").fit(train)
    copy = clone(model)
    assert not hasattr(copy, "card_") and copy.features_ is None
    assert isinstance(copy.regressor, LinearRegressor) and not hasattr(copy.regressor, "coef_")


def test_card_tells_where_the_model_comes_from(train, other):
    card = make_model("polynomial").fit([train, other]).card_
    assert (card.unit, card.axis, card.gyro_unit) == ("CHECK-1", "x", "deg/h")
    assert [(run.name, run.sha256) for run in card.runs] == [("other", other.hash), ("train", train.hash)]
    assert card.earth_known and card.sample_s == 1.0 and card.rows == len(train) + len(other) - 2 * 16


def with_facts(run, **facts):
    return replace(run, facts=run.facts.model_copy(update=facts))


def test_runs_that_do_not_belong_together_are_refused(train, other):
    model = make_model("polynomial")
    with pytest.raises(InputError, match="no training run"):
        model.fit([])
    with pytest.raises(InputError, match=r"more than one unit: .*another \(other\)"):
        model.fit([train, with_facts(other, unit="another")])
    with pytest.raises(InputError, match="more than one axis"):
        model.fit([train, with_facts(other, axis="y")])
    with pytest.raises(InputError, match="other: latitude and input_axis are not stated"):
        model.fit([train, with_facts(other, latitude=None)])
    with pytest.raises(InputError, match="holds no samples"):
        model.fit([train[:0]])


def test_missing_outer_sensor_is_told(train):
    columns = {name: values for name, values in train.columns.items() if name != "T_out"}
    with pytest.raises(InputError, match="T_out"):
        make_model("M3").fit(replace(train, columns=columns))


def test_notes_on_use(train, other):
    model = make_model("polynomial").fit(replace(train, facts=Facts()))
    notes = model.check_applies(other)
    assert any("the model states no unit" in note for note in notes)
    assert any("Earth rate" in note for note in notes)
    model, foreign = make_model("polynomial").fit(train), with_facts(other, unit="another")
    assert model.check_applies(other) == ()
    with pytest.raises(InputError, match="unit 'another', but the model was trained on"):
        model.compensate(foreign)
    assert np.array_equal(model.compensate(foreign, any_unit=True).drift, model.predict(foreign))


def test_what_is_no_run_is_told_as_that() -> None:
    time = 2.0 * np.arange(1500)
    warm = 20.0 - 20.0 * np.cos(time / 500.0)
    run = Run("a", {"time": time, "gyro": 5.0 + 0.05 * warm + np.sin(time), "T": warm})
    model = make_model("polynomial", "T").fit(run)
    calls = (
        lambda: model.fit(run.to_pandas()),
        lambda: model.fit(["a.csv"]),
        lambda: judge(model, "a.csv", run),
        lambda: model.predict([run]),
    )
    for call, found in zip(calls, ("DataFrame", "str", "str", "list"), strict=True):
        with pytest.raises(InputError, match=rf"needed, found {found}"):
            call()
    assert str(judge(model, run, run)).startswith("polynomial, judged\na: rms")


def test_a_sensor_stands_in_calls_of_several_arguments_too(train):
    features = resolve_features(
        "lag({sensor}, 600 s), T*dT[slope, 60 s], play({sensor}, 4 degC)^1..2", [train]
    )
    assert features.names() == [
        "T*dT[slope, 60 s]",
        *[f"{text.format(name)}" for name in ("T_in", "T_out") for text in EACH],
    ]


EACH = ("lag({}, 600 s)", "play({}, 4 degC)", "play({}, 4 degC)^2")


@pytest.mark.parametrize("name", ["polynomial", "mixed-effects", "rbf", "auto"])
@pytest.mark.parametrize("text", ["T, power^20", "1e300*T_in, T_out"])
def test_a_feature_too_large_to_be_squared_is_refused(train, name, text):
    run = train.with_columns(power=1e17 + 0.0 * train.time)
    with pytest.raises(InputError, match=r"feature \S+ is as large as 1e\d+ in the training runs"):
        make_model(name, text).fit(run)


@pytest.mark.parametrize("features", [["T", "dT"], 3, object()])
def test_features_that_are_no_text_are_refused(features) -> None:
    with pytest.raises(InputError, match="a text such as"):
        FeatureModel(features).fit(synthetic_run("a", 1.0))
