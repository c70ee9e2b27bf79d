"""Jointly outside: a temperature that training passed one way only is outside the other way."""

import json
from itertools import pairwise

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.features.features import Features
from fogml.features.slices import SavedSlices, Slices
from fogml.models.box import distance_outside, learn_box, slices_of
from fogml.models.names import make_model
from fogml.models.saved import load_model, save_model
from fogml.runs.run import Run
from fogml.strict import as_written, strictly


def _run(*ends, name="run", rate=1.0, sample_s=4.0, **others):
    """Ramps through temperatures [degC] at a rate [degC/min], with noise in the output."""
    parts = [np.linspace(a, b, round(60.0 * abs(b - a) / rate / sample_s)) for a, b in pairwise(ends)]
    T = np.concatenate(parts)
    y = 0.1 * T + np.random.default_rng(len(T)).normal(0.0, 0.1, len(T))
    columns = {"time": sample_s * np.arange(len(T)), "gyro": y, "T": T}
    return Run(name, columns | {key: make(T) for key, make in others.items()})


TRAIN = _run(-10.0, 60.0, 0.0, name="train")
TEST = _run(60.0, -10.0, 60.0, name="test")


@pytest.mark.parametrize("text", ["T, dT, T*dT", "T, T^2, lag(T, 40 s)", "T, play(T, 4 degC)"])
def test_a_temperature_that_fell_never_is_outside_when_it_falls(text):
    model = make_model("polynomial", text).fit(TRAIN)
    evaluation, T = model.evaluate(TEST), TEST.columns["T"]
    falls = np.arange(len(T)) < len(T) // 2
    never, trained = falls & (T < -3.0) & evaluation.full, ~falls | (T > 3.0)
    assert evaluation.outside[never].all()
    # What turns on its way is told where it has settled on it.
    turning = (T < 0.0) & (T.min() + 8.0 > T)
    settled = trained & evaluation.full & evaluation.settled & ~turning
    assert not evaluation.outside[settled].any()
    low, high = model.predict_interval(TEST)
    assert (high - low)[never].min() > 1.5 * (high - low)[settled].max()


def test_it_is_what_brute_force_over_the_training_rows_finds():
    features = Features("T, dT, T_out, power")
    rng = np.random.default_rng(1)
    T = rng.uniform(-40.0, 60.0, 3000)
    atoms = np.column_stack([T, np.sin(T / 9.0) * rng.uniform(-1, 1, 3000), T + rng.normal(size=3000), T**2])
    learn_box(features, [atoms])
    values = np.column_stack([rng.uniform(-40.0, 60.0, 500), rng.uniform(-1, 1, 500), T[:500], T[:500] ** 2])
    values[:, 2] = values[:, 0] + rng.normal(0.0, 2.0, 500)
    values[:, 3] = values[:, 0] ** 2
    inputs = [lambda a: a[:, 1], lambda a: a[:, 2] - a[:, 0], lambda a: a[:, 3]]
    edges = np.linspace(atoms[:, 0].min(), atoms[:, 0].max(), 33)
    expected = np.zeros(500, dtype=bool)
    for row in range(500):
        k = np.clip(np.searchsorted(edges, values[row, 0], side="right") - 1, 0, 31)
        same = (atoms[:, 0] >= edges[k]) & (atoms[:, 0] < edges[k + 1] if k < 31 else True)
        for of in inputs:
            trained, now = of(atoms), of(values)[row]
            slack = 0.25 * np.ptp(trained)
            expected[row] |= not trained[same].min() - slack <= now <= trained[same].max() + slack
    box = features.box
    in_box = np.logical_and.reduce([(v >= lo) & (v <= hi) for v, (lo, hi) in zip(values.T, box.values())])
    _, outside = features.limit(values)
    assert np.array_equal(outside[in_box], expected[in_box])
    assert expected[in_box].any() and not expected[in_box].all()
    distance = distance_outside(values, outside, features)
    assert (distance[outside] > 0.0).all() and not distance[~outside].any()


def test_streaming_saving_and_c_tell_the_same(tmp_path):
    model = make_model("polynomial", "T^1..3, dT, T*dT").fit(TRAIN)
    flag = model.compensate(TEST).flag
    assert (flag == 1).any()
    save_model(model, tmp_path / "model")
    assert np.array_equal(load_model(tmp_path / "model").compensate(TEST).flag, flag)
    stream = model.stream(TEST.sample_s)
    steps = [stream.step(float(t), {"T": float(T)}) for t, T in zip(TEST.columns["time"], TEST.columns["T"])]
    assert np.array_equal([int(s.outside) if s.full and s.settled else 2 for s in steps], flag)


def test_slices_of_a_file_are_checked():
    features = Features("T, dT")
    learn_box(features, [np.column_stack([np.arange(40.0), np.arange(40.0) % 3])])
    values = json.loads(json.dumps(as_written(slices_of(features))))
    again = Slices.from_saved(strictly(SavedSlices, values), features.atoms)
    assert np.array_equal(again.low, features.slices.low)
    with pytest.raises(InputError, match="no atom 'dT_in'"):
        wrong = values | {"inputs": [values["inputs"][0] | {"atom": "dT_in"}]}
        Slices.from_saved(strictly(SavedSlices, wrong), features.atoms)
    with pytest.raises(InputError, match="width"):
        strictly(SavedSlices, values | {"width": 0.0})


def test_of_some_of_the_atoms_it_says_what_it_says_of_all():
    rng = np.random.default_rng(3)
    features = Features("T, dT, T_out, power")
    atoms = np.column_stack([rng.uniform(0.0, 50.0, 2000), *rng.normal(size=(3, 2000)) * [[1], [20], [4]]])
    learn_box(features, [atoms])
    places = [0, 3, 1]
    beyond = np.column_stack([rng.uniform(0.0, 50.0, 300), 1.5 * rng.normal(size=(300, 3)) * [1, 20, 4]])
    # The input made of T_out is gone: held at a trained value it says nothing.
    calm = beyond.copy()
    calm[:, 2] = calm[:, 0] + np.median(atoms[:, 2] - atoms[:, 0])
    fewer = features.slices.of_atoms(places)
    assert np.array_equal(fewer.outside(beyond[:, places]), features.slices.outside(calm))
    assert features.slices.of_atoms([1, 3]) is None and features.slices.of_atoms([0]) is None
