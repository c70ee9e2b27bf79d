"""Memory operators against closed forms, and in pieces against the whole."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from fogml.errors import InputError
from fogml.features.operators import SINCE_ON
from fogml.signals.memory import Lag, Play


def test_a_lag_behind_a_ramp_is_its_rate_times_the_time_constant() -> None:
    time = np.arange(0.0, 9000.0, 7.0)
    values, settled = Lag(600.0, 7.0).push(time, 20.0 + 0.01 * time)
    # dy/dt = (x - y)/tau from rest: y = x - r tau (1 - exp(-t/tau)).
    expected = 20.0 + 0.01 * time - 6.0 * (1.0 - np.exp(-time / 600.0))
    np.testing.assert_allclose(values, expected, atol=1e-10)
    assert time[settled][0] == pytest.approx(1800.0, abs=7.0)


def test_a_lag_of_any_path_is_the_differential_equations_solution() -> None:
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(5.0, 20.0, 80))
    x = np.cumsum(rng.normal(0.0, 2.0, 80))
    values, _ = Lag(300.0, 12.0).push(time, x)
    path = solve_ivp(
        lambda t, y: (np.interp(t, time, x) - y) / 300.0,
        (time[0], time[-1]),
        [x[0]],
        t_eval=time,
        rtol=1e-9,
        atol=1e-9,
        max_step=2.0,
    )
    np.testing.assert_allclose(values, path.y[0], atol=1e-5)


def test_a_lag_begins_anew_after_a_gap_that_it_can_t_span() -> None:
    time = np.concatenate([np.arange(100.0), np.arange(1000.0, 1100.0)])
    x = np.linspace(0.0, 10.0, 200)
    values, settled = Lag(30.0, 1.0).push(time, x)
    assert values[100] == x[100]
    assert settled[99] and not settled[100] and settled[-1]


def test_a_play_follows_a_triangle_with_its_half_width_between_the_branches() -> None:
    x = np.concatenate([np.linspace(0.0, 50.0, 501), np.linspace(50.0, 0.0, 501)])
    values, settled = Play(4.0).push(np.arange(1002.0), x)
    up, down = np.s_[100:501], np.s_[590:1002]
    np.testing.assert_allclose(values[up], x[up] - 4.0, atol=1e-12)
    np.testing.assert_allclose(values[down], x[down] + 4.0, atol=1e-12)
    assert x[settled][0] == pytest.approx(8.0, abs=0.11)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-50.0, 80.0), min_size=2, max_size=60),
    st.floats(0.5, 10.0),
    st.floats(-10.0, 10.0),
)
def test_a_settled_play_has_forgotten_where_it_began(path: list[float], width: float, began: float) -> None:
    x = np.array(path)
    first = np.clip(began, -width, width) + x[0]
    mine, settled = Play(width).push(np.arange(float(len(x))), x)
    other = Play(width)
    other._state = first
    theirs, _ = other.push(np.arange(float(len(x))), x)
    np.testing.assert_allclose(mine[settled], theirs[settled], atol=1e-9)
    assert (np.abs(mine - x) <= width + 1e-9).all()


def test_a_decay_is_the_exponential_of_the_time_on() -> None:
    values, settled = SINCE_ON.operator((400.0,), 1.0).push(np.arange(3.0), np.array([0.0, 400.0, np.inf]))
    np.testing.assert_allclose(values, [1.0, np.exp(-1.0), 0.0], rtol=1e-15)
    assert settled.all()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.lists(st.integers(1, 30), min_size=1, max_size=8))
def test_pieces_give_the_very_numbers_of_the_whole(seed: int, sizes: list[int]) -> None:
    rng = np.random.default_rng(seed)
    count = sum(sizes)
    time = np.cumsum(rng.choice([1.0, 1.1, 0.9, 40.0], count, p=[0.5, 0.2, 0.28, 0.02]))
    x = np.cumsum(rng.normal(size=count))
    for make in (lambda: Lag(20.0, 1.0), lambda: Play(1.5)):
        whole, whole_settled = make().push(time, x)
        operator, ends = make(), np.cumsum(sizes)
        pieces = [operator.push(time[end - n : end], x[end - n : end]) for n, end in zip(sizes, ends)]
        np.testing.assert_array_equal(whole, np.concatenate([piece[0] for piece in pieces]))
        np.testing.assert_array_equal(whole_settled, np.concatenate([piece[1] for piece in pieces]))


@pytest.mark.parametrize("make", [lambda: Lag(0.5, 1.0), lambda: Lag(np.nan, 1.0), lambda: Play(0.0)])
def test_sizes_that_mean_nothing_are_refused(make) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError):
        make()
