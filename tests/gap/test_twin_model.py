"""The twin as a model that can be diagnosed: its columns and responses are those of its replay."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.fitting import fit_model
from fogml.gap.model import Candidate, EffectValue, NoisePrior
from fogml.gap.observation import observe
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.shapes import AT_AMPLITUDE, usual_shape
from fogml.gap.twin_model import TwinModel
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.effect import NoiseEffect, SensorEffect, ThermalEffect
from fogml.twin.inputs import STAND_INS
from fogml.twin.nominal import NAMES
from fogml.twin.programme import load_programme
from fogml.twin.registry import effect
from fogml.twin.replay import replay
from fogml.twin.twin_file import load_twin

TWIN = load_twin("nominal")
VALUES = {"e0": 100.0, "k1": 5.0, "k2": 0.05, "b0": 1.0, "b1": 0.04, "b2": 5e-4, "g": 0.2, "m": 1.0}
ZERO = dict.fromkeys(NAMES, 0.0)
STEPS = [
    {"soak at 25 degC for 40 min": ["turn at 5 deg/s for 60 s, then -5 deg/s for 60 s, from minute 10"]},
    "ramp to 50 degC at 1 degC/min",
    {"soak at 50 degC for 40 min": ["turn at 5 deg/s for 60 s, then -5 deg/s for 60 s, from minute 10"]},
    "ramp to 10 degC at 2 degC/min",
    "soak at 10 degC for 40 min",
]


@pytest.fixture(scope="module")
def run() -> Run:
    return TWIN.simulate(load_programme(STEPS), sample_s=10.0, seed=1).run


@pytest.fixture(scope="module")
def on(run):
    return TwinModel(TWIN).on(run)


def test_columns_are_what_the_output_changes_by(on):
    base = on.output(ZERO)
    columns = on.columns()
    assert set(columns) == set(NAMES)
    for name, column in columns.items():
        changed = on.output({**ZERO, name: 3.0}) - base
        np.testing.assert_allclose(changed, 3.0 * column, atol=1e-9 * max(1.0, np.abs(base).max()))


def test_output_is_the_twins_replay(on, run):
    values = (EffectValue("thermal_hysteresis", 0.2, {"half_width": 6.0}),)
    twin = TWIN.with_nominal(**VALUES).with_effect("thermal_hysteresis", 0.2, half_width=6.0)
    np.testing.assert_array_equal(on.output(VALUES, values), replay(twin, run))


def test_constants_that_coarse_sensors_hide_are_found_with_what_the_sensors_miss(run):
    """Steps of half a degree are as large as DeltaT itself: beside them its constant comes out small."""
    true, rng = {**VALUES, "m": 2.0}, np.random.default_rng(5)
    noise = NoiseModel(0.001, 1e-6, 1e-6)
    clean = replay(TWIN.with_nominal(**true), run) + 0.02 * rng.standard_normal(len(run))
    coarse = {name: 0.5 * np.rint(run.columns[name] / 0.5) for name in run.temperature_columns}
    record = Run(name="coarse.csv", columns={**run.columns, **coarse, "gyro": clean}, facts=run.facts)
    model = TwinModel(TWIN)
    o = observe(record, model)
    whiteners = (RunWhitener(noise, o, true, np.zeros(len(record))),)
    alone = fit_model([o], whiteners, model.constants)
    steps = (EffectValue("sensor_quantisation", 0.3, {}),)
    fit = fit_model([o], whiteners, model.constants, steps, model.candidates(), start=alone.constants)
    assert fit.square < 0.2 * alone.square
    assert fit.effects[0].amplitude == pytest.approx(0.5, abs=0.03)
    assert abs(fit.constants["m"] - 2.0) < 0.5 * abs(alone.constants["m"] - 2.0)
    # It is the best there is, from wherever it starts.
    again = fit_model([o], whiteners, model.constants, steps, model.candidates(), start=true)
    assert fit.square == pytest.approx(again.square, rel=1e-4)
    assert fit.constants["m"] == pytest.approx(again.constants["m"], abs=0.01)


def left_share(on, base, id) -> float | None:
    """What a response leaves of the change by a small amplitude, as a share; None where nothing acts."""
    declared = effect(id)
    shape = declared.default_shape()
    response = on.response(id, shape, VALUES)
    amplitude = 1e-3 * declared.amplitude.tactical[1]
    # The signature of one that is not in proportion is that of its usual amplitude.
    amplitude = declared.amplitude.typical() if declared.amplitudes else amplitude
    changed = on.output(VALUES, (EffectValue(id, amplitude, shape),)) - base
    size = float(np.sqrt(np.mean(response**2)))
    if size == 0.0:
        np.testing.assert_allclose(changed, 0.0, atol=1e-9)
        return None
    return float(np.sqrt(np.mean((changed / amplitude - response) ** 2))) / size


def test_a_response_is_what_a_small_amplitude_changes(on):
    base, checked = on.output(VALUES), 0
    for id in TwinModel(TWIN).candidates():
        if isinstance(effect(id), NoiseEffect) or id == "sensor_quantisation":
            continue
        share = left_share(on, base, id)
        if share is not None:
            # A sensor's own noise is in the replay's slope and kept out of the response.
            assert share <= (0.3 if isinstance(effect(id), SensorEffect | ThermalEffect) else 0.05), id
            checked += 1
    assert checked >= 25


def test_the_response_of_a_coarse_sensor_is_what_its_steps_change():
    coarse = TWIN.with_effect("sensor_quantisation", 0.0625)
    on = TwinModel(TWIN).on(coarse.simulate(load_programme(STEPS), sample_s=10.0, seed=1).run)
    assert left_share(on, on.output(VALUES), "sensor_quantisation") <= 0.3


def test_good_sensors_are_no_coarse_ones_but_part_of_any_recording(run, on):
    rounded = {name: 0.01 * np.rint(run.columns[name] / 0.01) for name in run.temperature_columns}
    good = TwinModel(TWIN).on(Run.from_columns("good", **{**run.columns, **rounded}))
    assert not good.response("sensor_quantisation", {}, VALUES).any()
    assert not on.response("sensor_quantisation", {}, VALUES).any()
    hidden = good.nuisances(VALUES)["steps of the sensors"]
    assert 0.0 < np.abs(hidden).max() <= 0.02
    coarse = {name: 0.05 * np.rint(run.columns[name] / 0.05) for name in run.temperature_columns}
    coarse = TwinModel(TWIN).on(Run.from_columns("coarse", **{**run.columns, **coarse}))
    assert "steps of the sensors" not in coarse.nuisances(VALUES)
    assert coarse.response("sensor_quantisation", {}, VALUES).any()


def test_candidates_are_those_that_are_not_on():
    every = TwinModel(TWIN).candidates()
    assert all(isinstance(c, Candidate) for c in every.values())
    assert all(c.id == id and c.title for id, c in every.items())
    with_one = TwinModel(TWIN.with_effect("thermal_hysteresis")).candidates()
    assert set(every) - set(with_one) == {"thermal_hysteresis"}


def test_reading_noise_is_the_scatter_of_replays_of_noisy_temperatures(run):
    time = np.arange(0.0, 8000.0, 10.0)
    rate = np.where((time > 3000.0) & (time < 3600.0), 20.0, 0.0)
    smooth = 30.0 + 20.0 * np.sin(time / 2000.0)
    rng = np.random.default_rng(0)
    deviation = 0.02

    def noisy():
        T = smooth + deviation * rng.standard_normal(len(time))
        return Run.from_columns("n", time=time, gyro=np.zeros(len(time)), T=T, rate=rate)

    values = {**ZERO, "b1": 0.5, "k1": 20.0}
    outputs = np.array([TwinModel(TWIN).on(noisy()).output(values) for _ in range(30)])
    told = TwinModel(TWIN).on(noisy()).reading_noise(values)
    still = rate == 0.0
    for part in (still, ~still):
        assert np.median(told[part]) == pytest.approx(np.median(outputs.std(axis=0)[part]), rel=0.2)


def test_a_delays_response_does_not_hold_the_noise_of_the_readings_twice(run):
    shape = {"growth": 0.0, AT_AMPLITUDE: 20.0}
    rng = np.random.default_rng(4)
    noisy = run.with_columns(
        **{name: run.columns[name] + 0.05 * rng.standard_normal(len(run)) for name in run.temperature_columns}
    )
    clean, found = (TwinModel(TWIN).on(r).response("logger_skew", shape, VALUES) for r in (run, noisy))
    replayed = [
        TwinModel(TWIN).on(noisy).output(VALUES, effects)
        for effects in ((EffectValue("logger_skew", 20.0, {"growth": 0.0}),), ())
    ]
    # Between turns the table tells nothing, and a difference of two replays is mostly noise.
    still = ~np.convolve(np.abs(run.rate) > 0.0, np.ones(7), mode="same").astype(bool)
    off, twice = (np.std((x - clean)[still]) for x in (found, (replayed[0] - replayed[1]) / 20.0))
    assert off < 0.4 * twice


def test_nuisances_have_the_same_names_on_every_run_and_follow_the_rate(on):
    late = on.nuisances(VALUES)
    assert late and all(np.isfinite(v).all() for v in late.values())
    other = TwinModel(TWIN).on(TWIN.simulate(load_programme(STEPS), sample_s=20.0, seed=2).run)
    assert set(other.nuisances(VALUES)) == set(late)
    assert not any(np.any(v) for v in on.nuisances(ZERO).values())


def test_the_twin_that_is_written_replays_what_was_found(tmp_path, run):
    values = (EffectValue("thermal_hysteresis", 0.2, {"half_width": 6.0}),)
    path = tmp_path / "twin.yaml"
    noise = NoisePrior(0.004, 0.02, 0.006, 1.1, 1.5, 2.0)
    TwinModel(TWIN).write(path, VALUES, values, noise, {"b0": 0.01, "e0": 2.0})
    written = load_twin(path)
    np.testing.assert_allclose(replay(written, run), TwinModel(TWIN).on(run).output(VALUES, values))
    again = TwinModel(written)
    assert {c.name: (c.mean, c.sd) for c in again.constants}["b0"] == (1.0, 0.01)
    assert (again.noise.N, again.noise.factor_B) == pytest.approx((0.004, 1.5))
    assert "thermal_hysteresis" not in again.candidates()


def test_values_beyond_what_is_physical_are_written_within_it(tmp_path):
    path = tmp_path / "twin.yaml"
    wild = (EffectValue("thermal_hysteresis", 0.1, {"half_width": -3.0}),)
    TwinModel(TWIN).write(path, VALUES, wild, NoisePrior(0.004, 0.02, 0.006), {})
    assert load_twin(path).settings["thermal_hysteresis"].shape["half_width"] > 0.0


def test_a_run_without_temperature_is_refused():
    run = Run.from_columns("bare", time=np.arange(900.0), gyro=np.zeros(900))
    with pytest.raises(InputError, match="bare: holds no temperature"):
        TwinModel(TWIN).on(run)


def test_other_orders_differ_where_a_node_was_not_recorded_and_only_there(run):
    kept = {name: c for name, c in run.columns.items() if name in ("time", "gyro", "T_in", "T_out", "rate")}
    model = TwinModel(TWIN)
    bare = model.on(Run(run.name, kept, run.facts, run.gyro_unit))
    for id in ("shupe_mohr", "deadband", "sensor_lag", "rate_ramp"):
        assert bare.other_orders(id, _usual(id), VALUES) == []
    for id in ("pigtail_shupe", "polarization_nonreciprocity", "source_wavelength"):
        own = bare.response(id, _usual(id), VALUES)
        others = bare.other_orders(id, _usual(id), VALUES)
        differ = [np.linalg.norm(other - own) / np.linalg.norm(own) for other in others]
        assert len(differ) == 2
        assert 1e-6 < max(differ) < 0.7, id
    # Where all nodes are recorded there is nothing that another order could change.
    whole = model.on(run.with_columns(**dict.fromkeys(_every_node(), run.columns["T_in"])))
    assert whole.other_orders("pigtail_shupe", _usual("pigtail_shupe"), VALUES) == []


def _every_node() -> tuple[str, ...]:
    return tuple(name for name in STAND_INS if name != "T")


def _usual(id: str) -> dict[str, float]:
    return usual_shape(effect(id), TWIN.grade)
