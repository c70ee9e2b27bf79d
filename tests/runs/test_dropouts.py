"""Readings that are none are held at the last good one, flagged, and no part of fit, score or trained box."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.features.parse import parse_features
from fogml.models.compensation import compensate_blocks
from fogml.models.names import make_model
from fogml.runs.dropouts import RULE, DropoutRule, last_reading, read_thermometer
from fogml.runs.facts import Facts
from fogml.runs.noise_of_run import moving_temperatures
from fogml.runs.run import Run
from fogml.validation.inspection import inspection_json

ROWS = 7200
BAD = np.r_[50, 900:905, 3000, 5000:5200, 7199]


def cycle(seed=0, interval=1.0):
    time = interval * np.arange(float(ROWS))
    temperature = 20.0 + 40.0 * np.sin(np.pi * np.arange(ROWS) / ROWS) ** 2
    noise = np.random.default_rng(seed).normal(0.0, 0.3, ROWS)
    return {
        "time": time,
        "gyro": 5.0 + 0.05 * temperature + noise,
        "T": np.round(temperature / 0.0625) * 0.0625,
    }


def by_the_rule(time, values):
    """The rule as its docstring states it, sample by sample, from a good first reading on."""
    good, since, rejected, at, held, bad = values[0], time[0], None, 0.0, [values[0]], [False]
    for t, x in zip(time[1:], values[1:], strict=True):
        is_bad = not RULE.low_degC <= x <= RULE.high_degC or x == rejected
        is_bad |= abs(x - good) > RULE.jump_degC + RULE.rate_degC_s * (t - since)
        if rejected is not None and t - since <= RULE.spell_s:
            is_bad |= abs(x - rejected) <= 0.5 * RULE.jump_degC + RULE.rate_degC_s * (t - at)
        if is_bad:
            rejected, at = x, t
        else:
            good, since, rejected = x, t, None
        held.append(good)
        bad.append(is_bad)
    return np.array(held), np.array(bad)


@pytest.mark.parametrize("interval", [0.05, 1.0, 10.0])
@pytest.mark.parametrize("sentinel", [-127.0, 85.0, 0.0, -9999.0, 999.0])
def test_sentinels(sentinel, interval):
    columns = cycle(interval=interval)
    values = columns["T"].copy()
    values[BAD] = sentinel
    found = read_thermometer(columns["time"], values)
    held, bad = by_the_rule(columns["time"], values)
    np.testing.assert_array_equal(found.values, held)
    np.testing.assert_array_equal(found.bad, bad)
    told = np.abs(values - columns["T"]) > RULE.jump_degC + RULE.rate_degC_s * interval
    assert set(np.flatnonzero(found.bad)) <= set(BAD)
    assert np.all(found.bad[told] | (np.abs(values[told] - columns["T"][told]) < 25.0))
    assert np.abs(found.values - columns["T"])[told & found.bad].max() < 4.0


def test_a_dropout_at_the_first_sample():
    columns = cycle()
    columns["T"][:3] = 85.0
    found = read_thermometer(columns["time"], columns["T"])
    assert np.flatnonzero(found.bad).tolist() == [0, 1, 2]
    assert found.values[:3].tolist() == [columns["T"][3]] * 3


def test_nothing_is_found_in_sound_thermometers():
    rng = np.random.default_rng(4)
    columns = cycle()
    ramps = np.interp(columns["time"], [0, 600, 3600, 4100, 7200], [25.0, 25.0, -40.0, 85.0, 0.0])
    for values in (columns["T"], ramps, np.rint(ramps), ramps + rng.normal(0.0, 2.0, ROWS), np.zeros(ROWS)):
        assert read_thermometer(columns["time"], values).bad is None
    kelvin = columns["T"] + 273.15
    assert read_thermometer(columns["time"], kelvin).bad is None


@pytest.mark.parametrize("features", ["T, dT, T*dT", "T"])
def test_model_box_and_flags_are_those_of_the_clean_rows(features):
    sound, dropped = cycle(), cycle()
    dropped["T"][BAD] = -127.0
    clean, run = Run("clean", sound), Run("run", dropped)
    np.testing.assert_array_equal(run.columns["T"], dropped["T"])
    model = make_model("polynomial", features=features).fit(run)
    reference = make_model("polynomial", features=features).fit(clean)
    for name, (low, high) in model.card_.box.items():
        np.testing.assert_allclose((low, high), reference.card_.box[name], atol=0.25)
    np.testing.assert_allclose(model.predict(clean), reference.predict(clean), atol=0.02)
    flags = model.compensate(run).flag
    assert np.all(flags[BAD] == 2)
    # After a spell of 200 s no window is full, as after a gap.
    assert np.count_nonzero(flags != model.compensate(clean).flag) <= len(BAD) + model.window_s
    blocks = [run[start : start + 700] for start in range(0, ROWS, 700)]
    parts = [compensation for _, compensation in compensate_blocks(model, blocks)]
    np.testing.assert_array_equal(np.concatenate([part.flag for part in parts]), flags)
    drift = np.concatenate([part.drift for part in parts])
    np.testing.assert_allclose(drift, model.compensate(run).drift, atol=1e-9)


def test_what_is_told_of_a_run_counts_no_dropout():
    columns = cycle()
    columns["T"][BAD] = -127.0
    run = Run("r.csv", columns)
    told = inspection_json([run])["runs"][0]
    temperature = told["temperatures"]["T"]
    assert temperature["least"] > 19.0 and temperature["span"] < 41.0
    assert next(c for c in told["columns"] if c["name"] == "T")["least"] == temperature["least"]
    still = Run("s.csv", {**columns, "T": np.where(np.isin(np.arange(ROWS), BAD), -127.0, 25.0)})
    assert moving_temperatures(still) == {}


def test_a_mean_that_cancels_is_nothing_rather_than_rounding() -> None:
    turns = np.tile([0.1, 0.3, -0.3, -0.1], 25)
    assert turns.mean() != 0.0
    run = Run.from_columns(time=np.arange(100.0), gyro=1.0 + turns, rate=turns)
    told = {column["name"]: column["mean"] for column in inspection_json([run])["runs"][0]["columns"]}
    assert told["rate"] == 0.0 and told["gyro"] == pytest.approx(1.0)


def test_a_single_reading_after_others_is_judged_by_them():
    time, values = np.arange(51.0), np.full(51, 25.0)
    before = last_reading(time[:50], values[:50], read_thermometer(time[:50], values[:50]))
    for shown, bad in ((25.1, None), (999.0, [True])):
        found = read_thermometer(time[50:], np.array([shown]), before=before)
        assert (found.bad if found.bad is None else found.bad.tolist()) == bad
        assert found.values.tolist() == [25.0 if bad else shown]


def test_other_facts_and_findings_leave_the_rule_as_it_is():
    time = np.arange(100.0)
    run = Run.from_columns(time=time, gyro=np.sin(time), T=20.0 + 3.0 * (time == 50.0))
    run = run.read_by(DropoutRule(jump_degC=1.0, rate_degC_s=0.01, noise_sigma=0.0))
    assert run.temperature()[50] == 20.0
    assert run.with_facts(Facts(unit="F")).temperature()[50] == 20.0
    assert run.with_findings([]).temperature()[50] == 20.0


@pytest.mark.parametrize("spikes", [1, 40])
@pytest.mark.parametrize("moves", [0.0, 0.0625])
def test_spikes_make_no_quiet_thermometer_a_noisy_one(spikes, moves):
    """A thermometer that stands still or steps once, and spells of its sentinel: they alone change often."""
    time = np.arange(4000.0)
    values = np.where(time < 2000.0, 25.0, 25.0 + moves)
    false = np.isin(np.arange(4000), 50 + 90 * np.arange(spikes)[:, None] + np.arange(3))
    values[false] = 85.0
    found = read_thermometer(time, values)
    assert np.array_equal(np.flatnonzero(found.bad), np.flatnonzero(false))


def test_a_noisy_thermometer_steps_by_its_noise_and_no_further():
    """White noise of 3 degC, held or not: none of it is a dropout, 120 degC more is (8 sqrt(2) 3 = 34)."""
    rng = np.random.default_rng(0)
    for held in (1, 20):
        values = np.repeat(25.0 + 3.0 * rng.standard_normal(4000 // held), held)
        values[2000] += 120.0
        found = read_thermometer(np.arange(4000.0), values)
        assert np.flatnonzero(found.bad).tolist() == [2000]


@pytest.mark.parametrize("length", [1, 7, 64])
def test_blocks_of_any_length_find_the_dropouts_of_the_whole(length):
    rng = np.random.default_rng(1)
    time = np.arange(640.0)
    values = 20.0 + 15.0 * np.sin(time / 60.0) + 0.05 * rng.standard_normal(len(time))
    for start in (100, 200, 203, 441):
        values[start : start + 5] = rng.choice([-127.0, 85.0, 0.0])
    run = Run("run", {"time": time, "gyro": np.zeros(len(time)), "T": values})
    features = parse_features("T, dT[slope, 20 s], lag(T, 30 s)")
    blocks = features.blocks(1.0)
    pieces = [blocks.push(run[at : at + length]) for at in range(0, len(run), length)]
    whole = features.atom_values(run)
    assert np.array_equal(np.concatenate([piece.full for piece in pieces]), whole.full)
    np.testing.assert_allclose(np.concatenate([piece.values for piece in pieces]), whole.values, atol=1e-9)
