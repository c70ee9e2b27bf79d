"""The family of programmes: what it writes is what the twin's language reads, within the hours."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.gap.planning.lab import Lab
from fogml.gap.planning.programme_family import Design, Family
from fogml.gap.planning.programme_search import search
from fogml.twin.programme import programme_from

LAB = Lab()
designs = st.builds(
    Design,
    rates=st.tuples(*[st.sampled_from([None, *LAB.ramp_rates])] * 3),
    cold_share=st.sampled_from([0.25, 0.5, 1.0]),
    hot_share=st.sampled_from([0.25, 0.5, 1.0]),
    first=st.sampled_from(["cold", "hot"]),
    soak_s=st.sampled_from(LAB.soaks_s),
    stops=st.sampled_from([0, 1, 3]),
    minor_loop=st.booleans(),
    ladder=st.sampled_from(list(LAB.ladders)),
    power_steps=st.sampled_from(["none", "first", "each"]),
    cold_start=st.booleans(),
    fan_off=st.booleans(),
    compressor_off=st.booleans(),
    yaw=st.booleans(),
    mounting=st.sampled_from(["up", "north", None]),
)


@settings(max_examples=60, deadline=None)
@given(designs, st.floats(-80.0, 20.0), st.floats(30.0, 100.0))
def test_a_design_reads_back_as_the_same_programme(design, coldest, hottest):
    """Within the chamber's limits, which need not be whole degrees."""
    family = Family(hours=1000.0, limits=(coldest, hottest))
    programme = family.programme(design)
    read = programme_from(yaml.safe_load(programme.as_yaml()))
    assert read.steps == programme.steps and read.powered == programme.powered
    assert read.schedule.set_point == programme.schedule.set_point
    low, high = family.limits
    assert (
        low <= min(programme.schedule.set_point.values) and max(programme.schedule.set_point.values) <= high
    )
    # Choices that make no difference are told to make none.
    assert family.programme(design.plain()).steps == programme.steps


labs = st.builds(
    Lab,
    fastest_ramp=st.floats(0.2, 20.0),
    fastest_turn=st.sampled_from([0.0, 0.004, 5.0, 30.0, 400.0]),
    fan_steps=st.booleans(),
    compressor_steps=st.booleans(),
    yaw=st.booleans(),
)


@settings(max_examples=30, deadline=None)
@given(labs, st.booleans(), st.integers(0, 1000))
def test_nothing_is_planned_that_the_lab_can_not_do(lab, power_steps, seed):
    """Along a walk through what a search may try, from what it begins with."""
    family = Family(hours=60.0, limits=(-20.0, 50.0), power_steps=power_steps, lab=lab)
    rng = np.random.default_rng(seed)
    for start in family.starts():
        design = start
        for _ in range(8):
            schedule = family.programme(design).schedule
            time, air = schedule.set_point.arrays
            assert np.all(np.abs(np.diff(air)) * 60.0 <= lab.fastest_ramp * np.diff(time) * (1.0 + 1e-9))
            assert max(map(abs, schedule.table_rate.values), default=0.0) <= lab.fastest_turn
            may = {"power": power_steps, "fan": lab.fan_steps, "yaw": lab.yaw}
            may["compressor"] = lab.compressor_steps
            assert not any(len(schedule.settings[what].times) > 1 for what, can in may.items() if not can)
            design = next(family.neighbours(design, rng))


@settings(max_examples=30, deadline=None)
@given(designs, st.floats(6.0, 40.0))
def test_shortened_designs_and_neighbours_fit_the_hours(design, hours):
    family = Family(hours=hours)
    short = family.shortened(design)
    if short is None:
        return
    assert family.programme(short).total_hours <= hours
    for near in list(family.neighbours(short))[::7]:
        assert family.programme(near).total_hours <= hours


def test_hours_of_a_simple_design_follow_from_its_ramps_and_soaks():
    design = Design(rates=(0.5, None, None), soak_s=3600.0)
    # 25 to -40 to 60 to 25 degC: 65 + 100 + 35 degC at 0.5 degC/min, and four soaks.
    assert Family().programme(design).total_hours == pytest.approx(200.0 / 0.5 / 60.0 + 4.0)


@pytest.mark.parametrize(
    ("settings_", "message"),
    [
        ({"hours": 2.0}, "the shortest programme between -40 and 60 degC takes"),
        ({"hours": 5000.0}, "up to 1000 h"),
        ({"limits": (60.0, -40.0)}, "temperature limits 60 and -40 degC"),
        ({"limits": (30.0, 60.0)}, "below 25"),
        ({"hours": 5.0, "lab": {"fastest_ramp": 0.5}}, "takes 8.67 h"),
        ({"lab": {"fastest_ramp": 200.0}}, "between 0.01 and 100 degC/min"),
        ({"lab": {"fastest_turn": -1.0}}, "of 0 or more"),
    ],
)
def test_what_no_chamber_does_is_refused(settings_, message):
    with pytest.raises(InputError, match=message):
        Family(**settings_ | ({"lab": Lab(**settings_["lab"])} if "lab" in settings_ else {}))


def test_the_search_finds_the_best_of_a_known_landscape():
    family = Family(hours=30.0)

    def merit(design: Design) -> float:
        return float(0.25 in design.cycles) + design.minor_loop + (design.first == "hot") - design.yaw

    found = search(family, merit, seed=4, most=400)[0]
    best = found.design
    assert 0.25 in best.cycles and best.minor_loop and best.first == "hot" and not best.yaw
    # What gives nothing is not paid for.
    assert best.ladder == "none" and best.power_steps == "none" and best.soak_s == LAB.soaks_s[0]
    assert found == search(family, merit, seed=4, most=400)[0]
