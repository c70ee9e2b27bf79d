"""The acceptance report of several kinds of run together: what each tells, by hand-made tables of rates."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.lab.acceptance import acceptance_json
from fogml.lab.acceptance_rows import Limit, Limits
from fogml.lab.rate_json import rate_json
from fogml.report.acceptance_page import acceptance_page
from fogml.runs.checks import check_run
from fogml.runs.facts import Facts
from fogml.runs.noise_of_run import noise_report
from fogml.runs.run import Run
from tests.lab.units import EARTH, row

UP = Facts(unit="FOG-0417", axis="z", latitude=39.9, input_axis="up")
EAST = UP.model_copy(update={"input_axis": "east"})


def table_run(name, rates_deg_h, seen_deg_h, stay=200, facts=EAST, seed=0, slope_ppm=0.0, noise=1e-4):
    """Plateaus of a table, each `stay` seconds, and what the gyro sees of them."""
    rate, seen = (np.repeat(np.asarray(values, dtype=float), stay) for values in (rates_deg_h, seen_deg_h))
    time = np.arange(len(rate), dtype=float)
    gyro = (
        seen
        + (facts.earth_rate_deg_h or 0.0)
        + noise * np.random.default_rng(seed).standard_normal(len(rate))
    )
    temperature = np.full(len(rate), 25.0)
    return Run.from_columns(name, facts, time=time, gyro=gyro, T=temperature, rate=rate / 3600.0)


def rising_ladder(asymmetry_ppm=40.0, cubic_ppm=30.0):
    """A ladder whose rates rise, each once, and by hand its nonlinearity [ppm]."""
    sizes = np.array([1.0, 5.0, 10.0, 20.0, 50.0, 80.0, 100.0])
    rates = 3600.0 * np.array([0.0, *(sign * size for size in sizes for sign in (1.0, -1.0)), 0.0])
    error = rates * 1e-6 * (0.5 * asymmetry_ppm * np.sign(rates) + cubic_ppm * (rates / 3.6e5) ** 2)
    levels = np.unique(rates)
    of_level = np.array([error[rates == level][0] for level in levels])
    left = of_level - np.polyval(np.polyfit(levels, of_level, 1), levels)
    return table_run("ladder", rates, rates + error), 1e6 * np.abs(left).max() / levels.max()


def test_nonlinearity_and_asymmetry_of_rates_that_rise_are_those_of_the_gyro_and_of_lab_rate():
    ladder, nonlinearity = rising_ladder()
    values = acceptance_json([ladder])
    line = rate_json([ladder], source="")["scale_factor"]
    for told in (row(values, "scale_factor_nonlinearity")["before"], line["nonlinearity_ppm"]):
        assert told == pytest.approx(nonlinearity, rel=1e-3)
    for told in (row(values, "scale_factor_asymmetry")["before"], line["asymmetry_ppm"]):
        assert told == pytest.approx(40.0, rel=1e-3)


@pytest.mark.parametrize(("stay", "rests"), [(20, True), (10, False), (200, False)])
def test_a_ladder_that_hardly_rests_tells_its_scale_factor_and_no_bias(cycle, stay, rests):
    """Short rests refused the report altogether; without rests what the scale factor is off was a bias."""
    rates = 3600.0 * np.array([sign * size for size in (1.0, 20.0, 50.0, 100.0) for sign in (1.0, -1.0)])
    rates = np.append(np.column_stack([np.zeros(8), rates]).ravel(), 0.0) if rests else rates
    ladder = table_run("ladder", rates, rates * (1.0 + 50e-6) + 0.3, stay=stay)
    alone, both = acceptance_json([ladder]), acceptance_json([cycle, ladder])
    assert row(alone, "scale_factor_error")["before"] == pytest.approx(50.0, abs=0.01)
    assert not row(alone, "bias")["tested"] and not row(alone, "bias_stability")["tested"]
    (note,) = (note for note in alone["notes"] if "tells no bias" in note)
    assert note.startswith("ladder: ") and note in both["notes"]
    for key in ("bias", "bias_stability", "hysteresis"):
        assert row(both, key) == row(acceptance_json([cycle]), key)
    assert row(alone, "scale_factor_nonlinearity")["before"] < 1.0
    assert "ladder" in acceptance_page(both)


@pytest.mark.parametrize("seconds", [3, 40, 140])
def test_a_static_run_too_short_for_a_bias_leaves_the_others_their_figures(cycle, seconds):
    """It refused the report altogether."""
    noise = 0.3 * np.random.default_rng(4).standard_normal(seconds)
    run = table_run("short", [0.0], [0.2], stay=seconds)
    columns = {name: run.columns[name] for name in ("time", "T")}
    short = Run.from_columns("short", EAST, **columns, gyro=0.2 + noise)
    alone, both = acceptance_json([short]), acceptance_json([cycle, short])
    for values in (alone, both):
        assert any(note.startswith("short: the run holds less than two averages") for note in values["notes"])
    for key in ("bias", "bias_stability"):
        assert "two averages at rest" in row(alone, key)["remark"]
        assert row(both, key) == row(acceptance_json([cycle]), key)
    told = row(alone, "bias_stability_10s")
    assert told["tested"] is (seconds >= 20)
    if told["tested"]:
        means = noise[: seconds // 10 * 10].reshape(-1, 10).mean(axis=1)
        assert told["before"] == pytest.approx(np.std(means, ddof=1))
    assert "short" in acceptance_page(both)


def warming(name, time_constant_s, ramp_deg_h=0.0):
    time = np.arange(7200.0)
    noise = 1e-4 * np.random.default_rng(1).standard_normal(len(time))
    gyro = 0.5 * np.exp(-time / time_constant_s) + ramp_deg_h * time / 7200.0 + noise
    facts = Facts(unit="u", axis="z", latitude=0.0, input_axis="up", powered_on=0.0)
    return Run.from_columns(name, facts, time=time, gyro=gyro, T=np.full(len(time), 25.0))


def test_turn_on_time_is_the_longest_of_the_runs_and_says_so():
    quick, slow, drifts = warming("quick", 300.0), warming("slow", 600.0), warming("drifts", 300.0, 1.0)

    def told(*runs, **more):
        return row(acceptance_json(runs, turn_on_band=0.05, averaging_s=20.0, **more), "turn_on_time")

    one = told(quick)
    assert one["before"] == pytest.approx(300.0 * np.log(0.5 / 0.05), rel=0.01)
    assert (one["of"], one["remark"], one["at_least"]) == ("quick", "", False)
    both = told(quick, slow)
    assert both["before"] == pytest.approx(600.0 * np.log(0.5 / 0.05), rel=0.01)
    assert (both["of"], both["remark"]) == ("slow", "the longest of 2 runs")
    # Half of a ramp's way in the run's last quarter is outside of the band.
    ends = told(slow, drifts)
    assert ends["at_least"] and ends["of"] == "drifts" and "drifts: not settled" in ends["remark"]
    assert ends["before"] == pytest.approx(0.75 * 7200.0, rel=0.01)
    for limit, met in ((7000.0, None), (5000.0, False)):
        assert told(drifts, limits=Limits({"turn_on_time": Limit(0.0, limit)}))["met"] is met


def test_repeatability_is_of_power_cycles_where_runs_say_so(cycle):
    rng = np.random.default_rng(2)
    bias, scale = 0.02 * rng.standard_normal(6), 8.0 * rng.standard_normal(6)
    turns = 3600.0 * np.array([0.0, 50.0, 0.0, -50.0, 0.0, 0.0])
    on = UP.model_copy(update={"powered_on": 0.0})
    starts = [
        table_run(f"on{k}", turns, turns * (1.0 + 1e-6 * scale[k]) + bias[k], facts=on, seed=k)
        for k in range(6)
    ]
    values = acceptance_json([cycle, *starts])
    assert row(values, "bias_repeatability")["before"] == pytest.approx(np.std(bias, ddof=1), rel=1e-3)
    assert row(values, "scale_factor_repeatability")["before"] == pytest.approx(
        np.std(scale, ddof=1), rel=1e-2
    )
    assert row(values, "bias_repeatability")["of"] == "6 power cycles"
    # Chi-square of five degrees of freedom lies under 1.1455 and over 11.0705 with 5 % each, by tables.
    spread = row(values, "bias_repeatability")["before"]
    ends = [spread * np.sqrt(5.0 / quantile) for quantile in (11.0705, 1.1455)]
    assert row(values, "bias_repeatability")["ci90"] == pytest.approx(ends, rel=1e-4)
    for times, near in ((0.5, False), (0.9, True), (1.5, True), (2.5, False)):
        limits = Limits({"bias_repeatability": Limit(0.0, times * spread)})
        found = acceptance_json([cycle, *starts], limits=limits)
        assert row(found, "bias_repeatability")["met"] is (times > 1.0)
        told = [
            note for note in found["notes"] if note.startswith("Bias repeatability: the limit lies within")
        ]
        assert bool(told) is near


def test_sensitivity_is_of_the_run_over_temperature_alone(cycle):
    """A ladder at one temperature has another scale factor by its nonlinearity."""
    ladder, _ = rising_ladder(cubic_ppm=3000.0)
    told = row(acceptance_json([cycle, ladder]), "scale_factor_temperature_sensitivity")
    assert (told["before"], told["of"]) == (pytest.approx(4.0, abs=0.01), "cycle")


def test_a_test_of_the_threshold_is_no_instability(cycle):
    sizes = [0.1, 0.3, 0.6, 1.2]
    rates = np.array([0.0, *(sign * size for size in sizes for sign in (1.0, 0.0, -1.0, 0.0))])
    small = table_run("small", rates, np.where(np.abs(rates) < 0.5, 0.0, rates))
    alone = acceptance_json([cycle])
    values = acceptance_json([cycle, small])
    assert (
        row(values, "threshold")["before"] == pytest.approx(0.6) and row(values, "threshold")["of"] == "small"
    )
    for key in ("bias", "bias_stability"):
        assert row(values, key)["before"] == row(alone, key)["before"]
    assert any("small: rates about zero" in note for note in values["notes"])
    assert not any(line["run"] == "small" for line in values["soaks"])


def test_a_range_of_limits_is_held_against_every_run(cycle, limits):
    """The run of the largest error is within, another one is not."""
    low = Run.derived("low", cycle.columns | {"gyro": cycle.gyro - 3600.0 * cycle.rate * 200e-6}, cycle.facts)
    values = acceptance_json([cycle, low], limits=limits(scale_factor_error={"from": -20, "to": 200}))
    told = row(values, "scale_factor_error")
    assert values["verdict"] == "rejected" and told["of"] == "low" and told["before"] < -20.0


def test_a_term_under_the_others_is_at_most_its_upper_end(limits):
    random = np.random.default_rng(4)
    gyro = EARTH + 0.1 * random.standard_normal(20_000)
    columns = {"time": np.arange(20_000.0), "gyro": gyro, "T": np.full(20_000, 25.0)}
    run = Run.from_columns("static", UP, **columns)
    told = row(acceptance_json([run]), "bias_instability")
    assert told["tested"] and told["at_most"] and 0.0 < told["before"] < 0.1
    bound = told["before"]
    assert acceptance_json([run], limits=limits(bias_instability=1.1 * bound))["verdict"] == "accepted"
    open_one = acceptance_json([run], limits=limits(bias_instability=0.9 * bound))
    assert open_one["verdict"] == "incomplete" and "at most" in open_one["reasons"][0]
    assert "≤ " in acceptance_page(open_one) and "! open" in acceptance_page(open_one)


def test_bias_stability_is_over_one_less_than_the_averages(limits):
    """Of few averages the difference decides: over n, three stand 18 % too low."""
    gyro = EARTH + 0.1 * np.random.default_rng(6).standard_normal(300)
    columns = {"time": np.arange(300.0), "gyro": gyro, "T": np.full(300, 25.0)}
    run = Run.from_columns("short", UP, **columns)
    for key, length in (("bias_stability", 100), ("bias_stability_10s", 10)):
        true = gyro.reshape(-1, length).mean(axis=1).std(ddof=1)
        assert row(acceptance_json([run]), key)["before"] == pytest.approx(true, rel=1e-9)
        assert acceptance_json([run], limits=limits(**{key: 0.97 * float(true)}))["verdict"] == "rejected"


def test_runs_that_do_not_state_their_attitude_bring_no_earth_rate_into_biases(limits):
    """Of eight runs two state none: before, the report rejected the unit by 9.65 deg/h of Earth rate."""
    rng = np.random.default_rng(9)
    biases = 0.02 * rng.standard_normal(8)
    temperatures = (25.0, 25.0, 25.0, -20.0, -20.0, 60.0, 60.0, 60.0)
    runs = []
    for k, (bias, temperature) in enumerate(zip(biases, temperatures, strict=True)):
        gyro = EARTH + bias + 1e-4 * rng.standard_normal(1500)
        facts = UP if k not in (1, 4) else Facts(unit=UP.unit, axis=UP.axis)
        columns = {"time": np.arange(1500.0), "gyro": gyro, "T": np.full(1500, temperature)}
        runs.append(Run.from_columns(f"run{k}", facts, **columns))
    values = acceptance_json(
        runs, limits=limits(bias=0.1, bias_repeatability=0.05, temperature_sensitivity=0.01)
    )
    known = np.delete(biases, [1, 4])
    assert row(values, "bias")["before"] == pytest.approx(known[np.argmax(np.abs(known))], abs=1e-4)
    assert row(values, "bias_repeatability")["before"] == pytest.approx(np.std(known, ddof=1), abs=1e-4)
    assert row(values, "bias_repeatability")["of"] == "6 runs"
    assert values["verdict"] == "accepted"
    assert any("run1, run4: Earth rate is not known" in note for note in values["notes"])
    # Where none states it, it is in all alike, and repeatability is of all.
    alike = [Run.from_columns(one.name, Facts(unit=UP.unit, axis=UP.axis), **one.columns) for one in runs]
    told = row(acceptance_json(alike), "bias_repeatability")
    assert told["before"] == pytest.approx(np.std(biases, ddof=1), abs=1e-4)


def test_noise_terms_are_those_of_the_static_run_alone(cycle, monkeypatch):
    """A fit for each run, of which nothing is told, took three quarters of the time."""
    fitted = []

    def told(run):
        fitted.append(run.name)
        return noise_report(run)

    for place in ("fogml.validation.judge", "fogml.lab.acceptance_figures"):
        monkeypatch.setattr(f"{place}.noise_report", told)
    still = table_run("still", [0.0], [0.0], stay=2000, facts=UP)
    assert row(acceptance_json([cycle, still]), "angle_random_walk")["of"] == "still"
    assert set(fitted) == {"still"}


def test_a_noise_run_that_warms_up_tells_what_noise_tells_of_it(cycle):
    """It was left out without a word: N was "not tested" of a run that was named for it."""
    time = np.arange(4000.0)
    T = 25.0 + 3.0 * (1.0 - np.exp(-time / 900.0))
    gyro = EARTH + 0.05 * T + 0.6 * np.random.default_rng(5).standard_normal(4000)
    rate = 1e-6 * np.random.default_rng(6).standard_normal(4000)  # as recorded of a table that rests
    warm = Run.from_columns("warm", UP, time=time, gyro=gyro, T=T, rate=rate)
    values = acceptance_json([cycle], noise=warm)
    assert row(values, "angle_random_walk")["before"] == pytest.approx(0.6 / 60.0, rel=0.05)
    for key in ("rate_random_walk", "rate_ramp"):
        assert "0.5 degC" in row(values, key)["remark"] and not row(values, key)["tested"]
    still = warm.with_columns(T=np.full(4000, 25.0))
    assert row(acceptance_json([still]), "angle_random_walk")["tested"]
    with pytest.raises(InputError, match="a noise run is a static one"):
        acceptance_json([cycle], noise=cycle)


def test_an_output_at_the_ends_of_its_range_is_not_accepted(cycle, limits):
    stated = limits(bias_stability=1.0)
    assert acceptance_json([cycle.with_findings(check_run(cycle))], limits=stated)["verdict"] == "accepted"
    at_rest, noisy = cycle.rate == 0.0, cycle.gyro + np.random.default_rng(3).normal(0.0, 0.05, len(cycle))
    cut = np.where(at_rest, np.minimum(noisy, np.quantile(noisy[at_rest], 0.9)), cycle.gyro)
    cut[~at_rest] = np.minimum(cut[~at_rest], cut[at_rest].max())
    run = cycle.with_columns(gyro=cut)
    told = acceptance_json([run.with_findings(check_run(run))], limits=stated)
    assert told["verdict"] == "incomplete"
    assert "may saturate" in told["reasons"][0]


def test_what_can_not_be_as_stated_is_in_the_notes(cycle):
    turned = cycle.with_columns(rate=-cycle.rate)
    told = acceptance_json([turned.with_findings(check_run(turned))])
    assert "with the other sign" in told["notes"][0]
    noisy = cycle.gyro + np.random.default_rng(3).normal(0.0, 0.05, len(cycle))
    beyond = cycle.with_columns(gyro=np.clip(noisy, -3600.0 * 50.0, 3600.0 * 50.0))
    told = acceptance_json([beyond.with_findings(check_run(beyond))])
    assert "may saturate" in told["notes"][0] and "may saturate" not in " ".join(told["reasons"])


def test_a_threshold_above_all_that_was_tested_is_told_and_misses_its_limit():
    large = 3600.0 * np.array([0.0, 10.0, -10.0, 50.0, -50.0, 100.0, -100.0, 0.0])
    small = np.array([0.0, *(sign * size for size in (0.1, 0.2, 0.5) for sign in (1.0, 0.0, -1.0)), 0.0])
    runs = [table_run("run.csv", large, large), table_run("run.csv", small, 0.0 * small, seed=1)]
    for most, met, verdict in ((0.2, False, "rejected"), (1.0, None, "incomplete")):
        values = acceptance_json(runs, limits=Limits({"threshold": Limit(-most, most)}))
        told = row(values, "threshold")
        assert told["tested"] and told["at_least"] and told["before"] == pytest.approx(0.5)
        assert told["met"] is met and values["verdict"] == verdict
    assert "≥ 0.5" in acceptance_page(values)
