"""Regimes on programmes whose truth is known, over rates, sampling, noise, lags and gaps."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from fogml.runs.facts import Facts
from fogml.runs.regimes import Regimes, regimes
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run
from fogml.runs.temperature_motion import _resumptions

STEPS = [(30, 25.0), (90, -40.0), (90, 60.0), (60, 25.0)]
"""Minutes of soak at a temperature, one after another, ramps between."""


def staircase(steps, rate_degc_min, sample_s):
    """Chamber temperature, and the true regimes as (name, from, to) in minutes."""
    corners_t, corners_v, truth, t = [0.0], [steps[0][1]], [], 0.0
    for number, (minutes, level) in enumerate(steps):
        if number:
            duration = abs(level - corners_v[-1]) / rate_degc_min
            truth.append(("ramp_up" if level > corners_v[-1] else "ramp_down", t, t + duration))
            t += duration
            corners_t.append(t)
            corners_v.append(level)
        truth.append(("stay", t, t + minutes))
        t += minutes
        corners_t.append(t)
        corners_v.append(level)
    time = np.arange(0.0, 60.0 * t, sample_s)
    return time, np.interp(time / 60.0, corners_t, corners_v), truth


def with_sensor(temperature, noise=0.0, quantum=0.0, seed=1):
    out = temperature + noise * np.random.default_rng(seed).standard_normal(len(temperature))
    return np.round(out / quantum) * quantum if quantum else out


def lagged(temperature, lag_s, sample_s):
    pole = np.exp(-sample_s / lag_s)
    return lfilter([1 - pole], [1, -pole], temperature, zi=[pole * temperature[0]])[0]


def run_of(time, **columns) -> Run:
    return Run.from_columns(time=time, gyro=np.zeros(len(time)), **columns)


def minutes(run: Run) -> list[tuple[str, float, float]]:
    return [(name, run.time[a] / 60, run.time[b - 1] / 60) for name, a, b in regimes(run).segments()]


def check(run: Run, truth, tolerance_min: float) -> None:
    """Ramps where they are, nothing else called a ramp, soaks after 10 min of each stay."""
    found = [segment for segment in minutes(run) if segment[0].startswith("ramp")]
    wanted = [segment for segment in truth if segment[0].startswith("ramp")]
    assert [name for name, *_ in found] == [name for name, *_ in wanted]
    for (_, start, stop), (_, true_start, true_stop) in zip(found, wanted):
        assert start == pytest.approx(true_start, abs=tolerance_min)
        assert stop == pytest.approx(true_stop, abs=tolerance_min)
    soak = regimes(run).mask("soak")
    for name, start, stop in truth:
        inside = (run.time / 60 > start + tolerance_min) & (run.time / 60 < stop - tolerance_min)
        settled = inside & (run.time / 60 > start + (10.0 if start else 0.0) + tolerance_min)
        if name == "stay":
            assert soak[settled].all()
        else:
            assert not soak[inside].any()


@pytest.mark.parametrize("rate", [0.1, 0.5, 1.0, 3.0, 10.0])
@pytest.mark.parametrize("sample_s", [0.1, 1.0, 10.0, 60.0])
@pytest.mark.parametrize(("noise", "quantum"), [(0.0, 0.0), (0.02, 1 / 16), (0.0, 0.5)])
def test_a_sensor_without_lag(rate, sample_s, noise, quantum):
    if rate < 0.5 and sample_s < 1.0:
        sample_s = 0.5
    time, temperature, truth = staircase(STEPS, rate, sample_s)
    # The edge of a ramp shows once the sensor has moved; a coarse sensor moves late.
    tolerance = 1.0 + 2 * sample_s / 60 + max(0.2, 1.5 * quantum) / rate
    check(run_of(time, T=with_sensor(temperature, noise, quantum)), truth, tolerance)


def test_a_hundred_samples_a_second():
    time, temperature, truth = staircase([(20, 25.0), (30, 45.0), (20, 30.0)], 2.0, 0.01)
    check(run_of(time, T=with_sensor(temperature, 0.05)), truth, 1.0)


@pytest.mark.parametrize("lag_s", [60.0, 300.0, 1200.0])
def test_a_lagged_sensor_settles_after_the_ramp(lag_s):
    time, chamber, truth = staircase(STEPS, 1.0, 1.0)
    run = run_of(time, T=with_sensor(lagged(chamber, lag_s, 1.0), 0.02, 1 / 16))
    found = minutes(run)
    ramps = [segment for segment in found if segment[0].startswith("ramp")]
    wanted = [segment for segment in truth if segment[0].startswith("ramp")]
    assert [name for name, *_ in ramps] == [name for name, *_ in wanted]
    for (_, start, stop), (_, true_start, true_stop) in zip(ramps, wanted):
        assert start == pytest.approx(true_start, abs=0.5 + 0.2 * lag_s / 60)
        assert stop == pytest.approx(true_stop, abs=0.5 + 0.5 * lag_s / 60)
    # A soak begins once the sensor is slower than about 0.05 degC/min: lag * ln(rate / 0.05).
    settling = lag_s / 60 * np.log(1.0 / 0.05)
    ends = [stop for name, _, stop in found if name == "after_ramp"]
    for (_, _, true_stop), end in zip(wanted, ends, strict=True):
        assert end - true_stop == pytest.approx(max(10.0, settling), abs=1.5 + 0.2 * lag_s / 60)
    names = [name for name, *_ in found]
    assert all(after == "soak" for name, after in pairwise(names) if name == "after_ramp")


def test_short_soaks_of_a_slow_coil_are_no_soaks():
    steps = [(60, -40.0), *((30, -40.0 + 10 * k) for k in range(1, 8))]
    time, chamber, truth = staircase(steps, 1.0, 1.0)
    run = run_of(time, T=with_sensor(lagged(chamber, 1200.0, 1.0), 0.02, 1 / 16))
    found = [name for name, *_ in minutes(run)]
    assert found[0] == "soak"
    assert found.count("ramp_up") == sum(name == "ramp_up" for name, *_ in truth)
    assert "soak" not in found[1:]


def test_another_sensor_of_the_coil_keeps_the_soak_from_beginning():
    time, chamber, _ = staircase([(30, 25.0), (180, 60.0)], 1.0, 1.0)
    quick, slow = lagged(chamber, 60.0, 1.0), lagged(chamber, 1200.0, 1.0)
    alone = [segment for segment in minutes(run_of(time, T_in=quick)) if segment[0] == "soak"][-1]
    paired = [segment for segment in minutes(run_of(time, T_in=quick, T_out=slow)) if segment[0] == "soak"]
    assert paired[-1][1] > alone[1] + 30.0


def test_odd_sensors_stand_for_the_inner_face():
    time, chamber, truth = staircase(STEPS, 1.0, 5.0)
    check(run_of(time, T1=chamber + 0.1, T3=chamber - 0.1, T2=chamber, T4=chamber), truth, 1.5)


def test_single_outliers_of_the_sensor_change_nothing():
    time, chamber, truth = staircase(STEPS, 1.0, 1.0)
    temperature = with_sensor(chamber, 0.02)
    temperature[np.random.default_rng(4).integers(0, len(time), 30)] += 40.0
    check(run_of(time, T=temperature), truth, 1.0)


def test_bursts_with_gaps_between():
    time, chamber, truth = staircase(STEPS, 1.0, 0.1)
    kept = time % 4.0 < 1.0
    check(run_of(time[kept], T=with_sensor(chamber, 0.02)[kept]), truth, 1.2)


def test_a_long_gap_is_no_ramp():
    time = np.arange(0.0, 9000.0)
    kept = (time < 3000) | (time > 5000)
    run = run_of(time[kept], T=np.where(time < 4000, 25.0, 60.0)[kept])
    assert {name for name, *_ in minutes(run)} == {"soak"}


def test_a_chamber_that_hunts_about_its_level_soaks():
    time = np.arange(0.0, 7200.0)
    run = run_of(time, T=25.0 + 0.5 * np.sin(2 * np.pi * time / 600.0))
    assert {name for name, *_ in minutes(run)} == {"soak"}


class TestStartUp:
    time = np.arange(0.0, 7200.0)
    heating = 25.0 + 8.0 * (1.0 - np.exp(-time / 600.0))

    def test_self_heating_is_told_from_its_shape(self):
        found = minutes(run_of(self.time, T=with_sensor(self.heating, 0.02)))
        assert [name for name, *_ in found] == ["start_up", "soak"]
        # 8 degC / 10 min slows to 0.05 degC/min after 10 ln(16) = 27.7 min.
        assert found[0][2] == pytest.approx(27.7, abs=3.0)

    def test_slow_self_heating_is_start_up_for_half_an_hour(self):
        slow = 25.0 + 8.0 * (1.0 - np.exp(-self.time / 1500.0))
        found = minutes(run_of(self.time, T=slow))
        assert [name for name, *_ in found] == ["start_up", "after_ramp", "soak"]
        assert found[0][2] == pytest.approx(30.0, abs=0.1)

    def test_cooling_from_the_first_sample_is_no_start_up(self):
        assert "start_up" not in {name for name, *_ in minutes(run_of(self.time, T=50.0 - self.heating))}

    def test_a_ramp_from_the_first_sample_is_no_start_up(self):
        time, chamber, _ = staircase([(0.01, 20.0), (60, 40.0)], 1.0, 1.0)
        for temperature in (chamber, lagged(chamber, 300.0, 1.0)):
            assert minutes(run_of(time, T=temperature))[0][0] == "ramp_up"

    def test_a_ramp_from_the_first_sample_that_slows_down_a_little_is_no_start_up(self):
        """Half way at four fifths of its first rate: self-heating would be little more than half as fast."""
        progress = np.minimum(self.time / 600.0, 1.0)
        slowing = 25.0 + 8.0 * (progress - 0.25 * progress**2) / 0.75
        assert minutes(run_of(self.time, T=slowing))[0][0] == "ramp_up"

    @pytest.mark.parametrize(("powered_on", "end"), [(0.0, 10.0), (-300.0, 5.0), (-3600.0, None)])
    def test_settled_temperatures_end_it_after_ten_minutes(self, powered_on, end):
        columns = {"time": self.time, "gyro": self.time, "T": np.full(7200, 25.0)}
        found = minutes(Run("a", columns, Facts(powered_on=powered_on)))
        if end is None:
            assert [name for name, *_ in found] == ["soak"]
        else:
            assert [name for name, *_ in found] == ["start_up", "soak"]
            assert found[0][2] == pytest.approx(end, abs=0.1)

    def test_moving_temperatures_keep_it_for_half_an_hour(self):
        slow = 25.0 + 8.0 * (1.0 - np.exp(-self.time / 1500.0))
        columns = {"time": self.time, "gyro": self.time, "T": slow}
        found = minutes(Run("a", columns, Facts(powered_on=0.0)))
        assert found[0][0] == "start_up"
        assert found[0][2] == pytest.approx(30.0, abs=0.1)

    def test_a_stated_power_on_long_ago_rules_self_heating_out(self):
        columns = {"time": self.time, "gyro": self.time, "T": self.heating}
        found = minutes(Run("a", columns, Facts(powered_on=-7200.0)))
        assert found[0][0] == "ramp_up"

    def test_without_temperatures_it_lasts_half_an_hour(self):
        columns = {"time": self.time, "gyro": self.time}
        found = minutes(Run("a", columns, Facts(powered_on=0.0)))
        assert [name for name, *_ in found] == ["start_up", "soak"]
        assert found[0][2] == pytest.approx(30.0, abs=0.1)


@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_turning_is_where_the_table_turns(noise):
    time, chamber, _ = staircase([(60, 25.0), (60, 60.0)], 1.0, 1.0)
    table = np.where((time > 1000) & (time < 1060), -10.0, 0.0)
    table[(time > 4000) & (time < 4060)] = 0.1
    measured = table + noise * np.random.default_rng(2).standard_normal(len(time))
    found = regimes(run_of(time, T=chamber, rate=measured))
    assert np.array_equal(found.mask("turning"), table != 0.0)


@pytest.mark.parametrize("sample_s", [1.3, 3.7, 7.3])
def test_regimes_are_the_same_on_a_clock_of_the_epoch(sample_s):
    """Times near 1.7e9 s are told to 0.2 us, so that a sample may fall short of its bin's begin."""
    time = sample_s * np.arange(int(14400 / sample_s))
    chamber = np.interp(time, [0, 2400, 5100, 7800, 10500], [25, 25, 60, 60, -20])
    gain = 1.0 - np.exp(-sample_s / 400.0)
    coil = lfilter([gain], [1.0, gain - 1.0], chamber - 25.0) + 25.0
    read = np.round(128.0 * (coil + 0.003 * np.random.default_rng(0).normal(size=len(time)))) / 128.0
    labels = [
        regimes(Run("run", {"time": start + time, "gyro": np.zeros(len(time)), "T": read})).labels
        for start in (0.0, 1.7e9)
    ]
    assert np.array_equal(*labels)


def test_the_thermal_cycle():
    share = {}
    for leg, name in ((1, "ramp_down"), (2, "ramp_up"), (3, "ramp_down")):
        found = regimes(shipped_run(f"thermal-cycle-{leg}-x"))
        share[leg] = found.mask(name).mean()
        assert not found.mask("soak").any()
        assert not found.mask("start_up").any()
    assert share[1] > 0.99
    assert share[2] > 0.95
    assert share[3] > 0.95


def test_the_cold_start_and_the_static_recordings():
    found = minutes(shipped_run("cold-start-x"))
    assert [name for name, *_ in found] == ["start_up", "soak"]
    assert 15.0 < found[0][2] < 31.0
    for name in ("two-temperatures-cold-x", "two-temperatures-hot-x", "ring-laser-x"):
        assert [name for name, *_ in minutes(shipped_run(name))] == ["soak"]


@pytest.mark.parametrize("rows", [0, 1, 2, 3, 5])
def test_a_few_rows_are_no_trouble(rows):
    time = np.arange(float(rows))
    found = regimes(run_of(time, T=20.0 + time, rate=0 * time))
    assert found.labels.shape == (rows,)
    assert sum(stop - start for _, start, stop in found.segments()) == rows


def test_computed_once_and_read_only():
    run = shipped_run("thermal-cycle-1-x")
    assert regimes(run) is regimes(run)
    with pytest.raises(ValueError, match="read-only"):
        regimes(run).labels[0] = 1


@settings(max_examples=40, deadline=None)
@given(
    levels=st.lists(st.integers(-5, 7), min_size=1, max_size=6),
    soak=st.integers(25, 90),
    rate=st.floats(0.3, 10.0),
    sample_s=st.sampled_from([0.7, 5.0, 30.0]),
    seed=st.integers(0, 99),
)
def test_any_staircase_is_covered_and_told(levels, soak, rate, sample_s, seed):
    steps = [(soak, 10.0 * level) for level, before in zip(levels, [None, *levels]) if level != before]
    time, chamber, truth = staircase(steps, rate, sample_s)
    run = run_of(time, T=with_sensor(chamber, 0.02, 1 / 16, seed))
    segments = regimes(run).segments()
    assert segments[0][1] == 0
    assert segments[-1][2] == len(run)
    assert all(a[2] == b[1] and a[0] != b[0] for a, b in pairwise(segments))
    assert {name for name, *_ in segments} <= set(Regimes.names)
    check(run, truth, 1.5 + 4 * sample_s / 60 + 0.3 / rate)


@pytest.mark.parametrize(
    ("speeds", "taken_up"),
    [((1.0, 0.4, 1.0), 1), ((1.0, 0.53, 1.2), 0), ((1.0, 0.2, 0.52), 1), ((1.0, 0.2, 0.45), 0)],
)
@pytest.mark.parametrize("last", [60.0, 600.0])
def test_a_move_is_taken_up_again_from_less_than_half_its_speed_to_more(speeds, taken_up, last):
    corners = np.cumsum([0.0, 600.0, 600.0, last])
    time = np.arange(0.0, corners[-1] + 1.0, 5.0)
    course = np.interp(time, corners, np.cumsum([0.0, *(0.05 * np.array(speeds) * np.diff(corners))]))
    found = _resumptions(SimpleNamespace(time=time), course, 0, len(time))
    assert len(found) == taken_up and all(600.0 <= time[place] <= 1200.0 for place in found)


@pytest.mark.parametrize("noise", [0.05, 0.5, 1.0])
def test_noisy_readings_tell_moves_within_two_minutes(noise):
    time = np.arange(0.0, 21_600.0)
    degrees = np.interp(time, [0.0, 3600.0, 6000.0, 9600.0, 12_000.0], [20.0, 20.0, 60.0, 60.0, 20.0])
    read = degrees + noise * np.random.default_rng(1).normal(size=len(time))
    found = regimes(Run("run", {"time": time, "gyro": np.zeros(len(time)), "T": read})).segments()
    assert [name for name, *_ in found] == [
        "soak", "ramp_up", "after_ramp", "soak", "ramp_down", "after_ramp", "soak",
    ]  # fmt: skip
    starts = {name: time[start] for name, start, _ in found}
    assert (starts["ramp_up"], starts["ramp_down"]) == pytest.approx((3600.0, 9600.0), abs=120.0)
