"""The structural gap of each run: what recalibration leaves, and the systematic part of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fogml.gap.fitting import Fit
from fogml.gap.frame import constant_rows
from fogml.gap.model import Candidate
from fogml.gap.observation import Observation
from fogml.gap.search import Search
from fogml.gap.where import GapOnRun
from fogml.runs.run import FloatArray

if TYPE_CHECKING:
    from fogml.gap.classes import Ranking
    from fogml.gap.preparing import Prepared

GROUP_STAGE = {"table_rate": "scale_factor"}
"""Stage that a group of the unknown is booked on; bias for the others."""


def gaps_on_runs(p: Prepared, after: Fit, search: Search, ranking: Ranking) -> list[GapOnRun]:
    """The structural gap of the fit runs, with its systematic part."""
    unknown = _beside_constants(p, unknown_parts(p, search, ranking))
    gaps = []
    for o, more in zip(p.fit, unknown):
        recalibrated = o.averaged(o.model.output(p.recalibrated.constants, p.recalibrated.effects))
        explained = o.averaged(o.model.output(after.constants, after.effects)) - recalibrated
        gaps.append(GapOnRun(o, o.recorded - recalibrated, explained + more, _taken(p, o)))
    return gaps


def _taken(p: Prepared, o: Observation) -> float:
    """Mean square of what the noise moves the recalibrated constants by, on a run [(deg/h)^2]."""
    count = len(p.model.constants)
    rows = constant_rows(o, p.model.constants) / [c.sd for c in p.model.constants]
    return float(np.mean(np.sum((rows @ p.recalibrated.covariance[:count, :count]) * rows, axis=1)))


def stage_energies(
    p: Prepared, after: Fit, candidates: Mapping[str, Candidate], search: Search, ranking: Ranking
) -> dict[str, float]:
    """Energy of the systematic part by stage [(deg/h)^2], summed over the rows of all runs."""
    energies: dict[str, float] = {}

    def book(stage: str, parts: list[FloatArray]) -> None:
        energy = float(sum(np.sum(part**2) for part in parts))
        if energy > 0.0:
            energies[stage] = energies.get(stage, 0.0) + energy

    for effect in after.effects:
        others = tuple(e for e in after.effects if e.id != effect.id)
        parts = [
            o.averaged(
                o.model.output(after.constants, after.effects) - o.model.output(after.constants, others)
            )
            for o in p.fit
        ]
        book(candidates[effect.id].stage, _beside_constants(p, parts))
    if ranking.best.unknown is not None:
        stage = GROUP_STAGE.get(ranking.best.unknown[0], "bias")
        book(stage, _beside_constants(p, unknown_parts(p, search, ranking)))
    return energies


def unknown_parts(p: Prepared, search: Search, ranking: Ranking) -> list[FloatArray]:
    """The unknown's best estimate on each fit run [deg/h], shape (m,); zeros where there is none."""
    if ranking.best.unknown is None:
        return [np.zeros(len(o)) for o in p.fit]
    name, _ = ranking.best.unknown
    mean, _ = search.field_.condition(search.terms(ranking.best)).coefficients()
    basis = search.field_.basis
    own = mean[len(mean) - len(basis.groups[name]) :]
    group = basis.kinds[name]
    return [columns @ (basis.transforms[name] @ own) for columns in group.columns]


def _beside_constants(p: Prepared, parts: list[FloatArray]) -> list[FloatArray]:
    """What of a signal the recalibrated constants leave, shape (m,) each."""
    if not any(np.any(part) for part in parts):
        return parts
    fixed, columns = [], []
    for o, whitener in zip(p.fit, p.whiteners):
        own = constant_rows(o, p.model.constants)
        fixed.append(own)
        columns.append(whitener.whiten(own))
    white = np.concatenate([w.whiten(part) for w, part in zip(p.whiteners, parts)])
    every = np.concatenate(columns)
    inner = every.T @ every + np.eye(every.shape[1])
    taken = np.linalg.solve(inner, every.T @ white)
    return [part - own @ taken for part, own in zip(parts, fixed)]
