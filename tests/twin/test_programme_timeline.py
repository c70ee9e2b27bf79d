"""A programme on a clock: each quantity against what the sentences say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.twin.programme import Programme, load_programme, programme_names
from fogml.twin.timeline import ROOM_HUMIDITY, Timeline, saturation_pressure

QUANTITIES = (
    "set_point", "set_rate", "table_rate", "angle", "powered", "powered_on_s", "fan", "compressor", "heater",
    "humidity", "yaw", "step",
)  # fmt: skip


def on_clock(steps: list, sample_s: float = 1.0, **keys: object) -> Timeline:
    return Timeline(load_programme({"steps": steps, **keys}), sample_s)


@pytest.mark.parametrize("name", programme_names())
@pytest.mark.parametrize("sample_s", [0.7, 10.0])
def test_blocks_give_the_whole(name: str, sample_s: float) -> None:
    line = Timeline(load_programme(name), sample_s)
    blocks = list(line.blocks(997))
    assert sum(len(block) for block in blocks) == len(line)
    for quantity in ("time", *QUANTITIES):
        joined = np.concatenate([getattr(block, quantity) for block in blocks])
        np.testing.assert_array_equal(joined, getattr(line.whole, quantity))


@pytest.mark.parametrize("name", ["joint-staircase", "separating", "four-positions"])
def test_angle_is_the_integral_of_the_rate_and_the_table_keeps_its_acceleration(name: str) -> None:
    programme = load_programme(name)
    line = Timeline(programme, 0.01)
    block = line.block(0, 1_500_000)
    steps = np.diff(block.table_rate)
    assert np.abs(steps).max() <= programme.table_acceleration * 0.01 * (1 + 1e-9)
    integral = np.concatenate([[0.0], np.cumsum(0.005 * (block.table_rate[1:] + block.table_rate[:-1]))])
    np.testing.assert_allclose(block.angle, integral, atol=2e-3)


def test_rate_changes_at_the_acceleration_and_positions_are_met() -> None:
    block = on_clock(
        [
            {"hold for 5 min": [
                "turn at 10 deg/s for 60 s, then -20 deg/s for 60 s, from minute 1",
                "turn to 90 deg at 10 deg/s from minute 4",
            ]},
            {"hold for 5 min": ["turn to -45 deg at 10 deg/s", "turn by 720 deg at 20 deg/s from minute 2"]},
        ],
        0.25,
        table_acceleration="5 deg/s2",
    ).whole  # fmt: skip
    rate = dict(zip(block.time.tolist(), block.table_rate.tolist()))
    assert [rate[t] for t in (60.0, 61.0, 62.0, 120.0, 123.0, 126.0, 180.0, 182.0, 184.0)] == pytest.approx(
        [0.0, 5.0, 10.0, 10.0, -5.0, -20.0, -20.0, -10.0, 0.0]
    )
    angle = dict(zip(block.time.tolist(), block.angle.tolist()))
    # The shorter way to an angle, whole turns not counted.
    assert math.remainder(angle[299.0] - 90.0, 360.0) == pytest.approx(0.0, abs=1e-9)
    assert abs(angle[299.0] - angle[239.0]) <= 180.0
    assert math.remainder(angle[400.0] + 45.0, 360.0) == pytest.approx(0.0, abs=1e-9)
    assert angle[599.0] - angle[400.0] == pytest.approx(720.0, abs=1e-9)


def test_half_a_turn_goes_the_positive_way_and_small_moves_stay_below_their_rate() -> None:
    block = on_clock(
        [{"hold for 2 min": ["turn to 180 deg at 10 deg/s", "turn by 1 deg at 90 deg/s from minute 1"]}]
    )
    fine = block.at(np.arange(0.0, 120.0, 0.01))
    assert fine.angle[5900] == pytest.approx(180.0, abs=1e-9)
    # From rest to rest over d at acceleration a: the peak is sqrt(a d).
    assert fine.table_rate[6000:].max() == pytest.approx(math.sqrt(50.0), abs=50.0 * 0.01)
    assert fine.angle[-1] == pytest.approx(181.0, abs=1e-9)


def test_a_soak_goes_there_at_the_fastest_rate_and_counts_from_arrival() -> None:
    line = on_clock(
        [{"soak at 5 degC for 10 min": ["fan off for 2 min from minute 3"]}], fastest_rate="4 degC/min"
    )
    block = line.whole
    assert line.programme.total_s == 900.0
    assert block.set_point[[0, 150, 300, 899]] == pytest.approx([25.0, 15.0, 5.0, 5.0])
    assert block.set_rate[[0, 299, 300]] == pytest.approx([-4.0, -4.0, 0.0])
    np.testing.assert_array_equal(np.flatnonzero(block.fan == 0.0), np.arange(480, 600))


@pytest.mark.parametrize("sample_s", [0.1, 0.3, 1.0, 7.0])
def test_switches_fall_on_their_sample(sample_s: float) -> None:
    line = on_clock(
        [
            {
                "hold for 2 h": [
                    "power on at minute 10",
                    "power off for 10 min from minute 42",
                    "fan off at hour 1",
                ]
            }
        ],
        sample_s,
    )
    time = np.arange(len(line)) * sample_s
    late = 1e-6 * sample_s
    after = [time >= moment - late for moment in (600.0, 2520.0, 3120.0, 3600.0)]
    np.testing.assert_array_equal(line.whole.powered, (after[0] & ~after[1]) | after[2])
    np.testing.assert_array_equal(line.whole.fan, ~after[3])
    assert line.power_windows == ((600.0, 2520.0), (3120.0, math.inf))
    since = line.whole.powered_on_s
    assert np.isposinf(since[~after[0]]).all()
    assert (since[after[0] & ~after[2]] == 600.0).all() and (since[after[2]] == 3120.0).all()


def test_power_is_on_since_long_before_unless_the_steps_switch_it_on() -> None:
    assert on_clock(["hold for 1 h"]).power_windows == ((-math.inf, math.inf),)
    assert on_clock(["hold for 1 h"], power="off").power_windows == ()
    switched = [{"hold for 1 h": ["power on"]}]
    assert on_clock(switched).power_windows == ((0.0, math.inf),)
    assert on_clock(switched, power="on").power_windows == ((-math.inf, math.inf),)
    pulse = on_clock([{"hold for 1 h": ["power on for 5 min from minute 1"]}])
    assert pulse.power_windows == ((60.0, 360.0),)


def test_a_timed_setting_gives_way_to_what_held_before() -> None:
    block = on_clock(
        [
            {"hold for 1 h": ["fan at 50 % from minute 10", "fan off for 10 min from minute 30"]},
            {"hold for 1 h": ["compressor on for 10 min", "heater off", "yaw to 180 deg at minute 30"]},
        ],
        60.0,
        start_temperature="65 degC",
    ).whole
    assert block.fan[[0, 9, 10, 29, 30, 39, 40, 119]].tolist() == [1.0, 1.0, 0.5, 0.5, 0.0, 0.0, 0.5, 0.5]
    assert block.compressor[[0, 60, 69, 70]].tolist() == [0.0, 1.0, 1.0, 0.0]
    # Left to the chamber: 40 degC above the room takes two fifths of its power.
    assert block.heater[[0, 59, 60, 119]] == pytest.approx([0.4, 0.4, 0.0, 0.0])
    assert block.yaw[[0, 89, 90, 119]].tolist() == [0.0, 0.0, 180.0, 180.0]


def test_machines_work_for_the_rate_too() -> None:
    block = on_clock(["ramp to -40 degC at 2 degC/min", "hold for 1 h"], fastest_rate="5 degC/min").whole
    assert block.compressor[0] == pytest.approx(0.4)
    assert block.compressor[-1] == pytest.approx(0.65)
    assert block.heater.max() == 0.0


def test_air_that_was_cold_is_dry_when_warm_again() -> None:
    block = on_clock(
        [
            "ramp to -20 degC at 2 degC/min",
            "ramp to 25 degC at 2 degC/min",
            {"hold for 1 h": ["humidity 20 %"]},
        ]
    ).whole
    coldest = int(np.argmin(block.set_point))
    # Dew point of air at 25 degC and 50 %: 13.9 degC.
    dew = block.set_point[np.argmax(block.humidity > 100.0 - 1e-9)]
    assert dew == pytest.approx(13.9, abs=0.1)
    assert block.humidity[0] == pytest.approx(ROOM_HUMIDITY)
    assert block.humidity[coldest] == pytest.approx(100.0, abs=0.5)
    before_hold = int(np.argmax(block.step == 2)) - 1
    ratio = saturation_pressure(np.array([-20.0])) / saturation_pressure(np.array([25.0]))
    assert block.humidity[before_hold] == pytest.approx(100.0 * ratio[0], rel=0.01)
    assert (block.humidity[block.step == 2] == 20.0).all()
    assert block.humidity.max() <= 100.0 + 1e-9


def test_saturation_pressure_is_that_of_steam_tables() -> None:
    given = saturation_pressure(np.array([0.01, 20.0, 40.0, 60.0]))
    np.testing.assert_allclose(given, [6.117, 23.39, 73.85, 199.5], rtol=5e-3)


def test_samples_end_before_the_programme_does() -> None:
    programme = Programme(load_programme(["hold for 1 h"]).steps)
    assert len(Timeline(programme, 1.0)) == 3600
    assert len(Timeline(programme, 0.1)) == 36_000
    assert len(Timeline(programme, 7.0)) == 515
    assert Timeline(programme, 7.0).whole.time[-1] < 3600.0
    for bad in (0.0, -1.0, math.nan, 3601.0):
        with pytest.raises(InputError, match="'sample_s'"):
            Timeline(programme, bad)


def test_an_oscillation_is_a_sine_about_rest_and_comes_back() -> None:
    said = "oscillate at 3 deg/s and 2 Hz for 10 s from 5 s"
    line = on_clock([{"hold for 30 s": [said, "turn at 4 deg/s for 5 s from second 20"]}], 0.01)
    assert str(load_programme([{"hold for 30 s": [said]}]).steps[0].actions[0]) == said
    block, time = line.whole, line.whole.time
    waving = (time >= 5.0) & (time < 15.0)
    omega = 4.0 * math.pi
    assert block.table_rate[waving] == pytest.approx(3.0 * np.sin(omega * (time[waving] - 5.0)), abs=1e-9)
    wanted = 3.0 / omega * (1.0 - np.cos(omega * (time[waving] - 5.0)))
    assert block.angle[waving] == pytest.approx(wanted, abs=1e-9)
    assert not block.table_rate[(time >= 15.0) & (time < 20.0)].any()
    assert block.angle[-1] == pytest.approx(20.0)
    pieces = np.concatenate([part.table_rate for part in line.blocks(333)])
    assert pieces == pytest.approx(block.table_rate, abs=1e-12)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("oscillate at 3 deg/s and 2 Hz for 10.3 s", "20.6 cycles; a whole number is needed"),
        ("oscillate at 3 deg/s and 2 m for 10 s", r"needs a unit \(Hz, mHz, kHz\)"),
        ("oscillate at 3 deg/s and 20 Hz for 10 s", "state a higher 'table_acceleration'"),
        ("oscillate at 1 deg/s and 5 Hz for 10 s", "needs samples closer than 0.1 s"),
    ],
)
def test_what_an_oscillation_can_not_be_is_said(said: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        on_clock([{"hold for 30 s": [said]}], 0.5)


def test_a_block_of_a_long_programme_looks_at_what_reaches_into_it() -> None:
    """As the whole has it, oscillations and dose as well; of 3000 steps a block of 300 s takes a few."""
    to_and_fro = {
        "soak at 25 degC for 1 min": [
            "oscillate at 2 deg/s and 0.1 Hz for 20 s",
            "turn by 30 deg at 5 deg/s from second 30",
            "radiation at 5 Gy/h for 10 s from second 20",
        ]
    }
    programme = load_programme(
        [{"repeat 1000 times": [to_and_fro, "ramp to 27 degC at 1 degC/min", "hold for 7 s"]}]
    )
    timeline = Timeline(programme, 1.0)
    whole, block = timeline.whole, timeline.block(90_000, 90_300)
    for name in ("set_point", "set_rate", "table_rate", "angle", "dose", "humidity", "compressor", "step"):
        found, wanted = getattr(block, name), getattr(whole, name)[90_000:90_300]
        assert np.abs(found - wanted).max() <= 1e-9 * max(np.abs(wanted).max(), 1.0), name
    assert np.ptp(block.table_rate) > 6.0
    pieces, samples = block._samples_of(timeline.set_point_knots[0])
    assert pieces.stop - pieces.start < 12 and samples.sum() == 300


@pytest.mark.parametrize(("sample_s", "missed"), [(1.0, 0), (50.0, 1), (100.0, 2), (200.0, 3)])
def test_rates_that_samples_may_miss_are_counted(sample_s: float, missed: int) -> None:
    """Rates held for 40, 80 and 120 s; what takes the table there and back comes on top."""
    steps = [
        {"soak at 25 degC for 1 h": ["turn at 5 deg/s for 40 s, then -5 deg/s for 80 s, from minute 5",
                                     "turn at 10 deg/s for 120 s from minute 20"]},
    ]  # fmt: skip
    assert on_clock(steps, sample_s, table_acceleration="100 deg/s2").short_rates == missed
    assert on_clock(["soak at 25 degC for 1 h"], sample_s).short_rates == 0
