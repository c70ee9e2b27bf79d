"""The systematic part of the gap: what truly acts beside the constants, named or not, run by run."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from fogml.gap.frame import constant_rows
from fogml.gap.model import EffectValue
from fogml.gap.preparing import prepare
from fogml.gap.structure import gaps_on_runs, stage_energies, systematic_parts
from fogml.gap.trials import best_trial
from tests.gap.small_model import SmallModel, dense, noise_of, ramps, recorded

CUBE = (2.0, -1.0)


def silent(what):
    """No progress is shown."""


def trial(ids, acting, added=lambda run: 0.0):
    model, rng = SmallModel(ids), np.random.default_rng(5)
    runs = []
    for (name, turns), effects in zip((("a", 2), ("b", 3)), acting):
        run = ramps(name, count=400, turns=turns)
        made = recorded(run, SmallModel(), {"offset": 1.0, "slope": -0.5}, effects, noise_of(run, rng))
        runs.append(made.with_columns(gyro=made.gyro + added(run)))
    p = prepare(model, runs, [ramps("c", count=100)], None)
    return best_trial(p, model.candidates(), silent)


def beside_constants(p, parts):
    """What constants with their priors leave of signals on the runs, by dense least squares."""
    fixed = np.concatenate([constant_rows(o, p.model.constants) for o in p.fit])
    covariance = block_diag(*(dense(o.time, o.row_s) for o in p.fit))
    weighed = np.linalg.solve(covariance, fixed)
    whole = np.concatenate(parts)
    left = whole - fixed @ np.linalg.solve(weighed.T @ fixed + np.eye(2), weighed.T @ whole)
    return np.split(left, [len(parts[0])])


def cubes(p):
    return [size * ((o.temperature - 20.0) / 20.0) ** 3 for size, o in zip(CUBE, p.fit)]


def correlation(found, true):
    found, true = np.concatenate(found), np.concatenate(true)
    return float(found @ true / np.sqrt((found @ found) * (true @ true)))


def test_an_effect_of_another_amplitude_on_each_run_has_its_gap_on_each():
    acting = [(EffectValue("cube", size, {}),) for size in CUBE]
    found = trial(("bend", "cube_drawn"), acting)
    assert found.ranking.best.ids == {"cube_drawn"}
    gaps = gaps_on_runs(found.prepared, systematic_parts(found.search, found.ranking))
    true = beside_constants(found.prepared, cubes(found.prepared))
    for gap, expected in zip(gaps, true):
        assert np.sqrt(np.mean((gap.systematic - expected) ** 2)) < 0.2 * np.sqrt(np.mean(expected**2))
    stages = stage_energies(found.prepared.model.candidates(), systematic_parts(found.search, found.ranking))
    energy = sum(float(np.sum(part**2)) for part in true)
    assert set(stages) == {"bias"} and stages["bias"] == pytest.approx(energy, rel=0.2)


def test_what_has_no_name_has_its_place_all_the_same():
    found = trial(("cube",), [(), ()], lambda run: 0.6 * np.sin(2.0 * np.pi * run.time / 2000.0))
    assert found.ranking.unknown > 0.5
    gaps = gaps_on_runs(found.prepared, systematic_parts(found.search, found.ranking))
    true = [0.6 * np.sin(2.0 * np.pi * o.time / 2000.0) for o in found.prepared.fit]
    assert correlation([g.systematic for g in gaps], true) > 0.9


def test_where_nothing_acts_next_to_nothing_is_systematic():
    found = trial(("bend", "cube"), [(), ()])
    gaps = gaps_on_runs(found.prepared, systematic_parts(found.search, found.ranking))
    for gap in gaps:
        assert np.std(gap.systematic) < 0.2 * np.std(gap.gap)
