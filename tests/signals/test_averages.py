from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.signals.averages import block_averages, covered_share, mean_cosine


def plain(time: np.ndarray, values: np.ndarray, window_s: float) -> tuple[list[float], list[int]]:
    """The definition, sample by sample."""
    sample_s = float(np.median(np.diff(time)))
    groups: list[list[int]] = []
    origin = time[0]
    window = 0
    groups.append([0])
    for i in range(1, len(time)):
        gap = time[i] - time[i - 1]
        if gap > 3 * sample_s and gap > window_s / 4:
            origin, window = time[i], 0
            groups.append([i])
            continue
        now = int(np.floor((time[i] - origin + (0.5 + 1e-6) * sample_s) / window_s))
        if now != window:
            window = now
            groups.append([])
        groups[-1].append(i)
    kept = [g for g in groups if time[g[-1]] - time[g[0]] + sample_s >= 0.5 * window_s - 1e-6 * sample_s]
    return [float(np.mean(values[g])) for g in kept], [len(g) for g in kept]


def test_regular_sampling_is_reshape_and_mean():
    rng = np.random.default_rng(1)
    time = 0.1 * np.arange(1000) + 5e8
    x = rng.normal(size=1000)
    got = block_averages(time, x, window_s=10.0)
    np.testing.assert_allclose(got.values[0], x.reshape(10, 100).mean(axis=1), rtol=0, atol=1e-14)
    np.testing.assert_array_equal(got.counts, 100)
    np.testing.assert_allclose(got.time_s, time.reshape(10, 100).mean(axis=1), rtol=1e-15)


@pytest.mark.parametrize("samples", [1, 2, 60])
@pytest.mark.parametrize("origin", [0.0, 1.7e9])
def test_times_that_are_not_quite_even_move_no_sample_to_another_window(samples: int, origin: float):
    """A sample in each window, and 1 % of jitter: a quarter of them had none, others two."""
    rng = np.random.default_rng(4)
    x = rng.normal(size=30 * samples)
    time = origin + 100.0 * (np.arange(len(x)) + rng.uniform(-0.2, 0.2, len(x)))
    got = block_averages(time, x, window_s=100.0 * samples)
    np.testing.assert_array_equal(got.counts, samples)
    np.testing.assert_allclose(got.values[0], x.reshape(30, -1).mean(axis=1), rtol=0, atol=1e-14)


def test_columns_keep_their_order_and_shape():
    time = np.arange(40.0)
    table = np.column_stack((time, 2 * time, time**2))
    got = block_averages(time, time, table, window_s=10.0)
    assert got.values[1].shape == (4, 3)
    np.testing.assert_allclose(got.values[1][:, 1], 2 * got.values[0])
    np.testing.assert_allclose(got.values[0], [4.5, 14.5, 24.5, 34.5])


@pytest.mark.parametrize(("samples", "windows"), [(14, 1), (15, 2), (19, 2), (20, 2), (4, 0), (5, 1)])
def test_rest_is_kept_from_half_full(samples: int, windows: int):
    time = np.arange(float(samples))
    assert len(block_averages(time, time, window_s=10.0)) == windows


def test_long_gap_begins_anew_and_short_gap_is_spanned():
    time = np.concatenate((np.arange(25.0), 1000.0 + np.arange(25.0)))
    got = block_averages(time, time, window_s=10.0)
    np.testing.assert_array_equal(got.starts, [0, 10, 20, 25, 35, 45])
    np.testing.assert_array_equal(got.stops, [10, 20, 25, 35, 45, 50])
    # A logger that pauses for 3 s in every 6 s still gives an average for every 100 s.
    bursts = (6.0 * np.arange(100)[:, None] + 0.1 * np.arange(30)).ravel()
    assert len(block_averages(bursts, bursts, window_s=100.0)) == 6


def test_a_large_offset_costs_no_digits():
    rng = np.random.default_rng(2)
    noise = np.round(rng.normal(size=100_000) * 2**20) / 2**20
    got = block_averages(np.arange(1e5), noise + 2.0**25, window_s=1e4)
    want = noise.reshape(10, -1).mean(axis=1)
    np.testing.assert_allclose(got.values[0] - 2.0**25, want, atol=1e-8)


@settings(deadline=None)
@given(
    steps=st.lists(st.sampled_from([1.0, 1.0, 1.0, 1.0, 2.0, 2.5, 7.0, 40.0]), min_size=1, max_size=80),
    window_s=st.sampled_from([0.5, 1.0, 2.5, 5.0, 10.0, 30.0]),
)
def test_equals_the_definition(steps: list[float], window_s: float):
    time = np.cumsum([0.0, *steps])
    values = np.sin(time)
    want, counts = plain(time, values, window_s)
    got = block_averages(time, values, window_s=window_s)
    np.testing.assert_allclose(got.values[0], want, atol=1e-13)
    assert got.counts.tolist() == counts


def test_empty_single_and_bad_input():
    empty = np.empty(0)
    assert len(block_averages(empty, empty, window_s=1.0)) == 0
    assert block_averages([3.0], [7.0], window_s=1.0).values[0].tolist() == [7.0]
    with pytest.raises(InputError, match="positive"):
        block_averages([0.0, 1.0], [1.0, 2.0], window_s=0.0)
    with pytest.raises(InputError, match="column 2 has 1 samples"):
        block_averages([0.0, 1.0], [1.0, 2.0], [1.0], window_s=1.0)


@pytest.mark.parametrize("row", [0, 5])
@pytest.mark.parametrize("missing", [np.nan, np.inf])
def test_a_value_that_is_missing_is_in_its_own_window_alone(row: int, missing: float):
    values = np.arange(10.0)
    values[row] = missing
    (means,) = block_averages(np.arange(10.0), values, window_s=2.0).values
    expected = np.array([0.5, 2.5, 4.5, 6.5, 8.5])
    expected[row // 2] = missing
    np.testing.assert_allclose(means, expected)


def test_an_angle_that_is_missing_leaves_the_others():
    before, after = np.array([0.0, 1.0, np.nan]), np.array([3.0, 5.0, 6.0])
    np.testing.assert_allclose(
        mean_cosine(before, after), (np.sin(after) - np.sin(before)) / (after - before)
    )


def test_samples_after_a_gap_cover_their_own_time_in_each_of_records_that_follow_one_another() -> None:
    step = np.concatenate([[0.0], np.ones(150), 20.0 * np.ones(200)])
    wanted = np.ones(len(step))
    for row, times in ((30, 4.0), (31, 7.0), (200, 3.0), (350, 2.0)):
        step[row] *= times
        wanted[row] = 1.0 / times
    assert covered_share(step) == pytest.approx(wanted)
    # A block of one sample, or of none, tells of no gap.
    assert covered_share(np.array([5.0])).tolist() == [1.0]
    assert covered_share(np.empty(0)).tolist() == []
