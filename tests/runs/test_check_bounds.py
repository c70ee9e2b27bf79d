"""Checks that rule faults out by quick bounds find what a search of every sample finds."""

from __future__ import annotations

from itertools import groupby

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.runs import arrival_times, dropouts, plausible
from fogml.runs.checks import check_run
from fogml.runs.outliers import _none_stands_out, find_outliers
from fogml.runs.run import Run
from fogml.runs.stuck import MOVED_DEGC, STUCK_S

BLOCK = 1024


def samples_stuck(time, values, other):
    """Samples of spells during which `other`, which rises, has been away long enough, one after the other."""
    count = begin = 0
    for value, spell in groupby(values.tolist()):
        end = begin + len(list(spell))
        away = [
            t for t, x in zip(time[begin:end], other[begin:end]) if x > max(value, other[begin]) + MOVED_DEGC
        ]
        count += (end - begin) * (len(away) > 0 and time[end - 1] - away[0] > STUCK_S)
        begin = end
    return count


@settings(max_examples=200, deadline=None)
@given(
    interval_s=st.sampled_from([1.0, 7.0, 59.9, 250.0, 300.0, 650.0]),
    jitter=st.sampled_from([0.0, 0.4]),
    gap_s=st.sampled_from([0.0, 200.0, 320.0, 601.0]),
    begin=st.integers(0, 1200),
    held_s=st.sampled_from([590.0, 599.0, 600.0, 601.0, 615.0, 2000.0]),
    seed=st.integers(0, 1000),
)
def test_a_stuck_sensor_anywhere(interval_s, jitter, gap_s, begin, held_s, seed):
    rng = np.random.default_rng(seed)
    steps = interval_s * rng.uniform(1.0 - jitter, 1.0 + jitter, 1200)
    steps[begin // 2 :: 150] += gap_s
    time = np.cumsum(steps)
    moving = time / interval_s
    # Steps of 0.1 are its resolution, so that what the other has to move by is MOVED_DEGC.
    held = 0.1 * rng.integers(0, 3, 1200)
    held[(time >= time[begin % 1200]) & (time <= time[begin % 1200] + held_s)] = 1.0
    run = Run("run", {"time": time, "gyro": rng.normal(size=1200), "T_in": moving, "T_out": held})
    found = [f.count for f in check_run(run) if f.code == "stuck_sensor"]
    assert found == [n for n in [samples_stuck(time, held, moving)] if n]


@pytest.mark.parametrize("samples", [5, 700, 5 * BLOCK, 5 * BLOCK + 1, 6 * BLOCK - 1])
@pytest.mark.parametrize("quantum", [1e-3, 0.7, 3.0])
def test_outliers_of_every_height(samples, quantum, monkeypatch):
    rng = np.random.default_rng(samples)
    outputs = []
    for height in np.linspace(0.0, 20.0, 60):
        gyro = rng.normal(size=samples)
        gyro[rng.integers(0, samples, 2)] += height
        outputs.append(quantum * np.round(gyro / quantum))
    quick = [find_outliers(gyro) for gyro in outputs]
    ruled_out = sum(_none_stands_out(gyro) for gyro in outputs)
    monkeypatch.setattr("fogml.runs.outliers._none_stands_out", lambda gyro: False)
    for bounded, exact in zip(quick, [find_outliers(gyro) for gyro in outputs]):
        np.testing.assert_array_equal(bounded, exact)
    assert 0 < ruled_out < len(outputs) or samples == 5 or quantum > 1.0


@settings(max_examples=200, deadline=None)
@given(
    apart=st.sampled_from([0.0, 4.0, 9.5, 79.9, 80.1, "Fahrenheit"]),
    jitter=st.sampled_from([0.0, 0.3, 0.5, 0.9]),
    burst=st.sampled_from([1, 2, 7]),
    step=st.sampled_from([0.0, 4.9, 5.1, 30.0]),
    dropout=st.sampled_from([20.0, -127.0, 85.0]),
    seed=st.integers(0, 1000),
)
def test_bounds_of_clocks_and_thermometers(apart, jitter, burst, step, dropout, seed):
    rng = np.random.default_rng(seed)
    rows = int(rng.integers(5, 3000))
    time = np.arange(rows) + rng.uniform(0.0, jitter, rows)
    time = time // burst * burst + 0.01 * (time % burst)
    inner = 20.0 + 10.0 * np.sin(time / 300.0) + rng.normal(0.0, 0.01, rows)
    outer = 1.8 * inner + 32.0 if apart == "Fahrenheit" else inner + apart
    outer[rows // 2 :] += step
    outer[rng.integers(0, rows)] = dropout
    columns = {"time": time, "gyro": rng.normal(size=rows), "T_in": inner, "T_out": outer}
    run = Run.derived("run", columns)
    quick = check_run(run), arrival_times.burst_ends(time)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(plausible, "_most_apart", lambda columns: np.inf)
        patched.setattr(dropouts, "_greatest_step", lambda values: np.inf)
        patched.setattr(arrival_times, "_SURELY_LONG", 0.0)
        exact = check_run(Run.derived("run", columns)), arrival_times.burst_ends(time)
    assert quick[0] == exact[0]
    np.testing.assert_equal(quick[1], exact[1])
