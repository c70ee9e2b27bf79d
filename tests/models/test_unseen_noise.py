"""Slow noise on another run against matrices written out, and against runs drawn with it."""

from itertools import pairwise

import numpy as np
import pytest

import fogml.models.unseen_noise as unseen_noise
from fogml.models.folds import time_folds
from fogml.models.row_noise import RowNoise
from fogml.models.table import TrainingTable
from fogml.models.unseen_noise import NONE, Unseen, unseen_noises
from fogml.signals.noise_model import NoiseModel, flicker_ladder
from fogml.signals.random_noise import LONGEST_S

STEP_S = 100.0
SQUARES = np.array([[4.0, 0.0, 0.0], [4.0, 1e-3, 0.0], [4.0, 1e-3, 1e-6]])


def table_of(columns, y, runs):
    time = np.concatenate([STEP_S * np.arange(np.sum(runs == run)) for run in np.unique(runs)])
    return TrainingTable(columns, y, runs, time, np.zeros(len(y), dtype=np.intp), STEP_S)


def course(count):
    """Two temperatures up and down, shape (count, 2)."""
    phase = np.linspace(0.0, 4.0 * np.pi, count)
    return np.column_stack((np.sin(phase), np.sin(phase - 0.4) + 0.2 * np.sin(3.0 * phase)))


def covariance_of(squares, time):
    n, b, k = np.sqrt(squares)
    model = NoiseModel(float(n) / 60.0, float(b), 60.0 * float(k))
    return model.covariance(time, STEP_S, flicker_ladder(STEP_S, LONGEST_S))


@pytest.mark.parametrize("lengths", [(80,), (50, 70)])
def test_what_parts_do_not_show_is_that_of_least_squares(monkeypatch, lengths):
    rng, weights = np.random.default_rng(2), np.array([0.2, 0.5, 0.3])
    columns = np.concatenate([course(length) for length in lengths])
    runs = np.repeat(np.arange(len(lengths)), lengths)
    table, predicted = table_of(columns, rng.standard_normal(len(runs)), runs), rng.standard_normal(len(runs))
    told = RowNoise(SQUARES, weights, 60.0, STEP_S)
    monkeypatch.setattr(unseen_noise, "noise_of_rows", lambda _: told)
    folds = time_folds(table)
    halves = [
        (np.flatnonzero(half), np.flatnonzero(~half)) for half in (table.time_s < 3e3, table.time_s >= 3e3)
    ]
    found = unseen_noises(table, predicted, [folds, halves])
    X = np.column_stack((np.ones(len(runs)), columns, predicted))
    for ways, unseen in zip((folds, halves), found, strict=True):
        for squares, variance in zip(SQUARES, unseen.variances, strict=True):
            C = np.zeros((len(runs), len(runs)))
            for low, high in pairwise(np.cumsum((0, *lengths)).tolist()):
                C[low:high, low:high] = covariance_of(squares, table.time_s[low:high])
            hat = X @ np.linalg.pinv(X)
            more = np.trace(C) + np.trace(hat @ C @ hat.T)
            for fitted, held in ways:
                left = np.zeros((len(held), len(runs)))
                left[np.arange(len(held)), held] = 1.0
                left[:, fitted] -= X[held] @ np.linalg.pinv(X[fitted])
                more -= np.trace(left @ C @ left.T)
            assert variance == pytest.approx(max(more / len(runs), 0.0), rel=1e-6, abs=1e-9)
        np.testing.assert_array_equal(unseen.weights, weights)


def test_a_walk_is_told_and_white_noise_adds_next_to_nothing():
    """Mean squares on another run of the same course, over those on blocks left out, as they come out."""
    rng, columns, runs = np.random.default_rng(5), course(300), np.zeros(300, dtype=np.intp)
    X = np.column_stack((np.ones(300), columns))
    for walk, tolerance in ((0.0, 0.1), (0.05, 0.35)):
        stated, came = [], []
        for _ in range(40):
            noises = rng.standard_normal((2, 300)) + np.cumsum(walk * rng.standard_normal((2, 300)), axis=1)
            table, told = table_of(columns, noises[0], runs), np.zeros(300)
            folds = time_folds(table)
            for fitted, held in folds:
                told[held] = X[held] @ np.linalg.lstsq(X[fitted], noises[0][fitted])[0]
            (unseen,) = unseen_noises(table, told, [folds])
            stated.append(unseen.weights @ unseen.variances)
            new = noises[1] - X @ np.linalg.lstsq(X, noises[0])[0]
            came.append(np.mean(new**2) - np.mean((noises[0] - told) ** 2))
        assert np.mean(stated) == pytest.approx(np.mean(came), abs=tolerance * max(np.mean(came), 1.0))


def test_half_widths_grow_as_variances_do():
    levels, half = (0.5, 0.9, 0.99), np.array([0.67, 1.64, 2.58])
    np.testing.assert_allclose(NONE.widened(half, levels), half, rtol=1e-9)
    three = Unseen(np.array([3.0]), np.ones(1)).widened(half, levels)
    np.testing.assert_allclose(three, half * np.sqrt(1.0 + 3.0 / np.array([0.99, 1.0, 1.0])), rtol=0.02)
    # Half of the models without, half with: between both, and nearer to the wide one the higher the level.
    both = Unseen(np.array([0.0, 3.0]), np.array([0.5, 0.5])).widened(half, levels)
    share = (both - half) / (three - half)
    assert np.all((share > 0.0) & (share < 1.0)) and np.all(np.diff(share) > 0.0)


def test_long_tables_are_looked_at_in_averages():
    rng, columns, runs = np.random.default_rng(7), course(6000), np.zeros(6000, dtype=np.intp)
    noise = rng.standard_normal(6000) + np.cumsum(0.05 * rng.standard_normal(6000))
    table = table_of(columns, noise, runs)
    folds = time_folds(table)
    few, all_of_them = (
        unseen_noises(table, columns[:, 0], [folds], most_rows=rows)[0] for rows in (600, 6000)
    )
    assert few.weights @ few.variances == pytest.approx(all_of_them.weights @ all_of_them.variances, rel=0.3)
