"""Other ways to name a missing effect, as methods of ``fogml blind run``: pysindy, and sbi's comparison.

Each gets what the diagnosis gets: a case's files and the catalogue's candidates.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.blind.baselines.answer import Finding, write_answer
from fogml.blind.baselines.regression import Regression
from fogml.blind.folders import CaseFiles

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]
THRESHOLD = 0.1
"""Terms under this share of the gap's rms are dropped."""
FITS = 20
KEEP = 0.5
SIMULATIONS, EPOCHS, DRAWS = 4000, 60, 1000
STRENGTHS = (3.0, 40.0)
"""Whitened lengths that the comparison's prior spans, log-uniform."""


def pysindy_discrepancy(case: CaseFiles, out: Path) -> None:
    """A sparse discrepancy model: the gap as a sum of few candidates, by pysindy's ensemble STLSQ.

    Rows are taken as they are (unwhitened), candidates at their usual shapes, nominal constants
    taken out first; an effect's probability is the share of the ensemble that keeps it.
    """
    import pysindy

    problem = Regression(case, whiten=False, grid=False)
    columns = problem.beside_constants(problem.columns)
    target = problem.beside_constants(problem.target[:, None])
    usable = np.flatnonzero(problem.visible(columns))
    sizes = np.linalg.norm(columns[:, usable], axis=0)
    unit = columns[:, usable] / sizes
    scaled = target / np.linalg.norm(target)
    optimiser = pysindy.EnsembleOptimizer(
        pysindy.STLSQ(threshold=THRESHOLD, alpha=1e-6), bagging=True, n_models=FITS
    )
    # pysindy draws from numpy's global generator.
    state = np.random.get_state()  # noqa: NPY002
    np.random.seed(case.seed)  # noqa: NPY002
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        optimiser.fit(unit, scaled)
    np.random.set_state(state)  # noqa: NPY002
    share = np.mean([np.ravel(c) != 0.0 for c in optimiser.coef_list], axis=0)
    _answer(problem, usable, share, out)


def sbi_comparison(case: CaseFiles, out: Path) -> None:
    """Comparison of "nothing" and each single effect by sbi's mixed neural posterior estimation.

    Simulated are the whitened gap's projections on the candidates' unit columns, for an effect and
    a strength drawn from the prior; the network gives the posterior of which effect it was.
    """
    import torch
    from sbi.inference import MNPE

    problem = Regression(case, grid=False)
    columns = problem.beside_constants(problem.columns)
    target = problem.beside_constants(problem.target[:, None])[:, 0]
    usable = np.flatnonzero(problem.visible(columns))
    unit = columns[:, usable] / np.linalg.norm(columns[:, usable], axis=0)
    gram = unit.T @ unit
    rng = np.random.default_rng(case.seed)
    which = rng.integers(0, len(usable) + 1, SIMULATIONS)
    log_strength = rng.uniform(*np.log(STRENGTHS), SIMULATIONS)
    signed = np.exp(log_strength) * rng.choice([-1.0, 1.0], SIMULATIONS)
    values, vectors = np.linalg.eigh(gram)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    seen = rng.standard_normal((SIMULATIONS, len(usable))) @ root.T
    present = which > 0
    seen[present] += signed[present, None] * gram[which[present] - 1]
    theta = np.column_stack((signed, which))
    with warnings.catch_warnings(), torch.random.fork_rng(devices=[]):
        warnings.simplefilter("ignore")
        torch.manual_seed(case.seed)
        inference: Any = MNPE(show_progress_bars=False)
        inference.append_simulations(_tensor(theta), _tensor(seen))
        inference.train(max_num_epochs=EPOCHS)
        posterior = inference.build_posterior()
        drawn = posterior.sample((DRAWS,), x=_tensor((unit.T @ target)[None]), show_progress_bars=False)
    counts = np.bincount(np.asarray(drawn[:, 1]).round().astype(int), minlength=len(usable) + 1)
    _answer(problem, usable, counts[1:] / DRAWS, out)


def _tensor(values: FloatArray) -> Any:
    import torch

    return torch.as_tensor(values, dtype=torch.float32)


def _answer(problem: Regression, usable: IndexArray, share: FloatArray, out: Path) -> None:
    """Write what is kept in more than half of the fits or draws, amplitudes fitted."""
    kept: Sequence[int] = usable[share >= KEEP].tolist()
    picked = [problem.atoms[i] for i in kept]
    fitted = problem.fit(problem.columns[:, kept])
    findings = [
        Finding(atom.id, (atom.id,), float(p), float(value), float(se), dict(atom.shape))
        for atom, p, value, se in zip(picked, share[share >= KEEP], fitted.amplitudes, fitted.se)
    ]
    fit, held_out = (problem.prediction(runs, picked) for runs in (problem.stack, problem.held_out))
    write_answer(out, findings, 0.0, fit, held_out, problem.noise)
