"""Units drawn from priors, and repeats of one unit."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.twin.registry import effect
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin, twin_dict
from fogml.twin.units import draw_units, repeat_unit


@pytest.fixture(scope="module")
def units():
    return draw_units(load_twin("tactical"), 400, repeats=2, seed=3)


def test_constants_follow_the_stated_priors(units):
    twin = load_twin("tactical")
    for name, mean in asdict(twin.nominal).items():
        sd = getattr(twin.nominal_sd, name)
        drawn = np.array([getattr(unit.constants.nominal, name) for unit in units])
        assert drawn.mean() == pytest.approx(mean, abs=4 * sd / np.sqrt(len(units))), name
        assert drawn.std() == pytest.approx(sd, rel=0.15), name
    for name in ("N", "B", "K"):
        logs = np.log([getattr(unit.constants.noise, name) for unit in units])
        assert logs.mean() == pytest.approx(np.log(getattr(twin.noise, name)), abs=0.06), name
        assert logs.std() == pytest.approx(np.log(1.3), rel=0.15), name
    # Known coefficients stay.
    assert {unit.constants.noise.Q for unit in units} == {twin.noise.Q}


def test_effects_follow_the_catalogue(units):
    low, high = effect("thermal_hysteresis").amplitude.tactical
    sizes = np.abs([unit.constants.settings["thermal_hysteresis"].amplitude for unit in units])
    assert np.mean((sizes >= low) & (sizes <= high)) == pytest.approx(0.9, abs=0.05)
    widths = {unit.constants.settings["thermal_hysteresis"].shape["half_width"] for unit in units}
    assert len(widths) == len(units)


def test_repeats_share_all_but_what_power_on_draws(units):
    for unit in units[:20]:
        first, second = unit.runs
        for twin in (first, second):
            assert twin.nominal == unit.constants.nominal and twin.noise == unit.constants.noise
            assert twin.name == unit.serial_number
            for id, setting in unit.constants.settings.items():
                if id == "turn_on_bias":
                    assert twin.settings[id].amplitude != setting.amplitude
                else:
                    assert twin.settings[id] == setting
        assert first.settings["turn_on_bias"] != second.settings["turn_on_bias"]


def test_repeats_scatter_by_the_stated_deviation():
    unit = Twin().with_effect("turn_on_bias", 0.4)
    drawn = [twin.settings["turn_on_bias"].amplitude for twin in repeat_unit(unit, 500, seed=1)]
    assert np.mean(drawn) == pytest.approx(0.0, abs=0.07)
    assert np.std(drawn) == pytest.approx(0.4, rel=0.12)


def test_a_unit_does_not_depend_on_how_many_there_are(units):
    again = draw_units(load_twin("tactical"), 3, repeats=3, seed=3)
    for few, many in zip(again, units):
        assert few.serial_number == many.serial_number
        assert twin_dict(few.constants) == twin_dict(many.constants)
        assert [twin_dict(run) for run in few.runs[:2]] == [twin_dict(run) for run in many.runs]
    other = draw_units(load_twin("tactical"), 1, seed=4)[0]
    assert other.constants.nominal != again[0].constants.nominal


def test_type_and_laboratory_stay(units):
    twin = load_twin("tactical")
    assert all(unit.constants.plant == twin.plant for unit in units)
    assert all(unit.constants.sensors == twin.sensors for unit in units)


def test_at_least_one():
    with pytest.raises(InputError, match="units: 0"):
        draw_units(Twin(), 0)
    with pytest.raises(InputError, match="repeats: 0"):
        repeat_unit(replace(Twin(), name="x"), 0)
