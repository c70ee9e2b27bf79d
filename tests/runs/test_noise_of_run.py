from __future__ import annotations

import json
import re

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from fogml.errors import InputError
from fogml.runs import noise_of_run
from fogml.runs.facts import Facts, ScaleFactor
from fogml.runs.noise_of_run import noise_report
from fogml.runs.noise_series import rows_at_rest, stretches_at_rest
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run
from fogml.signals import noise_terms


def still_run(seed: int = 1, n: int = 20_000, **columns: np.ndarray) -> Run:
    """White noise of N = 0.01 deg/sqrt(h) at 10 Hz, on Earth rate."""
    rng = np.random.default_rng(seed)
    gyro = 9.0 + 0.6 / np.sqrt(0.1) * rng.normal(size=n)
    return Run.from_columns("still", time=0.1 * np.arange(n), **{"gyro": gyro, **columns})


def at(report: dict, tau_s: float) -> float:
    return report["adev"][report["taus_s"].index(tau_s)]


def test_ring_laser_figures():
    run = shipped_run("ring-laser-z")
    overlapping = noise_report(run)
    found = [at(overlapping, tau) for tau in (1.0, 10.0, 60.0)]
    assert found == pytest.approx([8.71, 1.49, 0.40], abs=0.005)
    stepped = noise_report(run, overlapping=False)
    found = [at(stepped, tau) for tau in (1.0, 10.0, 60.0)]
    assert found == pytest.approx([7.25, 1.53, 0.28], abs=0.006)
    # The terms come from the same windows either way.
    assert stepped["terms"] == overlapping["terms"]


def test_ring_laser_sees_the_earth_turn():
    seen = [noise_report(shipped_run(f"ring-laser-{axis}"))["mean"] for axis in "xyz"]
    assert np.linalg.norm(seen) == pytest.approx(14.85, abs=0.01)


def test_report_is_json_with_the_documented_keys():
    report = noise_report(still_run())
    again = json.loads(json.dumps(report, allow_nan=False))
    assert again["schema"] == "fogml.noise/1"
    assert again["unit"] == "deg/h"
    assert {"taus_s", "adev", "ci", "terms", "minimum"} <= set(again)
    assert len(again["taus_s"]) == len(again["adev"]) == len(again["ci"])
    assert all(low <= adev <= high for adev, (low, high) in zip(again["adev"], again["ci"]))
    assert list(again["terms"]) == ["Q", "N", "B", "K", "R"]
    assert [again["terms"][name]["unit"] for name in "NBKQR"] == [
        "deg/sqrt(h)",
        "deg/h",
        "deg/h/sqrt(h)",
        "urad",
        "deg/h/h",
    ]
    assert set(again["minimum"]) == {"adev", "tau_s"}
    low, high = again["terms"]["N"]["ci"]
    assert 0.0095 < low < again["terms"]["N"]["value"] < high < 0.0105


def test_gaps_are_not_joined_and_lost_samples_do_not_stretch_time():
    run = still_run(n=30_000)
    # Offsets that a difference across a gap would see.
    part = np.repeat([0.0, 300.0, -200.0], 10_000)
    gapped = run.with_columns(gyro=run.gyro + part, time=run.time + np.repeat([0.0, 50.0, 400.0], 10_000))
    report = noise_report(gapped)
    assert report["stretches"] == 3
    assert report["terms"]["N"]["value"] == pytest.approx(0.01, rel=0.05)
    assert at(report, 10.0) == pytest.approx(at(noise_report(run), 10.0), rel=0.2)


@pytest.mark.parametrize("column", ["T", "T_in", "T4", "T_case"])
def test_moving_temperature_takes_k_and_r_away(column: str):
    moving = still_run(**{column: np.linspace(20.0, 21.0, 20_000)})
    report = noise_report(moving)
    for name in ("K", "R"):
        assert report["terms"][name]["value"] is None
        assert report["terms"][name]["ci"] == [None, None]
        assert "temperature" in report["terms"][name]["reason"]
    assert [warning["code"] for warning in report["warnings"]] == ["moving_temperature"]
    assert column in report["warnings"][0]["message"]
    assert report["terms"]["N"]["value"] is not None


def test_the_minimum_of_a_drift_is_no_bias_instability():
    """White noise alone on a drift with T: the minimum over 0.664 is far above the bound of B."""
    rng, time = np.random.default_rng(3), np.arange(28_000.0)
    temperature = 25.0 + 40.0 * np.sin(2.0 * np.pi * time / 28_000.0)
    for seed in range(3):
        gyro = 0.02 * temperature + 0.3 * np.random.default_rng(seed).standard_normal(len(time))
        read = temperature + 0.01 * rng.standard_normal(len(time))
        report = noise_report(Run.from_columns("drift", time=time, gyro=gyro, T=read))
        flicker, from_minimum = report["terms"]["B"], report["minimum"]["adev"] / 0.664
        assert flicker["value"] is None and flicker["ci"][0] == 0.0
        assert from_minimum > 2.0 * flicker["ci"][1]


def test_steady_temperature_leaves_them():
    rng = np.random.default_rng(2)
    steady = 20.0 + np.round(rng.normal(size=20_000)) / 2
    chamber = 20.0 + np.sin(0.01 * np.arange(20_000))
    report = noise_report(still_run(T=steady, T_chamber=chamber))
    assert report["warnings"] == []
    assert report["terms"]["K"]["ci"][0] == 0.0
    assert report["terms"]["K"]["ci"][1] > 0.0


def test_only_rows_at_rest_count_where_the_table_turns():
    rate = np.zeros(20_000)
    rate[8000:12_000] = 10.0
    turning = still_run(rate=rate)
    turning = turning.with_columns(gyro=turning.gyro + 36_000.0 * 1.01 * rate / 10.0)
    report = noise_report(turning)
    assert [warning["code"] for warning in report["warnings"]] == ["turning"]
    assert report["stretches"] == 2
    kept = np.concatenate([np.arange(20_000)[part] for part in stretches_at_rest(turning)])
    np.testing.assert_array_equal(kept, np.flatnonzero(rows_at_rest(turning)))
    assert report["terms"]["N"]["value"] == pytest.approx(0.01, rel=0.05)
    assert "all through" in noise_report(still_run(rate=np.full(20_000, 10.0)))["warnings"][0]["message"]


@pytest.mark.parametrize(("late", "ramp"), [(-50, 1), (0, 20), (20, 1), (50, 20)])
def test_a_table_that_follows_slowly_or_on_another_clock_tells_the_same(late, ramp):
    """Turns of 30 s in 2 min at 10 Hz; the table takes so many samples to its rate, its log is as late."""
    place = np.arange(20_000)
    true, recorded = (np.where(np.maximum(place - by, 0) // 300 % 4 == 1, 10.0, 0.0) for by in (0, late))
    true = np.convolve(true, np.ones(ramp) / ramp)[: len(place)]
    run = still_run(rate=recorded)
    report = noise_report(run.with_columns(gyro=run.gyro + 36_000.0 * 1.01 * true / 10.0))
    assert [warning["code"] for warning in report["warnings"]] == ["turning"]
    assert report["terms"]["N"]["value"] == pytest.approx(0.01, rel=0.05)


def test_uneven_samples_are_told():
    rng = np.random.default_rng(3)
    run = still_run()
    uneven = run.with_columns(time=run.time + 0.04 * rng.uniform(size=len(run)))
    assert [warning["code"] for warning in noise_report(uneven)["warnings"]] == ["irregular_sampling"]


def test_what_lost_rows_add_to_white_noise_is_told():
    run = still_run()
    kept = np.random.default_rng(4).random(len(run)) > 0.1
    columns = {"time": run.time[kept], "gyro": run.columns["gyro"][kept]}
    report = noise_report(Run.from_columns("lossy", **columns))
    (warning,) = report["warnings"]
    told = re.search(r"as ([0-9.]+) s apart.* itself is ([0-9.]+) % less", warning["message"])
    # A tenth of the rows lost: those kept stand for 1/0.9 of their time.
    assert float(told[1]) == pytest.approx(0.1 / 0.9, rel=2e-2)
    assert float(told[2]) == pytest.approx(100.0 * (1.0 - 0.9**0.5), abs=0.4)
    assert report["terms"]["N"]["value"] * (1.0 - 0.01 * float(told[2])) == pytest.approx(0.01, rel=0.02)


@pytest.mark.parametrize(("step_arcsec", "told"), [(0.5, True), (0.005, False)])
def test_counts_that_noise_does_not_move_are_no_white_noise(step_arcsec, told):
    """Angles in whole counts at 100 Hz, of 0.006 arcsec of noise a sample and two thirds of a count each."""
    rng = np.random.default_rng(2)
    angle = 0.64 * step_arcsec * np.arange(30_001.0) + np.cumsum(0.006 * rng.normal(size=30_001))
    counts = np.diff(np.floor(angle / step_arcsec))
    run = Run.from_columns("counts", time=0.01 * np.arange(30_000), gyro=counts * step_arcsec / 0.01)
    report = noise_report(run)
    assert ("coarse_steps" in [warning["code"] for warning in report["warnings"]]) == told
    q_urad = step_arcsec / np.sqrt(12.0) * np.deg2rad(1.0) / 3600.0 * 1e6
    low, high = report["terms"]["Q"]["ci"]
    if told:
        (message,) = [w["message"] for w in report["warnings"] if w["code"] == "coarse_steps"]
        assert f"{q_urad:.3g} urad" in message and f"{step_arcsec:.3g} arcsec" in message
    else:
        assert low < 1.02 * q_urad and high > 0.98 * q_urad


def test_asked_times_and_counts():
    run = still_run()
    asked = noise_report(run, taus=[1.0, 7.0])
    assert asked["taus_s"] == [1.0, 7.0]
    assert asked["terms"] == noise_report(run)["terms"]
    counts = Run(
        "counts",
        {"time": run.time, "gyro": 50.0 * run.gyro},
        Facts(scale_factor=ScaleFactor(value=50.0)),
        gyro_unit="count",
    )
    assert at(noise_report(counts), 1.0) == pytest.approx(at(noise_report(run), 1.0), rel=1e-12)


def test_too_short():
    with pytest.raises(InputError, match="short: too short"):
        noise_report(Run.from_columns("short", time=[0.0, 1.0], gyro=[1.0, 2.0]))
    rate = np.where(np.arange(500) % 12 < 2, 0.0, 5.0)
    with pytest.raises(InputError, match="table turns at 416 of 500; give a longer run at rest"):
        noise_report(still_run(n=500, rate=rate))
    with pytest.raises(InputError, match="still: Allan deviation: no averaging time"):
        noise_report(still_run(n=500), taus=[1e6])


def test_an_output_that_stands_still_has_no_terms():
    run = still_run(n=2000)
    report = noise_report(run.with_columns(gyro=np.full(2000, 7.5)))
    assert {(term["value"], *term["ci"]) for term in report["terms"].values()} == {(None, None, None)}
    assert all("stands still" in term["reason"] for term in report["terms"].values())


def test_each_value_four_times_and_a_filtered_output():
    run = still_run(n=40_000)
    held = still_run(n=10_000)
    held = run.with_columns(gyro=np.repeat(9.0 + (held.gyro - 9.0) / 2.0, 4))
    report = noise_report(held)
    assert report["hold"] == {"samples": 4.0, "interval_s": pytest.approx(0.4)}
    low, high = report["terms"]["N"]["ci"]
    assert low <= 0.01 <= high < 1.1 * low
    assert report["holds_from_s"] == pytest.approx(0.4)
    assert any("stands for 4 samples" in note for note in report["notes"])
    filtered = noise_report(run.with_columns(gyro=9.0 + lfilter(*butter(2, 0.06), run.gyro - 9.0)))
    assert filtered["filter"]["order"] == 2
    assert filtered["filter"]["corner_hz"] == pytest.approx(0.3, rel=0.05)
    low, high = filtered["terms"]["N"]["ci"]
    assert low <= 0.01 <= high < 1.1 * low
    # The curve bends below what the terms alone make, and the model follows it.
    modelled, ahead = (np.array(filtered["model"][key]) for key in ("adev", "ahead_of_filter"))
    assert modelled[0] == pytest.approx(filtered["adev"][0], rel=0.1) and modelled[0] < 0.3 * ahead[0]
    assert any("The output is filtered" in note for note in filtered["notes"])
    assert not any("the output drifts" in note for note in filtered["notes"])
    json.dumps(filtered, allow_nan=False)


def test_a_drift_that_is_taken_for_noise_behind_a_slow_filter_is_told():
    """Ramps of temperature that are not recorded: white noise of 0.05 deg/h a sample, drift of 2 deg/h."""
    time = 4.0 * np.arange(5400)
    at = np.array([0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0]) * time[-1]
    outside = np.interp(time, at, [25.0, 25.0, 60.0, 60.0, -40.0, -40.0, 25.0])
    lag = np.exp(-4.0 / 600.0)
    inside = lfilter([1.0 - lag], [1.0, -lag], outside - 25.0) + 25.0
    drift = 0.02 * (inside - 25.0) + 0.0004 * (inside - 25.0) ** 2 + 0.05 * (outside - inside)
    gyro = 8.0 + drift + 0.05 * np.random.default_rng(1).normal(size=len(time))
    told = noise_report(Run("cycle.csv", {"time": time, "gyro": gyro}))
    of_noise = 0.05 * np.sqrt(4.0) / 60.0
    right = told["terms"]["N"]["value"] == pytest.approx(of_noise, rel=0.1)
    assert right or any("the output drifts" in note for note in told["notes"])
    recorded = noise_report(Run("cycle.csv", {"time": time, "gyro": gyro, "T_in": inside, "T_out": outside}))
    assert recorded["terms"]["N"]["value"] == pytest.approx(of_noise, rel=0.1)
    assert not any("the output drifts" in note for note in recorded["notes"])


def test_a_hold_counts_in_stretches_too_short_to_tell_it():
    """White noise of 1 deg/h, values 0.5 s apart that are logged five times, mostly in stretches of 24."""
    rng = np.random.default_rng(1)
    counts = [400, *[24] * 40]
    pauses = np.repeat(rng.uniform(1.0, 6.0, len(counts)).cumsum(), 5 * np.array(counts))
    time = 0.1 * np.arange(5 * sum(counts)) + pauses
    report = noise_report(Run.from_columns(time=time, gyro=np.repeat(rng.normal(size=sum(counts)), 5)))
    low, high = report["terms"]["N"]["ci"]
    assert report["hold"]["samples"] == 5.0 and report["stretches"] == len(counts)
    assert low < np.sqrt(0.5 / 3600.0) < high < 1.2 * low


def test_replicates_share_their_terms_or_are_told_apart():
    one, other = still_run(1), still_run(2)
    shared = noise_report([one, other])
    assert [each["run"] for each in shared["runs"]] == ["still", "still"]
    alone = noise_report(one)
    widths = [np.diff(report["terms"]["N"]["ci"])[0] for report in (alone, shared)]
    assert widths[1] == pytest.approx(widths[0] / np.sqrt(2), rel=0.2)
    assert not shared["warnings"] and alone["runs"] == []
    louder = other.with_columns(gyro=9.0 + 1.2 * (other.gyro - 9.0))
    assert "replicates_differ" in [warning["code"] for warning in noise_report([one, louder])["warnings"]]
    with pytest.raises(InputError, match="one sample interval"):
        noise_report([one, Run.from_columns("slow", time=np.arange(2000.0), gyro=np.zeros(2000))])


def test_noise_that_changes_and_gaps_are_told():
    run = still_run(n=30_000)
    louder = np.where(np.arange(30_000) < 15_000, 1.0, 1.5)
    report = noise_report(run.with_columns(gyro=9.0 + louder * (run.gyro - 9.0)))
    assert "not_stationary" in [warning["code"] for warning in report["warnings"]]
    assert report["stationarity"]["thirds"][0] < report["stationarity"]["thirds"][2]
    gapped = noise_report(run.with_columns(time=run.time + np.repeat([0.0, 50.0, 400.0], 10_000)))
    assert gapped["gaps"] == {"count": 2, "lost_s": pytest.approx(400.0)}
    once = noise_report(run.with_columns(time=run.time + np.repeat([0.0, 0.0, 400.0], 10_000)))
    assert any(note.startswith("1 gap (") for note in once["notes"])


@pytest.mark.parametrize("recorded", [True, False])
def test_drift_over_a_cycle_is_no_noise_behind_a_filter(recorded):
    """White noise of 0.01 deg/sqrt(h) beside a drift of 1.5 deg/h with temperature, that recorded or not."""
    time = 0.5 * np.arange(7200)
    temperature = 20.0 + 30.0 * (0.5 - 0.5 * np.cos(2 * np.pi * time / time[-1]))
    noise = 0.01 * 60.0 * np.sqrt(2.0) * np.random.default_rng(1).normal(size=len(time))
    columns = {"time": time, "gyro": 7.0 + 0.05 * temperature + noise, "T": temperature}
    if not recorded:
        del columns["T"]
    report = noise_report(Run("cycle.csv", columns))
    assert report["filter"] is None
    assert report["terms"]["N"]["value"] == pytest.approx(0.01, rel=0.03)
    if recorded:
        low, high = report["terms"]["N"]["ci"]
        assert low < 0.01 < high
        assert report["terms"]["B"]["ci"][0] == 0.0


def test_the_likelihood_of_a_recording_has_no_steps(monkeypatch):
    """What its temperature makes is nearly collinear; a column that comes and goes is 10 nats."""
    found = []
    search = noise_terms.search_noise
    monkeypatch.setattr(noise_terms, "search_noise", lambda *a: found.append(search(*a)) or found[-1])
    monkeypatch.setattr(noise_of_run, "noise_terms", noise_terms.noise_terms)
    noise_report(shipped_run("thermal-cycle-3-z"))
    best = found[0].candidates[0]
    levels = best.fit["N"] * np.linspace(0.9, 1.1, 41)
    losses = [best.model.fit(best.fit, held=(0, level)).loss for level in levels]
    assert np.abs(np.diff(losses, 2)).max() < 0.1
