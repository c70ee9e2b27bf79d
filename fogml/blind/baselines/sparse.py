"""Sparse regression over candidates at their usual shapes, as SINDy does, as an ensemble.

Sequentially thresholded least squares (S. L. Brunton et al., PNAS 113 (2016) 3932) on bootstrapped
blocks of time; an effect's probability is the share of the fits that keep it (U. Fasel et al.,
Proc. R. Soc. A 478 (2022) 20210904).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fogml.blind.baselines.answer import Finding, write_answer
from fogml.blind.baselines.regression import Regression
from fogml.blind.folders import CaseFiles
from fogml.runs.run import FloatArray

THRESHOLD = 0.1
"""A term whose rms falls under this share of the gap's is dropped."""
FITS = 20
_ROUNDS = 10
_RIDGE = 1e-6
_BLOCKS = 40
_KEEP = 0.5


def stlsq(case: CaseFiles, out: Path) -> None:
    """An ensemble of thresholded fits, rows taken as they are."""
    problem = Regression(case, whiten=False, grid=False)
    columns = problem.beside_constants(problem.columns)
    target = problem.beside_constants(problem.target[:, None])[:, 0]
    sizes = np.linalg.norm(columns, axis=0)
    usable = np.flatnonzero(problem.visible(columns))
    unit = columns[:, usable] / sizes[usable]
    blocks = np.array_split(np.arange(len(problem.stack)), _BLOCKS)
    rng = np.random.default_rng(case.seed)
    kept = np.zeros(len(usable))
    for _ in range(FITS):
        rows = np.concatenate([blocks[i] for i in rng.integers(0, _BLOCKS, _BLOCKS)])
        kept += _thresholded(unit[rows], target[rows]) != 0.0
    share = kept / FITS
    picked = [problem.atoms[i] for i in usable[share >= _KEEP]]
    fitted = problem.fit(problem.columns[:, usable[share >= _KEEP]])
    findings = [
        Finding(atom.id, (atom.id,), float(p), float(value), float(se), dict(atom.shape))
        for atom, p, value, se in zip(picked, share[share >= _KEEP], fitted.amplitudes, fitted.se)
    ]
    fit, held_out = (problem.prediction(runs, picked) for runs in (problem.stack, problem.held_out))
    write_answer(out, findings, 0.0, fit, held_out, problem.noise)


def _thresholded(columns: FloatArray, target: FloatArray) -> FloatArray:
    """Coefficients of columns, those of small terms zero, shape (k,)."""
    found = np.zeros(columns.shape[1])
    kept = np.arange(columns.shape[1])
    limit = THRESHOLD * float(np.linalg.norm(target))
    for _ in range(_ROUNDS):
        if not len(kept):
            break
        part = columns[:, kept]
        values = np.linalg.solve(part.T @ part + _RIDGE * np.eye(len(kept)), part.T @ target)
        large = np.abs(values) * np.linalg.norm(part, axis=0) >= limit
        if large.all():
            found[kept] = values
            break
        kept = kept[large]
    return found
