"""Features over runs: values, composition, the static part, scikit-learn's conventions."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline

from fogml.errors import InputError
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.features.signal import Signal
from fogml.runs.run import Run


@pytest.fixture
def run() -> Run:
    rng = np.random.default_rng(1)
    time = np.arange(2000.0)
    inner = 20.0 + 30.0 * np.sin(time / 300.0) + 0.01 * rng.normal(size=2000)
    outer = inner + 2.0 * np.cos(time / 200.0)
    return Run.from_columns(time=time, gyro=np.zeros(2000), T1=inner, T2=outer, T3=inner + 1.0)


def test_columns_are_the_products_of_powers(run: Run) -> None:
    columns = parse_features("T1, dT1, T1*dT1, T1^3*dT1^2, (T1-T2)^2, T1-T2, sign(dT1)*T1").transform(run)
    inner, outer = run.columns["T1"], run.columns["T2"]
    rate = np.zeros(2000)
    for i in range(127, 2000):
        # The mean times of two windows of 64 samples lie 64 s apart.
        rate[i] = (inner[i - 63 : i + 1].mean() - inner[i - 127 : i - 63].mean()) / 64.0 * 60.0
    direction = np.where(np.abs(rate) > 0.05, np.sign(rate), 0.0)
    wanted = [
        inner,
        rate,
        inner * rate,
        inner**3 * rate**2,
        (inner - outer) ** 2,
        inner - outer,
        direction * inner,
    ]
    np.testing.assert_allclose(columns[127:], np.column_stack(wanted)[127:], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "sign(dT1), dT1, dT1^2, T1",
        "T1*dT1, d(T1-T2), T1-T2",
        "diff(T1), dT1[slope, 30 s], dT1[exp, 30 s], T1*dT1[first], 2*T1",
        "(T1-T2)^2, T1*T2",
    ],
)
@pytest.mark.parametrize("begin", [0, 1998])
def test_columns_made_in_place_are_those_of_the_atom_values(run: Run, text: str, begin: int) -> None:
    features, part = Features(text), run[begin:]
    before = {name: values.copy() for name, values in part.columns.items()}
    values = features.atom_values(part).values
    np.testing.assert_array_equal(features.transform(part), features.compose(values))
    for name, column in before.items():
        np.testing.assert_array_equal(part.columns[name], column)


def test_what_was_not_measured_is_no_part_of_columns(run: Run) -> None:
    features, T = Features("T1, dT1, lag(T1, 300 s)"), run.columns["T1"].copy()
    T[500:520] = -273.15
    gone = run.with_columns(T1=T)
    rows = np.delete(np.arange(len(run)), np.arange(500, 520))
    rest = Run.from_columns("rest", **{name: values[rows] for name, values in run.columns.items()})
    found = features.transform(gone)
    np.testing.assert_allclose(found[rows], features.transform(rest), atol=1e-9)
    np.testing.assert_array_equal(found[500:520], np.tile(found[499], (20, 1)))


def test_names_of_formulas_stand_for_recorded_sensors(run: Run) -> None:
    inner, outer = run.columns["T1"] + 0.5, run.columns["T2"]
    columns = parse_features("T, T_in, T_in-T_out, 2*T1-0.5*T2").transform(run)
    wanted = [inner, inner, inner - outer, 2.0 * run.columns["T1"] - 0.5 * outer]
    np.testing.assert_allclose(columns, np.column_stack(wanted), rtol=1e-12)


def test_units_of_rates_and_differences() -> None:
    time = np.arange(1000.0)
    ramp = Run.from_columns(time=time, gyro=time, T=20.0 + time / 60.0)
    columns = parse_features(
        "dT, diff(T), dT[slope, 30 s], dT[exp, 30 s], dT[first], diff(T)[first]"
    ).transform(ramp)
    np.testing.assert_allclose(columns[-1], [1.0, 64.0 / 60.0, 1.0, 1.0, 1.0, 1.0 / 60.0], rtol=1e-9)


@pytest.mark.parametrize(
    ("rate", "wanted"), [(0.05, 0.0), (-0.05, 0.0), (0.051, 1.0), (-0.051, -1.0), (0.0, 0.0)]
)
def test_direction_has_a_dead_band(rate: float, wanted: float) -> None:
    time = np.arange(400.0)
    run = Run.from_columns(time=time, gyro=time, T=20.0 + rate * time / 60.0)
    assert parse_features("sign(dT)").transform(run)[-1, 0] == wanted


def test_windows_begin_at_the_static_part_and_count_from_an_eighth_on(run: Run) -> None:
    features = parse_features("T1, T1*dT1, dT1[first], T1^2")
    values, full, settled = features.atom_values(run)
    assert full.tolist() == [False] * 16 + [True] * (2000 - 16)
    assert settled.tolist() == [False] * 127 + [True] * (2000 - 127)
    inner = run.columns["T1"]
    np.testing.assert_allclose(features.transform(run)[0], [inner[0], 0.0, 0.0, inner[0] ** 2], rtol=1e-14)
    assert values.shape == (2000, len(features.atoms))


def test_features_without_windows_are_full_everywhere(run: Run) -> None:
    features = parse_features("T1, T1-T2")
    assert features.atom_values(run)[1].all()
    assert features.window_s == features.memory_s == 0.0


def test_what_features_need() -> None:
    features = parse_features("T, dT_in[slope, 60 s], d(T1-T2)[exp, 120 s], dT[first]")
    assert features.sensors == ("T", "T_in", "T1", "T2")
    assert features.window_s == 360.0
    assert features.memory_s == 4800.0
    assert [str(atom) for atom in features.atoms] == [
        "T",
        "dT_in[slope, 60 s]",
        "d(T1-T2)[exp, 120 s]",
        "dT[first]",
    ]
    assert [atom.unit for atom in features.atoms] == ["degC", "degC/min", "degC/min", "degC/min"]
    assert parse_features("dT").window_s == 128.0


def test_beside_and_products() -> None:
    one, other = Features("T, dT"), Features("dT, T_out")
    assert (one + other).names() == ["T", "dT", "T_out"]
    assert (one * other).names() == ["T*dT", "T*T_out", "dT^2", "T_out*dT"]
    assert Features("T") + Features("dT") + Features("T") * Features("dT") == parse_features("T, dT, T*dT")
    with pytest.raises(TypeError):
        _ = one + "T"
    with pytest.raises(TypeError):
        _ = one * 2


def test_equality_is_of_terms_in_order() -> None:
    assert Features("dT*T,T") == Features("T*dT, T")
    assert Features("T, dT") != Features("dT, T")
    assert Features("T") != "T"
    assert len({Features("T*dT"), Features("dT*T"), Features("T")}) == 2


def test_scikit_learn_conventions(run: Run) -> None:
    features = Features("dT1*T1,T1").fit(run)
    copy = clone(features)
    assert copy == features and copy is not features
    assert not copy.fitted and features.fitted
    assert features.get_params() == {"text": "T1*dT1, T1"}
    assert features.set_params(text="T2").names() == ["T2"]
    assert not features.fitted
    with pytest.raises(InputError, match="no parameter 'window'"):
        features.set_params(window=3)
    assert list(features.get_feature_names_out()) == ["T2"]
    assert pickle.loads(pickle.dumps(features)) == features


def test_they_stand_in_a_scikit_learn_pipeline(run: Run) -> None:
    target = 3.0 * run.columns["T1"] - 2.0 * run.columns["T2"]
    pipeline = make_pipeline(Features("T1, T2"), LinearRegression()).fit(run, target)
    np.testing.assert_allclose(pipeline.predict(run), target, atol=1e-9)
    assert clone(pipeline)[0] == Features("T1, T2")
    assert list(pipeline[:1].get_feature_names_out()) == ["T1", "T2"]
    assert "Features" in repr(pipeline)


def test_errors_name_the_run() -> None:
    run = Run.from_columns("slow.csv", time=np.arange(0.0, 1000.0, 100.0), gyro=np.zeros(10), T=np.zeros(10))
    with pytest.raises(
        InputError, match=r"slow.csv: a block window of 64 s is too short .* widen it to at least 100 s"
    ):
        parse_features("dT").transform(run)
    with pytest.raises(InputError, match=r"slow.csv: no temperature 'T_out'[\s\S]*the run holds T"):
        parse_features("T-T_out").transform(run)
    with pytest.raises(InputError, match=r"\(n, 2\) was expected"):
        parse_features("T, dT").compose(np.zeros((4, 3)))


def test_blocks_come_in_time_order(run: Run) -> None:
    blocks = parse_features("T1, dT1").blocks(1.0)
    blocks.push(run[:500])
    with pytest.raises(InputError, match="in time order"):
        blocks.push(run[400:600])
    with pytest.raises(InputError, match="lacks T1"):
        blocks.push(Run(name="b", columns={"time": run.time[500:], "gyro": run.gyro[500:]}))


def test_blocks_keep_bounded_history(run: Run) -> None:
    features = parse_features("dT1[block, 20 s]")
    blocks = features.blocks(1.0)
    whole = features.atom_values(run).values
    for low in range(0, 2000, 10):
        values = blocks.push(run[low : low + 10]).values
        np.testing.assert_allclose(values, whole[low : low + 10], rtol=1e-9, atol=1e-12)
        assert blocks._history is not None and len(blocks._history) <= 43


def test_a_signal_is_the_sum_that_it_says_and_a_view_of_one_column(run: Run) -> None:
    one = Signal.of("T1").values(run)
    assert np.shares_memory(one, run.columns["T1"])
    for first, other in ((1.0, -1.0), (1.1, -1.1), (1.0, 0.5)):
        found = Signal.of({"T1": first, "T2": other}).values(run)
        np.testing.assert_allclose(found, first * run.columns["T1"] + other * run.columns["T2"])


@pytest.mark.parametrize(
    ("text", "told"),
    [("T", True), ("lag(T, 300 s)", True), ("dT[slope, 60 s]", False), ("diff(T)[exp, 60 s]", False)],
)
def test_a_value_at_rest_is_told_by_its_signal_where_it_is_no_rate(text: str, told: bool) -> None:
    (atom,) = parse_features(text).atoms
    assert atom.of_input_at_rest is told
