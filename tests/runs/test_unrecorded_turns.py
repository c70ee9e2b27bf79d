"""Turning that a run does not state is told; no bias, slow drift, shock or recorded turn is taken for it."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.runs.checks import check_run
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.runs.turning import CODE

TIME = np.arange(0.0, 3600.0, 0.5)
NOISE = np.random.default_rng(0).normal(0.0, 5.0, len(TIME))
REST = 20.0 + NOISE


def found(gyro, **columns):
    run = Run("run", {"time": TIME, "gyro": gyro, **columns}, Facts())
    return [finding for finding in check_run(run) if finding.code == CODE]


def turned(first_s, last_s, rate_deg_s=10.0):
    return np.where((first_s <= TIME) & (last_s > TIME), rate_deg_s, 0.0)


@pytest.mark.parametrize("span", [(0.0, 300.0), (600.0, 900.0), (3000.0, 3600.0)])
@pytest.mark.parametrize("columns", [{}, {"rate": np.zeros(len(TIME))}])
def test_turning_without_a_rate_is_told(span, columns):
    (one,) = found(REST + 3600.0 * turned(*span), **columns)
    assert one.count == int(np.count_nonzero(turned(*span)))
    assert one.row == int(np.argmax(turned(*span) > 0.0)) + 1
    assert "10 deg/s off" in one.message


def test_an_angle_alone_is_no_rate():
    """The reference is of the column 'rate': without it a turn that the angle shows counts as drift."""
    rate = turned(600.0, 900.0)
    (one,) = found(REST + 3600.0 * rate, angle=np.cumsum(rate) * 0.5)
    assert one.row == int(np.argmax(rate > 0.0)) + 1
    assert found(REST + 3600.0 * rate, angle=np.cumsum(rate) * 0.5, rate=rate) == []


def test_a_table_that_takes_its_time_is_told():
    ramp = np.clip(np.minimum(TIME - 600.0, 1200.0 - TIME), 0.0, 20.0)  # 1 deg/s2
    assert len(found(REST + 3600.0 * ramp)) == 1


def test_two_turns_are_one_finding():
    (one,) = found(REST + 3600.0 * (turned(100.0, 200.0) - turned(500.0, 700.0)))
    assert one.count == 600 and "1 time more" in one.message


def test_an_output_that_no_bias_reaches_is_told():
    (one,) = found(3600.0 * (18000.0 + 0.01 * REST))
    assert one.count == len(TIME) and "18000 deg/s" in one.message


def test_nothing_else_is_taken_for_turning():
    rate = turned(600.0, 900.0)
    drift = 40_000.0 * TIME / TIME[-1]  # 11 deg/s in an hour
    shocks = np.where(np.arange(len(TIME)) % 500 < 4, 36_000.0, 0.0)
    for gyro, columns in (
        (REST, {}),
        (REST + 3600.0 * rate, {"rate": rate}),
        # The log of the table's rate begins late and ends early by a second.
        (REST + 3600.0 * rate, {"rate": turned(601.0, 899.0)}),
        (REST + 3600.0 * rate, {"position": np.cumsum(rate) * 0.5}),
        (REST + drift, {}),
        (REST + shocks, {}),
        (40.0 * NOISE * 10.0, {}),
        (REST + 70_000.0, {}),  # a cheap gyro's bias
    ):
        assert found(gyro, **columns) == []
