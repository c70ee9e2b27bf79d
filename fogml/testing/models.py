"""The contract of drift models, as a check that any model can be put to."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.json_files import json_text
from fogml.models.base import GOOD, NOT_FULL, OUTSIDE, DriftModel
from fogml.models.compact import network_of
from fogml.models.compensation import compensate_blocks
from fogml.models.feature_model import FeatureModel
from fogml.models.regressors import goes_on_linearly, predict_rows
from fogml.models.saved import as_model, load_model, model_to_saved, save_model
from fogml.models.scikit_learn import clone
from fogml.runs.facts import Facts, ScaleFactor
from fogml.runs.run import Run

AGREEMENT = 1e-9
"""Greatest difference between two ways to the same value, relative to the values' size."""
EXPORTED = 1e-6
"""The same between a regressor and its compact form."""
_COUNT_PER_DEG_H = 2.0
# A power of two: counts then hold the very same digits, and even a forest of trees must agree.
_FACTS = Facts(unit="CHECK-1", axis="x", latitude=30.0, input_axis="up")


def check_model(
    model: DriftModel, train: Sequence[Run] | None = None, other: Run | None = None, *, turns: bool = False
) -> None:
    """Check that a drift model keeps the contract that validation, saving and export rely on.

    The checks: parameters rebuild the model (clone); a second fit gives the same numbers; nothing
    of another run gets into a fit or is altered by use; drift at a sample depends on no later
    sample; compensated is output less drift; flags tell windows that are not full and temperatures
    outside training, where the drift stays bounded; intervals hold the drift and grow with their
    level; counts with a stated scale factor give what deg/h gives; block by block gives what the
    whole run gives; save and load give the same model, and a damaged file is refused; a regressor's
    compact form, where it has one, is what it predicts; another unit or axis is refused unless allowed.

    Parameters
    ----------
    model
        An unfitted model; it stays unfitted.
    train
        Training runs that state unit and axis; synthetic ones if None.
    other
        A run of the same unit and axis that is not among them, at another ramp rate.
    turns
        Whether the synthetic runs turn, for models that need it.

    Raises
    ------
    AssertionError
        Naming the part of the contract that is not kept.
    InputError
        What fogml tells of a regressor that raises, writes to the table that it is given, or answers with
        another thing than a number a row.
    """
    model = as_model(model)
    train = [synthetic_run("train", 1.0, turns)] if train is None else list(train)
    other = synthetic_run("other", 2.0, turns, seed=1) if other is None else other
    fitted = _check_refit(model, train)
    _check_use(fitted, train, other)
    _check_flags(fitted, other)
    _check_intervals(fitted, other)
    _check_counts(model, fitted, train, other)
    _check_blocks(fitted, other)
    _check_saving(fitted, other)
    _check_compact(fitted, other)
    _check_unit_and_axis(fitted, other)


def synthetic_run(name: str, rate: float, turns: bool = False, seed: int = 0) -> Run:
    """25 to -10 to 50 degC at `rate` degC/min with soaks, 1 Hz, two faces of a coil, known Earth rate.

    With `turns`, the table turns at 10 deg/s one way and back in each soak.
    """
    rng = np.random.default_rng(seed)
    soak = np.zeros(1200)
    steps = [(-10.0 - 25.0) / 2, (-10.0 - 25.0) / 2, 20.0, 20.0, 20.0]
    ramps = [np.full(int(abs(step) / rate * 60.0), np.sign(step) * rate / 60.0) for step in steps]
    slope = np.concatenate([part for ramp in ramps for part in (soak, ramp)] + [soak])
    chamber = 25.0 + np.cumsum(slope)
    inside = _lagged(chamber, 400.0)
    outside = _lagged(chamber, 150.0)
    time = np.arange(len(chamber), dtype=np.float64)
    warming = np.gradient(inside) * 60.0
    table = np.zeros(len(chamber))
    if turns:
        starts = np.cumsum([0, *(len(soak) + len(ramp) for ramp in ramps)]) + 900
        for start in starts:
            table[start : start + 60] = -10.0
            table[start + 60 : start + 120] = 10.0
    reference = 3600.0 * table + (_FACTS.earth_rate_deg_h or 0.0)
    drift = 0.4 + 0.01 * inside - 1e-4 * inside**2 + 0.3 * warming + 0.05 * (inside - outside)
    scale_error = 1e-6 * (50.0 + 2.0 * (inside - 25.0)) if turns else 0.0
    return Run.from_columns(
        name,
        facts=_FACTS,
        time=time,
        gyro=reference * (1.0 + scale_error) + drift + rng.normal(scale=0.05, size=len(time)),
        rate=table,
        T_in=inside + rng.normal(scale=0.002, size=len(time)),
        T_out=outside + rng.normal(scale=0.002, size=len(time)),
    )


def _lagged(x: FloatArray, time_constant_s: float) -> FloatArray:
    from scipy.signal import lfilter

    gain = 1.0 - np.exp(-1.0 / time_constant_s)
    return np.asarray(lfilter([gain], [1.0, gain - 1.0], x, zi=[(1.0 - gain) * x[0]])[0])


def _check_refit(model: DriftModel, train: Sequence[Run]) -> DriftModel:
    copy: DriftModel = clone(model)
    assert type(copy) is type(model) and copy.kind == model.kind, "clone: another model came back"
    first = copy.fit(train)
    assert not hasattr(model, "card_"), "clone: fitting a clone fitted the original"
    assert clone(first).get_params().keys() == model.get_params().keys(), "clone: parameters differ"
    assert first is copy and first.fit(train) is first, "fit: must return the model itself"
    third: DriftModel = clone(model).fit(train)
    for run in train:
        assert np.array_equal(first.predict(run), third.predict(run)), "refit: another fit, other numbers"
    assert _state(first) == _state(third), "refit: another fit, another state"
    return first


def _state(model: DriftModel) -> str:
    """What is saved of a model, as text."""
    values, arrays = model_to_saved(model)
    # skops names the parts of its archive by their places in memory: same objects, other bytes.
    numbers = {name: array.tobytes().hex() for name, array in sorted(arrays.items()) if name != "skops"}
    return json.dumps(json.loads(json_text([values, numbers], model.kind)), sort_keys=True)


def _check_use(model: DriftModel, train: Sequence[Run], other: Run) -> None:
    hashes = {record.sha256 for record in model.card_.runs}
    assert hashes == {run.hash for run in train}, "card: the training runs' hashes are not those of the runs"
    before = _state(model)
    drift = model.predict(other)
    compensation = model.compensate(other)
    assert _state(model) == before, "use: compensating another run altered the model"
    assert drift.shape == (len(other),) and np.isfinite(drift).all(), "predict: a number for every sample"
    scale = np.abs(other.gyro_deg_h).max()
    assert np.allclose(compensation.drift, drift, rtol=0, atol=AGREEMENT * scale), "compensate: another drift"
    assert np.allclose(compensation.compensated, other.gyro_deg_h - drift, rtol=0, atol=AGREEMENT * scale), (
        "compensate: compensated is not output less drift"
    )
    part = Run(other.name, other[: len(other) // 2].columns, other.facts, other.gyro_unit)
    assert np.allclose(
        model.predict(part), drift[: len(part)], rtol=0, atol=AGREEMENT * (1.0 + np.abs(drift).max())
    ), "predict: the drift at a sample depends on later samples"


def _check_flags(model: DriftModel, other: Run) -> None:
    flag = model.compensate(other).flag
    assert flag.shape == (len(other),) and set(np.unique(flag)) <= {GOOD, OUTSIDE, NOT_FULL}, (
        "flag: 0, 1 or 2"
    )
    age = other.time - other.time[0]
    early = age < model.window_s - 2.0 * other.sample_s
    assert (flag[early] == NOT_FULL).all(), "flag: windows can't be full so early"
    assert (flag[age > model.window_s] != NOT_FULL).all(), "flag: windows are full by now"
    if not model.sensors:
        return
    hot = other.with_columns(**{name: other.columns[name] + 300.0 for name in other.temperature_columns})
    evaluation = model.evaluate(hot)
    if any(name != "T_in-T_out" and not name.startswith(("d", "sign")) for name in model.card_.box):
        late = age > model.window_s
        assert (evaluation.flag[late] == OUTSIDE).all(), "flag: 300 degC hotter is outside training"
        assert (evaluation.excess[late] > 0.0).all(), "evaluate: outside, yet no distance from the box"
    spread = 1.0 + 10.0 * np.ptp(model.predict(other)) + np.abs(model.predict(other)).max()
    assert np.abs(evaluation.drift).max() < 10.0 * spread, "predict: the drift runs away outside training"


def _check_intervals(model: DriftModel, other: Run) -> None:
    drift = model.predict(other)
    widths = []
    for level in (0.5, 0.9, 0.99):
        lower, upper = model.predict_interval(other, level)
        assert (lower <= drift).all() and (drift <= upper).all(), "interval: does not hold the drift"
        widths.append(upper - lower)
    assert (widths[0] <= widths[1]).all() and (widths[1] <= widths[2]).all(), (
        "interval: narrower at a higher level"
    )
    assert widths[1].max() > 0.0, "interval: of no width"
    for level in (0.0, 1.0, -1.0, 2.0):
        _refused(partial(model.predict_interval, other, level), f"interval: level {level} taken")


def _check_counts(model: DriftModel, fitted: DriftModel, train: Sequence[Run], other: Run) -> None:
    counting = clone(model).fit([_in_counts(run) for run in train])
    expected = fitted.compensate(other).compensated
    found = counting.compensate(_in_counts(other)).compensated
    size = 1.0 + np.abs(other.gyro_deg_h).max()
    assert np.allclose(found, expected, rtol=0, atol=1e-6 * size), (
        "units: counts give another result than deg/h"
    )


def _in_counts(run: Run) -> Run:
    facts = run.facts.model_copy(update={"scale_factor": ScaleFactor(value=_COUNT_PER_DEG_H)})
    columns = {**run.columns, "gyro": run.gyro_deg_h * _COUNT_PER_DEG_H}
    return Run(run.name, columns, facts, "count")


def _check_blocks(model: DriftModel, other: Run) -> None:
    whole = model.compensate(other)
    edges = [0, 50, 51, min(2000, len(other) // 3), len(other) // 2, len(other)]
    pieces = [other[start:stop] for start, stop in pairwise(edges)]
    found = list(compensate_blocks(model, iter(pieces)))
    assert [len(block) for block, _ in found] == [len(piece) for piece in pieces], "blocks: other lengths"
    drift = np.concatenate([compensation.drift for _, compensation in found])
    flag = np.concatenate([compensation.flag for _, compensation in found])
    size = 1.0 + np.abs(other.gyro_deg_h).max()
    assert np.allclose(drift, whole.drift, rtol=0, atol=AGREEMENT * size), (
        "blocks: another drift than the whole"
    )
    assert np.array_equal(flag, whole.flag), "blocks: other flags than the whole"


def _check_saving(model: DriftModel, other: Run) -> None:
    with tempfile.TemporaryDirectory() as folder:
        save_model(model, f"{folder}/model")
        loaded = load_model(f"{folder}/model")
        assert type(loaded) is type(model) and loaded.kind == model.kind, "load: another model came back"
        assert np.array_equal(loaded.predict(other), model.predict(other)), "load: other numbers"
        assert loaded.card_ == model.card_ and loaded.intervals_ == model.intervals_, "load: another card"
        assert model_to_saved(loaded)[0] == model_to_saved(model)[0], "load: saved again it differs"
        for file in ("model.json", "weights.safetensors"):
            path = f"{folder}/model/{file}"
            with open(path, "rb") as stream:
                content = stream.read()
            with open(path, "wb") as stream:
                stream.write(content[: len(content) // 2])
            _refused(partial(load_model, f"{folder}/model"), f"load: {file} cut short was taken")
            with open(path, "wb") as stream:
                stream.write(content)


def _check_compact(model: DriftModel, other: Run) -> None:
    regressor = getattr(model, "regressor_", None)
    network = None if regressor is None else network_of(regressor)
    if not isinstance(model, FeatureModel) or network is None:
        return
    values, full, _ = model.features_.atom_values(other)
    limited, _ = model.features_.limit(values, full, linear=goes_on_linearly(regressor))
    columns = model.features_.compose(limited)
    wanted, found = predict_rows(regressor, columns), network(columns)
    size = 1.0 + np.abs(wanted).max()
    assert np.allclose(found, wanted, rtol=0, atol=EXPORTED * size), (
        f"compact: up to {np.abs(found - wanted).max():.2g} deg/h from what the regressor predicts"
    )


def _check_unit_and_axis(model: DriftModel, other: Run) -> None:
    if model.card_.unit is None or model.card_.axis is None:
        raise AssertionError("check_model needs training runs that state unit and axis")
    model.check_applies(other)
    for fact in ("unit", "axis"):
        foreign = replace(other, facts=other.facts.model_copy(update={fact: "another"}))
        _refused(partial(model.check_applies, foreign), f"unit and axis: another {fact} was taken")
        assert model.check_applies(foreign, any_unit=True), f"unit and axis: no note on another {fact}"
        silent = replace(other, facts=other.facts.model_copy(update={fact: None}))
        assert model.check_applies(silent), f"unit and axis: no note on an unknown {fact}"


def _refused(action: Callable[[], object], otherwise: str) -> None:
    try:
        action()
    except InputError:
        return
    raise AssertionError(otherwise)
