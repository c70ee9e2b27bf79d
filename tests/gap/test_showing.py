"""Programmes that show what runs so far could not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from fogml.gap.model import EffectValue
from fogml.gap.planning.fisher import usual_value
from fogml.gap.planning.next_run import lengths, showing_run
from fogml.gap.planning.programme_family import Design, Family
from fogml.gap.planning.rehearsal import Rehearsal, stage
from fogml.gap.planning.separating import LEAST_DISTANCE, distances, members_of
from fogml.runs.facts import Facts
from fogml.signals.noise_model import NoiseModel
from fogml.twin.programme import load_programme
from fogml.twin.replay import Replayer
from fogml.twin.set_up import Sensors
from fogml.twin.twin_file import load_twin

TWIN = load_twin("nominal")
NOISE = NoiseModel(0.005, 0.01, 0.005)
CONSTANTS = {"e0": 100.0, "k1": 10.0, "k2": 0.1, "b0": 1.0, "b1": 0.05, "b2": 5e-4, "g": 0.3, "m": 1.0}
FACTS = Facts(latitude=39.9, input_axis="up")


def test_lengths_are_those_of_a_search_for_separating_runs():
    on, family = stage(TWIN, NOISE, CONSTANTS, facts=FACTS), Family()
    rehearsal = Rehearsal(on, family, Design(rates=(0.5, 2.0, None), ladder="rates"))
    values = [usual_value(on, id) for id in ("thermal_hysteresis", "sf_asymmetry")]
    wanted = [distances(rehearsal, members_of(on, family, [value]))[0, 0] for value in values]
    np.testing.assert_allclose(lengths(rehearsal, values), wanted, rtol=1e-6)


def test_the_length_of_a_dead_zone_is_that_at_its_own_size():
    facts = FACTS.model_copy(update={"input_axis": "east"})
    plain = replace(TWIN.with_nominal(**dict.fromkeys(CONSTANTS, 0.0)), sensors=Sensors())
    on, family = stage(plain, NOISE, dict.fromkeys(CONSTANTS, 0.0), facts=facts), Family()
    rehearsal = Rehearsal(on, family, Design(mounting=None, ladder="slow rates"))
    for size in (0.02, 0.5):
        replayer = Replayer(rehearsal.rows.run)
        made = replayer.output(plain.with_effect("deadband", size)) - replayer.output(plain)
        white = rehearsal._whiten(made[rehearsal.rows.kept][:, None])
        expected = np.sqrt(rehearsal.beside(white)[0, 0])
        value = EffectValue("deadband", size)
        assert lengths(rehearsal, [value])[0] == pytest.approx(expected, rel=1e-6)
        assert distances(rehearsal, members_of(on, family, [value]))[0, 0] == pytest.approx(
            expected, rel=1e-6
        )


def test_what_needs_turns_or_a_changed_temperature_gets_them():
    ids = ["sf_asymmetry", "thermal_hysteresis", "coil_expansion", "sensor_quantisation"]
    on, family = stage(TWIN, NOISE, CONSTANTS, facts=FACTS), Family(12.0)
    found = showing_run(on, family, ids, most=40)
    # An expansion of the coil is one with the nominal scale factor, and steps are read off a record.
    assert found is not None and found.separates == ("sf_asymmetry", "thermal_hysteresis")
    assert found.distance >= LEAST_DISTANCE and found.hours <= 12.0
    text = "; ".join(found.steps)
    assert "turn" in text and "ramp" in text
    assert load_programme(yaml.safe_load(found.programme)).total_hours == pytest.approx(found.hours)
    assert showing_run(on, family, ids, most=40) == found


def test_where_no_programme_helps_none_is_told():
    on = stage(TWIN, NOISE, CONSTANTS, facts=FACTS)
    assert showing_run(on, Family(), ["coil_expansion"], most=10) is None
    assert showing_run(on, Family(), ["sensor_quantisation"], most=10) is None
