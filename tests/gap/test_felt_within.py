"""Room for an effect that is felt deeper within the gyro than its temperature is measured."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fogml.gap.basis import build_basis
from fogml.gap.dictionary import unknown_groups
from fogml.gap.evidence import Field, Term
from fogml.gap.felt_within import within_columns
from fogml.gap.priors import SLACK_FROM
from fogml.gap.search import Search
from fogml.gap.shapes import usual_shape
from fogml.gap.twin_model import TwinModel
from fogml.runs.run import Run
from fogml.twin.effect import NoiseEffect
from fogml.twin.programme import load_programme
from fogml.twin.registry import effect
from fogml.twin.twin_file import load_twin
from tests.gap.small_model import OnRun, SmallModel, dense, framed, noise_of, ramps

SIZE = 3.0
TWIN = load_twin("nominal")
VALUES = {"e0": 100.0, "k1": 5.0, "k2": 0.05, "b0": 1.0, "b1": 0.04, "b2": 5e-4, "g": 0.2, "m": 1.0}


def deeper(run):
    """The cube of a temperature that a ramp holds back by up to 3 degC, less that of what is measured."""
    ramp = np.gradient(run.temperature(), run.time)
    held_back = run.temperature() - 3.0 * ramp / np.abs(ramp).max()
    return ((held_back - 20.0) / 20.0) ** 3 - ((run.temperature() - 20.0) / 20.0) ** 3


class OnRunWithin(OnRun):
    """The model with a cube that may be felt deeper."""

    def felt_within(self, id, shape, constants):
        return deeper(self.run) if id == "cube" else None


class OnlyOnLong(OnRunWithin):
    """One that knows of it on one of the runs alone."""

    def felt_within(self, id, shape, constants):
        return super().felt_within(id, shape, constants) if len(self.run) > 250 else None


@dataclass(frozen=True)
class Within(SmallModel):
    """The small model with runs of one kind."""

    on_run: type[OnRun] = OnRunWithin

    def on(self, run):
        return self.on_run(run)


def searched(on_run, size=SIZE) -> Search:
    rng = np.random.default_rng(2)
    model, runs = Within(("cube", "bend", "line"), on_run=on_run), []
    for name, count, turns in (("a", 300, 2), ("b", 240, 3)):
        run = ramps(name, count=count, turns=turns)
        u = (run.temperature() - 20.0) / 20.0
        runs.append(run.with_columns(gyro=size * (u**3 + deeper(run)) + noise_of(run, rng)))
    frame = framed(runs, model)
    groups = unknown_groups(frame.observations)
    return Search(Field(build_basis(frame, model.candidates(), groups, model.grade)))


def node_of(search, id):
    return int(search.places[id][0])


@pytest.mark.parametrize("size", [1.0, SIZE])
def test_an_effect_felt_deeper_is_one_effect_and_nothing_besides(size):
    with_room, without = (
        max(searched(kind, size).run(), key=lambda e: e.log_posterior) for kind in (OnRunWithin, OnRun)
    )
    assert with_room.ids == {"cube"} and with_room.rest == "nothing"
    assert without.rest == "unknown"
    assert with_room.log_posterior > without.log_posterior + 10.0


def test_the_column_is_what_the_response_changes_by_less_what_its_size_holds():
    search = searched(OnRunWithin)
    frame, basis = search.field_.basis.frame, search.field_.basis
    place = node_of(search, "cube")
    node = basis.nodes[place]
    column = within_columns(basis, place)
    assert column.shape == (len(basis.rows), 1)

    # Whitened by dense covariances; the part along the response itself is its amplitude.
    parts = []
    for o in frame.observations:
        factor = np.linalg.cholesky(dense(o.run.time, o.run.sample_s))
        cube = ((o.run.temperature() - 20.0) / 20.0) ** 3
        parts.append(np.linalg.solve(factor, np.column_stack([deeper(o.run), cube])))
    change, cube = np.concatenate(parts).T
    left = change - cube * (change @ cube) / (cube @ cube)
    assert np.linalg.norm(column) == pytest.approx(node.size * np.linalg.norm(left), rel=1e-3)
    assert np.abs(column.T @ basis.rows[:, list(node.columns)]).max() < 1e-9 * np.linalg.norm(column) ** 2


def test_an_effect_has_it_on_every_run_or_on_none():
    for kind, id in ((OnlyOnLong, "cube"), (OnRun, "cube"), (OnRunWithin, "bend")):
        search = searched(kind)
        place = node_of(search, id)
        assert within_columns(search.field_.basis, place).shape == (len(search.field_.basis.rows), 0)
        assert search.field_.within(place) == ()


def test_large_effects_alone_have_it_of_whatever_form():
    search = searched(OnRunWithin)
    chosen = replace(search.best_node("cube", search.field_.condition([])), size=2.0 * SLACK_FROM)
    room = Term(search.field_.within(chosen.node), chosen.size)
    for exact in (True, False):
        assert room in search.parts.of([chosen], None, exact=exact)
        small = replace(chosen, size=0.9 * SLACK_FROM)
        assert len(search.parts.of([small], None, exact=exact)) == 1


@pytest.fixture(scope="module")
def chamber() -> Run:
    steps = ["soak at 25 degC for 20 min", "ramp to 50 degC at 1 degC/min", "soak at 50 degC for 20 min"]
    made = TWIN.simulate(load_programme(steps), sample_s=10.0, seed=3).run
    # Smooth readings: what a sensor's noise makes of a response is another matter.
    phase = 2.0 * np.pi * np.arange(len(made)) / len(made)
    smooth = {"T": 0.0, "T_in": 0.2, "T_out": -0.3}
    return made.with_columns(**{name: 30.0 - 10.0 * np.cos(phase - late) for name, late in smooth.items()})


@pytest.mark.parametrize(
    "id", ["thermal_hysteresis", "bias_polynomial", "shupe_mohr", "coil_expansion", "moisture"]
)
def test_of_the_twin_it_is_the_response_to_the_middle_of_the_winding(chamber, id):
    model, shape = TwinModel(TWIN), usual_shape(effect(id), TWIN.grade)
    columns = chamber.columns
    middle = chamber.with_columns(T=columns["T"] + 0.5 * (columns["T_out"] - columns["T_in"]))
    here, there = (model.on(run).response(id, shape, VALUES) for run in (chamber, middle))
    found = model.on(chamber).felt_within(id, shape, VALUES)
    if "T" not in effect(id).needs:
        assert found is None
    else:
        assert np.linalg.norm(there - here) > 1e-3 * np.linalg.norm(here)
        np.testing.assert_allclose(found, there - here, atol=1e-3 * np.abs(there - here).max())


def test_of_the_twin_sensors_the_logger_and_noise_have_none(chamber):
    on = TwinModel(TWIN).on(chamber)
    for id in TwinModel(TWIN).candidates():
        declared = effect(id)
        if isinstance(declared, NoiseEffect) or declared.stage in ("sensor", "logger"):
            assert on.felt_within(id, usual_shape(declared, TWIN.grade), VALUES) is None
