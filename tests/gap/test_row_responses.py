"""Responses on rows: taken on means of the inputs where that gives what the samples give, and only there."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap.assumptions import assumptions
from fogml.gap.model import Decimating
from fogml.gap.observation import Observation, observe
from fogml.gap.row_responses import blocks_of_all, parts_of_blocks
from fogml.gap.shapes import AT_AMPLITUDE, is_angle, usual_shape
from fogml.gap.twin_model import TwinModel
from fogml.runs.run import Run
from fogml.twin.programme import load_programme
from fogml.twin.twin_file import load_twin
from tests.gap.small_model import MEANS, OnRun, SmallModel

MODEL = TwinModel(load_twin("nominal"))
VALUES = {c.name: c.mean + 0.5 * c.sd for c in MODEL.constants}
TURNS = ["turn at 5 deg/s for 61 s, then -5 deg/s for 61 s, from minute 7"]
STEPS = [
    {"soak at 25 degC for 20 min": TURNS},
    "ramp to 60 degC at 2 degC/min",
    {"soak at 60 degC for 20 min": TURNS},
    "ramp to -10 degC at 1.5 degC/min",
    "soak at -10 degC for 20 min",
]
BEND = {"centre_temperature": 20.0, "width": 5.0}
GAP = slice(3000, 3500)
SLOW = {
    "ageing",
    "bias_polynomial",
    "glass_transition",
    "hidden_thermal_node",
    "sf_hysteresis",
    "stress_relaxation",
    "thermal_hysteresis",
}
FAST = {"sf_nonlinearity", "table_rate_error", "azimuthal_gradient", "magnetic", "deadband", "logger_skew"}
READINGS = {"sensor_lag", "sensor_quantisation", "sensor_placement", "sinusoidal", "chamber_pickup"}


@pytest.fixture(scope="module")
def run() -> Run:
    whole = MODEL.twin.simulate(load_programme(STEPS), sample_s=1.0, seed=1).run
    columns = {name: np.delete(values, GAP) for name, values in whole.columns.items()}
    return Run(whole.name, columns, whole.facts, whole.gyro_unit)


@pytest.fixture(scope="module")
def o(run) -> Observation:
    return observe(run, MODEL, largest_rows=1000)


def averaged(o: Observation, id, shape):
    return o.averaged(o.model.response(id, shape, VALUES))


def usual(id) -> dict[str, float]:
    candidate = MODEL.candidates()[id]
    at = {AT_AMPLITUDE: 10.0} if getattr(candidate, "amplitudes", ()) else {}
    return usual_shape(candidate, "tactical") | at


def shapes_of(candidate, rng) -> list[dict[str, float]]:
    """The usual shape, a few drawn from the usual range, and angles turned."""
    drawn = [{q.name: float(rng.uniform(*q.range("tactical"))) for q in candidate.shape} for _ in range(3)]
    turned = [{q.name: 40.0 for q in candidate.shape if is_angle(q)}]
    more = ({}, *drawn, *turned) if candidate.shape else ({},)
    return [usual(candidate.id) | changed for changed in more]


def test_every_candidates_response_is_the_mean_of_what_the_samples_give(o):
    assert o.width > 5 and len(o.run.stretches) == 2
    rng = np.random.default_rng(0)
    for id, candidate in MODEL.candidates().items():
        for shape in shapes_of(candidate, rng):
            wanted, taken = averaged(o, id, shape), o.response(id, shape, VALUES)
            assert np.linalg.norm(taken - wanted) <= 1e-2 * np.linalg.norm(wanted), (id, shape)


def test_slow_effects_are_taken_on_means_and_those_of_the_table_and_of_readings_are_not(o):
    for id in SLOW | FAST | READINGS:
        o.response(id, usual(id), VALUES)
    assert o.responses.on_means >= SLOW
    assert not (FAST | READINGS) & o.responses.on_means


def test_an_effect_of_the_rate_is_taken_on_means_where_the_table_stands_still(run):
    kept = {name: values for name, values in run.columns.items() if name not in ("rate", "angle")}
    still = observe(Run("still", kept), MODEL, largest_rows=1000)
    still.response("sf_nonlinearity", usual("sf_nonlinearity"), VALUES)
    assert still.responses.on_means == {"sf_nonlinearity"}


def test_rows_of_one_sample_and_models_without_means_are_as_they_were(run):
    single = observe(run[:3000], MODEL)
    assert single.width == 1
    for id in ("thermal_hysteresis", "stress_relaxation", "glass_transition"):
        shape = usual(id)
        np.testing.assert_array_equal(single.response(id, shape, VALUES), averaged(single, id, shape))
    small = observe(run, SmallModel(), largest_rows=1000)
    assert not isinstance(small.model, Decimating)
    wanted = small.averaged(small.model.response("bend", BEND, MEANS))
    np.testing.assert_array_equal(small.response("bend", BEND, MEANS), wanted)
    assert not single.responses.on_means | small.responses.on_means


class OnSmallRun(OnRun):
    """The small model on a run, which trusts the means of what is bent."""

    def shapes_to_compare(self, id):
        return (BEND,) if id == "bend" else ()

    def on_means(self, starts):
        counts = np.diff(starts, append=len(self.run))
        means = {name: np.add.reduceat(c, starts) / counts for name, c in self.run.columns.items()}
        return OnRun(Run.from_columns("means", **means))


class MeansModel(SmallModel):
    def on(self, run):
        return OnSmallRun(run)


def test_what_means_would_blur_is_averaged_from_the_samples():
    time = np.arange(0.0, 3000.0)
    smooth = 20.0 + 10.0 * np.sin(time / 300.0)
    for temperature, held in ((smooth, {"bend"}), (smooth + 8.0 * (-1.0) ** np.arange(3000), set())):
        o = observe(
            Run.from_columns("r", time=time, gyro=0.0 * time, T=temperature), MeansModel(), largest_rows=500
        )
        wanted = o.averaged(o.model.response("bend", BEND, MEANS))
        taken = o.response("bend", BEND, MEANS)
        o.response("cube", {}, MEANS)
        assert o.responses.on_means == held
        np.testing.assert_allclose(taken, wanted, atol=0.0 if not held else 2e-3)


def test_responses_that_stay_as_they_are_are_kept_for_other_constants(run, monkeypatch):
    o = observe(run, MODEL, largest_rows=1000)
    others = {name: 2.0 * value for name, value in VALUES.items()}
    asked = []
    respond = type(o.model).response
    monkeypatch.setattr(
        type(o.model), "response", lambda on, id, *more: asked.append(id) or respond(on, id, *more)
    )
    for id in ("shupe_pure", "deadband", "sensor_lag", "logger_skew"):
        shapes = [usual(id), usual(id)]
        for values in (VALUES, others):
            found = o.responses.at(id, shapes, values)
            wanted = [o.averaged(respond(o.model, id, shape, values)) for shape in shapes]
            np.testing.assert_allclose(found, np.column_stack(wanted), rtol=1e-9, atol=1e-12)
        asked.clear()
        o.responses.at(id, shapes, others)
        # Those of the output, or of its slopes, are other ones at other constants.
        assert bool(asked) == (id != "shupe_pure"), id
    # Other shapes are not taken for those that are kept.
    other = o.responses.at("hidden_thermal_node", [usual("hidden_thermal_node")], VALUES)
    changed = {name: 1.5 * value for name, value in usual("hidden_thermal_node").items()}
    assert not np.allclose(o.responses.at("hidden_thermal_node", [changed], VALUES), other)


def test_of_other_shapes_than_the_first_the_latest_are_kept(run, monkeypatch):
    o = observe(run, MODEL, largest_rows=1000)
    sets = [[{"time_constant": 100.0 * k}] for k in range(1, 6)]
    for shapes in sets:
        o.responses.at("hidden_thermal_node", shapes, VALUES)
    asked = []
    monkeypatch.setattr(type(o.responses), "of", lambda on, id, shape, values: asked.append(shape) or o.time)
    for shapes in (sets[0], sets[3], sets[4]):
        o.responses.at("hidden_thermal_node", shapes, VALUES)
    assert not asked
    o.responses.at("hidden_thermal_node", sets[1], VALUES)
    assert asked == sets[1]


def test_no_more_responses_are_kept_than_there_is_room_for(run, monkeypatch):
    from fogml.gap import row_responses

    o = observe(run, MODEL, largest_rows=1000)
    monkeypatch.setattr(row_responses, "MOST_KEPT_BYTES", 8.0 * len(o))
    for id in ("shupe_pure", "ageing"):
        o.responses.at(id, [usual(id)], VALUES)
    assert set(o.responses._kept) == {"shupe_pure"}


def test_the_result_says_what_was_taken_on_means(run):
    def said(o) -> str:
        noise = SimpleNamespace(source="these runs")
        prepared = SimpleNamespace(fit=[o], model=MODEL, noise=noise)
        return " ".join(assumptions(prepared, SimpleNamespace(within_constants=())))

    o = observe(run, MODEL, largest_rows=1000)
    assert "averaged before the search" in said(o) and "averaged inputs" not in said(o)
    o.response("thermal_hysteresis", usual("thermal_hysteresis"), VALUES)
    assert "averaged inputs" in said(o)


def test_blocks_hold_every_sample_and_begin_with_each_stretch(o):
    starts = blocks_of_all(o.run, o.width, o.starts)
    assert set(o.starts) <= set(starts)
    assert {part.start for part in o.run.stretches} <= set(starts)
    lengths = np.diff(starts, append=len(o.run))
    assert lengths.min() >= 1 and lengths.max() == o.width
    parts = parts_of_blocks(starts, len(o.run), 3)
    assert set(starts) <= set(parts)
    assert np.diff(parts, append=len(o.run)).max() == -(-o.width // 3)
