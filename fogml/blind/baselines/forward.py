"""Forward selection by the Bayesian information criterion: with and without whitening, constants fixed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.special import expit

from fogml.arrays import FloatArray
from fogml.blind.baselines.answer import Finding, write_answer
from fogml.blind.baselines.regression import Regression
from fogml.blind.folders import CaseFiles
from fogml.blind.signatures import Atom, smooth_curves

MOST = 4
"""Effects at most."""
_CLASS = 6.0
"""Members of a class are within this much of the best in the criterion: 3 nats."""
_LEFT = 1e-9


def bic(case: CaseFiles, out: Path) -> None:
    """Whitened, constants with their priors always in."""
    _answer(Regression(case), out)


def bic_unwhitened(case: CaseFiles, out: Path) -> None:
    """The noise taken for white."""
    _answer(Regression(case, whiten=False), out)


def bic_fixed_nominal(case: CaseFiles, out: Path) -> None:
    """Whitened, constants held at their priors' means."""
    _answer(Regression(case, free=False), out)


def _answer(problem: Regression, out: Path) -> None:
    columns = problem.beside_constants(problem.columns)
    target = problem.beside_constants(problem.target[:, None])[:, 0]
    n, ids = len(problem.stack), np.array([atom.id for atom in problem.atoms])
    price = np.log(n) * np.array([1.0 + len(atom.shape) for atom in problem.atoms])
    chosen: list[int] = []
    gains: list[tuple[float, tuple[str, ...]]] = []
    usable = problem.visible(columns)
    before = np.linalg.norm(columns, axis=0)
    while len(chosen) < MOST:
        lengths = np.linalg.norm(columns, axis=0)
        left = usable & (lengths > _LEFT * before) & ~np.isin(ids, ids[chosen])
        if not left.any():
            break
        along = np.where(left, target @ columns / np.where(left, lengths, 1.0), 0.0)
        rest = float(target @ target)
        gain = n * np.log(rest / np.maximum(rest - along**2, 1e-300)) - price
        gain[~left] = -np.inf
        best = int(np.argmax(gain))
        if gain[best] <= 0.0:
            break
        alike = {str(ids[i]) for i in np.flatnonzero(gain > gain[best] - _CLASS)} - {str(ids[best])}
        chosen.append(best)
        gains.append((float(gain[best]), (str(ids[best]), *sorted(alike))))
        direction = columns[:, best] / lengths[best]
        target = target - direction * (direction @ target)
        columns = columns - np.outer(direction, direction @ columns)
    picked = [problem.atoms[i] for i in chosen]
    findings = _findings(problem, picked, gains)
    fit, held_out = (problem.prediction(runs, picked) for runs in (problem.stack, problem.held_out))
    unknown = _unknown(problem, target, [problem.columns[:, i] for i in chosen])
    write_answer(out, findings, unknown, fit, held_out, problem.noise)


def _findings(
    problem: Regression, picked: Sequence[Atom], gains: Sequence[tuple[float, tuple[str, ...]]]
) -> list[Finding]:
    if not picked:
        return []
    fitted = problem.fit(problem.weighted(np.column_stack([problem.stack.column(a) for a in picked])))
    return [
        Finding(a.id, members, float(expit(0.5 * gain)), float(value), float(se), dict(a.shape))
        for a, (gain, members), value, se in zip(picked, gains, fitted.amplitudes, fitted.se)
    ]


def _unknown(problem: Regression, left: FloatArray, chosen: Sequence[FloatArray]) -> float:
    """Whether smooth curves in time and temperature still gain, tested once effects are chosen."""
    curves = problem.weighted(smooth_curves(problem.stack))
    curves = problem.beside_constants(curves)
    if chosen:
        basis, _ = np.linalg.qr(problem.beside_constants(np.column_stack(chosen)))
        curves = curves - basis @ (basis.T @ curves)
    sizes = np.linalg.norm(curves, axis=0)
    basis, _ = np.linalg.qr(curves[:, sizes > 0.0] / sizes[sizes > 0.0])
    n, rest = len(problem.stack), float(left @ left)
    explained = float(np.sum((basis.T @ left) ** 2))
    gain = n * np.log(rest / max(rest - explained, 1e-300)) - basis.shape[1] * np.log(n)
    return float(expit(0.5 * gain))
