"""Rows whitened by noise and by errors of the readings, beside dense covariances."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap.frame import RunWhitening, Whitening, whitener_of
from fogml.gap.settings import STANDARD
from fogml.signals.noise_model import NoiseModel

NOISE = NoiseModel(0.02, 0.03, 0.05)
LONGEST = STANDARD.noise.longest_runs
COUNT, ROW_S = 60, 10.0


def _rows(seed=1):
    """What whitening takes of a run: when its rows end, and how full they are."""
    rng = np.random.default_rng(seed)
    ends = ROW_S * np.sort(rng.choice(np.arange(1, 80), COUNT, replace=False))
    return SimpleNamespace(end_s=ends, row_s=ROW_S, weight=np.sqrt(rng.uniform(0.5, 1.0, COUNT)))


def _covariance(rows):
    """Of the rows without errors; what a row lacks of its samples adds to what is new in it."""
    by_noise = whitener_of(NOISE, rows, LONGEST)
    lacking = (1.0 / rows.weight**2 - 1.0) * NOISE.white_density / ROW_S
    new = np.sqrt(1.0 + lacking / by_noise.deviation**2)
    root = by_noise.colour(np.diag(new))
    return root @ root.T


@pytest.mark.parametrize("columns", [1, 7, COUNT, 90])
@pytest.mark.parametrize("size", [1e-6, 0.3, 30.0])
@pytest.mark.parametrize("by_covariance", [False, True])
def test_errors_of_readings_add_to_the_covariance(columns, size, by_covariance):
    rows = _rows()
    errors = size * np.random.default_rng(2).standard_normal((COUNT, columns))
    held = RunWhitening(NOISE, rows, LONGEST, errors, errors @ errors.T if by_covariance else None)
    dense = _covariance(rows) + errors @ errors.T
    white = held.whiten(np.eye(COUNT))
    tell = np.linalg.inv(dense)
    assert white.T @ white == pytest.approx(tell, abs=1e-6 * np.abs(tell).max())
    assert held.log_det == pytest.approx(0.5 * np.linalg.slogdet(dense)[1], rel=1e-6)
    series = np.random.default_rng(3).standard_normal((COUNT, 2))
    expected = errors @ errors.T @ np.linalg.solve(dense, series)
    assert held.errors_in(series) == pytest.approx(expected, abs=1e-5)
    assert held.errors_in(series[:, 0]) == pytest.approx(expected[:, 0], abs=1e-5)


def test_without_errors_noise_alone_whitens_and_nothing_is_of_the_readings():
    rows = _rows()
    held = RunWhitening(NOISE, rows, LONGEST, np.zeros((COUNT, 0)))
    white = held.whiten(np.eye(COUNT))
    dense = _covariance(rows)
    assert white.T @ white == pytest.approx(np.linalg.inv(dense), rel=1e-6, abs=1e-6)
    assert not held.errors_in(np.ones(COUNT)).any()


def test_runs_are_whitened_apart():
    runs = [_rows(1), _rows(2)]
    errors = tuple(np.random.default_rng(i).standard_normal((COUNT, 3)) for i in range(2))
    setting = SimpleNamespace(scene=SimpleNamespace(fit=runs), priors=STANDARD, errors=errors, covariances=())
    whitening = Whitening(NOISE, setting)
    series = [np.random.default_rng(9).standard_normal((COUNT, 4)), np.zeros((COUNT, 4))]
    stacked = whitening.stacked(series)
    alone = RunWhitening(NOISE, runs[0], LONGEST, errors[0]).whiten(series[0].copy())
    assert stacked[:COUNT] == pytest.approx(alone)
    assert not stacked[COUNT:].any()
    assert whitening.log_det == pytest.approx(sum(run.log_det for run in whitening.runs))
