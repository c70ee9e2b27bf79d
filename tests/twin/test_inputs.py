"""What effects are offered: stand-ins, rates, drives at rest, angle, power-on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.facts import Direction, Facts
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory

TIME = np.arange(0.0, 1000.0, 10.0)
RAMP = 25.0 + TIME / 60.0


def inputs(**temperatures: np.ndarray) -> Inputs:
    return Inputs(TIME, temperatures, np.zeros(100))


def test_a_place_without_a_node_is_read_from_the_nearest() -> None:
    given = inputs(T_in=RAMP, T_out=RAMP + 1.0)
    places = ("T", "T_hub", "T_case", "T_electronics", "T_chamber", "T_plate")
    assert [given.place(name) for name in places] == ["T_in", "T_in", "T_out", "T_out", "T_out", "T_out"]
    assert inputs(T=RAMP).place("T_electronics") == "T"
    assert inputs(T=RAMP).place("T_leads") is None
    assert not inputs(T=RAMP).gradient.any()


def test_a_place_without_any_stand_in_is_an_error() -> None:
    with pytest.raises(InputError, match=r"no temperature 'T_in' is recorded .*; there is T_case"):
        inputs(T_case=RAMP).temperature("T_in")


def test_rates_are_worked_out_once_a_block() -> None:
    given = inputs(T=RAMP)
    assert given.dT("T_in") is given.dT("T") is given.afresh().dT("T_case")
    assert given.dT()[1:] == pytest.approx(1.0)


def test_afresh_forgets_what_an_effect_remembered() -> None:
    given = inputs(T=RAMP)
    first = given.memory.play("x", RAMP, 2.0)
    assert given.afresh().memory.play("x", RAMP, 2.0).tolist() == first.tolist()
    assert given.memory.play("x", RAMP, 2.0).tolist() != first.tolist()


def test_drives_at_rest() -> None:
    given = inputs(T=RAMP)
    assert set(given.drive("fan")) == {1.0} and set(given.drive("supply")) == {0.0}
    recorded = replace(given, drives={"fan": TIME})
    assert recorded.drive("fan") is TIME


def test_angle_is_recorded_or_integrated() -> None:
    given = replace(inputs(T=RAMP), table_rate=np.full(100, 0.5))
    assert given.angle_deg == pytest.approx(0.5 * TIME)
    assert replace(given, drives={"angle": TIME}).angle_deg is TIME
    memory, pieces = Memory(), []
    for part in (slice(0, 33), slice(33, 100)):
        block = Inputs(TIME[part], {}, given.table_rate[part], memory=memory)
        pieces += [
            block.angle_deg,
        ]
        assert block.angle_deg is pieces[-1]
    assert np.concatenate(pieces) == pytest.approx(0.5 * TIME)


def test_time_since_the_latest_power_on() -> None:
    assert np.isinf(inputs(T=RAMP).time_on_s).all()
    given = replace(inputs(T=RAMP), powered_on_s=-40.0, power_ons_s=(200.0, 700.0))
    assert given.time_on_s[[0, 19, 20, 69, 70]].tolist() == [40.0, 230.0, 0.0, 490.0, 0.0]
    assert given.power_cycle[[0, 19, 20, 70]].tolist() == [0, 0, 1, 2]
    assert replace(given, powered_on_s=150.0).time_on_s[0] == 0.0


def test_angle_of_a_table_that_is_not_square_to_the_axis() -> None:
    """A table tilted by 60 deg turns twice as fast as the rate about the input axis that is recorded."""
    facts = Facts(input_axis="up", table_axis=Direction(heading=0.0, elevation=30.0))
    given = Inputs(np.arange(10.0), {}, np.full(10, 3.0), facts=facts)
    np.testing.assert_allclose(given.angle_deg, 6.0 * np.arange(10.0))
    np.testing.assert_allclose(given.turning_deg_s, 6.0)
