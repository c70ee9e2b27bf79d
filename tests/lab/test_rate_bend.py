"""The interval of a rate ladder's nonlinearity, against normal draws and a gyro whose bend is known."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.lab.rate_errors import greatest_within
from fogml.lab.rate_json import rate_json
from fogml.lab.rate_pieces import with_steady_earth
from fogml.lab.rate_words import result_rows, verdict_sentences
from fogml.runs.facts import Facts
from fogml.runs.run import Run

RATES = (0.0, 10.0, -10.0, 25.0, -25.0, 50.0, -50.0, 100.0, -100.0, 0.0)


def told(cubic_ppm: float, seed: int, rates=RATES) -> dict:
    """A ladder of minutes whose output is off by `cubic_ppm` at the greatest rate, cubic in it."""
    rng = np.random.default_rng(seed)
    rate = np.repeat(rates, 60)
    gyro = 3600.0 * rate * (1.0 + 1e-6 * cubic_ppm * (rate / 100.0) ** 2) + rng.normal(0.0, 1.2, len(rate))
    gyro += np.cumsum(rng.normal(0.0, 0.01, len(rate)))
    run = Run("ladder", {"time": np.arange(len(rate)) + 1.0, "rate": rate, "gyro": gyro}, Facts())
    return rate_json([run], source="a ladder")


@pytest.mark.parametrize("true", [np.zeros(6), np.array([3.0, 0.0, 0.0, -1.0, 0.0, 0.0])])
def test_the_greatest_of_correlated_values_is_within(true) -> None:
    rng = np.random.default_rng(0)
    mixing = rng.normal(size=(6, 4))
    errors = np.linalg.norm(mixing, axis=1)
    held = 0
    for _ in range(2000):
        low, high = greatest_within(true + mixing @ rng.normal(size=4), errors)
        held += low <= np.abs(true).max() <= high
    assert held / 2000 > 0.9 - 2.0 * np.sqrt(0.09 / 2000)


def test_a_bend_is_told_and_a_straight_line_has_none() -> None:
    levels = np.unique(RATES)
    output = levels * (1.0 + 20e-6 * (levels / 100.0) ** 2)
    off = output - np.polyval(np.polyfit(levels, output, 1), levels)
    bend = 1e6 * np.abs(off).max() / np.abs(output).max()
    line = told(20.0, 1)["scale_factor"]
    low, high = line["nonlinearity_ci90_ppm"]
    assert 0.5 * bend < low <= line["nonlinearity_ppm"] <= high < 2.0 * bend and low <= bend <= high
    lows = [told(0.0, seed)["scale_factor"]["nonlinearity_ci90_ppm"][0] for seed in range(20)]
    # Of twenty, more than five beyond a probability of 0.1 each happen once in ninety.
    assert sum(low > 0.0 for low in lows) <= 5


def test_words_say_where_noise_alone_may_make_it() -> None:
    remarks = {
        cubic: {row.quantity: row.remark for row in result_rows(told(cubic, 3))} for cubic in (0.0, 20.0)
    }
    assert "noise alone may make as much" in remarks[0.0]["nonlinearity"]
    assert remarks[20.0]["nonlinearity"].startswith("90 %: ") and "noise" not in remarks[20.0]["nonlinearity"]


def test_a_sentence_says_what_the_test_comes_to() -> None:
    values = told(20.0, 3)
    low, high = (1e6 * (end - 1.0) for end in values["scale_factor"]["ci90"])
    [sentence] = verdict_sentences(values)
    found = re.fullmatch(
        r"The scale factor is (\S+) ± (\S+) ppm \(90 %\) off the nominal one, linear within (\S+) ppm up to "
        r"100 deg/s\.",
        sentence,
    )
    assert [float(part) for part in found.groups()] == pytest.approx(
        [0.5 * (low + high), 0.5 * (high - low), values["scale_factor"]["nonlinearity_ppm"]], rel=0.05
    )
    bare = dict.fromkeys(("scale_factor", "range", "bandwidth", "temperature_sensitivity"))
    assert verdict_sentences(bare) == ["These runs tell no scale factor; the notes say what it needs."]


def test_rows_have_the_digits_that_their_errors_allow() -> None:
    values = told(20.0, 3)
    line = values["scale_factor"] | {"scale_factor": 1.00022075, "se": 1.6e-7, "ci90": [1.0002205, 1.000221]}
    sensed = {"temperature": [0, 1, 2, 3], "ppm_per_degC": 10.71847, "se": 0.00014, "ci90": [10.718, 10.719]}
    sensed["curvature_ppm_per_degC2"] = None
    slew = {"limited": False, "output_deg_s2": 100022.0, "table_deg_s2": 100000.0}
    values |= {"scale_factor": line, "temperature_sensitivity": sensed, "slew": slew}
    rows = {row.quantity: row for row in result_rows(values)}
    assert rows["scale factor"][1:3] == ("1.00022075", "1.6 × 10⁻⁷")
    assert rows["scale factor"].remark == "+220.75 ± 0.25 ppm (90 %)"
    assert rows["temperature sensitivity"][1:3] == ("10.71847", "0.00014")
    assert rows["temperature sensitivity"].remark == "over 4 temperatures, 90 %: ± 0.00050 ppm/°C"
    assert rows["slew, at least"].value == "100000"


def test_three_rates_tell_none() -> None:
    line = told(0.0, 0, (0.0, 10.0, -10.0, 0.0))["scale_factor"]
    assert line["nonlinearity_ppm"] is None and line["nonlinearity_ci90_ppm"] is None


def test_a_rising_ladder_says_what_a_drift_of_the_scale_factor_makes_of_it() -> None:
    """By a gyro whose scale factor grows by 100 ppm; rates that come back the other way round bear it."""
    found = {}
    for name, rates in (("rising", RATES), ("back", (*RATES, *RATES[::-1]))):
        rate = np.repeat(rates, 60)
        course = np.arange(len(rate)) / (len(rate) - 1.0) - 0.5
        gyro = 3600.0 * rate * (1.0 + 100e-6 * course)
        run = Run("ladder", {"time": np.arange(len(rate)) + 1.0, "rate": rate, "gyro": gyro}, Facts())
        values = rate_json([run], source="a ladder")
        off = 1e6 * abs(values["scale_factor"]["scale_factor"] - 1.0) / 100.0
        words = [note for note in values["notes"] if "rates grow or fall" in note]
        found[name] = off, values["scale_factor"]["nonlinearity_ppm"] / 100.0, words
    off, bent, (words,) = found["rising"]
    # Plateaus' middles are as far apart as all but one of ten of them.
    assert float(words.split("told ")[1].split()[0]) == pytest.approx(off / 0.9, rel=0.05)
    assert float(words.split("nonlinearity of ")[1].split()[0]) == pytest.approx(bent / 0.9, rel=0.06)
    assert off > 0.1 and found["back"][0] < 0.01 and not found["back"][2]
    # A temperature that stays speaks against it.
    for span, said in ((0.1, False), (3.0, True)):
        warm = run.with_columns(T=25.0 + span * course)[: 60 * len(RATES)]
        notes = rate_json([warm], source="a ladder")["notes"]
        assert any("rates grow or fall" in note for note in notes) == said


def test_the_noise_of_a_measured_rate_is_no_bend() -> None:
    """Of 200 samples of 2e-3 deg/s a rate is known to 1.4 ppm of the greatest, many times its output."""
    lows = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        rate = np.repeat(RATES, 200)
        gyro = 3600.0 * rate + rng.normal(0.0, 0.2, len(rate))
        measured = rate + rng.normal(0.0, 2e-3, len(rate))
        run = Run("ladder", {"time": np.arange(len(rate)) + 1.0, "rate": measured, "gyro": gyro}, Facts())
        lows.append(rate_json([run], source="a ladder")["scale_factor"]["nonlinearity_ci90_ppm"][0])
    # Of ten, more than three beyond a probability of 0.1 each happen once in eighty.
    assert sum(low > 0.0 for low in lows) <= 3


@pytest.mark.parametrize("scale", [1.0002, -1.0002])
def test_earth_rate_that_the_table_turns_about_is_no_bend_and_no_asymmetry(scale: float) -> None:
    """A table that leans by 10 deg to north carries an upright axis round, by Rodrigues' formula."""
    lean, latitude = np.radians(10.0), np.radians(40.0)
    table = np.array([np.sin(lean), np.cos(lean)])
    earth = 15.041067 * np.array([np.cos(latitude), np.sin(latitude)])
    rates = np.array([0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0, 0.0])
    rate = np.repeat(rates, 100)
    angle = np.cumsum(rate)
    fixed = (table @ earth) * table[1]
    along = fixed + (earth[1] - fixed) * np.cos(np.radians(angle))
    gyro = scale * (3600.0 * rate + along) + 3.0 + np.random.default_rng(0).normal(0.0, 0.02, len(rate))
    facts = Facts(latitude=40.0, input_axis="up", table_axis={"heading": 0.0, "elevation": 80.0})
    columns = {"time": np.arange(len(rate)) + 1.0, "rate": rate, "gyro": gyro, "angle": angle}
    line = rate_json([Run("leaning", columns, facts)], source="a table")["scale_factor"]
    assert line["scale_factor"] == pytest.approx(scale, abs=3e-6)
    assert abs(line["asymmetry_ppm"]) < 5.0 and line["nonlinearity_ppm"] < 5.0


@pytest.mark.parametrize("rate", [5.0, 0.1])
def test_one_rate_alone_is_told_as_that_where_earth_rate_turns_with_the_table(rate) -> None:
    """No slope over the rate is told by one rate, nor by what rounding leaves of its mean."""
    time = np.arange(2000.0)
    columns = {"time": time, "rate": 0.0 * time + rate, "angle": rate * time, "gyro": np.sin(time)}
    run = Run("one rate", columns, Facts(latitude=40.0, input_axis="north"))
    assert with_steady_earth(run) is run
    with pytest.raises(InputError, match="has to stay at two rates"):
        rate_json([run], source="one rate")
