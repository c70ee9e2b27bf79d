"""Training rows: what is used, how it is averaged, and how time is parted into folds."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.features.parse import parse_features
from fogml.models.folds import dealt_folds, run_folds, time_folds
from fogml.models.table import averaged_table, run_rows, training_table
from fogml.runs.run import Run
from fogml.testing.models import synthetic_run

FEATURES = "T, dT, T*dT, T^2"


@pytest.fixture(scope="module")
def run():
    return synthetic_run("a", 1.0)


def test_rows_are_those_whose_windows_count(run):
    features = parse_features(FEATURES)
    table = training_table([run], features)
    _, full, _ = features.atom_values(run)
    np.testing.assert_array_equal(table.X, features.transform(run)[full])
    np.testing.assert_array_equal(table.y, run.error_deg_h[full])
    assert len(table) == len(run) - 16 and table.averaging_s == run.sample_s


def test_averages_are_means_of_composed_rows(run):
    features = parse_features(FEATURES)
    plain = training_table([run], features)
    averaged = averaged_table([run_rows(run, features)], features.compose, 50.0)
    count = len(plain) // 50
    expected = plain.X[: count * 50].reshape(count, 50, -1).mean(axis=1)
    np.testing.assert_allclose(averaged.X[:count], expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(averaged.y[:count], plain.y[: count * 50].reshape(count, 50).mean(axis=1))
    assert abs(averaged.X[:count, 3] - averaged.X[:count, 0] ** 2).max() > 1e-6


def test_max_rows_is_kept(run):
    table = training_table([run, run], parse_features(FEATURES), max_rows=300)
    assert 280 <= len(table) <= 302
    assert set(table.run_index) == {0, 1}


def test_averages_do_not_cross_a_gap(run):
    late = run.time + np.where(np.arange(len(run)) >= 5000, 10_000.0, 0.0)
    gapped = run.with_columns(time=late)
    features = parse_features("T")
    table = averaged_table([run_rows(gapped, features)], features.compose, 100.0)
    assert not np.any((table.time_s > 5_001) & (table.time_s < 15_000))


def test_turning_rows_are_left_out_of_drift_models_with_a_note():
    turning = synthetic_run("t", 1.0, turns=True)
    table = training_table([turning], parse_features("T"))
    at_rest = np.searchsorted(turning.time, table.time_s)
    assert (turning.rate[at_rest] == 0.0).all()
    assert any("turns left out" in note for note in table.notes)
    assert abs(table.y).max() < 10.0


def test_run_that_always_turns_keeps_its_rows(run):
    always = run.with_columns(rate=np.full(len(run), 5.0), gyro=run.gyro + 18000.0)
    assert len(training_table([always], parse_features("T"))) == len(run)


def test_too_short_a_run_is_told(run):
    with pytest.raises(InputError, match="an eighth of a feature window"):
        training_table([run[:16]], parse_features("T, dT"))


def test_blocks_go_on_from_run_to_run(run):
    table = training_table([run, run], parse_features("T"), max_rows=500)
    assert table.block.max() == 39 and (np.diff(table.block) >= 0).all()
    assert not set(table.block[table.run_index == 0]) & set(table.block[table.run_index == 1])


def test_folds_part_the_rows(run):
    table = training_table([run, run], parse_features("T"), max_rows=1000)
    folds = time_folds(table)
    held = np.concatenate([held for _, held in folds])
    assert sorted(held) == list(range(len(table)))
    for fitted, left_out in folds:
        assert not set(fitted) & set(left_out)
        # Each fold holds four blocks of each run: rows with held-out neighbours on both sides.
        assert np.count_nonzero(np.diff(left_out) > 1) + 1 >= 7


def test_guard_keeps_fitted_rows_away_from_held_out_ones(run):
    table = training_table([run, run], parse_features("T"), max_rows=1000)
    for fitted, held in time_folds(table, guard_s=128.0):
        for number in (0, 1):
            mine = table.time_s[fitted[table.run_index[fitted] == number]]
            theirs = table.time_s[held[table.run_index[held] == number]]
            assert np.abs(mine[:, None] - theirs[None, :]).min() > 128.0


def test_one_block_per_fold_holds_out_whole_parts(run):
    table = training_table([run], parse_features("T"), max_rows=500)
    for _, held in time_folds(table, 4, blocks_per_fold=1):
        assert (np.diff(held) == 1).all()


def test_leaving_out_runs(run):
    table = training_table([run, run[:3000], run], parse_features("T"), max_rows=900)
    folds = run_folds(table)
    assert [set(table.run_index[held]) for _, held in folds] == [{0}, {1}, {2}]
    with pytest.raises(InputError, match="at least 2"):
        run_folds(training_table([run], parse_features("T"), max_rows=50))


@pytest.mark.parametrize("count", [0, 1, 3, 19, 20, 21, 1000])
def test_dealt_folds_use_all_folds_evenly(count):
    labels = dealt_folds(count)
    assert labels.shape == (count,)
    if count >= 20:
        sizes = np.bincount(labels, minlength=5)
        assert sizes.max() - sizes.min() <= 4


def test_bad_fold_counts_are_told(run):
    table = training_table([run], parse_features("T"), max_rows=50)
    with pytest.raises(InputError, match="at least 2"):
        time_folds(table, 1)
    with pytest.raises(InputError, match="at least 2"):
        time_folds(table.take(np.array([0])))


def test_run_without_needed_temperature_is_told(run):
    bare = Run.from_columns("bare.csv", time=run.time, gyro=run.gyro)
    with pytest.raises(InputError, match=r"bare\.csv: .*temperature"):
        training_table([bare], parse_features("T"))
