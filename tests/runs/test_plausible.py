"""A wrong sign or unit, thermometers apart and a second compensation are said first, and of no sound run."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.models.names import make_model
from fogml.runs.checks import check_run
from fogml.runs.columns import column_spec
from fogml.runs.facts import Facts
from fogml.runs.findings import FIRST_OF_ALL
from fogml.runs.plausible import FACTORS, implausible
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_names, shipped_run

FACTS = Facts(latitude=39.9, input_axis="up")  # 9.648 deg/h of Earth rate
ROWS = 3000


def columns(**changed):
    rng = np.random.default_rng(0)
    time = np.arange(float(ROWS))
    inner = 20.0 + 25.0 * np.sin(time / 500.0)
    rate = 50.0 * np.sign(np.sin(time / 100.0)) * (time > 2000.0)
    gyro = 9.648 + 0.4 + 3600.0 * rate + rng.normal(0.0, 0.3, ROWS)
    return {"time": time, "gyro": gyro, "T_in": inner, "T_out": inner - 1.0, "rate": rate, **changed}


SOUND = columns()
REST = SOUND["gyro"] - 3600.0 * SOUND["rate"]
TURN = 3600.0 * SOUND["rate"]
GIVEN_AWAY = {
    "sound": ({}, set()),
    "other sign": ({"gyro": TURN - REST}, {"implausible_earth_rate"}),
    "deg/s stated as deg/h": (
        {"gyro": SOUND["gyro"] / 3600.0},
        {"implausible_earth_rate", "implausible_scale_factor"},
    ),
    "rad/s stated as deg/s": (
        {"gyro": SOUND["gyro"] * np.pi / 180.0},
        {"implausible_earth_rate", "implausible_scale_factor"},
    ),
    "table turned round": ({"gyro": REST - TURN}, {"implausible_scale_factor"}),
    "both turned round": ({"gyro": -SOUND["gyro"]}, {"implausible_earth_rate", "implausible_scale_factor"}),
    "kelvin": ({"T_in": SOUND["T_in"] + 273.15}, {"implausible_temperature"}),
    "Fahrenheit": ({"T_in": 1.8 * SOUND["T_in"] + 32.0}, {"implausible_temperature"}),
    "raw counts": ({"T_in": 340.0 * (SOUND["T_in"] - 60.0)}, {"implausible_temperature"}),
    "readings that are none": (
        {"T_in": np.where(np.arange(ROWS) % 300 == 0, -9999.0, SOUND["T_in"])},
        {"temperature_dropouts"},
    ),
    "a stretch of readings that are none": (
        {"T_in": np.where(np.arange(ROWS) // 200 == 3, -32768.0, SOUND["T_in"])},
        {"temperature_dropouts"},
    ),
    "hours stated as s": ({"time": SOUND["time"] / 3600.0}, {"implausible_clock"}),
    "s stated as ms": ({"time": SOUND["time"] / 1000.0}, {"implausible_clock"}),
    "days of a spreadsheet": ({"time": 45000.0 + SOUND["time"] / 86400.0}, {"implausible_clock"}),
    "a clock that began days ago": ({"time": 45000.0 + SOUND["time"]}, set()),
    "us stated as s": ({"time": 1e6 * SOUND["time"]}, {"implausible_clock"}),
    "apart": ({"T_in": SOUND["T_in"] + 120.0}, {"thermometers_apart"}),
    "dropouts": ({"T_in": np.where(np.arange(ROWS) == 700, 85.0, SOUND["T_in"])}, {"temperature_dropouts"}),
}


@pytest.mark.parametrize("case", GIVEN_AWAY)
def test_what_the_numbers_give_away(case):
    changed, codes = GIVEN_AWAY[case]
    run = Run("run", columns(**changed), FACTS)
    run = run.with_findings(check_run(run))
    found = [finding.code for finding in run.findings]
    assert set(found) & set(FIRST_OF_ALL) == codes
    assert set(found[: len(codes)]) == codes


def test_a_bias_of_a_gyro_that_is_no_fibre_optic_one_is_no_unit():
    for bias in (-300.0, 120.0, 1800.0):
        gyro = bias + np.random.default_rng(1).normal(0.0, 300.0, ROWS)
        assert list(implausible(Run("run", columns(gyro=gyro + TURN), FACTS))) == []


def test_nothing_is_said_of_the_shipped_recordings():
    for name in shipped_names():
        assert not {finding.code for finding in shipped_run(name).findings} & set(FIRST_OF_ALL)


def test_compensating_twice_is_refused():
    run = Run("run", columns(), FACTS)
    model = make_model("polynomial", features="T").fit(run)
    once = model.compensate(run)
    beside = run.with_columns(gyro_compensated=once.compensated)
    stated = Run("run", columns(gyro=once.compensated), FACTS.model_copy(update={"compensated": True}))
    for again in (beside, stated):
        with pytest.raises(InputError, match="run: compensated already"):
            model.compensate(again)
    assert [finding.code for finding in implausible(stated)][:1] == ["already_compensated"]


@pytest.mark.parametrize("words", FACTORS)
def test_a_unit_taken_for_another_is_off_by_what_one_is_in_the_other(words):
    true, taken = words.split(" taken for ")
    units = column_spec("gyro").units
    # What is read as one of the wrong unit is one of the right one.
    assert FACTORS[words] == pytest.approx(units[taken][0] / units[true][0])


def soaked(own_heat, lag_s=400.0):
    """A chamber at 25, -40 and 60 degC, and a thermometer beside the coil that lags and is warmer."""
    time = 10.0 * np.arange(2000)
    chamber = np.interp(time, [0, 3000, 6000, 10_000, 15_000, 17_000], [25.0, 25.0, -40.0, -40.0, 60.0, 60.0])
    coil = np.empty_like(chamber)
    coil[0] = chamber[0]
    for i in range(1, len(time)):
        coil[i] = coil[i - 1] + (chamber[i] - coil[i - 1]) * 10.0 / lag_s
    return {"time": time, "gyro": 0.01 * coil, "T_chamber": chamber, "T_in": coil + own_heat}


@pytest.mark.parametrize("reads", [["T_in"], ["T_chamber"], ["T_in", "T_chamber"]])
def test_fahrenheit_is_told_beside_a_thermometer_that_lags_and_where_all_read_so(reads):
    sound = soaked(4.0)
    assert not any("emperature" in one.message for one in implausible(Run("run", sound)))
    run = Run("run", sound | {name: 1.8 * sound[name] + 32.0 for name in reads})
    found = [one for one in implausible(run) if one.code == "implausible_temperature"]
    assert [one.column for one in found] == sorted(reads) and "Fahrenheit" in found[0].message


def test_electronics_that_warm_up_fast_are_in_no_other_unit():
    """Before, ends of 1.8 times a cold coil and 32 more were Fahrenheit, though nothing moved by 1.8."""
    time = np.arange(6000.0)
    cold = 18.0 + 3.0 * np.sin(time / 900.0)
    for electronics in (np.full(6000, 67.0) + 0.1 * np.sin(time), cold + 30.0 - 12.0 * np.exp(-time / 900.0)):
        run = Run("run", {"time": time, "gyro": cold, "T": cold, "T_electronics": electronics})
        assert [one.code for one in implausible(run)] == []


def test_degrees_celsius_under_kelvin_are_told():
    run = Run("run", columns(T_in=SOUND["T_in"] - 273.15))
    assert any("[K]" in one.message for one in implausible(run) if one.column == "T_in")


@pytest.mark.parametrize(("middle", "unit"), [(330.0, "kelvin"), (417.0, "raw counts")])
def test_a_coil_in_kelvin_is_not_beyond_what_a_gyro_stands(middle, unit):
    run = Run("run", columns(T_in=middle + np.linspace(-10.0, 10.0, ROWS)), FACTS)
    (found,) = [finding for finding in implausible(run) if finding.code == "implausible_temperature"]
    assert unit in found.message


def test_a_slow_clock_is_told_and_a_year_of_weather_is_none():
    days = np.arange(0.0, 200.0, 1.0 / 48.0)
    season, day = 8.0 * np.cos(2.0 * np.pi * days / 365.0), 1.5 * np.sin(2.0 * np.pi * days)
    noise = np.random.default_rng(2).normal(0.0, 0.3, len(days))
    for temperature, codes in ((25.0 + season + day, []), (25.0 + season, ["implausible_clock"])):
        run = Run("run", {"time": 86400.0 * days, "gyro": noise, "T": temperature}, Facts())
        assert [finding.code for finding in implausible(run)] == codes


@pytest.mark.parametrize(
    ("factor", "contact", "codes"),
    [(1.0, 60.0, []), (1000.0, 0.0, ["implausible_clock"]), (1 / 120, 0.0, ["implausible_clock"])],
)
def test_of_a_long_run_blocks_tell_the_clock_s_unit_whatever_readings_are_none(factor, contact, codes):
    # Two hours at 100 Hz, every sixteenth reading none, and a contact that is bad for a minute.
    time = 0.01 * np.arange(720_000)
    warm = 20.0 - 35.0 * np.cos(np.pi * time / 7200.0)
    warm[::16] = -9999.0
    warm[300_000:306_000] += contact
    run = Run("run", {"time": factor * time, "gyro": np.sin(time), "T": warm})
    assert [one.code for one in implausible(run) if one.code == "implausible_clock"] == codes
