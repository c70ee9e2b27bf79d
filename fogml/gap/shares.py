"""Shares of what causes take away of the gap's energy, by Shapley: in all, by run, by regime."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.field import Member
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.posterior import Judgement
from fogml.gap.result_parts import CauseShare
from fogml.intervals import TAILS
from fogml.runs.regimes import Regimes


def cause_shares(
    found: Inference, judged: Judgement, every: Foretold, recalibrated: Foretold, seed: int
) -> tuple[CauseShare, ...]:
    """Shapley's shares of what the causes of the likeliest set take away on the fit runs: in all, by run, by
    regime; intervals of 90 % from the posterior of coefficients.

    A set S of causes takes the energy ``v(S) = sum r^2 - sum (r - sum_S c)^2`` away from a gap r. Shapley's
    value of this game (L. S. Shapley, Ann. Math. Stud. 28 (1953) 307) has a closed form, since what two
    causes do together is a product of the two, which they share alike::

        value of i = sum over rows of c_i (2 r - sum_k c_k)

    ``c`` are the causes' courses less what the constants would take up of each. Values add up to v of all
    causes. Known causes are told apart; all others are ``unknown``.
    """
    scene, least = found.scene, found.setting.priors.reported.least_part
    groups: dict[str, list[Member]] = {}
    for m in judged.best.members:
        id = found.columns.families[m.family].id if found.kind(m) == "known" else "unknown"
        groups.setdefault(id, []).append(m)
    if not groups:
        return ()
    rng = np.random.default_rng([seed, len(groups)])
    courses = _group_courses(found, every, recalibrated, list(groups.values()), rng)
    values = [shapley_values(recalibrated.left_on(i), c) for i, c in enumerate(courses)]
    by_run = [v.sum(axis=0) for v in values]
    whole = np.sum(by_run, axis=0)
    parts: list[tuple[str | None, str | None, FloatArray]] = []
    if scene.fitted > 1:
        parts += [(r.run.name, None, part) for r, part in zip(scene.fit, by_run)]
    for index, name in enumerate(Regimes.names):
        inside = [v[r.regime == index].sum(axis=0) for r, v in zip(scene.fit, values)]
        parts.append((None, name, np.sum(inside, axis=0)))
    shares = _told(groups, whole, None, None)
    for run, regime, part in parts:
        # Of a part with hardly anything of all that is taken away nothing can be told.
        if part[:, 0].sum() > least * whole[:, 0].sum():
            shares += _told(groups, part, run, regime)
    return tuple(shares)


def shapley_values(gap: FloatArray, courses: FloatArray) -> FloatArray:
    """What each cause takes away of the energy of each row [(deg/h)^2], by Shapley.

    A gap of shape (m,), courses of shape (m, causes, ...); the sum over rows is the cause's value.
    """
    left = gap.reshape(len(gap), *(1 for _ in courses.shape[1:]))
    return np.asarray(courses * (2.0 * left - courses.sum(axis=1, keepdims=True)))


def _group_courses(
    found: Inference,
    every: Foretold,
    recalibrated: Foretold,
    groups: Sequence[Sequence[Member]],
    rng: np.random.Generator,
) -> list[FloatArray]:
    """What each group makes on each fit run beyond the constants: the mean first, then draws.

    Shape (m, groups, 1 + draws) for each run.
    """
    drawn = every.drawn(rng)
    parts = [
        np.stack([np.sum([every.part(i, m, drawn) for m in group], axis=0) for group in groups], axis=1)
        for i in range(found.scene.fitted)
    ]
    return beyond_constants(found, recalibrated, parts)


def beyond_constants(
    found: Inference, recalibrated: Foretold, parts: Sequence[FloatArray]
) -> list[FloatArray]:
    """What causes make on each fit run [deg/h], shape (m_r, ...), less what the constants would take up."""
    flat = [p.reshape(len(p), -1) for p in parts]
    taken = recalibrated.posterior.covariance @ (found.field.fixed.T @ found.field.whitening.stacked(flat))
    left = [p - found.setting.fixed[i] @ taken for i, p in enumerate(flat)]
    shown = (p - run.errors_in(p) for p, run in zip(left, found.field.whitening.runs))
    return [own.reshape(p.shape) for own, p in zip(shown, parts)]


def energy(found: Inference, every: Foretold, recalibrated: Foretold, member: Member) -> float:
    """Squares of what a cause makes on the fit runs beyond the constants [(deg/h)^2]."""
    parts = [every.of_member(i, member) for i in range(found.scene.fitted)]
    return float(sum(np.sum(p**2) for p in beyond_constants(found, recalibrated, parts)))


def _told(groups: Iterable[str], values: FloatArray, run: str | None, regime: str | None) -> list[CauseShare]:
    """Shares of values of shape (groups, 1 + draws)."""
    total = values.sum(axis=0)
    shares = values / np.where(np.abs(total) > 0.0, total, np.inf)
    low, high = np.quantile(shares[:, 1:], TAILS, axis=1)
    rows = zip(groups, shares[:, 0], low, high)
    return [
        CauseShare(name, run, regime, float(s), (float(min(a, s)), float(max(b, s))))
        for name, s, a, b in rows
    ]
