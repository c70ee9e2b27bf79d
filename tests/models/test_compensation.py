"""Compensation block by block: as the whole, over gaps, in bounded memory."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from sklearn.neighbors import KNeighborsRegressor

from fogml.errors import InputError
from fogml.models import feature_model
from fogml.models.card import check_unit_and_axis
from fogml.models.compensation import compensate_blocks
from fogml.models.feature_model import FeatureModel
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.signals import large
from fogml.testing.models import synthetic_run


@pytest.fixture(scope="module")
def train():
    return synthetic_run("train", 1.0)


@pytest.fixture(scope="module")
def gapped():
    """Another run with short and long gaps, and a jitter on its clock."""
    run = synthetic_run("gapped", 2.0, seed=1)
    rng = np.random.default_rng(0)
    keep = np.ones(len(run), dtype=bool)
    for start, length in ((1500, 10), (3000, 40), (5000, 900), (7777, 3)):
        keep[start : start + length] = False
    run = replace(run, columns={name: values[keep] for name, values in run.columns.items()})
    return run.with_columns(time=run.time + rng.uniform(-0.05, 0.05, size=len(run)))


@pytest.mark.parametrize(
    "features", ["T, dT", "T, dT[slope, 90 s]", "T, dT[exp, 50 s]", "T, diff(T)[first], T*dT"]
)
@pytest.mark.parametrize("rows", [97, 1024, 5000])
def test_blocks_give_what_the_whole_gives(train, gapped, features, rows):
    model = FeatureModel(features).fit(train)
    whole = model.compensate(gapped)
    blocks = [gapped[start : start + rows] for start in range(0, len(gapped), rows)]
    found = list(compensate_blocks(model, blocks))
    assert [block for block, _ in found] == blocks
    # The jitter moves the median interval of a block a little from the run's; windows may differ there.
    drift = np.concatenate([part.drift for _, part in found])
    flag = np.concatenate([part.flag for _, part in found])
    compensated = np.concatenate([part.compensated for _, part in found])
    np.testing.assert_allclose(drift, whole.drift, atol=1e-9)
    np.testing.assert_allclose(compensated, whole.compensated, atol=1e-9)
    assert np.array_equal(flag, whole.flag)
    assert (flag == 2).sum() > 100


@pytest.mark.parametrize("kind", ["linear", "levelled"])
def test_samples_one_by_one_give_what_the_whole_gives_beyond_the_box(train, kind):
    """A ramp faster, a gradient larger and temperatures further out than in training."""
    model = make_model("polynomial", "T^1..3, dT, T*dT, T_in-T_out, dT_out^2")
    if kind == "levelled":
        model = FeatureModel("T, dT", regressor=KNeighborsRegressor(3))
    model.fit(train)
    inner = 25.0 + 3.0 * (train.temperature("T_in") - 25.0)
    fast = train.with_columns(T_in=inner, T_out=2.0 * train.temperature("T_out"))[:4000:4]
    whole = model.compensate(fast)
    assert 0.1 < (whole.flag == 1).mean() < 1.0
    stream = model.stream(fast.sample_s)
    names = fast.temperature_columns
    steps = [
        stream.step(time, dict(zip(names, temperatures)))
        for time, *temperatures in zip(*(fast.columns[name].tolist() for name in ("time", *names)))
    ]
    drift = model.regressor_.predict(np.array([step.values for step in steps]))
    np.testing.assert_allclose(drift, whole.drift, atol=1e-9)
    assert np.array_equal(
        [int(step.outside) if step.full and step.settled else 2 for step in steps], whole.flag
    )
    # A linear model is followed further than the plain limit goes, any other is not.
    plain = model.features_.transform(fast, limited=True)
    followed = np.abs(model.regressor_.predict(plain) - whole.drift).max() > 1e-3
    assert followed == (kind == "linear")


def test_joint_model_too(train):
    turning = synthetic_run("turning", 1.0, turns=True)
    model = make_model("joint").fit(turning)
    whole = model.compensate(turning)
    blocks = [turning[start : start + 1000] for start in range(0, len(turning), 1000)]
    found = np.concatenate([part.compensated for _, part in compensate_blocks(model, blocks)])
    np.testing.assert_allclose(found, whole.compensated, atol=1e-6)


def test_columns_are_those_of_the_command(train):
    columns = make_model("mean").fit(train).compensate(train).columns()
    assert list(columns) == ["drift [deg/h]", "gyro_compensated [deg/h]", "flag"]


def test_blocks_out_of_order_are_told(train):
    model = FeatureModel("T, dT").fit(train)
    with pytest.raises(InputError, match="time order"):
        list(compensate_blocks(model, [train[2000:3000], train[:1000]]))


def test_another_unit_is_refused_before_anything_is_done(train):
    model = make_model("mean").fit(train)
    foreign = replace(train, facts=train.facts.model_copy(update={"unit": "other"}))
    with pytest.raises(InputError, match="--any-unit"):
        next(compensate_blocks(model, [foreign]))
    assert len(list(compensate_blocks(model, [foreign], any_unit=True))) == 1


def test_empty_blocks_are_skipped(train):
    model = FeatureModel("T, dT").fit(train)
    assert len(list(compensate_blocks(model, [train[:0], train, train[:0]]))) == 1


@pytest.mark.parametrize("features", ["T, T^2, dT, lag(T, 60 s), play(T, 4 degC)", "T, dT, T*dT"])
def test_limits_of_a_long_run_are_held_in_parts(monkeypatch, train, features):
    """Beyond the trained box all atoms were copied, for a linear model twice."""
    model = FeatureModel(features).fit(train)
    hotter = train.with_columns(**{name: 1.2 * train.columns[name] for name in train.temperature_columns})
    atoms, whole = model.features_.atom_values(hotter), model.evaluate(hotter)
    assert whole.outside.any()
    monkeypatch.setattr(large, "HELD_VALUES", 300)
    monkeypatch.setattr(large, "PIECE", 300)
    monkeypatch.setattr(feature_model, "_PREDICTED_VALUES", 300)
    tracemalloc.start()
    parted = model.evaluate_atoms(hotter, atoms)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    np.testing.assert_allclose(parted.drift, whole.drift, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(parted.outside, whole.outside)
    assert most < parted.drift.nbytes + parted.outside.nbytes + atoms.values.nbytes


def test_memory_does_not_grow_with_the_recording(train):
    model = make_model("polynomial").fit(train)

    def blocks(count, rows=20_000):
        for number in range(count):
            time = np.arange(number * rows, (number + 1) * rows, dtype=np.float64)
            temperature = 20.0 + 10.0 * np.sin(time / 3000.0)
            yield Run.from_columns("long", facts=train.facts, time=time, gyro=temperature, T_in=temperature)

    def peak(count):
        tracemalloc.start()
        for _ in compensate_blocks(model, blocks(count)):
            pass
        _, highest = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return highest

    peak(2)
    assert peak(30) < 1.2 * peak(3)


@pytest.mark.parametrize("fact", ["unit", "axis"])
@pytest.mark.parametrize(
    ("trained", "found", "told"),
    [
        ("A", "A", ()),
        (None, None, ()),
        ("A", None, ("run states no {}",)),
        (None, "A", ("the model states no {}",)),
        ("A", "B", ("run: {} 'B', but the model was trained on {} 'A': applied",)),
    ],
)
def test_whether_model_and_run_belong_together(fact, trained, found, told):
    card = SimpleNamespace(**{"unit": None, "axis": None, "earth_known": False, fact: trained})
    run = SimpleNamespace(name="run", earth_known=False, facts=SimpleNamespace(unit=None, axis=None))
    setattr(run.facts, fact, found)
    notes = check_unit_and_axis(card, run, any_unit=True)
    assert len(notes) == len(told)
    assert all(note.startswith(words.replace("{}", fact)) for note, words in zip(notes, told))
    if trained and found and trained != found:
        with pytest.raises(InputError, match=f"use a model of this {fact}"):
            check_unit_and_axis(card, run, any_unit=False)


def test_what_is_no_number_is_told_by_its_time_in_any_block(train):
    """A row of a block is none of the file's."""
    on = (np.arange(len(train)) >= 150).astype(np.float64)
    run = train.with_columns(power=on)
    model = make_model("polynomial", "T, power").fit(run)
    model.regressor_.coef_, model.regressor_.intercept_ = np.array([0.0, 1e308]), 1e308
    with pytest.raises(InputError, match=f": at time {run.time[150]:.10g} s the model's drift is inf"):
        list(compensate_blocks(model, [run[:100], run[100:]]))
