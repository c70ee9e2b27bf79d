"""Runs longer than memory are worked on in parts, to the same figures."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from fogml.export.losses import training_rows
from fogml.export.plan import Plan
from fogml.signals import large
from tests.export.conftest import fitted, training_run

PIECE = 256


@pytest.mark.parametrize("name", ["memory", "rbf"])
def test_an_export_of_a_long_run_holds_little_beside_its_rows(monkeypatch, name):
    model, run = fitted(name), training_run()
    evaluation, atoms = model.evaluate(run), model.features_.atom_values(run)
    plan = Plan.of(model)
    rows = training_rows(model, plan, [run])
    monkeypatch.setattr(large, "HELD_VALUES", PIECE)
    monkeypatch.setattr(large, "PIECE", PIECE)
    tracemalloc.start()
    columns = plan.full_columns(atoms.values)
    compensated, flags = plan.compensated(atoms, run.gyro_deg_h)
    left = rows.left_by(plan)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # As the model itself has it of the whole run.
    np.testing.assert_allclose(compensated, run.gyro_deg_h - evaluation.drift, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(flags, evaluation.flag)
    error_deg_h = (run.error_deg_h - evaluation.drift)[np.isin(run.time, rows.time)]
    full = evaluation.full[np.isin(run.time, rows.time)]
    np.testing.assert_allclose(left[full], error_deg_h[full], rtol=0.0, atol=1e-9)
    parts = 40 * 8 * PIECE * atoms.values.shape[1]
    assert most < columns.nbytes + compensated.nbytes + flags.nbytes + left.nbytes + parts
