"""Importance in a random forest: the effects whose signatures it leans on."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fogml.blind.baselines.answer import Finding, Prediction, write_answer
from fogml.blind.baselines.regression import Regression
from fogml.blind.folders import CaseFiles
from fogml.blind.signatures import Stack
from fogml.runs.run import FloatArray

_TREES, _DEPTH, _ROWS = 50, 8, 2000


def random_forest(case: CaseFiles, out: Path) -> None:
    """Importance of each candidate's usual signature for the structural gap, as its probability."""
    from sklearn.ensemble import RandomForestRegressor

    problem = Regression(case, grid=False)
    fit = problem.prediction(problem.stack, [])
    held_out = problem.prediction(problem.held_out, [])
    columns = problem.beside_constants(problem.columns)
    usable = np.flatnonzero(problem.visible(columns))
    picked = [problem.atoms[i] for i in usable]
    gap = fit.stack.gap - fit.recalibrated
    rng = np.random.default_rng(case.seed)
    rows = rng.choice(len(gap), min(len(gap), _ROWS), replace=False)
    forest = RandomForestRegressor(
        _TREES, max_depth=_DEPTH, min_samples_leaf=5, random_state=case.seed, n_jobs=1
    )

    def table(runs: Stack) -> FloatArray:
        return np.column_stack([runs.column(atom) for atom in picked])

    forest.fit(table(problem.stack)[rows], gap[rows])
    findings = []
    for i, atom, importance in zip(usable, picked, forest.feature_importances_):
        alone = problem.fit(problem.columns[:, [i]])
        amplitude, se = float(alone.amplitudes[0]), float(alone.se[0])
        findings.append(Finding(atom.id, (atom.id,), float(importance), amplitude, se, dict(atom.shape)))
    learnt = [
        Prediction(p.stack, p.recalibrated, p.recalibrated + forest.predict(table(p.stack)))
        for p in (fit, held_out)
    ]
    write_answer(out, findings, 0.0, learnt[0], learnt[1], problem.noise)
