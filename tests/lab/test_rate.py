"""Tests on a rate table against closed forms: of twins, and of a table written by hand."""

from __future__ import annotations

import html
import math
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.lab.rate_json import rate_json, unit_facts
from fogml.lab.rate_pieces import Oscillation, find_oscillations, find_plateaus, merged
from fogml.lab.rate_programmes import rate_runs
from fogml.lab.rate_response import bandwidth, gain_of
from fogml.lab.rate_temperature import temperature_sensitivity
from fogml.lab.rate_tests import Answer, Criteria, least_seen
from fogml.lab.rate_words import bracketed, result_rows
from fogml.pictures import Curve
from fogml.report import rate_page as page
from fogml.report.rate_page import rate_page
from fogml.runs.checks import check_run
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.twin.optics import Coil
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin

TAU_S = 5e-4
FREQUENCIES = np.array([10.0, 100.0, 200.0, 300.0, 400.0, 600.0])


@lru_cache(maxsize=1)
def of_a_twin() -> dict[str, Any]:
    """A twin with one of each, noise-free."""
    twin = load_twin("nominal").with_nominal(k1=20.0, b0=1.0)
    twin = twin.with_effect("deadband", 0.3).with_effect("rate_range", 1.0, range=330.0)
    twin = twin.with_effect("loop_gain", TAU_S, power_slope=0.0, leak_time=1e9)
    twin = twin.with_effect("sf_asymmetry", 100.0).with_effect("sf_temperature", 15.0)
    twin = twin.with_effect("slew_limit", 1.0, slew=8000.0)
    return rate_json(rate_runs(twin, frequencies_hz=FREQUENCIES), source="twin", twin=twin)


def test_threshold_and_dead_zone_of_a_locked_oscillator() -> None:
    """out = sqrt(w**2 - w_d**2) is half of w at 2 w_d / sqrt(3), and dead from -w_d to w_d."""
    told = of_a_twin()
    threshold, zone = told["threshold"], told["dead_zone"]
    assert threshold["above_deg_h"] < 2.0 / math.sqrt(3.0) * 0.3 <= threshold["below_deg_h"]
    assert zone["above_deg_h"] <= 0.6 <= zone["below_deg_h"]
    shares = {round(one["size"], 6): one["share"] for one in told["zero_answers"]}
    assert shares[1.0] == pytest.approx(math.sqrt(1.0 - 0.3**2), abs=2e-3)
    # Away from zero there is none of it.
    assert told["resolution"] == {"above_deg_h": None, "below_deg_h": pytest.approx(0.001)}


def test_range_slew_asymmetry_and_bandwidth_are_those_of_the_effects() -> None:
    told = of_a_twin()
    assert told["range"]["followed_deg_s"] == pytest.approx(300.0)
    assert told["range"]["exceeded_deg_s"] == pytest.approx(350.0)
    assert told["range"]["output_deg_s"] == pytest.approx(330.0)
    # Both senses have their own scale factor, k_a above and below the mean.
    assert told["scale_factor"]["asymmetry_ppm"] == pytest.approx(200.0, rel=1e-3)
    assert told["slew"]["limited"] and told["slew"]["output_deg_s2"] == pytest.approx(8000.0, rel=0.02)
    wanted = 1.0 / (2.0 * math.pi * TAU_S)
    assert told["bandwidth"]["half_power_hz"] == pytest.approx(wanted, rel=5e-3)
    assert told["bandwidth"]["first_order_hz"] == pytest.approx(wanted, rel=5e-3)


def test_temperature_sensitivity_is_the_sum_of_its_causes() -> None:
    sensed = of_a_twin()["temperature_sensitivity"]
    # In ppm of the scale factor at the mean of the temperatures.
    assert sensed["ppm_per_degC"] == pytest.approx(35.0, rel=1e-3)
    assert abs(sensed["curvature_ppm_per_degC2"]) < 1e-3
    assert of_a_twin()["notes"] == []


def test_the_order_of_runs_at_a_temperature_each_says_nothing() -> None:
    runs = []
    for seed, degrees in enumerate([-20.0, 10.0, 25.0, 60.0]):
        run = by_hand(np.array([0.0, 20.0, -20.0, 40.0, -40.0, 0.0]), seed=seed)
        runs.append(Run(f"at {degrees}", {**run.columns, "T": np.full(len(run), degrees)}, run.facts))
    one, other = (temperature_sensitivity(order, 3600.0, 3.6e5) for order in (runs, runs[2:] + runs[:2]))
    assert one is not None and other is not None
    assert other.ppm_per_degC == pytest.approx(one.ppm_per_degC, rel=1e-9)
    assert other.se == pytest.approx(one.se, rel=1e-9) and abs(one.ppm_per_degC) < 4.0 * one.se


def test_a_scale_factor_over_temperature_is_no_nonlinearity() -> None:
    """Turns in soaks of one run: the line is that of one temperature, and the run is said to be synthetic."""
    turns = [
        "turn at 10 deg/s for 60 s, then -10 deg/s for 60 s, then 40 deg/s for 60 s, then -40 deg/s for 60 s"
    ]
    steps = [{"soak at 25 degC for 2 h": [f"{turns[0]}, from minute 100"]}, "ramp to 60 degC at 5 degC/min"]
    steps += [{"soak at 60 degC for 3 h": [f"{turns[0]}, from minute 160"]}]
    run = simulate(steps, Twin().with_nominal(k1=20.0), sample_s=1.0).run
    told = rate_json([run], source="a run")
    line = told["scale_factor"]
    assert line["nonlinearity_ppm"] < 1.0 and abs(line["asymmetry_ppm"]) < 1.0
    assert told["temperature_sensitivity"]["ppm_per_degC"] == pytest.approx(20.0, rel=0.01)
    assert told["synthetic"] and told["kind"] == "recorded"
    bare = Run(run.name, run.columns, run.facts.model_copy(update={"notes": None}))
    assert not rate_json([bare], source="a run")["synthetic"]


@pytest.mark.parametrize("scale", [1.0, -1.0])
def test_the_slew_of_a_saturated_output_is_the_tables_and_no_rows(scale: float) -> None:
    """From 300 to -300 deg/s at 50 deg/s2, of which the output follows 250 of either side."""
    commanded = np.repeat([0.0, 100.0, -100.0, 300.0, -300.0, 0.0], 600)
    rate = np.zeros(len(commanded))
    for row in range(1, len(rate)):
        rate[row] = rate[row - 1] + np.clip(commanded[row] - rate[row - 1], -5.0, 5.0)
    gyro = scale * 3600.0 * np.clip(rate, -250.0, 250.0) + np.random.default_rng(0).standard_normal(len(rate))
    run = Run("run", {"time": 0.1 * np.arange(len(rate)), "gyro": gyro, "rate": rate}, Facts())
    told = rate_json([run], source="a run")["slew"]
    assert told["output_deg_s2"] == pytest.approx(50.0, rel=0.01)
    assert told["table_deg_s2"] == pytest.approx(50.0, rel=0.01) and not told["limited"]


def test_the_picture_is_of_the_ladder_that_the_line_is_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """One ladder of many rates, and one that is cut off at 250 deg/s, whose rates are as great."""
    many = np.array([0, 50, -50, 100, -100, 200, -200, 300, -300.0])
    ladders = {"many": many, "few": np.array([0, 100, -100, 300, -300.0])}
    runs = []
    for name, rates in ladders.items():
        rate = np.repeat(rates, 60)
        output = 1.0002 * rate if name == "many" else np.clip(rate, -250.0, 250.0)
        gyro = 3600.0 * output + np.random.default_rng(1).standard_normal(len(rate))
        runs.insert(0, Run(name, {"time": 1.0 * np.arange(len(rate)), "gyro": gyro, "rate": rate}, Facts()))
    told = rate_json(runs, source="two runs")
    assert told["told_by"]["scale_factor"] == ["many"] and told["range"]["followed_deg_s"] == 300.0
    assert "In few the output no longer follows 300 deg/s, which many follows." in told["notes"]
    drawn: list[Curve] = []
    monkeypatch.setattr(page, "line_figure", lambda curves, *_, **__: drawn.extend(curves))
    page._ladder(told)
    assert len(drawn[0].x) == len(many) and np.nanmax(np.abs(drawn[0].y)) < 5.0


def test_a_lag_is_no_slew_limit() -> None:
    twin = Twin().with_effect("loop_gain", 5e-3, power_slope=0.0, leak_time=1e9)
    told = rate_json(rate_runs(twin, frequencies_hz=np.array([10.0, 20.0])), source="twin", twin=twin)
    assert not told["slew"]["limited"]
    # From 10 to 90 % an exponential takes ln 9 time constants.
    assert told["bandwidth"]["first_order_hz"] == pytest.approx(1.0 / (2.0 * math.pi * 5e-3), rel=0.01)


def test_the_ladder_that_ships_tells_a_dead_zone_through_noise() -> None:
    twin = Twin().with_noise(N=0.002).with_effect("deadband", 0.3).with_effect("sf_asymmetry", 50.0)
    facts = Facts(latitude=-20.0, input_axis="west", table_axis="west")
    for seed in range(3):
        run = simulate("rate-ladder", twin, seed=seed, facts=facts, columns=("T_in", "rate")).run
        told = rate_json([run], source="ladder")
        zone, threshold = told["dead_zone"], told["threshold"]
        assert zone["above_deg_h"] <= 0.6 <= zone["below_deg_h"] <= 1.0
        assert threshold["above_deg_h"] <= 2.0 / math.sqrt(3.0) * 0.3 <= threshold["below_deg_h"]
        assert told["scale_factor"]["asymmetry_ppm"] == pytest.approx(100.0, abs=2.0)


def test_noise_hides_small_rates_and_the_answer_says_so() -> None:
    twin = Twin().with_noise(N=0.05)
    told = rate_json(rate_runs(twin, frequencies_hz=np.array([10.0]), noise=True, seed=2), source="twin")
    # 0.05 deg/sqrt(h) over a minute is 0.39 deg/h, and a share is told to 0.2.
    smallest = min(one["size"] for one in told["zero_answers"])
    assert 0.4 < smallest <= 5.0
    assert told["threshold"]["above_deg_h"] is None and told["threshold"]["below_deg_h"] == smallest


def by_hand(rates: FloatArray, stay: int = 40, seed: int = 1, **facts: Any) -> Run:
    """A table's rates in turn, a gyro of 1.0002 with a drifting bias and noise, Earth rate on the axis."""
    rng = np.random.default_rng(seed)
    rate = np.repeat(rates, stay)
    time = 0.5 * np.arange(len(rate))
    stated = Facts(**facts)
    acting = 3600.0 * rate + (stated.earth_rate_deg_h or 0.0)
    gyro = 1.0002 * acting + 2.0 + 1e-3 * time + 0.5 * rng.standard_normal(len(rate))
    return Run("table", {"time": time, "gyro": gyro, "rate": rate}, stated)


def test_scale_factor_of_a_table_by_hand_within_its_standard_error() -> None:
    ladder = np.array([0.0, 5.0, -5.0, 10.0, -10.0, 20.0, -20.0, 40.0, -40.0, 0.0])
    off = []
    for seed in range(20):
        run = by_hand(ladder, seed=seed, latitude=50.0, input_axis="up")
        line = rate_json([run], source="table")["scale_factor"]
        off.append((line["scale_factor"] - 1.0002) / line["se"])
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.5


def test_a_rate_that_was_measured_has_its_noise_and_the_same_levels() -> None:
    ladder = np.array([0.0, 5.0, -5.0, 10.0, -10.0, 5.0, -5.0, 0.0])
    run = by_hand(ladder, stay=200)
    rng = np.random.default_rng(9)
    noisy = run.with_columns(rate=run.rate + 0.002 * rng.standard_normal(len(run)))
    plateaus = find_plateaus(noisy)
    assert len(plateaus) == len(ladder)
    assert len(np.unique(merged(plateaus.rate, plateaus.rate_error))) == 5
    told = rate_json([noisy], source="table")
    assert told["scale_factor"]["scale_factor"] == pytest.approx(1.0002, abs=1e-4)
    assert abs(told["scale_factor"]["asymmetry_ppm"]) < 300.0


def test_earth_rate_counts_where_zero_is() -> None:
    """With the axis up a table that turns against the Earth has zero rate on the gyro."""
    earth = Facts(latitude=50.0, input_axis="up").earth_rate_deg_h
    assert earth is not None
    small = np.array([0.0, 1.0, -1.0, 5.0, -5.0, 20.0, -20.0])
    rates = np.concatenate([(small - earth) / 3600.0, [10.0, -10.0]])
    run = by_hand(rates, stay=400, latitude=50.0, input_axis="up")
    assert find_plateaus(run).rate[:3] == pytest.approx([0.0, 1.0, -1.0], abs=1e-9)
    told = rate_json([run], source="table")
    assert told["threshold"]["below_deg_h"] == pytest.approx(1.0)


BOTH, ONE = (2.0, -2.0, 5.0, -5.0, 10.0, -10.0, 20.0, -20.0), (2.0, 5.0, 10.0, 20.0)


@pytest.mark.parametrize(
    ("small", "zero", "rests", "told"),
    [
        (BOTH, 0.0, True, (10.0, 20.0)),
        (BOTH, 0.0, False, (10.0, 20.0)),
        (BOTH, -40.0, True, (10.0, 20.0)),
        (ONE, 0.0, True, None),
        (ONE, 0.0, False, None),
        ((10.0, 20.0, 30.0, 40.0), 0.0, False, None),
        ((*BOTH, 30.0), 0.0, True, (10.0, 20.0)),
    ],
)
def test_a_threshold_is_told_of_both_senses_about_where_the_table_returns_to(
    small, zero, rests, told
) -> None:
    """A gyro that is silent up to 15 deg/h about a rate; one sense alone has another middle."""
    between = [[zero + rate, zero] if rests else [zero + rate] for rate in small]
    rates = np.concatenate([[0.0, 36000.0, 0.0, -36000.0, 0.0, zero], *between, [0.0]])
    rate = np.repeat(rates, 60)
    off = rate - zero
    gyro = off * (np.abs(off) > 15.0) + 0.05 * np.random.default_rng(3).standard_normal(len(rate))
    run = Run("small", {"time": 1.0 * np.arange(len(rate)), "gyro": gyro, "rate": rate / 3600.0}, Facts())
    values = rate_json([run], source="table")
    if told is None:
        assert values["threshold"] is None and values["dead_zone"] is None
        assert any("rates of both senses about zero" in note for note in values["notes"])
        return
    assert tuple(values["threshold"].values()) == pytest.approx(told)
    assert tuple(values["dead_zone"].values()) == pytest.approx((2.0 * told[0], 2.0 * told[1]))


@pytest.mark.parametrize("scale", [1.0, -1.0, 2.5])
def test_a_bandwidth_is_the_same_of_an_output_of_either_sign(scale: float) -> None:
    """A first-order loop of 2 Hz, sampled densely; an output that counts the other way has the same gains."""
    time, parts = 0.01 * np.arange(2000), [np.repeat([0.0, 10.0, -10.0, 0.0], 500)]
    output = [parts[0]]
    for hertz in (0.5, 1.0, 2.0, 4.0):
        phase, lag = 2.0 * math.pi * hertz * time, math.atan(hertz / 2.0)
        parts += [5.0 * np.sin(phase), np.zeros(500)]
        output += [5.0 * math.cos(lag) * np.sin(phase - lag), np.zeros(500)]
    rate, gyro = np.concatenate(parts), 3600.0 * scale * np.concatenate(output)
    run = Run("waves", {"time": 0.01 * np.arange(len(rate)), "gyro": gyro, "rate": rate}, Facts())
    told = rate_json([run], source="table")
    assert told["scale_factor"]["scale_factor"] == pytest.approx(scale, rel=1e-4)
    assert told["bandwidth"]["half_power_hz"] == pytest.approx(2.0, rel=0.01)


def test_gain_of_a_delayed_wave_by_hand() -> None:
    time = 1e-3 * np.arange(4000.0)
    omega = 2.0 * math.pi * 5.0
    rate = np.where(time < 3.0, 2.0 * np.sin(omega * time), 0.0)
    gyro = np.where(time < 3.0, 0.8 * 7200.0 * np.sin(omega * time - 0.3), 0.0) + 4.0
    run = Run("wave", {"time": time, "gyro": gyro, "rate": rate}, Facts())
    (wave,) = find_oscillations(run)
    found = gain_of(run, wave)
    assert wave.frequency_hz == pytest.approx(5.0, rel=1e-6)
    assert found.gain == pytest.approx(0.8, rel=1e-3)
    assert found.phase_deg == pytest.approx(-math.degrees(0.3), abs=0.05)
    assert bandwidth([found]) is None


def test_a_gain_scatters_by_its_standard_error() -> None:
    random, time = np.random.default_rng(5), 1e-3 * np.arange(3000.0)
    wave = Oscillation(0, len(time), 5.0)
    rate = 2.0 * np.sin(10.0 * math.pi * time)
    found = [
        gain_of(Run("wave", {"time": time, "gyro": gyro, "rate": rate}, Facts()), wave)
        for gyro in 5760.0 * np.sin(10.0 * math.pi * time - 0.3)
        + 500.0 * random.standard_normal((300, len(time)))
    ]
    gains = np.array([one.gain for one in found])
    assert np.std(gains) == pytest.approx(np.mean([one.se for one in found]), rel=0.12)
    assert abs(np.mean(gains) - 0.8) < 4.0 * np.std(gains) / math.sqrt(len(gains))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("gains", "told"), [((1.0, 0.9), "> 300"), ((0.6, 0.3), "< 100")])
def test_a_bandwidth_beyond_the_frequencies_tested_says_on_which_side(gains, told, sign) -> None:
    values = rate_json([by_hand(np.array([0.0, 10.0, -10.0, 0.0]))], source="table")
    values["scale_factor"]["scale_factor"] *= sign
    values["gains"] = [{"frequency_hz": f, "gain": g} for f, g in zip((100.0, 300.0), gains)]
    values["bandwidth"] = {"half_power_hz": None, "first_order_hz": None}
    (row,) = (row for row in result_rows(values) if row.quantity == "bandwidth")
    assert row.value == told


def test_turns_to_and_fro_are_no_oscillation() -> None:
    run = by_hand(np.tile([10.0, -10.0], 6))
    assert find_oscillations(run) == [] and len(find_plateaus(run)) == 12


def test_what_is_not_tested_is_said_and_a_still_table_refused() -> None:
    told = rate_json([by_hand(np.array([0.0, 10.0, -10.0, 0.0]))], source="table")
    assert told["bandwidth"] is None and any("bandwidth" in note for note in told["notes"])
    with pytest.raises(InputError, match="holds no test on a rate table"):
        rate_json([by_hand(np.zeros(4))], source="table")


def test_facts_of_the_unit_follow_from_its_coil() -> None:
    facts = unit_facts(Twin(coil=Coil(length=2000.0, diameter=0.05, wavelength=1310e-9)))
    sagnac = 2.0 * math.pi * 2000.0 * 0.05 / (1310e-9 * 299_792_458.0)
    assert facts["sagnac_s"] == pytest.approx(sagnac)
    assert facts["fringe_deg_s"] == pytest.approx(math.degrees(2.0 * math.pi / sagnac))
    assert facts["transit_us"] == pytest.approx(1e6 * 1.4525 * 2000.0 / 299_792_458.0)
    assert facts["proper_frequency_khz"] == pytest.approx(500.0 / facts["transit_us"])
    # As the catalogue has it for the reference coil, 20 uW and a depth of pi / 2.
    assert unit_facts(Twin())["photon_walk_deg_sqrt_h"] == pytest.approx(1.89e-3, abs=5e-6)


def test_an_output_that_does_not_move_with_the_table_is_refused() -> None:
    run = by_hand(np.array([0.0, 10.0, -10.0, 20.0, -20.0]))
    with pytest.raises(InputError, match="table: the column 'gyro' stays at one value over all rates"):
        rate_json([run.with_columns(gyro=np.full(len(run), 3.0))], source="table")


def test_what_was_noticed_in_the_runs_is_told_and_drawn() -> None:
    ladder = np.array([0.0, 5.0, -5.0, 10.0, -10.0, 20.0, -20.0, 40.0, -40.0, 0.0])
    sound = by_hand(ladder)
    assert rate_json([sound.with_findings(check_run(sound))], source="sound")["findings"] == []
    stuck = sound.gyro.copy()
    stuck[200:320] = stuck[200]
    for gyro, code in ((-sound.gyro, "implausible_scale_factor"), (stuck, "stuck_sensor")):
        run = sound.with_columns(gyro=gyro)
        told = rate_json([run.with_findings(check_run(run))], source="faulty")
        assert ("table", code) == (told["findings"][0]["run"], told["findings"][0]["code"])
        assert told["findings"][0]["message"][1:] in html.unescape(rate_page(told))


def zone_and_ladder() -> tuple[Run, Run]:
    """Plateaus of 60 s of a gyro with a dead zone of 0.2 deg/h: small rates, and large ones."""
    runs = []
    for sizes in ((0.05, 0.1, 0.2, 0.5, 1.0, 2.0), (36e3, 72e3, 360e3)):
        rates = np.repeat([0.0, *(sign * size for size in sizes for sign in (1.0, 0.0, -1.0)), 0.0], 60)
        seen = np.sign(rates) * np.sqrt(np.maximum(rates**2 - 0.2**2, 0.0))
        time = np.arange(float(len(rates)))
        runs.append(Run.from_columns("run.csv", time=time, gyro=seen, rate=rates / 3600.0))
    return runs[0], runs[1]


def test_runs_of_one_name_are_all_told_of() -> None:
    small, large = zone_and_ladder()
    for runs in ((small, large), (large, small)):
        told = rate_json(runs, source="")
        assert told["threshold"] == {"above_deg_h": pytest.approx(0.2), "below_deg_h": pytest.approx(0.5)}
        assert len(set(told["runs"])) == 2


def test_a_dead_zone_is_not_the_end_of_the_range() -> None:
    """Alone, small rates are a ladder: its line goes through all of them, not the dead ones."""
    told = rate_json(zone_and_ladder()[:1], source="")
    assert told["range"]["exceeded_deg_s"] is None
    assert told["scale_factor"]["scale_factor"] == pytest.approx(1.0, abs=0.03)


def test_a_threshold_that_noise_leaves_open_has_no_end() -> None:
    found = least_seen([Answer(0.5, 0.5, 0.1), Answer(1.0, 0.6, 0.15)], Criteria())
    assert found is not None
    assert bracketed({"above_deg_h": found.above, "below_deg_h": found.below}) == "within noise"


def test_a_rate_at_which_the_output_is_cut_off_is_beyond_the_range() -> None:
    """A digital output ends at its rated range: cut off by less than its error, 40 deg/s read none."""
    ladder = np.array([0.0, 5.0, -5.0, 10.0, -10.0, 20.0, -20.0, 40.0, -40.0, 0.0])
    run = by_hand(ladder)
    cut = run.with_columns(gyro=np.clip(run.gyro, -3600.0 * 40.0, 3600.0 * 40.0))
    told = rate_json([cut], source="cut")
    assert (told["range"]["followed_deg_s"], told["range"]["exceeded_deg_s"]) == pytest.approx((20.0, 40.0))
    low, high = told["scale_factor"]["ci90"]
    assert low < 1.0002 < high
    # Neither coarse counts nor an output without noise are cut off.
    for gyro in (500.0 * np.round(run.gyro / 500.0), 1.0002 * 3600.0 * run.columns["rate"]):
        assert rate_json([run.with_columns(gyro=gyro)], source="whole")["range"]["exceeded_deg_s"] is None


@pytest.mark.parametrize("late", [0, 3, -3])
def test_a_rate_that_is_recorded_late_or_early_moves_no_scale_factor(late):
    """Plateaus held what the gyro saw of the next rate: with a second of 60 the scale factor was 4 % off."""
    rates = np.array([0.0, *(sign * size for size in (5.0, 20.0, 50.0) for sign in (1.0, -1.0)), 0.0])
    true = np.repeat(rates, 60)
    noise = 0.1 * np.random.default_rng(4).standard_normal(len(true))
    gyro = 3600.0 * true * (1.0 + 80e-6) + 2.0 + noise
    recorded = true[np.clip(np.arange(len(true)) - late, 0, len(true) - 1)]
    run = Run.from_columns("late", Facts(), time=np.arange(float(len(true))), gyro=gyro, rate=recorded)
    line = rate_json([run], source="")["scale_factor"]
    # A mean over 50 rows of 0.1 deg/h is told to 0.014 deg/h, 0.08 ppm of the greatest rate.
    assert line["scale_factor"] == pytest.approx(1.0 + 80e-6, abs=0.3e-6)
    assert line["ci90"][0] < 1.0 + 80e-6 < line["ci90"][1]
    assert line["nonlinearity_ppm"] < 0.5


def test_a_bias_that_bends_over_a_long_rest_takes_no_plateau_away():
    """What an hour's line misses at its end looked like a rate that is recorded late."""
    rate = np.append(np.concatenate([np.zeros(3600), np.repeat([10.0, -10.0], 60)] * 3), np.zeros(60))
    time = np.arange(float(len(rate)))
    bias = np.exp(-(time % 3720.0) / 200.0)
    noise = 0.3 * np.random.default_rng(1).standard_normal(len(rate))
    gyro = 3600.0 * rate * (1.0 + 50e-6) + bias + noise
    run = Run.from_columns("soaks", Facts(), time=time, gyro=gyro, rate=rate)
    assert len(find_plateaus(run)) == 10
    line = rate_json([run], source="")["scale_factor"]
    assert line["scale_factor"] == pytest.approx(1.0 + 50e-6, abs=5e-6)
