"""Window operators against plain definitions, closed forms, scipy and numpy, and sample by sample."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.signals import memory as streams
from fogml.signals.clock import Clock, gap_starts
from fogml.signals.windows import block_difference, exponential, first_difference, slope

WINDOWED = {"block": block_difference, "slope": slope, "exp": exponential}
STREAMS: dict[str, Any] = {
    "block": streams.BlockDifferenceStream,
    "slope": streams.SlopeStream,
    "exp": streams.ExponentialStream,
}


def operate(
    method: str, clock: Any, x: FloatArray, window_s: float, sample_s: float | None, unit_s: float | None
):  # type: ignore[no-untyped-def]
    if method == "first":
        return first_difference(clock, x, sample_s, unit_s=unit_s)
    return WINDOWED[method](clock, x, window_s, sample_s, unit_s=unit_s)


def by_definition(  # type: ignore[no-untyped-def]
    method: str,
    time: FloatArray,
    x: FloatArray,
    window_s: float,
    sample_s: float,
    unit_s: float | None,
    since: int = 0,
):
    """Values from the definition alone, over all earlier samples; where full; where they count."""
    values, (full, counts) = np.zeros(len(x)), np.zeros((2, len(x)), dtype=bool)
    edge = 1e-6 * sample_s
    span = {"block": 2.0, "slope": 1.0, "exp": 3.0, "first": 0.0}[method] * window_s
    longest = 3.0 * sample_s if method == "first" else max(window_s / 4.0, 3.0 * sample_s)
    longest += 0.01 * sample_s  # times are rounded
    start = 0
    for i in range(len(x)):
        if i and time[i] - time[i - 1] > longest:
            start = i
        if i == start or i < since:
            continue
        t, v = time[start : i + 1], x[start : i + 1]
        age = time[i] - t
        filling = age[0] < span - sample_s - edge
        part = 0.5 * age[0] if filling else window_s
        newest, before = age < part - edge, (age >= part - edge) & (age < 2.0 * window_s - edge)
        share = age[0] / span if filling else 1.0
        if method == "first":
            change, per = v[-1] - v[-2], t[-1] - t[-2]
        elif method == "block":
            if not before.any():
                continue
            change = math.fsum(v[newest]) / newest.sum() - math.fsum(v[before]) / before.sum()
            per = np.mean(age[before]) - np.mean(age[newest])
            change *= window_s / per if filling and unit_s is None else 1.0
        elif method == "slope":
            newest = age < window_s - edge
            if newest.sum() < 2:
                continue
            t, v = t[newest] - t[newest].mean(), v[newest]
            change, per = window_s * np.dot(t, v - v.mean()) / np.dot(t, t), window_s
        else:
            # Each past straight piece's slope, by the share of the exponential memory it covers.
            weight = np.exp(-age[1:] / window_s) - np.exp(-age[:-1] / window_s)
            change, per = window_s * np.sum(weight * np.diff(v) / np.diff(t)), window_s
        # Rates are 8**1.5 times a full window's noise; a part's goes with its length to the power of -1.5.
        noise = (8.0 * share) ** -3.0
        weight = (1.0 + 8.0**-3.0) / (1.0 + noise) if filling and method != "exp" else 1.0
        values[i] = weight * (change if unit_s is None else change * unit_s / per)
        full[i], counts[i] = not filling, age[0] >= 0.125 * span - edge
    return values, full, counts


@st.composite
def recordings(draw: st.DrawFn) -> tuple[FloatArray, FloatArray, float]:
    """Times with jitter, lost samples and gaps, or regular ones; a temperature; the interval."""
    count = draw(st.integers(2, 160))
    sample_s = draw(st.sampled_from([0.1, 0.25, 1.0, 3.0]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    jitter = draw(st.sampled_from([0.0, 0.2, 0.6]))
    interval = sample_s * (1.0 + jitter * rng.uniform(-1.0, 1.0, count))
    for _ in range(draw(st.integers(0, 4))):
        interval[rng.integers(count)] += sample_s * draw(st.sampled_from([1.0, 2.5, 6.0, 40.0, 400.0]))
    time = draw(st.sampled_from([0.0, -50.0, 1e5])) + np.cumsum(interval)
    if jitter == 0.0 and draw(st.booleans()):
        time = sample_s * np.arange(count)
    x = draw(st.sampled_from([0.0, -40.0, 300.0])) + np.cumsum(rng.normal(0.0, 0.1, count))
    return time, x, sample_s


@settings(max_examples=150, deadline=None)
@given(
    recordings(),
    st.sampled_from(["block", "slope", "exp", "first"]),
    st.sampled_from([2.0, 3.5, 8.0, 13.0]),
    st.sampled_from([None, 1.0, 60.0]),
)
def test_values_and_fullness_are_those_of_the_definition(
    recording: tuple[FloatArray, FloatArray, float], method: str, windows: float, unit_s: float | None
) -> None:
    time, x, sample_s = recording
    window_s = windows * sample_s
    values, *masks = operate(method, time, x, window_s, sample_s, unit_s)
    wanted, *wanted_masks = by_definition(method, time, x, window_s, sample_s, unit_s)
    np.testing.assert_array_equal(masks, wanted_masks)
    size = 1.0 if unit_s is None else unit_s / sample_s
    np.testing.assert_allclose(values, wanted, rtol=1e-9, atol=1e-10 * size)


@settings(max_examples=150, deadline=None)
@given(
    recordings(),
    st.sampled_from(["block", "slope", "exp", "first"]),
    st.sampled_from([2.0, 3.5, 8.0, 70.0]),
    st.sampled_from([None, 60.0]),
)
def test_streams_give_the_same_sample_by_sample(
    recording: tuple[FloatArray, FloatArray, float], method: str, windows: float, unit_s: float | None
) -> None:
    time, x, sample_s = recording
    window_s = windows * sample_s
    values, *masks = operate(method, time, x, window_s, sample_s, unit_s)
    stream = (
        streams.FirstDifferenceStream(sample_s, unit_s)
        if method == "first"
        else STREAMS[method](window_s, sample_s, unit_s)
    )
    steps = [stream.step(t, v) for t, v in zip(time.tolist(), x.tolist())]
    np.testing.assert_array_equal(masks, np.transpose([step[1:] for step in steps]))
    size = 1.0 if unit_s is None else unit_s / sample_s
    np.testing.assert_allclose([step[0] for step in steps], values, rtol=1e-9, atol=1e-11 * size)


@pytest.mark.parametrize(("seed", "window_s"), [(119, 2.0), (2, 3.5), (98, 8.0)])
def test_a_block_that_is_full_at_a_short_interval_takes_samples_back(seed: int, window_s: float) -> None:
    """Half of what is known by then is half an interval less than a block: the newest one was that short."""
    time = np.cumsum(1.0 + 0.6 * np.random.default_rng(seed).uniform(-1.0, 1.0, 30))
    x = np.random.default_rng(seed).normal(size=30)
    stream = streams.BlockDifferenceStream(window_s, 1.0)
    found, counts = [], []
    for t, v in zip(time.tolist(), x.tolist()):
        found.append(stream.step(t, v)[0])
        counts.append(len(stream._newest))
    assert np.diff(counts).max() > 1
    wanted, *_ = by_definition("block", time, x, window_s, 1.0, None)
    np.testing.assert_allclose(found, wanted, atol=1e-12)
    np.testing.assert_allclose(block_difference(time, x, window_s, 1.0).values, wanted, atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(recordings(), st.sampled_from(["block", "slope", "exp", "first"]), st.integers(0, 160))
def test_no_value_depends_on_later_samples(
    recording: tuple[FloatArray, FloatArray, float], method: str, cut: int
) -> None:
    time, x, sample_s = recording
    cut = min(cut, len(x))
    changed = np.concatenate([x[:cut], 1000.0 - 3.0 * x[cut:]])
    later = np.concatenate([time[:cut], time[cut:] + 5.5 * sample_s])
    values, *masks = operate(method, time, x, 8.0 * sample_s, sample_s, 60.0)
    again, *masks_again = operate(method, later, changed, 8.0 * sample_s, sample_s, 60.0)
    np.testing.assert_array_equal(np.array(masks)[:, :cut], np.array(masks_again)[:, :cut])
    np.testing.assert_allclose(values[:cut], again[:cut], rtol=1e-9, atol=1e-10 / sample_s)


@pytest.mark.parametrize("method", ["block", "slope", "exp", "first"])
@pytest.mark.parametrize("irregular", [False, True])
def test_a_ramp_gives_its_rate(method: str, irregular: bool) -> None:
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.5, 1.5, 3000)) if irregular else np.arange(3000.0)
    values, full, _ = operate(method, time, 25.0 + time / 60.0, 64.0, 1.0, 60.0)
    assert full.sum() > 2500
    # An exponential memory has taken up all but e**-3 of the ramp when it first counts as full.
    settled = full & (time > 2000.0)
    np.testing.assert_allclose(values[settled], 1.0, rtol=1e-10)
    difference, *_ = operate(method, time, 25.0 + time / 60.0, 64.0, 1.0, None)
    if method != "first" and not irregular:
        np.testing.assert_allclose(difference[settled], 64.0 / 60.0, rtol=1e-10)


def test_exponential_is_the_recursive_filter() -> None:
    rng = np.random.default_rng(5)
    x = np.cumsum(rng.normal(size=5000))
    weight = -math.expm1(-0.5 / 20.0)
    filtered = lfilter([weight], [1.0, weight - 1.0], np.diff(x, prepend=x[0]) / 0.5)
    values, full, _ = exponential(0.5 * np.arange(5000), x, 20.0, 0.5, unit_s=1.0)
    np.testing.assert_allclose(values, filtered, rtol=1e-10, atol=1e-12)
    assert int(np.argmax(full)) == 119


def test_block_is_the_difference_of_means_of_so_many_samples() -> None:
    x = np.random.default_rng(6).normal(size=500)
    values, full, counts = block_difference(np.arange(500.0), x, 64.0)
    assert int(np.argmax(full)) == 127 and int(np.argmax(counts)) == 16
    for i in (127, 300, 499):
        wanted = x[i - 63 : i + 1].mean() - x[i - 127 : i - 63].mean()
        assert values[i] == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize("window_s", [1.0, 1.5, 2.0, 2.5, 3.0, 31.0, 63.5, 64.0, 700.0, 1023.5])
@pytest.mark.parametrize("given", [False, True])
def test_means_of_windows_of_any_count(window_s: float, given: bool) -> None:
    """Beyond one chunk; 2.5 s and the like make a newest window of a sample more than the one before."""
    x = 1e3 + np.random.default_rng(10).normal(size=70_000)
    out = np.full(len(x), np.nan) if given else None
    values, full, _ = block_difference(np.arange(70_000.0), x, window_s, out=out)
    assert values is out or not given
    newest, both = math.ceil(window_s), round(2.0 * window_s)
    means = [np.convolve(x, np.full(n, 1.0 / n), "valid") for n in (newest, both - newest)]
    np.testing.assert_array_equal(full, np.arange(len(x)) >= both - 1)
    wanted = means[0][both - newest :] - means[1][: len(x) - both + 1]
    np.testing.assert_allclose(values[full], wanted, atol=1e-11)


def test_a_steady_signal_changes_by_nothing() -> None:
    values, *_ = block_difference(np.arange(50_000.0), np.full(50_000, 25.3), 63.5)
    assert not values.any()


@pytest.mark.parametrize("sample_s", [0.1, 0.02, 1.0 / 3.0, 0.7])
def test_float_noise_of_the_times_does_not_move_window_edges(sample_s: float) -> None:
    count, window_s = 2000, 40 * sample_s
    x = np.random.default_rng(7).normal(size=count)
    wanted, wanted_full, _ = block_difference(np.arange(float(count)), x, 40.0, 1.0)
    for time in (
        sample_s * np.arange(count),
        np.cumsum(np.full(count, sample_s)),
        1e6 + sample_s * np.arange(count),
    ):
        values, full, _ = block_difference(time, x, window_s, sample_s)
        np.testing.assert_array_equal(full, wanted_full)
        np.testing.assert_allclose(values, wanted, atol=1e-12)


@pytest.mark.parametrize("method", ["block", "slope"])
def test_running_sums_stay_exact_over_a_long_recording(method: str) -> None:
    """Far from the first value, late on the clock, on a grid and just off it."""
    count, sample_s, window_s = 2_000_000, 0.01, 0.64
    rng = np.random.default_rng(8)
    x = 60.0 + 1e-3 * rng.normal(size=count)
    x[0] = -40.0
    for jitter in (0.0, 1e-3):
        time = 1e6 + sample_s * np.arange(count) + jitter * sample_s * rng.uniform(-1.0, 1.0, count)
        values, full, _ = operate(method, time, x, window_s, sample_s, None)
        assert full[200:].all()
        for i in rng.integers(1000, count, 200):
            piece = slice(i - 199, i + 1)
            ages = time[piece] - time[i]
            wanted, *_ = by_definition(method, ages, x[piece], window_s, sample_s, None, since=199)
            assert values[i] == pytest.approx(wanted[-1], abs=1e-9)


def test_streams_stay_exact_over_a_long_recording() -> None:
    count = 60_000
    x = 60.0 + 1e-3 * np.random.default_rng(9).normal(size=count)
    x[:100] = -1e6
    for method, make in STREAMS.items():
        stream = make(8.0, 0.1, None)
        last = [stream.step(t, v)[0] for t, v in zip((0.1 * np.arange(count)).tolist(), x.tolist())]
        wanted, *_ = operate(method, 0.1 * np.arange(5000), x[-5000:], 8.0, 0.1, None)
        assert last[-1] == pytest.approx(wanted[-1], abs=1e-9)


def test_gaps_restart_only_beyond_a_quarter_of_the_window() -> None:
    time = np.arange(1000.0)
    x = np.sin(time / 50.0)
    for gap, spanned in ((15.0, True), (17.0, False)):
        shifted = time + np.where(time >= 500, gap - 1.0, 0.0)
        _, full, _ = block_difference(shifted, x, 64.0, 1.0)
        assert full[499]
        assert full[500] == spanned
        assert full[500 + 127]
        assert full[500 + 126] == spanned


@pytest.mark.parametrize("begins", [0.0, 1.7e9])
@pytest.mark.parametrize("per_s", [100, 20, 10, 3])
def test_rounding_of_times_makes_no_gap_of_two_lost_samples(per_s: int, begins: float) -> None:
    """Whole numbers tell which intervals are longer than three; seconds do not hold them exactly."""
    kept = np.ones(20_000, dtype=bool)
    kept[100::50] = kept[101::50] = False
    kept[102::500] = False
    number = np.flatnonzero(kept)
    longer = np.flatnonzero(np.diff(number) > 3) + 1
    clock = Clock(begins + number / per_s)
    np.testing.assert_array_equal(gap_starts(clock.time, clock.sample_s), longer)
    full = first_difference(clock, np.zeros(len(number))).full
    np.testing.assert_array_equal(np.flatnonzero(~full), [0, *longer])
    stream = streams.FirstDifferenceStream(clock.sample_s)
    np.testing.assert_array_equal([stream.step(t, 0.0)[1] for t in clock.time.tolist()], full)


def test_first_difference_never_crosses_a_gap() -> None:
    values, full, _ = first_difference([0.0, 1.0, 5.0, 6.0], [0.0, 1.0, 9.0, 10.0], 1.0)
    assert full.tolist() == [False, True, False, True]
    assert values.tolist() == [0.0, 1.0, 0.0, 1.0]


@pytest.mark.parametrize("method", ["block", "slope", "exp"])
def test_a_window_shorter_than_the_interval_is_refused(method: str) -> None:
    with pytest.raises(InputError, match=r"widen it to at least [12]00 s"):
        operate(method, 100.0 * np.arange(50), np.zeros(50), 64.0, None, None)
    with pytest.raises(InputError, match="widen"):
        STREAMS[method](64.0, 100.0)
    for wrong in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="positive number"):
            operate(method, np.arange(50.0), np.zeros(50), wrong, 1.0, None)


def test_lengths_must_agree() -> None:
    with pytest.raises(InputError, match=r"\(3,\) values for \(4,\) sample times"):
        block_difference(np.arange(4.0), np.zeros(3), 1.0)


@pytest.mark.parametrize("method", ["block", "slope", "exp", "first"])
@pytest.mark.parametrize("count", [0, 1, 2])
def test_the_shortest_recordings_have_no_full_window(method: str, count: int) -> None:
    values, full, _ = operate(method, np.arange(float(count)), np.ones(count), 5.0, 1.0, 60.0)
    assert values.shape == full.shape == (count,)
    assert full.sum() == (method == "first" and count == 2)


def test_a_clock_tells_a_grid_from_jitter() -> None:
    assert Clock(0.1 * np.arange(100_000)).grid_s == pytest.approx(0.1)
    for spoiled in (70_000, 3):
        time = 0.1 * np.arange(100_000)
        time[spoiled] += 1e-6
        assert Clock(time).grid_s is None


def test_the_nominal_interval_is_the_median_unless_given() -> None:
    jittered = np.cumsum(np.random.default_rng(10).uniform(0.5, 1.5, 1000))
    assert Clock(jittered).sample_s == np.median(np.diff(jittered))
    assert Clock(0.1 * np.arange(1000)).sample_s == pytest.approx(0.1, rel=1e-12)
    assert Clock([0.0, 1.0, 2.0], 0.7).sample_s == 0.7
    assert Clock([0.0, 1.0, 2.0], 0.7).grid_s is None
    assert Clock([4.0]).sample_s == 0.0
    with pytest.raises(InputError, match="one dimension"):
        Clock(np.zeros((2, 2)))


def test_streams_hold_no_more_than_their_windows() -> None:
    block, line = streams.BlockDifferenceStream(5.0, 0.1), streams.SlopeStream(5.0, 0.1)
    for i in range(5000):
        block.step(0.1 * i, float(i % 7))
        line.step(0.1 * i, float(i % 7))
        assert len(block._newest) + len(block._before) <= 100
        assert len(line._held) <= 50


@pytest.mark.parametrize("method", ["block", "slope"])
def test_what_a_filling_window_tells_is_the_best_guess_of_the_rate(method: str) -> None:
    """Rates of 23 times a full window's noise: their least squares on the values has slope 1 at any share."""
    rng = np.random.default_rng(12)
    time, runs, window_s = np.arange(130.0), 3000, 64.0
    # A mean of 64 less the one before, over 64 s; a line through 64 samples of 1 s.
    noise = 60.0 * (math.sqrt(2.0 / 64.0) / 64.0 if method == "block" else math.sqrt(12.0 / 64.0**3))
    rates = 8.0**1.5 * noise * rng.normal(size=runs)
    values = np.empty((runs, len(time)))
    for i, rate in enumerate(rates):
        x = rate * time / 60.0 + rng.normal(size=len(time))
        values[i] = operate(method, time, x, window_s, 1.0, 60.0)[0]
    for part in (0.125, 0.25, 0.5, 1.0):
        value = values[:, min(round(part * (128 if method == "block" else 64)), 127)]
        slope_of = float(rates @ value / (value @ value))
        # Few samples tell a line worse than the cube of their number says.
        assert slope_of == pytest.approx(1.0, abs=0.05 if part > 0.2 else 0.2), part


def test_a_ramp_that_goes_on_at_the_start_is_told_nearly_whole_at_half_a_window() -> None:
    time = np.arange(200.0)
    for operator in (block_difference, slope):
        values, full, counts = operator(time, 50.0 - 0.1 * time, 64.0, unit_s=60.0)
        span = int(np.argmax(full)) + 1
        assert values[span // 2] == pytest.approx(-6.0 * (1.0 + 8.0**-3) / (1.0 + 4.0**-3), rel=1e-9)
        assert np.argmax(counts) == span // 8
