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


@pytest.mark.parametrize(("middle", "unit"), [(330.0, "kelvin"), (417.0, "raw counts")])
def test_a_coil_in_kelvin_is_not_beyond_what_a_gyro_stands(middle, unit):
    run = Run("run", columns(T_in=middle + np.linspace(-10.0, 10.0, ROWS)), FACTS)
    (found,) = [finding for finding in implausible(run) if finding.code == "implausible_temperature"]
    assert unit in found.message
