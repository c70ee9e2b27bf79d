"""Other ways to name a missing effect: pysindy, sbi, MuJoCo's system identification, DoWhy's attribution.

Each gets what the diagnosis gets: a case's files and the catalogue's candidates.
"""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.blind.baselines.answer import Finding, Prediction, write_answer
from fogml.blind.baselines.regression import Regression
from fogml.blind.folders import CaseFiles
from fogml.blind.signatures import Stack, smooth_curves
from fogml.json_files import write_json

THRESHOLD = 0.1
"""Terms under this share of the gap's rms are dropped."""
FITS = 20
KEEP = 0.5
SIMULATIONS, EPOCHS, DRAWS = 4000, 60, 1000
STRENGTHS = (3.0, 40.0)
"""Whitened lengths that the comparison's prior spans, log-uniform."""
LEVEL = 0.05
"""Of sbi's test, and of MuJoCo's intervals."""
SHUFFLES, MOST_SAMPLES = 200, 500
"""Draws of the test's distance without misspecification, and simulations that each compares."""
MOST_SDS = 5.0
"""Bound of a constant, in its prior's standard deviations."""
BOUNDS = "bounds.json"
"""Which parameters ended at a bound."""
ROWS = 2000


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
    signed, which, seen = _simulated(gram, len(usable), case.seed)
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


def _simulated(gram: FloatArray, effects: int, seed: int) -> tuple[FloatArray, IndexArray, FloatArray]:
    """Strengths, effects (0 for none) and projections on unit columns; the first of these are effects'."""
    rng = np.random.default_rng(seed)
    which = rng.integers(0, effects + 1, SIMULATIONS)
    log_strength = rng.uniform(*np.log(STRENGTHS), SIMULATIONS)
    signed = np.exp(log_strength) * rng.choice([-1.0, 1.0], SIMULATIONS)
    values, vectors = np.linalg.eigh(gram)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    seen = rng.standard_normal((SIMULATIONS, len(gram))) @ root.T
    present = which > 0
    seen[present] += signed[present, None] * gram[which[present] - 1]
    return signed, which, seen


def sbi_misspecification(case: CaseFiles, out: Path) -> None:
    """sbi's test by maximum mean discrepancy: whether the gap lies among simulations of what is known.

    Simulated are projections on the candidates and on smooth curves, of nothing or one effect; what
    is refused at `LEVEL` is called unknown. It names nothing.
    """
    import torch
    from sbi.diagnostics.misspecification import calc_misspecification_mmd

    problem = Regression(case, grid=False)
    known = problem.beside_constants(problem.columns)
    known = known[:, problem.visible(known)]
    smooth = problem.beside_constants(problem.weighted(smooth_curves(problem.stack)))
    columns = np.concatenate([known, smooth[:, np.linalg.norm(smooth, axis=0) > 0.0]], axis=1)
    unit = columns / np.linalg.norm(columns, axis=0)
    target = unit.T @ problem.beside_constants(problem.target[:, None])[:, 0]
    _, _, seen = _simulated(unit.T @ unit, known.shape[1], case.seed)
    middle, spread = seen.mean(axis=0), seen.std(axis=0)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(case.seed)
        p, _ = calc_misspecification_mmd(
            _tensor((target - middle)[None] / spread),
            _tensor((seen - middle) / spread),
            n_shuffle=SHUFFLES,
            max_samples=MOST_SAMPLES,
        )
    unknown = 1.0 - float(p) if p < LEVEL else 0.0
    fit, held_out = (problem.prediction(runs, []) for runs in (problem.stack, problem.held_out))
    write_answer(out, [], unknown, fit, held_out, problem.noise)


def mujoco_sysid(case: CaseFiles, out: Path) -> None:
    """MuJoCo's bounded Gauss-Newton over constants and every candidate's amplitude at its usual shape.

    Constants are bounded at `MOST_SDS` of their priors, amplitudes at the largest usual one. An effect
    is named where its 95 % interval, of `mujoco.sysid.calculate_intervals`, leaves out nothing; one less
    the level at which it would hold it is the probability. `BOUNDS` tells what ended at a bound.
    """
    from mujoco import sysid
    from scipy.special import erf

    problem = Regression(case, grid=False)
    candidates = problem.stack.model.candidates()
    usable = np.flatnonzero(problem.visible(problem.beside_constants(problem.columns)))
    picked = [problem.atoms[i] for i in usable]
    largest = [max(map(abs, candidates[atom.id].amplitude.tactical)) for atom in picked]
    sizes = np.concatenate([problem.stack.prior_sd, largest])
    design = np.concatenate([problem.constants, problem.columns[:, usable]], axis=1) * sizes
    names = [*problem.stack.constants, *(atom.id for atom in picked)]
    constants = len(problem.stack.constants)
    most = np.where(np.arange(len(names)) < constants, MOST_SDS, 1.0)
    start = sysid.ParameterDict(
        {name: sysid.Parameter(name, 0.0, -high, high) for name, high in zip(names, most.tolist())}
    )

    def residual(x: FloatArray, params: Any) -> tuple[list[FloatArray], None, None]:
        # Several columns of parameters at once, as its finite differences give them, or one.
        left = design @ np.reshape(x, (len(names), -1)) - problem.target[:, None]
        return [left if np.ndim(x) > 1 else left[:, 0]], None, None

    with contextlib.redirect_stdout(io.StringIO()):  # its minimiser prints each iteration
        found, how = sysid.optimize(start, residual, verbose=False)
    x = found.as_vector()
    jacobian = np.asarray(how.jac)
    _, half = sysid.calculate_intervals([residual(x, found)[0][0]], jacobian, alpha=LEVEL)
    se = np.asarray(half) / 1.96
    surest = erf(np.abs(x) / se / np.sqrt(2.0))
    findings = [
        Finding(atom.id, (atom.id,), float(p), float(value * size), float(s * size), dict(atom.shape))
        for atom, p, value, s, size in zip(picked, *(v[constants:] for v in (surest, x, se, sizes)))
        if p > 1.0 - LEVEL
    ]
    hits = [name for name, value, high in zip(names, x, most) if abs(value) >= (1.0 - 1e-3) * high]
    write_json(out / BOUNDS, {"at_a_bound": hits, "parameters": len(names)})
    learnt = []
    for runs in (problem.stack, problem.held_out):
        before = problem.prediction(runs, [])
        columns = np.column_stack([runs.nominal, *(runs.column(atom) for atom in picked)])
        learnt.append(Prediction(runs, before.recalibrated, columns @ (x * sizes)))
    write_answer(out, findings, 0.0, learnt[0], learnt[1], problem.noise)


def dowhy_attribution(case: CaseFiles, out: Path) -> None:
    """DoWhy-GCM's strength of the arrow from each candidate's usual signature to the structural gap.

    The gap is a linear mechanism of the signatures with additive noise; a strength is the variance of
    the gap that goes with the arrow, and its share of the gap's variance is the probability.
    """
    import networkx
    import pandas as pd
    from dowhy import gcm

    problem = Regression(case, grid=False)
    fit, held_out = (problem.prediction(runs, []) for runs in (problem.stack, problem.held_out))
    usable = np.flatnonzero(problem.visible(problem.beside_constants(problem.columns)))
    picked = [problem.atoms[i] for i in usable]
    gap = fit.stack.gap - fit.recalibrated
    rows = np.random.default_rng(case.seed).choice(len(gap), min(len(gap), ROWS), replace=False)

    def table(runs: Stack) -> FloatArray:
        return np.column_stack([runs.column(atom) for atom in picked])

    seen = table(problem.stack)
    sizes = seen.std(axis=0)
    sizes[sizes == 0.0] = 1.0
    frame = pd.DataFrame(seen[rows] / sizes, columns=[atom.id for atom in picked]).assign(gap=gap[rows])
    causes = gcm.ProbabilisticCausalModel(networkx.DiGraph([(atom.id, "gap") for atom in picked]))
    for atom in picked:
        causes.set_causal_mechanism(atom.id, gcm.EmpiricalDistribution())
    causes.set_causal_mechanism("gap", gcm.AdditiveNoiseModel(gcm.ml.create_linear_regressor()))
    # DoWhy draws from numpy's global generator.
    state = np.random.get_state()  # noqa: NPY002
    gcm.util.general.set_random_seed(case.seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gcm.config.disable_progress_bars()
        gcm.fit(causes, frame)
        strengths = gcm.arrow_strength(
            causes,
            "gap",
            n_jobs=1,
            max_num_runs=FITS,
            difference_estimation_func=lambda a, b: np.var(b) - np.var(a),
        )
    np.random.set_state(state)  # noqa: NPY002
    whole = float(np.var(gap[rows])) or 1.0
    findings = []
    for i, atom in zip(usable, picked):
        alone = problem.fit(problem.columns[:, [i]])
        share = min(max(float(strengths[atom.id, "gap"]) / whole, 0.0), 1.0)
        amplitude, se = float(alone.amplitudes[0]), float(alone.se[0])
        findings.append(Finding(atom.id, (atom.id,), share, amplitude, se, dict(atom.shape)))
    mechanism = causes.causal_mechanism("gap").prediction_model
    parents = [picked.index(a) for name in sorted(a.id for a in picked) for a in picked if a.id == name]
    learnt = [
        Prediction(p.stack, p.recalibrated, p.recalibrated + np.ravel(mechanism.predict(X)))
        for p in (fit, held_out)
        for X in [(table(p.stack) / sizes)[:, parents]]
    ]
    write_answer(out, findings, 0.0, learnt[0], learnt[1], problem.noise)


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
