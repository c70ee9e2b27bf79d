"""Least squares of the gap on nominal constants with priors and on candidates' columns; forward selection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.special import expit

from fogml.arrays import BoolArray, FloatArray
from fogml.blind.baselines.answer import Finding, Prediction, write_answer
from fogml.blind.folders import CaseFiles
from fogml.blind.signatures import Atom, Stack, atoms, noise_of, smooth_curves
from fogml.signals.noise_model import NoiseModel

_BLIND = 1e-6
"""Columns that keep less than this share of their length beside the nominal constants show nothing."""


@dataclass(frozen=True)
class Fit:
    """Coefficients of constants and atoms, their standard errors, and the sum of squares left."""

    constants: FloatArray
    amplitudes: FloatArray
    se: FloatArray
    squares: float


class Regression:
    """The fit runs of a case as a linear problem, weighted so that its noise has unit variance.

    Parameters
    ----------
    case
        The case.
    whiten
        Whether rows are whitened by the noise model of the static run; otherwise they are only
        divided by the standard deviation of their fast part.
    free
        Whether nominal constants are fitted with their priors; otherwise they stay at the means.
    grid
        Whether candidates stand on a grid of shapes; otherwise at their usual shape.
    """

    def __init__(self, case: CaseFiles, *, whiten: bool = True, free: bool = True, grid: bool = True) -> None:
        self.case, self.free = case, free
        self._whiten = whiten
        rough = Stack(case.fit)
        self.noise: NoiseModel = noise_of(case.noise, rough)
        self._scale = float(np.std(np.diff(rough.gap))) / np.sqrt(2.0) or 1.0
        self.stack = rough
        if free:
            # Effects that falsify an input act by way of the constants: take them about fitted ones.
            found = self.fit(np.zeros((len(self.target), 0))).constants
            about = dict(zip(rough.constants, found.tolist()))
            self.stack = Stack(case.fit, about)
        self.atoms = atoms(self.stack.model.candidates(), case.without, grid)

    def weighted(self, columns: FloatArray) -> FloatArray:
        """Columns in units of the noise, with a row of zeros for each prior below."""
        if self._whiten:
            rows = self.stack.whitened(self.noise, columns)
        else:
            rows = columns / self._scale
        shape = (len(self.stack.prior_sd) if self.free else 0, *rows.shape[1:])
        return np.concatenate([rows, np.zeros(shape)])

    @cached_property
    def target(self) -> FloatArray:
        """The gap, weighted."""
        return self.weighted(self.stack.gap)

    @cached_property
    def constants(self) -> FloatArray:
        """The constants' columns, weighted, with their priors' rows; none where they are held."""
        if not self.free:
            return np.zeros((len(self.stack), 0))
        columns = self.weighted(self.stack.nominal)
        columns[len(self.stack) :] = np.diag(1.0 / self.stack.prior_sd)
        return columns

    @cached_property
    def raw(self) -> FloatArray:
        """Every atom's column [deg/h per unit], shape (n, number of atoms)."""
        return np.column_stack([self.stack.column(atom) for atom in self.atoms])

    @cached_property
    def columns(self) -> FloatArray:
        """The atoms' columns, weighted."""
        return self.weighted(self.raw)

    def beside_constants(self, columns: FloatArray) -> FloatArray:
        """Weighted columns less what the constants make up for; zero where nothing is left."""
        if not self.free:
            return columns.copy()
        # Scaled, so that small units do not hide a constant.
        scaled = self.constants / np.linalg.norm(self.constants, axis=0)
        basis, _ = np.linalg.qr(scaled)
        left = columns - basis @ (basis.T @ columns)
        gone = np.linalg.norm(left, axis=0) <= _BLIND * np.linalg.norm(columns, axis=0)
        return np.where(gone, 0.0, left)

    def visible(self, columns: FloatArray) -> BoolArray:
        """Atoms whose columns would rise over the noise at the largest usual amplitude, shape (k,)."""
        candidates = self.stack.model.candidates()
        largest = [max(map(abs, candidates[atom.id].amplitude.tactical)) for atom in self.atoms]
        return np.linalg.norm(columns, axis=0) * np.array(largest) > 1.0

    def fit(self, columns: FloatArray) -> Fit:
        """Constants and amplitudes for some atoms' weighted columns, shape (rows, k)."""
        design = np.concatenate([self.constants, columns], axis=1)
        scale = np.linalg.norm(design, axis=0)
        scale[scale == 0.0] = 1.0
        left, sizes, right = np.linalg.svd(design / scale, full_matrices=False)
        inverse = np.where(sizes > 1e-10 * sizes.max(initial=0.0), 1.0 / np.maximum(sizes, 1e-300), 0.0)
        found = (right.T * inverse) @ (left.T @ self.target) / scale
        rest = float(np.sum((self.target - design @ found) ** 2))
        # Weights may be off: errors are those of the residuals as they are.
        spread = max(rest / max(len(self.stack) - design.shape[1], 1), 1e-300)
        se = np.sqrt(spread * np.sum((right.T * inverse) ** 2, axis=1)) / scale
        k = self.constants.shape[1]
        return Fit(found[:k], found[k:], se[k:], rest)

    def prediction(self, runs: Stack, chosen: Sequence[Atom]) -> Prediction:
        """The recalibrated twin and the fitted model with some atoms, on some runs."""
        nothing = self.fit(np.zeros((len(self.target), 0)))
        fitted = nothing
        if chosen:
            fitted = self.fit(self.weighted(np.column_stack([self.stack.column(atom) for atom in chosen])))
        recalibrated = runs.nominal @ nothing.constants if self.free else np.zeros(len(runs))
        after = runs.nominal @ fitted.constants if self.free else np.zeros(len(runs))
        for atom, amplitude in zip(chosen, fitted.amplitudes):
            after = after + amplitude * runs.column(atom)
        return Prediction(runs, recalibrated, after)

    @cached_property
    def held_out(self) -> Stack:
        """The held-out runs, about the same constants."""
        return Stack(self.case.held_out, self.stack.about)


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
