"""What withheld effects and their worlds must obey, whatever is drawn of them."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from importlib import import_module
from pkgutil import iter_modules
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fogml.blind.first.effects.electrical import Crosstalk, PolarisationChirped
from fogml.blind.first.effects.invented import HotBursts
from fogml.blind.first.effects.turning import HuntingServo, SourceBent
from fogml.blind.first.programme import _chamber_path
from fogml.blind.frame import nominal
from fogml.blind.frame.form import Additive, Form
from fogml.blind.frame.noise import StateNoise
from fogml.blind.frame.record import EARTH_DEG_H
from fogml.blind.plan import REALITIES, reality
from fogml.blind.second.effects.driven import RattleThreshold
from fogml.blind.second.effects.lasting import _clusters
from fogml.blind.second.reality import _field, humidity_of
from fogml.blind.third.effects.driven import CreepingClock
from fogml.twin.registry import effects

TIME = 10.0 * np.arange(6000.0)
HIDDEN = [
    form
    for name in REALITIES
    for form in reality(name).known
    if form.name == "hidden_thermal_node" and issubclass(form, Additive)
]


def world(**more: Any) -> Any:
    """A world in which everything is at 40 degC and rests."""
    still = {
        "nodes": defaultdict(lambda: np.full(len(TIME), 40.0)),
        "rates": defaultdict(lambda: np.zeros(len(TIME))),
        "drives": defaultdict(lambda: np.zeros(len(TIME))),
    }
    return SimpleNamespace(time=TIME, sample_s=10.0, past=(), **(still | more))


@pytest.mark.parametrize("form", HIDDEN, ids=lambda form: form.form)
def test_a_hidden_node_that_is_as_warm_as_the_coil_shows_nothing(form: type[Additive]) -> None:
    rng = np.random.default_rng(1)
    found = form().response(world(), form().draw(rng), rng)
    assert found == pytest.approx(np.zeros(len(TIME)), abs=1e-9)


def test_cross_talk_grows_with_the_supply_times_its_ratio() -> None:
    supply = 12.0 + 0.5 * (TIME > 30_000.0)
    shown = world(drives={"supply": supply})
    none, one, three = (
        Crosstalk().response(shown, {"supply_ratio": ratio, "bend": 0.0}, np.random.default_rng(1))
        for ratio in (0.0, 2.0, 6.0)
    )
    assert one - none == pytest.approx(2.0 * (supply - 12.0)) and three - none == pytest.approx(
        3.0 * (one - none)
    )


def test_a_beat_repeats_after_its_period_and_sooner_the_more_it_drifts() -> None:
    degrees = np.linspace(25.0, 65.0, len(TIME))
    shown = world(nodes={"T_electronics": degrees})
    even, drifting = (
        PolarisationChirped().response(
            shown, {"period": 8.0, "phase": 30.0, "drift": drift}, np.random.default_rng(1)
        )
        for drift in (0.0, 2e-4)
    )
    assert np.interp(degrees[0] + 8.0, degrees, even) == pytest.approx(even[0], abs=1e-3) == 0.5
    rises = [np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0)) for x in (even, drifting)]
    assert np.diff(degrees[rises[0]]) == pytest.approx(8.0, abs=0.02) and np.all(rises[1] < rises[0])


def test_the_earth_turns_once_in_a_sidereal_day() -> None:
    assert pytest.approx(3600.0 * 360.0 / 86_164.0905, rel=1e-6) == EARTH_DEG_H


def test_loops_of_grains_scatter_about_their_typical_width() -> None:
    """Over 2000 draws of up to nine grains each, by its logarithm, beside a lean of 2 % a degree."""
    spreads = []
    for seed in range(2000):
        shape = _clusters(np.random.default_rng(seed))
        widths = np.log([shape[f"half_width_{k}"] for k in range(int(shape["grains"]))])
        spreads.append(np.var(widths, ddof=1))
    # Leans of up to 0.02 over centres from -30 to 60 scatter by 0.3 on the whole.
    assert np.mean(spreads) == pytest.approx(0.4**2 + 0.02**2 / 3.0 * 90.0**2 / 12.0, rel=0.1)


def test_a_scale_factor_error_is_told_in_parts_of_a_million_of_the_rate() -> None:
    """By its form 1000 ppm/degC at 15 degC above the middle lose 15 000 ppm: 1.5 % of 10 deg/s."""
    shown = world(rate_deg_h=np.full(len(TIME), 36_000.0))
    found = 1000.0 * SourceBent().response(shown, {"bend": 0.0}, np.random.default_rng(1))
    assert found == pytest.approx(np.full(len(TIME), -540.0))


def test_rattling_grows_with_its_power_of_what_exceeds_the_threshold() -> None:
    found = [
        RattleThreshold().response(
            world(drives={"vibration": np.full(len(TIME), 0.02 + above)}),
            {"threshold": 0.02, "exponent": 1.7},
            np.random.default_rng(1),
        )[0]
        for above in (-0.01, 0.1, 0.2)
    ]
    assert found == pytest.approx([0.0, 0.01, 0.01 * 2.0**1.7])


def test_a_clock_that_creeps_is_later_by_a_share_of_its_delay_each_hour() -> None:
    """An output that tells the time tells by how much it is late."""
    found = CreepingClock().distorted(TIME, world(), 4.0, {"growth": 0.25, "by_heat": 0.0})
    assert (TIME - found)[360::360] == pytest.approx(
        4.0 + np.arange(1.0, len(TIME) // 360 + 1)[: len(found[360::360])]
    )


def test_a_hunting_servo_swings_in_its_period() -> None:
    shown = world(table_rate=np.full(len(TIME), 0.1))
    found = HuntingServo().response(shown, {"period": 600.0, "phase": 0.3}, np.random.default_rng(1))
    assert np.argmax(np.abs(np.fft.rfft(found))) == len(TIME) * 10 // 600


def test_bursts_have_unit_variance_and_their_correlation() -> None:
    found = HotBursts().response(world(), {"from": 30.0, "correlation": 50.0}, np.random.default_rng(1))
    assert np.var(found) == pytest.approx(1.0, rel=0.1)
    assert np.mean(found[5:] * found[:-5]) == pytest.approx(np.exp(-1.0), abs=0.05)
    cold = HotBursts().response(world(), {"from": 41.0, "correlation": 50.0}, np.random.default_rng(1))
    assert not cold.any()


def test_air_that_nothing_dries_stays_as_wet_as_the_room() -> None:
    air = np.full(3000, 25.0)
    still = humidity_of(np.random.default_rng(2), air, np.zeros(3000), 5.0)
    assert np.ptp(still) < 1e-9
    dried = humidity_of(np.random.default_rng(2), air, np.ones(3000), 5.0)
    assert dried[0] < still[0] and np.all(np.diff(dried) <= 0.0)


def test_the_field_turns_against_the_table() -> None:
    angle, off = np.linspace(0.0, 720.0, 200), np.zeros(200)
    field = _field(np.random.default_rng(3), angle, off, off, 45.0)
    way = np.unwrap(np.arctan2(field["B_y"], field["B_x"]))
    assert way - way[0] == pytest.approx(-np.radians(angle))


@pytest.mark.parametrize("name", list(nominal.PRIOR_SD))
def test_a_column_is_what_a_unit_of_its_constant_adds(name: str) -> None:
    rng = np.random.default_rng(4)
    seen = nominal.Seen(
        *(rng.uniform(-40.0, 60.0, 50) for _ in range(3)), 3600.0 * rng.uniform(-50.0, 50.0, 50)
    )
    constants = nominal.draw_constants(rng, True)
    more = replace(constants, **{name: getattr(constants, name) + 1.0})
    (column,) = nominal.columns(seen, (name,)).T
    assert column == pytest.approx(
        nominal.output(more, seen) - nominal.output(constants, seen), rel=1e-5, abs=1e-8
    )


def test_equal_variances_in_each_half_decade_are_the_flicker_that_is_told() -> None:
    taus_s = np.geomspace(1.0, 1e6, 13)
    variances = np.full(13, 0.02**2 / np.pi * np.log(np.sqrt(10.0)))
    told = StateNoise(0.003, variances, taus_s, 0.001).amounts()
    assert told["B"][0] == pytest.approx(0.02, rel=0.03)


@pytest.mark.parametrize("seed", range(5))
def test_soaks_of_a_programme_last_and_the_chamber_stays_in_them(seed: int) -> None:
    corners, points, soaks = _chamber_path(np.random.default_rng(seed), 36_000.0, False)
    assert np.all(np.diff(corners) > 0.0) and soaks
    for begin, end in soaks:
        first, last = np.interp([begin, end], corners, points)
        assert 300.0 <= end - begin <= 6600.0 and first == last
    rates = np.abs(np.diff(points)) / np.diff(corners) * 60.0
    assert np.all((rates == 0.0) | ((rates > 0.29) & (rates < 3.01)))


@pytest.mark.parametrize("name", REALITIES)
def test_forms_with_a_name_in_the_catalogue_are_known_and_no_others(name: str) -> None:
    made = reality(name)
    assert all(form.known and form.name in effects() for form in made.known)
    others = (*made.invented, made.wrong_structure)
    assert not any(form.known or form.name in effects() for form in others)


@pytest.mark.parametrize("name", REALITIES)
def test_no_form_that_is_written_is_left_out(name: str) -> None:
    made = reality(name)
    effects_of = import_module(made.wrong_structure.__module__.rpartition(".")[0])
    written = {
        form
        for module in iter_modules(effects_of.__path__, f"{effects_of.__name__}.")
        for form in vars(import_module(module.name)).values()
        if isinstance(form, type) and issubclass(form, Form) and form.__module__ == module.name
    }
    used = {*made.known, *made.invented, made.wrong_structure}
    assert {form for form in written if "name" in vars(form)} == used
