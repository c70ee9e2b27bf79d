"""Units drawn from priors, and repeats of one unit."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy.stats import kstest

from fogml.errors import InputError
from fogml.twin.draws import draw_units, repeat_unit
from fogml.twin.effect import BiasEffect
from fogml.twin.quantities import Quantity
from fogml.twin.registry import effect, register, unregister
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin, twin_dict


class DrawnEachTime(BiasEffect):
    """A bias that is another one each time that the unit is used.

    ::

        b = A

    Source: none.
    """

    id, code, title = "drawn_each_time", "Z1", "Bias of a use"
    amplitude = Quantity("amplitude", "deg/h", (0.1, 1.0), (0.01, 0.1), "A", (-10.0, 10.0), signed=True)
    drawn_per_run = True

    def signature(self, inputs, **shape):
        return np.ones(len(inputs))


DRAWN = DrawnEachTime


@pytest.fixture(autouse=True)
def drawn_each_time():
    register(DRAWN)
    yield
    unregister(DRAWN.id)


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


def test_no_direction_is_more_usual_than_others():
    """A normal law over the circle has 1.8 times as many at 180 deg as at 0 (p = 2e-11)."""
    twin = Twin().with_effect("table_wobble")
    phases = [unit.constants.settings["table_wobble"].shape["phase"] for unit in draw_units(twin, 4000)]
    assert kstest(np.mod(phases, 360.0) / 360.0, "uniform").pvalue > 1e-3


def test_repeats_share_all_but_what_each_use_draws():
    """What a simulation draws from its seed stays with the unit; other draws differ from use to use."""
    unit = load_twin("tactical").with_effect("sinusoidal").with_effect(DRAWN.id, 0.4)
    first, second = repeat_unit(unit, 2, seed=1)
    for twin in (first, second):
        assert twin.nominal == unit.nominal and twin.noise == unit.noise
        for id, setting in unit.settings.items():
            assert (twin.settings[id] == setting) == (id != DRAWN.id)
    assert first.settings[DRAWN.id] != second.settings[DRAWN.id]


def test_repeats_scatter_by_the_stated_deviation():
    drawn = [
        t.settings[DRAWN.id].amplitude for t in repeat_unit(Twin().with_effect(DRAWN.id, 0.4), 500, seed=1)
    ]
    assert np.mean(drawn) == pytest.approx(0.0, abs=0.07)
    assert np.std(drawn) == pytest.approx(0.4, rel=0.12)


def test_repeats_of_a_unit_scatter_by_the_seeds_of_their_simulations():
    unit = Twin().with_effect("turn_on_bias", 0.4)
    assert repeat_unit(unit, 2)[1].settings == unit.settings
    means = [
        simulate(["hold for 20 s"], twin, seed=seed, columns=()).run.gyro.mean()
        for seed, twin in enumerate(repeat_unit(unit, 200))
    ]
    assert np.std(means) == pytest.approx(0.4, rel=0.15)


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
    with pytest.raises(InputError, match="'count' is 0"):
        draw_units(Twin(), 0)
    with pytest.raises(InputError, match="'repeats' is 0"):
        repeat_unit(replace(Twin(), name="x"), 0)
