"""A Gaussian process discrepancy: it fills the gap and names no cause.

After M. C. Kennedy and A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425, over temperature, its rate and
the difference of inner and outer face.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from scipy.special import expit

from fogml.blind.baselines.answer import Prediction, write_answer
from fogml.blind.baselines.regression import Regression
from fogml.blind.folders import CaseFiles
from fogml.blind.signatures import Stack
from fogml.runs.run import FloatArray

_ROWS = 400
_LARGEST_LOG_ODDS = 30.0


def gp_discrepancy(case: CaseFiles, out: Path) -> None:
    """A process over the recalibrated twin; the unknown's probability is its evidence against noise."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    problem = Regression(case, grid=False)
    fit = problem.prediction(problem.stack, [])
    held_out = problem.prediction(problem.held_out, [])
    inputs, gap = _inputs(problem.stack), fit.stack.gap - fit.recalibrated
    middle, spread = inputs.mean(axis=0), inputs.std(axis=0)
    spread[spread == 0.0] = 1.0
    # Means over neighbours, so that few rows carry the noise of all.
    edges = np.linspace(0, len(gap), min(len(gap), _ROWS) + 1).astype(np.intp)
    counts = np.diff(edges)
    x = (np.add.reduceat(inputs, edges[:-1]) / counts[:, None] - middle) / spread
    y = np.add.reduceat(gap, edges[:-1]) / counts
    size = float(y.std()) or 1.0
    kernel = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(np.ones(x.shape[1]), (0.05, 50.0))
    process = GaussianProcessRegressor(kernel + WhiteKernel(0.5, (1e-4, 10.0)), random_state=case.seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(x, y / size)
    of_noise = -0.5 * len(y) * (np.log(2.0 * np.pi) + 1.0)
    odds = float(process.log_marginal_likelihood_value_) - of_noise
    learnt = []
    for p in (fit, held_out):
        added = size * process.predict((_inputs(p.stack) - middle) / spread)
        learnt.append(Prediction(p.stack, p.recalibrated, p.recalibrated + added))
    unknown = float(expit(np.clip(odds, -_LARGEST_LOG_ODDS, _LARGEST_LOG_ODDS)))
    write_answer(out, [], unknown, learnt[0], learnt[1], problem.noise)


def _inputs(stack: Stack) -> FloatArray:
    """Temperature, its difference of 64 s means, and inner less outer face, shape (n, 3)."""
    names = list(stack.constants)
    columns = stack.nominal
    temperature = np.concatenate([part.temperature for part in stack.parts])
    return np.column_stack([temperature, columns[:, names.index("m")], columns[:, names.index("g")]])
