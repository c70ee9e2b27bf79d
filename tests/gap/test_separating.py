"""Distances between effects, and the programmes that pull them apart."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from fogml.errors import InputError
from fogml.gap.model import EffectValue
from fogml.gap.planning.programme_family import Design, Family
from fogml.gap.planning.rehearsal import Rehearsal, stage
from fogml.gap.planning.separating import LEAST_DISTANCE, _gain, distances, members_of, separating_run
from fogml.runs.facts import Facts
from fogml.signals.noise_model import NoiseModel
from fogml.twin.programme import load_programme
from fogml.twin.twin_file import load_twin

TWIN = load_twin("nominal")
NOISE = NoiseModel(0.005, 0.01, 0.005)
CONSTANTS = {"e0": 100.0, "k1": 10.0, "k2": 0.1, "b0": 1.0, "b1": 0.05, "b2": 5e-4, "g": 0.3, "m": 1.0}
FACTS = Facts(latitude=39.9, input_axis="up")
HYSTERESIS = EffectValue("thermal_hysteresis", 0.2, {"half_width": 8.0})
RELAXATION = EffectValue("stress_relaxation", 0.004, {"time_constant": 3600.0, "slow_share": 0.3})
# Both follow the heat's way in; only heat from within goes another way.
ELECTRONICS = EffectValue("electronic_crosstalk", 0.06)
PLATE = EffectValue("hidden_thermal_node", 0.4, {"time_constant": 600.0})


@pytest.fixture(scope="module")
def rehearsed():
    on = stage(TWIN, NOISE, CONSTANTS, facts=FACTS)
    family = Family()
    return on, family, Rehearsal(on, family, Design(rates=(0.5, 2.0, None)))


def _left(rehearsal, true, columns):
    """Length of what is left by dense least squares, priors as rows of their own."""
    fixed = np.concatenate([rehearsal.constants, rehearsal.nuisances], axis=1)
    zeros = np.zeros(fixed.shape[1])
    left = np.block([[fixed, columns], [np.eye(len(zeros)), np.zeros((len(zeros), columns.shape[1]))]])
    target = np.concatenate([true, zeros])
    scale = np.linalg.norm(left, axis=0)
    best = np.linalg.lstsq(left / scale, target, rcond=1e-12)[0]
    return float(np.linalg.norm(target - (left / scale) @ best))


def test_length_beside_the_constants_is_that_of_least_squares(rehearsed):
    on, family, rehearsal = rehearsed
    (length,) = distances(rehearsal, members_of(on, family, [HYSTERESIS])).ravel()
    true = HYSTERESIS.amplitude * rehearsal.white(HYSTERESIS.id, [HYSTERESIS.shape])[:, 0]
    assert length == pytest.approx(_left(rehearsal, true, np.empty((len(true), 0))), rel=1e-5)


def test_distance_is_what_the_best_of_a_dense_grid_leaves(rehearsed):
    on, family, rehearsal = rehearsed
    found = distances(rehearsal, members_of(on, family, [HYSTERESIS, RELAXATION]), refined=True)
    true = RELAXATION.amplitude * rehearsal.white(RELAXATION.id, [RELAXATION.shape])[:, 0]
    dense = min(
        _left(rehearsal, true, rehearsal.white("thermal_hysteresis", [{"half_width": width}]))
        for width in np.geomspace(3.0 / 1.5, 20.0 * 1.5, 150)
    )
    assert found[1, 0] == pytest.approx(dense, rel=5e-3)
    # Another effect can take off some of a response, never add to it.
    assert (found <= np.diag(found)[:, None] + 1e-9).all()


def test_distance_goes_with_the_amplitude(rehearsed):
    on, family, rehearsal = rehearsed
    once = distances(rehearsal, members_of(on, family, [HYSTERESIS, RELAXATION]))
    larger = replace(HYSTERESIS, amplitude=-2.5 * HYSTERESIS.amplitude)
    more = distances(rehearsal, members_of(on, family, [larger, RELAXATION]))
    np.testing.assert_allclose(more, once * [[2.5], [1.0]], rtol=1e-6)


def test_noise_twice_as_large_halves_the_distance_at_most(rehearsed):
    on, family, once = rehearsed
    told = members_of(on, family, [HYSTERESIS, RELAXATION])
    louder = stage(TWIN, NoiseModel(0.01, 0.02, 0.01), CONSTANTS, facts=FACTS)
    more = distances(Rehearsal(louder, family, Design(rates=(0.5, 2.0, None))), told)
    first = distances(once, told)
    # Priors count for more beside louder noise.
    assert (more < first).all() and (more > 0.499 * first).all()


def test_only_heat_from_within_separates_electronics_and_plate():
    on, ask = stage(TWIN, NOISE, CONSTANTS, facts=FACTS), {"most": 60, "seed": 4}
    found = separating_run(on, Family(), [ELECTRONICS, PLATE], **ask)
    assert found is not None and found.distance >= LEAST_DISTANCE
    assert "power" in "".join(found.steps)
    assert separating_run(on, Family(power_steps=False), [ELECTRONICS, PLATE], **ask) is None


def test_a_separating_run_is_ready_to_simulate_and_repeats():
    north = FACTS.model_copy(update={"input_axis": "north"})
    on, family = stage(TWIN, NOISE, CONSTANTS, facts=north), Family(14.0, mountings=(None,))
    found = separating_run(on, family, [HYSTERESIS, RELAXATION], seed=5, most=15)
    again = separating_run(on, family, [HYSTERESIS, RELAXATION], seed=5, most=15)
    assert found is not None and found == again
    programme = load_programme(yaml.safe_load(found.programme))
    assert programme.total_hours == pytest.approx(found.hours) and found.hours <= 14.0
    assert found.separates == ("thermal_hysteresis", "stress_relaxation")
    run = TWIN.simulate(programme, sample_s=60.0).run
    # Nothing else is stated to simulate it as it is mounted.
    assert run.facts.input_axis == "north"
    assert np.ptp(run.temperature()) > 10.0
    for other in found.alternatives:
        shorter = load_programme(yaml.safe_load(other["programme"])).total_hours
        assert shorter == pytest.approx(other["hours"])
        # Nothing is a runner-up that takes longer and gives less.
        assert shorter < found.hours or other["distance"] > found.distance


def test_a_single_effect_is_to_be_shown_and_a_small_one_cannot_be():
    on, family = stage(TWIN, NOISE, CONSTANTS, facts=FACTS), Family(8.0)
    found = separating_run(on, family, [HYSTERESIS], most=15)
    assert found is not None and found.separates == ("thermal_hysteresis",)
    small = replace(HYSTERESIS, amplitude=1e-4)
    assert separating_run(on, family, [small], most=15) is None
    # In the span of the nominal constants nothing helps.
    assert separating_run(on, family, [EffectValue("coil_expansion", 5.0)], most=15) is None


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ([], "no effect is given"),
        ([HYSTERESIS, HYSTERESIS], "named twice"),
        ([EffectValue("thermal_histeresis", 1.0)], "did you mean 'thermal_hysteresis'"),
        ([EffectValue("thermal_hysteresis", 0.0)], "a size of 0"),
    ],
)
def test_what_cannot_be_separated_is_refused(members, message):
    with pytest.raises(InputError, match=message):
        separating_run(stage(TWIN, NOISE, CONSTANTS), Family(), members)


@pytest.mark.parametrize(("limits", "gain"), [((0.0, 2.0), 0.0), ((-2.0, 1.0), 4.5)])
def test_an_amplitude_that_can_only_be_positive_takes_nothing_off_a_negative_response(limits, gain):
    candidate = SimpleNamespace(amplitude=SimpleNamespace(signed=False, limits=limits))
    gram = np.array([[2.0]])
    assert _gain(gram, np.array([-3.0]), candidate) == gain
    assert _gain(gram, np.array([3.0]), candidate) == 4.5
