"""Baselines that select nothing step by step: abstaining, sparse ensemble, forest, Gaussian process, oracle.

The ensemble is SINDy's: sequentially thresholded least squares (S. L. Brunton et al., PNAS 113 (2016) 3932)
on bootstrapped blocks of time; an effect's probability is the share of the fits that keep it (U. Fasel et
al., Proc. R. Soc. A 478 (2022) 20210904). The process is a discrepancy after M. C. Kennedy and A. O'Hagan, J.
R. Stat. Soc. B 63 (2001) 425, over temperature, its rate and the difference of inner and outer face.

The oracle is given the true form of what may be missing, and only asks whether it is there: what the data
allow. For each truly missing effect, and for the unknown ones together, that is the likelihood ratio between
its true contribution and none, whitened by the true noise, nominal constants integrated out, the other
missing effects known. No method that must find the form can do better.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from scipy.special import expit

from fogml.arrays import FloatArray
from fogml.blind.baselines.answer import Finding, Prediction, write_answer
from fogml.blind.baselines.regression import Regression
from fogml.blind.folders import BlindFolder, CaseFiles, case_files
from fogml.blind.signatures import Stack
from fogml.blind.truth import Truth, read_contributions
from fogml.signals.noise_model import NoiseModel


def abstain(case: CaseFiles, out: Path) -> None:
    """Recalibrate and say nothing."""
    problem = Regression(case, grid=False)
    fit, held_out = (problem.prediction(runs, []) for runs in (problem.stack, problem.held_out))
    write_answer(out, [], 0.0, fit, held_out, problem.noise)


def stlsq(
    case: CaseFiles, out: Path, *, threshold: float = 0.1, fits: int = 20, blocks: int = 40, keep: float = 0.5
) -> None:
    """An ensemble of `fits` thresholded fits to `blocks` of time, rows taken as they are.

    A term whose rms falls under a share `threshold` of the gap's is dropped; what a share `keep` of the fits
    keeps is listed.
    """
    problem = Regression(case, whiten=False, grid=False)
    columns = problem.beside_constants(problem.columns)
    target = problem.beside_constants(problem.target[:, None])[:, 0]
    sizes = np.linalg.norm(columns, axis=0)
    usable = np.flatnonzero(problem.visible(columns))
    unit = columns[:, usable] / sizes[usable]
    parts = np.array_split(np.arange(len(problem.stack)), blocks)
    rng = np.random.default_rng(case.seed)
    kept = np.zeros(len(usable))
    for _ in range(fits):
        rows = np.concatenate([parts[i] for i in rng.integers(0, blocks, blocks)])
        kept += _thresholded(unit[rows], target[rows], threshold) != 0.0
    share = kept / fits
    picked = [problem.atoms[i] for i in usable[share >= keep]]
    fitted = problem.fit(problem.columns[:, usable[share >= keep]])
    findings = [
        Finding(atom.id, (atom.id,), float(p), float(value), float(se), dict(atom.shape))
        for atom, p, value, se in zip(picked, share[share >= keep], fitted.amplitudes, fitted.se)
    ]
    fit, held_out = (problem.prediction(runs, picked) for runs in (problem.stack, problem.held_out))
    write_answer(out, findings, 0.0, fit, held_out, problem.noise)


def _thresholded(columns: FloatArray, target: FloatArray, threshold: float) -> FloatArray:
    """Coefficients of columns, those of small terms zero, shape (k,)."""
    found = np.zeros(columns.shape[1])
    kept = np.arange(columns.shape[1])
    limit = threshold * float(np.linalg.norm(target))
    for _ in range(10):
        if not len(kept):
            break
        part = columns[:, kept]
        values = np.linalg.solve(part.T @ part + 1e-6 * np.eye(len(kept)), part.T @ target)
        large = np.abs(values) * np.linalg.norm(part, axis=0) >= limit
        if large.all():
            found[kept] = values
            break
        kept = kept[large]
    return found


def random_forest(
    case: CaseFiles, out: Path, *, trees: int = 50, depth: int = 8, most_rows: int = 2000
) -> None:
    """Importance of each candidate's usual signature for the structural gap, as its probability.

    Of a forest of so many `trees` of a `depth`, which learns from `most_rows` rows.
    """
    from sklearn.ensemble import RandomForestRegressor

    problem = Regression(case, grid=False)
    fit = problem.prediction(problem.stack, [])
    held_out = problem.prediction(problem.held_out, [])
    columns = problem.beside_constants(problem.columns)
    usable = np.flatnonzero(problem.visible(columns))
    picked = [problem.atoms[i] for i in usable]
    gap = fit.stack.gap - fit.recalibrated
    rng = np.random.default_rng(case.seed)
    rows = rng.choice(len(gap), min(len(gap), most_rows), replace=False)
    forest = RandomForestRegressor(
        trees, max_depth=depth, min_samples_leaf=5, random_state=case.seed, n_jobs=1
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


def gp_discrepancy(
    case: CaseFiles, out: Path, *, most_rows: int = 400, largest_log_odds: float = 30.0
) -> None:
    """A process over the recalibrated twin; the unknown's probability is its evidence against noise.

    It learns from `most_rows` means over neighbouring rows; the evidence counts for `largest_log_odds` at
    most.
    """
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
    edges = np.linspace(0, len(gap), min(len(gap), most_rows) + 1).astype(np.intp)
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
    unknown = float(expit(np.clip(odds, -largest_log_odds, largest_log_odds)))
    write_answer(out, [], unknown, learnt[0], learnt[1], problem.noise)


def _inputs(stack: Stack) -> FloatArray:
    """Temperature, its difference of 64 s means, and inner less outer face, shape (n, 3)."""
    names = list(stack.constants)
    columns = stack.nominal
    temperature = np.concatenate([part.temperature for part in stack.parts])
    return np.column_stack([temperature, columns[:, names.index("m")], columns[:, names.index("g")]])


def oracle(folder: BlindFolder, truth: Truth, out: Path) -> None:
    """Answer one case of a suite with its truth at hand."""
    files = case_files(folder.cases / truth.case)
    given = read_contributions(folder.truth / f"{truth.case}.npz")
    noise = truth.noise_model
    fit, held_out = Stack(files.fit), Stack(files.held_out)
    contributions = [
        np.column_stack(
            [stack.averaged([given[run, i] for run in stack.names]) for i in range(len(truth.effects))]
            or [np.zeros((len(stack), 0))]
        )
        for stack in (fit, held_out)
    ]
    seen, target = _beside_constants(fit, noise, np.column_stack([contributions[0], fit.gap]))
    left = target - seen.sum(axis=1)
    odds = [float((left + s) @ s - 0.5 * s @ s) for s in seen.T]
    found = []
    for effect, ratio, s in zip(truth.effects, odds, seen.T):
        if effect.id is None or effect not in truth.known:
            continue
        true = effect.amplitude.value if effect.amplitude else 1.0
        # What the noise makes of the amplitude, were its form known.
        fitted = true * (1.0 + float(left @ s) / float(s @ s))
        se = abs(true) / float(np.linalg.norm(s))
        found.append(Finding(effect.id, (effect.id,), float(expit(ratio)), fitted, se, dict(effect.shape)))
    hidden = [i for i, effect in enumerate(truth.effects) if effect in truth.unknown]
    unknown = 0.0
    if hidden:
        s = seen[:, hidden].sum(axis=1)
        unknown = float(expit((left + s) @ s - 0.5 * s @ s))
    # The unknown stays: the oracle may see it, but has no name to add it by.
    named = [i for i, effect in enumerate(truth.effects) if effect in truth.known and odds[i] > 0.0]
    nothing = _constants(fit, noise, fit.gap)
    rest = _constants(fit, noise, fit.gap - contributions[0][:, named].sum(axis=1))
    predictions = [
        Prediction(stack, stack.nominal @ nothing, stack.nominal @ rest + s[:, named].sum(axis=1))
        for stack, s in zip((fit, held_out), contributions)
    ]
    total = contributions[0].sum(axis=1)
    structural = total - fit.nominal @ _constants(fit, noise, total)
    write_answer(out, found, unknown, predictions[0], predictions[1], noise, structural)


def _design(stack: Stack, noise: NoiseModel) -> FloatArray:
    """Whitened columns of the constants, in units of their priors, the priors' rows below."""
    columns = stack.whitened(noise, stack.nominal * stack.prior_sd)
    return np.concatenate([columns, np.eye(columns.shape[1])])


def _beside_constants(stack: Stack, noise: NoiseModel, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Whitened columns less what the constants make up for; the last one apart."""
    design = _design(stack, noise)
    white = np.concatenate([stack.whitened(noise, columns), np.zeros((design.shape[1], columns.shape[1]))])
    basis, _ = np.linalg.qr(design)
    left = white - basis @ (basis.T @ white)
    return left[:, :-1], left[:, -1]


def _constants(stack: Stack, noise: NoiseModel, gap: FloatArray) -> FloatArray:
    design = _design(stack, noise)
    target = np.concatenate([stack.whitened(noise, gap), np.zeros(design.shape[1])])
    return stack.prior_sd * np.linalg.lstsq(design, target, rcond=None)[0]
