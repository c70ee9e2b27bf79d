"""Lags, play operators, rates and sums: closed forms, plain loops, and blocks against the whole."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.arrays import FloatArray
from fogml.features.parse import parse_features
from fogml.runs.run import Run
from fogml.twin.memory import Memory

RNG = np.random.default_rng(11)
REGULAR = np.arange(3000.0)
UNEVEN = np.cumsum(RNG.uniform(0.4, 1.6, 3000))
GAPS = REGULAR + np.where(REGULAR > 1000, 90.0, 0.0) + np.where(REGULAR > 2000, 500.0, 0.0)
COARSE = 10.0 * np.arange(3000.0)
CLOCKS = {"regular": REGULAR, "uneven": UNEVEN, "gaps": GAPS, "coarse": COARSE, "late": REGULAR + 1.7e9}

# Steps that differ by the rounding of their times.
FINE = 0.018 * np.arange(3000.0) + 3e4


def temperature(time: FloatArray) -> FloatArray:
    t = time - time[0]
    return 20.0 + 30.0 * np.sin(t / 700.0) + 0.01 * np.random.default_rng(1).standard_normal(len(t))


def two_windows(time: FloatArray, x: FloatArray, window: float) -> tuple[FloatArray, FloatArray]:
    """Steps of the windows' means of x and of time, sample by sample from their definition."""
    steps = np.zeros((2, len(time)))
    for i in range(1, len(time)):
        age = time[i] - time[: i + 1]
        newest = np.flatnonzero(age < window - 1e-6)
        before = np.flatnonzero((age >= window - 1e-6) & (age < 2.0 * window - 1e-6))
        if not len(before):
            half = (newest[0] + i + 1) // 2
            before, newest = np.arange(newest[0], half), np.arange(half, i + 1)
        for row, values in enumerate((x, time - time[0])):
            if len(before):
                steps[row, i] = values[newest].mean() - values[before].mean()
            else:
                steps[row, i] = values[i] - values[i - 1]
    return steps[0], steps[1]


@pytest.mark.parametrize("clock", CLOCKS)
def test_rate_and_difference_by_definition(clock: str) -> None:
    time = CLOCKS[clock]
    x = temperature(time)
    step_x, step_t = two_windows(time, x, 64.0)
    told = np.where(step_t < 128.0, step_x, 0.0)
    assert Memory().difference("a", time, x, 64.0, whole=True) == pytest.approx(told, abs=1e-11)
    wanted = np.divide(60.0 * step_x, step_t, out=np.zeros_like(x), where=step_t > 0.0)
    # Times near 1.7e9 s have 2e-7 s of rounding themselves.
    assert Memory().rate("a", time, x, 64.0) == pytest.approx(wanted, abs=1e-6 if clock == "late" else 1e-11)


@pytest.mark.parametrize("clock", ["regular", "gaps"])
def test_difference_is_the_features_where_their_windows_are_full(clock: str) -> None:
    time = CLOCKS[clock]
    run = Run(name="r", columns={"time": time, "gyro": np.zeros(3000), "T": temperature(time)})
    values, _, full = parse_features("diff(T)").atom_values(run)
    assert full.sum() > 2000
    found = Memory().difference("a", time, temperature(time), 64.0)
    assert found[full] == pytest.approx(values[full, 0], abs=1e-10)


@pytest.mark.parametrize(
    "sample_s", [1.0, 7.0, 10.0, 20.0, 32.0, 45.0, 60.0, 64.0, 100.0, 127.0, 128.0, 200.0]
)
def test_difference_is_over_its_window_however_slow_the_samples(sample_s: float) -> None:
    """That of a course at 1 s, read where the samples are."""
    fine, slow = np.arange(36001.0), sample_s * np.arange(36000.0 // sample_s)

    def course(time: FloatArray) -> FloatArray:
        return 30.0 * np.sin(time / 1500.0) + 10.0 * np.cos(time / 2500.0)

    true = np.interp(slow, fine, Memory().difference("a", fine, course(fine), 64.0))
    found = Memory().difference("a", slow, course(slow), 64.0)
    later = slow > 400.0
    assert found[later] == pytest.approx(true[later], abs=0.03 * np.abs(true).max())
    assert found[later] @ true[later] == pytest.approx(true[later] @ true[later], rel=2e-3)


@pytest.mark.parametrize("clock", CLOCKS)
def test_difference_of_a_ramp_is_what_it_climbs_in_a_window(clock: str) -> None:
    time = CLOCKS[clock]
    found = Memory().difference("a", time, 0.5 * (time - time[0]), 64.0)
    assert found[0] == 0.0
    assert found[time - time[0] > 140.0] == pytest.approx(32.0, rel=1e-6)


def test_rate_of_a_ramp_is_exact_from_the_second_sample_on_and_over_gaps() -> None:
    for time in CLOCKS.values():
        ramp = -3.0 * (time - time[0]) / 60.0
        for window in (0.0, 64.0):
            found = Memory().rate("a", time, ramp, window)
            assert found[0] == 0.0
            assert found[1:] == pytest.approx(-3.0, rel=1e-5)


def in_blocks(kind: str, time: FloatArray, edges: list[int]) -> FloatArray:
    memory, x = Memory(), temperature(time)
    pieces = []
    for start, stop in pairwise(edges):
        t, v = time[start:stop], x[start:stop]
        pieces.append(
            {
                "rate": lambda t=t, v=v: memory.rate("a", t, v, 64.0),
                "difference": lambda t=t, v=v: memory.difference("a", t, v, 64.0),
                "neighbours": lambda t=t, v=v: memory.rate("a", t, v, 0.0),
                "lag": lambda t=t, v=v: memory.lag("a", t, v, 200.0),
                "lags": lambda t=t, v=v: memory.lag("a", t, v, 200.0 + v),
                "play": lambda t=t, v=v: memory.play("a", v, 4.0),
                "total": lambda t=t, v=v: memory.total("a", v),
                "previous": lambda t=t, v=v: memory.previous("a", v),
                "first": lambda t=t, v=v: np.full(len(v), memory.first("a", v)),
            }[kind]()
        )
    return np.concatenate(pieces)


KINDS = ["rate", "difference", "neighbours", "lag", "lags", "play", "total", "previous", "first"]


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(KINDS),
    st.sampled_from(sorted(CLOCKS)),
    st.lists(st.integers(0, 3000), min_size=1, max_size=8),
)
def test_blocks_give_the_whole(kind: str, clock: str, cuts: list[int]) -> None:
    time = CLOCKS[clock]
    whole = in_blocks(kind, time, [0, 3000])
    found = in_blocks(kind, time, [0, *sorted(cuts), 3000])
    slack = 1e-12 * np.abs(whole).max()
    if clock == "late" and kind == "rate":
        slack = 1e-6
    assert np.abs(found - whole).max() <= slack


def test_blocks_of_fine_steps_give_the_whole_to_the_last_digit() -> None:
    whole = in_blocks("lag", FINE, [0, 3000])
    assert np.array_equal(in_blocks("lag", FINE, [0, 1, 700, 701, 2999, 3000]), whole)


def test_lag_of_a_ramp_in_closed_form() -> None:
    assert len(np.unique(np.diff(FINE))) > 1
    for clock in (REGULAR, UNEVEN, COARSE, FINE):
        time = clock - clock[0]
        found = Memory().lag("a", clock, 2.0 * time, 300.0)
        wanted = 2.0 * (time - 300.0 * (1.0 - np.exp(-time / 300.0)))
        assert found == pytest.approx(wanted, rel=1e-10, abs=1e-9)


@pytest.mark.parametrize("clock", CLOCKS)
def test_lag_of_a_constant_is_exactly_that(clock: str) -> None:
    time = CLOCKS[clock]
    constant = np.full(len(time), 25.1)
    assert np.array_equal(Memory().lag("a", time, constant, 1234.5), constant)


def test_play_is_centred_at_the_first_sample_and_follows_at_its_half_width() -> None:
    up = np.linspace(0.0, 50.0, 101)
    found = Memory().play("a", np.concatenate([up, up[::-1]]), 5.0)
    assert found[:11] == pytest.approx(0.0)
    assert found[100] == pytest.approx(45.0) and found[120] == pytest.approx(45.0)
    assert found[-1] == pytest.approx(5.0)


def test_keys_do_not_share_states() -> None:
    memory = Memory()
    memory.play("a", np.array([100.0]), 1.0)
    assert memory.play("b", np.array([0.0]), 1.0).tolist() == [0.0]
