"""Findings fire on faults put into synthetic runs, and stay silent on sound ones."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.lib.stride_tricks import sliding_window_view

from fogml.runs.checks import check_run
from fogml.runs.facts import Facts
from fogml.runs.outliers import find_outliers
from fogml.runs.run import Run
from fogml.signals.bases import lag


def temperature(time, amplitude=20.0):
    return 25.0 + amplitude * np.sin(2 * np.pi * time / time[-1])


def noisy(rows=20_000, sample_s=0.1, seed=0, noise=1.0, **columns) -> dict[str, np.ndarray]:
    """White noise on a drift, with a sensor inside and one outside."""
    rng = np.random.default_rng(seed)
    time = sample_s * np.arange(rows)
    inner = temperature(time)
    return {
        "time": time,
        "gyro": 0.05 * inner + rng.normal(0.0, noise, rows),
        "T_in": inner + rng.normal(0.0, 0.01, rows),
        "T_out": temperature(time - 5.0) + rng.normal(0.0, 0.01, rows),
        **columns,
    }


def turning(rows, sample_s, speed_deg_s=10.0, acceleration_deg_s2=5.0, dwell_s=20.0):
    """Table rate [deg/s]: rest, one way, the other way, over and over, at a finite acceleration."""
    ramp = speed_deg_s / acceleration_deg_s2
    corners, levels = [0.0], [0.0]
    level = 0.0
    while corners[-1] < rows * sample_s:
        for target in (speed_deg_s, -speed_deg_s, 0.0):
            corners += [corners[-1] + dwell_s, corners[-1] + dwell_s + ramp * (1 + (target == -speed_deg_s))]
            levels += [level, target]
            level = target
    return np.interp(sample_s * np.arange(rows), corners, levels)


def codes(columns) -> list[str]:
    return [finding.code for finding in check_run(Run("run", columns))]


def one(columns, code):
    (finding,) = [finding for finding in check_run(Run("run", columns)) if finding.code == code]
    return finding


class TestSilentOnSoundRuns:
    @pytest.mark.parametrize("seed", range(5))
    def test_white_noise_on_drift(self, seed):
        assert codes(noisy(seed=seed)) == []

    @settings(max_examples=40, deadline=None)
    @given(
        sample_s=st.sampled_from([0.01, 0.1, 1.0, 10.0]),
        acceleration=st.sampled_from([0.5, 5.0, 50.0, 1e6]),
        speed=st.sampled_from([0.1, 10.0, 100.0]),
        noise=st.sampled_from([0.01, 1.0, 100.0]),
        quantum=st.sampled_from([0.0, 0.01, 0.3, 1.0, 2.0]),
        counts=st.booleans(),
        seed=st.integers(0, 100),
    )
    def test_a_turning_table(self, sample_s, acceleration, speed, noise, quantum, counts, seed):
        columns = noisy(4000, sample_s, seed, noise)
        rate = turning(4000, sample_s, speed, acceleration, dwell_s=20 * sample_s)
        scale = 1.002 + np.random.default_rng(seed).normal(0.0, 2e-8, 4000)
        gyro = columns["gyro"] + 3600.0 * rate * scale
        if quantum:
            gyro = np.round(gyro / (quantum * noise)) * quantum * noise
        columns |= {"gyro": gyro * (7.0 if counts else 1.0), "rate": rate}
        assert not {"outliers", "saturation", "stuck_sensor"} & set(codes(columns))
        # A table that rests at the ends and dwells between needs no column for its rate.
        end = np.flatnonzero(sliding_window_view(rate == 0.0, 3).all(axis=1))[-1] + 3
        assert not len(find_outliers(gyro[:end])[0])

    def test_noise_of_the_scale_factor_while_turning(self):
        columns = noisy(40_000, 0.01)
        rate = turning(40_000, 0.01, dwell_s=50.0)
        columns["gyro"] += 3600.0 * rate * (1.0 + np.random.default_rng(2).normal(0.0, 1e-3, 40_000))
        assert not len(find_outliers(columns["gyro"])[0])

    @pytest.mark.parametrize("quantum", [0.1, 0.5, 1.0, 2.0, 4.0])
    def test_a_quantised_output(self, quantum):
        columns = noisy()
        columns["gyro"] = quantum * np.round(columns["gyro"] / quantum)
        assert codes(columns) == []

    def test_without_noise(self):
        time = 0.1 * np.arange(20_000)
        columns = {"time": time, "gyro": np.sin(time / 50), "T_in": temperature(time)}
        assert codes(columns) == []
        columns["gyro"] = np.round(3 * np.sin(time / 300))
        assert codes(columns) == ["coarse_output"]

    def test_a_correlated_output(self):
        columns = noisy()
        columns["gyro"] = np.convolve(columns["gyro"], np.ones(16) / 16, mode="same")
        assert codes(columns) == []

    def test_a_noisy_half(self):
        columns = noisy()
        columns["gyro"][12_000:] += np.random.default_rng(3).normal(0.0, 50.0, 8000)
        assert "outliers" not in codes(columns)

    def test_a_coarse_sensor_is_not_stuck(self):
        columns = noisy(sample_s=1.0)
        columns["T_out"] = np.round(columns["T_out"])
        columns["T_case"] = 5.0 * np.round(columns["T_in"] / 5.0)
        assert codes(columns) == ["coarse_thermometer"]

    def test_a_coarse_quiet_gyro_is_not_stuck(self):
        columns = noisy(sample_s=1.0)
        columns["gyro"] = np.round(0.05 * columns["T_in"])
        assert codes(columns) == ["coarse_output"]

    def test_a_constant_chamber_in_a_short_run(self):
        columns = noisy(rows=5000)
        columns["T_chamber"] = np.full(5000, 25.0)  # 500 s
        assert "stuck_sensor" not in codes(columns)

    def test_a_sensor_held_while_others_rest(self):
        columns = noisy(sample_s=1.0)
        columns["T_in"] = 25.0 + 0.1 * np.sin(columns["time"])
        columns["T_out"] = np.full(20_000, 25.0)
        assert codes(columns) == ["small_temperature_span"]

    def test_nothing_to_judge(self):
        assert codes({"time": np.zeros(1), "gyro": np.zeros(1)}) == []
        assert check_run(Run("run", {"time": np.empty(0), "gyro": np.empty(0)})) == ()

    def test_values_near_the_greatest_that_are_read(self):
        columns = {"time": np.arange(3000.0), "gyro": np.resize([9e19, -9e19, 0.0], 3000)}
        columns["T"] = columns["gyro"]
        assert "gap" not in codes(columns)


class TestGapsAndSampling:
    @pytest.mark.parametrize(
        ("first", "zone", "told"), [("01:50", None, 1), ("01:47", None, 0), ("01:50", UTC, 0)]
    )
    def test_an_hour_that_local_time_skips_in_spring_is_told_as_that(self, first, zone, told):
        """A gap of an hour at another minute, or on a clock with a zone, is one."""
        time = 10.0 * np.arange(240.0)
        time[60:] += 3600.0
        columns = {"time": time, "gyro": np.sin(time), "T": 20.0 + 0.01 * time}
        started = datetime.fromisoformat(f"2026-03-29T{first}").replace(tzinfo=zone)
        (gap,) = (f for f in check_run(Run("run", columns, Facts(started=started))) if f.code == "gap")
        assert gap.count == 1
        assert ("after 2026-03-29 01:59:50 is an hour" in gap.message) == bool(told)

    def test_gaps_are_counted_and_the_longest_named(self):
        columns = noisy()
        keep = np.ones(20_000, dtype=bool)
        keep[100:105] = keep[5000:5100] = False
        keep[200:202] = False  # an interval of 3 samples is no gap
        columns = {name: values[keep] for name, values in columns.items()}
        finding = one(columns, "gap")
        assert (finding.count, finding.row) == (2, 101)
        assert "10.1 s at 499.9 s" in finding.message
        assert "outliers" not in codes(columns)

    @pytest.mark.parametrize("share, told", [(0.005, False), (0.03, True)])
    def test_irregular_sampling(self, share, told):
        columns = noisy()
        steps = np.full(19_999, 0.1)
        steps[: int(share * 20_000)] = 0.15
        columns["time"] = np.concatenate([[0.0], np.cumsum(steps)])
        assert ("irregular_sampling" in codes(columns)) is told
        if told:
            found = one(columns, "irregular_sampling")
            assert (found.count, found.row) == (int(share * 20_000), 2)

    def test_small_jitter_is_regular(self):
        columns = noisy()
        columns["time"] += np.random.default_rng(5).uniform(-0.004, 0.004, 20_000)
        assert codes(columns) == []


class TestOutliers:
    @pytest.mark.parametrize("sign", [-1.0, 1.0])
    @pytest.mark.parametrize("at", [0, 1, 2, 3, 1023, 1024, 10_000, 19_996, 19_997, 19_998, 19_999])
    def test_a_spike_anywhere(self, at, sign):
        columns = noisy(seed=at)
        columns["gyro"][at] = 0.05 * columns["T_in"][at] + sign * 12.0
        finding = one(columns, "outliers")
        assert (finding.count, finding.row) == (1, at + 1)
        assert finding.column == "gyro"

    def test_two_in_a_row(self):
        columns = noisy()
        columns["gyro"][[700, 701]] += 20.0
        assert one(columns, "outliers").count == 2

    def test_many(self):
        columns = noisy()
        places = np.random.default_rng(1).choice(np.arange(10, 19_990, 10), 500, replace=False)
        columns["gyro"][places] += 30.0
        found, sigma = find_outliers(columns["gyro"])
        assert found.tolist() == sorted(places)
        assert sigma == pytest.approx(1.0, abs=0.25)

    @pytest.mark.parametrize("recorded", [True, False])
    def test_during_turns_too(self, recorded):
        columns = noisy(sample_s=0.01)
        rate = turning(20_000, 0.01)
        columns["gyro"] += 3600.0 * rate
        places = [1500, 2500, 5000, 12_345]
        columns["gyro"][places] += 12.0
        if recorded:
            columns["rate"] = rate
        assert set(places) <= set(find_outliers(columns["gyro"], columns.get("rate"))[0].tolist())

    def test_a_short_turn_needs_the_rate(self):
        columns = noisy()
        rate = np.zeros(20_000)
        rate[5000:5002] = 1.0
        columns["gyro"] += 3600.0 * rate
        assert "outliers" in codes(columns)
        assert codes({**columns, "rate": rate}) == []

    def test_in_a_quantised_output(self):
        columns = noisy()
        columns["gyro"] = 2.0 * np.round(columns["gyro"] / 2.0)
        columns["gyro"][777] += 40.0
        assert one(columns, "outliers").row == 778

    def test_in_an_output_without_noise(self):
        columns = noisy(noise=0.0)
        columns["gyro"] = np.round(columns["gyro"])
        columns["gyro"][777] += 40.0
        assert one(columns, "outliers").row == 778

    @settings(max_examples=50, deadline=None)
    @given(st.lists(st.floats(-1e6, 1e6), min_size=5, max_size=60), st.integers(0, 60), st.integers(1, 60))
    def test_the_median_of_five_is_one(self, values, start, size):
        from fogml.runs.outliers import _less_median

        values = np.array(values)
        part = slice(min(start, len(values) - 1), min(start + size, len(values)))
        windows = sliding_window_view(np.pad(values, 2, mode="reflect"), 5)
        for at in (part, slice(0, len(values))):
            assert np.array_equal(_less_median(values, at), (values - np.median(windows, axis=1))[at])

    def test_sigma_is_that_of_white_noise(self):
        gyro = np.random.default_rng(0).normal(0.0, 3.0, 200_000)
        gyro[::2000] += 1000.0
        assert find_outliers(gyro)[1] == pytest.approx(3.0, rel=0.15)


class TestSaturation:
    @pytest.mark.parametrize("limit", [1.5, 2.0, 3.0])
    def test_noise_cut_off_above(self, limit):
        columns = noisy()
        columns["gyro"] = np.minimum(np.random.default_rng(0).normal(0.0, 1.0, 20_000), limit)
        finding = one(columns, "saturation")
        assert finding.count == int((columns["gyro"] == limit).sum())
        assert finding.row == int(np.argmax(columns["gyro"] == limit)) + 1

    def test_a_turn_beyond_the_range_both_ways(self):
        columns = noisy(sample_s=0.01)
        columns["gyro"] = np.clip(columns["gyro"] + 3600.0 * turning(20_000, 0.01), -30_000, 30_000)
        found = [f for f in check_run(Run("run", columns)) if f.code == "saturation"]
        assert len(found) == 2
        assert "30000" in found[0].message and "-30000" in found[1].message

    def test_a_quantised_output_cut_off(self):
        columns = noisy()
        columns["gyro"] = np.minimum(0.5 * np.round(columns["gyro"] / 0.5), 0.5)
        assert one(columns, "saturation").count == int((columns["gyro"] == 0.5).sum())

    def test_a_dead_output(self):
        columns = noisy()
        columns["gyro"] = np.full(20_000, 3.0)
        finding = one(columns, "dead_output")
        assert finding.count == 20_000 and "3 in every sample" in finding.message
        assert "not connected" in finding.message
        assert codes(columns)[0] == "dead_output"


class TestStuckSensors:
    def test_a_temperature(self):
        columns = noisy()
        columns["T_out"][3000:10_000] = columns["T_out"][3000]
        finding = one(columns, "stuck_sensor")
        assert (finding.column, finding.row, finding.count) == ("T_out", 3001, 7000)
        assert "300 s" in finding.message and "999.9 s" in finding.message

    def test_twice(self):
        columns = noisy()
        for part in (slice(1000, 8000), slice(10_000, 17_000)):
            columns["T_out"][part] = columns["T_out"][part.start]
        assert one(columns, "stuck_sensor").count == 14_000

    def test_not_within_ten_minutes_of_one_without_noise(self):
        columns = noisy()
        columns["T_out"] = temperature(columns["time"] - 5.0)
        columns["T_out"][3000:8900] = columns["T_out"][3000]
        assert "stuck_sensor" not in codes(columns)

    def test_the_gyro(self):
        columns = noisy()
        columns["gyro"][3000:12_000] = columns["gyro"][3000]
        assert one(columns, "stuck_sensor").column == "gyro"

    @pytest.mark.parametrize("spells", [((5000, 5100),), ((5000, 5100), (9000, 19_500))])
    @pytest.mark.parametrize("counted", [False, True])
    def test_the_gyro_for_a_short_time_or_at_a_steady_temperature(self, spells, counted):
        columns = noisy()
        columns["T_in"], columns["T_out"] = np.full((2, 20_000), 25.0)
        if counted:  # in counts a value stays for some samples by chance
            columns["gyro"] = np.floor(4.0 * columns["gyro"] / np.std(columns["gyro"]))
        sound = codes(columns)
        for start, stop in spells:
            columns["gyro"][start:stop] = 0.25
        (finding,) = [f for f in check_run(Run("run", columns)) if f.code == "stuck_sensor"]
        assert "stuck_sensor" not in sound
        assert (finding.row, finding.count) == (5001, sum(stop - start for start, stop in spells))

    def test_counts_at_rest_beside_turns_are_no_fault(self):
        columns = noisy()
        columns["rate"] = turning(20_000, 0.1)
        columns["gyro"] = np.round(columns["gyro"] * (columns["rate"] != 0.0) + 3600.0 * columns["rate"])
        assert "stuck_sensor" not in codes(columns)

    @pytest.mark.parametrize("resolution", [0.01, 0.1, 0.5])
    @pytest.mark.parametrize("behind_s", [0.0, 300.0])
    def test_a_coarse_sensor_that_settles_in_soaks_is_not_stuck(self, resolution, behind_s):
        # Soaks of two hours at -20, 50 and 25 degC; the case is 900 s behind the chamber, the coil further.
        time = 2.0 * np.arange(19_000)
        corners = [0, 7200, 8550, 15_750, 19_950, 27_150, 30_150, 38_000]
        chamber = np.interp(time, corners, [25, 25, -20, -20, 50, 50, 25, 25])
        case = lag(time, chamber, 900.0)
        columns = {
            "T_chamber": chamber,
            "T_case": case,
            "T_in": lag(time, case, behind_s) if behind_s else case,
        }
        columns = {name: resolution * np.round(values / resolution) for name, values in columns.items()}
        columns |= {"time": time, "gyro": np.random.default_rng(0).standard_normal(len(time))}
        assert "stuck_sensor" not in codes(columns)
        for start, stop in ((3800, 6000), (4100, 5000), (8000, 19_000)):
            frozen = columns["T_in"].copy()
            frozen[start:stop] = frozen[start]
            assert one({**columns, "T_in": frozen}, "stuck_sensor").column == "T_in"

    @pytest.mark.parametrize("start, stop", [(5000, 5070), (12_000, 20_000), (0, 15_000)])
    def test_the_only_thermometer_that_freezes_though_it_was_noisy(self, start, stop):
        columns = noisy()
        del columns["T_out"]
        columns["T_in"] = np.round(columns["T_in"], 3)
        assert "stuck_sensor" not in codes(columns)
        columns["T_in"][start:stop] = columns["T_in"][start]
        finding = one(columns, "stuck_sensor")
        assert (finding.column, finding.row, finding.count) == ("T_in", start + 1, stop - start)

    @pytest.mark.parametrize("step", [1e-6, 0.01, 0.0625, 0.5])
    def test_the_only_thermometer_that_comes_to_rest_is_not_stuck(self, step):
        # 1 degC/min, an hour of rest, one sample in 30 s: each in the ramp differs, none in the rest.
        time = 30.0 * np.arange(1000)
        way = np.interp(time, [0, 4200, 8400, 12_600, 30_000], [-20, 50, 50, -20, -20])
        settled = lag(time, way, 200.0)
        for course in (way, settled):
            columns = {"time": time, "gyro": np.random.default_rng(0).standard_normal(1000)}
            columns["T"] = step * np.round(course / step)
            assert "stuck_sensor" not in codes(columns)

    def test_a_sensor_dead_all_along(self):
        columns = noisy()
        columns["T_case"] = np.zeros(20_000)
        assert one(columns, "stuck_sensor").column == "T_case"


class TestTemperatureSpan:
    @pytest.mark.parametrize("amplitude, told", [(2.4, True), (2.6, False)])
    @pytest.mark.parametrize("name", ["T", "T_in", "T3", "T2", "T_chamber"])
    def test_of_whatever_is_recorded(self, amplitude, told, name):
        columns = noisy()
        del columns["T_in"], columns["T_out"]
        columns[name] = temperature(columns["time"], amplitude)
        assert codes(columns) == ["small_temperature_span"] * told

    def test_none_is_no_fault(self):
        columns = noisy()
        assert codes({name: columns[name] for name in ("time", "gyro")}) == []


def test_an_output_that_stays_while_the_table_changes_its_rate_is_stuck():
    columns = noisy(20_000, 0.1)
    columns["rate"] = turning(20_000, 0.1, dwell_s=50.0)
    columns["gyro"] = np.round(columns["gyro"] + 3600.0 * columns["rate"], -3)  # rests at one value
    assert "stuck_sensor" not in codes(columns)
    columns["gyro"][9000:15_000] = columns["gyro"][9000]
    finding = one(columns, "stuck_sensor")
    assert finding.column == "gyro"
    assert finding.count == pytest.approx(6000, abs=500)


def test_a_million_sound_rows_have_no_fault():
    columns = noisy(1_000_000, 0.01)
    columns["rate"] = np.zeros(1_000_000)
    assert codes(columns) == []
