"""A table's clock beside the gyro's: shifts put in are told, slow tables and slow gyros are not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from fogml.runs.checks import check_run
from fogml.runs.facts import Facts
from fogml.runs.lateness import late_rate
from fogml.runs.run import Run

FINE_S = 0.01


def turned(
    late_s: float = 0.0,
    *,
    sample_s: float = 0.1,
    acceleration: float = np.inf,
    lag_s: float = 0.0,
    noise: float = 2.0,
    rates: tuple[float, ...] = (10.0, -10.0, 50.0, -50.0),
) -> Run:
    """A run whose table turns for two minutes at each rate [deg/s], as the gyro's clock has it."""
    time, fine = np.arange(0.0, 1600.0, sample_s), np.arange(-100.0, 1700.0, FINE_S)

    def commanded(t: np.ndarray) -> np.ndarray:
        place, within = np.divmod(t - 60.0, 180.0)
        index = place.astype(int) % len(rates)
        return np.where((t >= 60.0) & (within < 120.0), np.array(rates)[index], 0.0)

    course = commanded(fine)
    if np.isfinite(acceleration):
        most, at, moved = acceleration * FINE_S, 0.0, np.empty_like(course)
        for i, target in enumerate(course):
            at += min(max(target - at, -most), most)
            moved[i] = at
        course = moved
    if lag_s:
        kept = np.exp(-FINE_S / lag_s)
        course = lfilter([1.0 - kept], [1.0, -kept], course)
    rng = np.random.default_rng(1)
    gyro = 5.0 + 3600.0 * np.interp(time - late_s, fine, course) + rng.normal(0.0, noise, len(time))
    return Run("r", {"time": time, "gyro": gyro, "rate": commanded(time)}, Facts())


@pytest.mark.parametrize(
    ("late_s", "told"),
    [(5.0, "5 s late"), (-5.0, "5 s early"), (20.0, "20 s late"), (0.5, ""), (0.0, ""), (-0.5, "")],
)
def test_a_shift_of_clocks_is_told_as_it_is(late_s: float, told: str) -> None:
    found = [one.message for one in late_rate(turned(late_s))]
    assert bool(found) == bool(told) and all(told in one for one in found)


@pytest.mark.parametrize("run", [turned(acceleration=20.0), turned(acceleration=5.0), turned(lag_s=5.0)])
def test_a_slow_table_or_a_slow_gyro_is_not_late(run: Run) -> None:
    assert not list(late_rate(run))


def test_a_slow_table_with_a_clock_that_is_late_is_late_by_the_clock() -> None:
    (found,) = late_rate(turned(4.0, acceleration=20.0))
    # The commanded step lies between two samples.
    assert "4.1 s late (17 of 17 steps)" in found.message
    (found,) = late_rate(turned(5.0, noise=3000.0))
    assert "5 s late" in found.message


def test_what_is_no_level_tells_nothing() -> None:
    run = turned(5.0)
    swung = 20.0 * np.sin(run.time / 3.0)
    columns = {"time": run.time, "rate": swung, "gyro": 3600.0 * 20.0 * np.sin((run.time - 5.0) / 3.0)}
    assert not list(late_rate(Run("r", columns, Facts())))
    assert not list(late_rate(turned(5.0, rates=(0.002, -0.002))))
    assert not list(late_rate(Run("r", {"time": run.time, "gyro": run.gyro}, Facts())))


def test_it_is_noticed_on_reading() -> None:
    assert "late_rate" in [one.code for one in check_run(turned(5.0))]
    assert "late_rate" not in [one.code for one in check_run(turned())]
