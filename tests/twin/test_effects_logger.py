"""Effects of the logger against closed forms, plain integration and blocks."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.twin.effect import LoggerEffect
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.registry import effect

TIME = np.arange(0.0, 7200.0)
UNEVEN = np.cumsum(np.random.default_rng(3).uniform(0.4, 1.6, 5000))


def logger(id: str) -> LoggerEffect:
    found = effect(id)
    assert isinstance(found, LoggerEffect)
    return found


def inputs(time: FloatArray, memory: Memory | None = None) -> Inputs:
    return Inputs(time, {"T": np.zeros(len(time))}, np.zeros(len(time)), memory=memory or Memory())


def wave(time: FloatArray) -> FloatArray:
    return 3.0 * np.sin(time / 300.0) + 0.5 * np.cos(time / 47.0)


def test_skew_on_a_static_bias_is_slope_times_rate_times_delay() -> None:
    """b(T) = 0.02 T + 1e-3 T**2 in a ramp of 1 degC/min, two seconds late."""
    temperature = -40.0 + TIME / 60.0
    bias = 0.02 * temperature + 1e-3 * temperature**2
    found = logger("logger_skew").record(bias, inputs(TIME), 2.0, growth=0.0)
    wanted = -(0.02 + 2e-3 * temperature) / 60.0 * 2.0
    assert (found - bias)[10:] == pytest.approx(wanted[10:], abs=2e-6)
    linear = logger("logger_skew").signature(inputs(TIME).with_output(bias), growth=0.0)
    assert 2.0 * linear[10:] == pytest.approx(wanted[10:], abs=2e-6)


@pytest.mark.parametrize("delay", [0.3, 17.25, -8.5])
def test_skewed_record_is_the_output_at_another_time(delay: float) -> None:
    found = logger("logger_skew").record(wave(TIME), inputs(TIME), delay, growth=0.0)
    inner = (TIME > 20.0) & (TIME < 7170.0)
    # Linear between samples: to second order in the sample interval.
    assert found[inner] == pytest.approx(wave(TIME - delay)[inner], abs=1e-4)


def test_clock_that_is_100_ppm_off_gains_a_third_of_a_second_an_hour() -> None:
    ramp = 1.0 * TIME
    found = logger("logger_skew").record(ramp, inputs(TIME), 1.0, growth=0.36)
    late = ramp - found
    assert late[3600] - late[0 + 5] == pytest.approx(100e-6 * 3595.0, rel=1e-6)


@pytest.mark.parametrize("window", [1.0, 7.0, 64.0])
@pytest.mark.parametrize("time", [TIME[:5000], UNEVEN], ids=["even", "uneven"])
def test_average_is_the_mean_of_the_samples_in_its_window(window: float, time: FloatArray) -> None:
    output = wave(time)
    found = logger("averaging").record(output, inputs(time), window)
    for row in (0, 1, 40, 333, 4999):
        inside = (time > time[row] - window + 1e-6) & (time <= time[row])
        assert found[row] == pytest.approx(output[inside].mean(), abs=1e-12)


def test_an_average_is_the_same_on_a_clock_of_the_epoch() -> None:
    """Times near 1.7e9 s are told to 0.2 us: a window's edge is no sharper."""
    time = 0.7 * np.arange(4000.0)
    output = wave(time)
    plain, late = (logger("averaging").record(output, inputs(start + time), 7.0) for start in (0.0, 1.7e9))
    assert late == pytest.approx(plain, abs=1e-9)


@pytest.mark.parametrize("count", [1, 4, 16])
def test_averaging_lowers_white_noise_by_the_root_of_its_samples(count: int) -> None:
    """A window of one sample changes nothing: samples are means already."""
    noise = np.random.default_rng(1).standard_normal(len(TIME))
    found = logger("averaging").record(noise, inputs(TIME), float(count))
    if count == 1:
        assert np.array_equal(found, noise)
    assert found.std() == pytest.approx(1.0 / np.sqrt(count), rel=0.06)


def test_average_is_a_delay_by_half_of_a_long_window_to_first_order() -> None:
    ramp, window = 0.7 * TIME, 100.0
    found = logger("averaging").record(ramp, inputs(TIME), window) - ramp
    linear = window * logger("averaging").signature(inputs(TIME).with_output(ramp))
    assert found[200:] == pytest.approx(-0.7 * 0.5 * (window - 1.0))
    assert found[200:] == pytest.approx(linear[200:], rel=0.02)


def test_edge_of_the_rate_becomes_a_ramp_as_long_as_the_window() -> None:
    edge = np.where(TIME >= 1000.0, 36_000.0, 0.0)
    found = logger("averaging").record(edge, inputs(TIME), 20.0)
    rising = (TIME >= 1000.0) & (TIME <= 1019.0)
    assert np.diff(found[rising]) == pytest.approx(1800.0, rel=1e-6)


@pytest.mark.parametrize(("id", "amplitude"), [("logger_skew", 23.7), ("averaging", 31.0)])
def test_records_go_on_from_block_to_block(id: str, amplitude: float) -> None:
    output, declared, memory = wave(UNEVEN), logger(id), Memory()
    shape = declared.default_shape() | ({"growth": 0.4} if id == "logger_skew" else {})
    whole = declared.record(output, inputs(UNEVEN), amplitude, **shape)
    pieces = [
        declared.record(output[start:stop], inputs(UNEVEN[start:stop], memory), amplitude, **shape)
        for start, stop in pairwise([0, 1, 9, 700, 701, 3000, 5000])
    ]
    assert np.concatenate(pieces) == pytest.approx(whole, rel=1e-11, abs=1e-12)


def test_wrong_unit_and_sign() -> None:
    output = wave(TIME)
    units = logger("units_and_gaps")
    assert np.array_equal(units.record(output, inputs(TIME), -2.0), -output)
    seconds = units.record(output, inputs(TIME), 1.0 / 3600.0 - 1.0)
    assert seconds == pytest.approx(output / 3600.0)
    given = replace(inputs(TIME), output=output)
    assert np.array_equal(units.signature(given), output)


def test_counts_after_a_sample_that_stands_alone_are_whole_and_lose_nothing() -> None:
    """A unit that is switched on at the last sample of a block begins with one sample of unknown length."""
    counts, memory, rate = logger("output_counts"), Memory(), 5.0 + wave(TIME[:500])
    parts = [counts.record(rate[a:b], inputs(TIME[a:b], memory), 0.7) for a, b in ((0, 1), (1, 500))]
    whole = parts[1] / 0.7
    np.testing.assert_allclose(whole, np.rint(whole), atol=1e-9)
    assert abs(parts[1].sum() - rate[1:].sum()) < 0.7
    np.testing.assert_array_equal(parts[0], rate[:1])
