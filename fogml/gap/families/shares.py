"""Which part of the gap's energy each cause makes: in all, by run, by regime.

A set S of causes takes the energy ``v(S) = sum r^2 - sum (r - sum_S c)^2`` away from a gap r. Shapley's
value of this game (L. S. Shapley, Ann. Math. Stud. 28 (1953) 307) has a closed form, since what two causes do
together is a product of the two, which they share alike::

    value of i = sum over rows of c_i (2 r - sum_k c_k)

``c`` are the causes' courses less what the constants would take up of each. Values add up to v of all causes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fogml.gap.families.closing import DRAWS, Foretold
from fogml.gap.families.inference import Inference
from fogml.gap.families.posterior import Judgement
from fogml.gap.families.search import Member
from fogml.gap.how_far_result import CauseShare
from fogml.runs.regimes import Regimes
from fogml.runs.run import FloatArray

UNKNOWN = "unknown"
"""What a share of anything but a known cause is called."""
LEAST_PART = 0.03
"""A run or regime with less of all that is taken away is left out: nothing can be told of it."""


def cause_shares(
    found: Inference, judged: Judgement, every: Foretold, recalibrated: Foretold, seed: int
) -> tuple[CauseShare, ...]:
    """Shapley's shares of what the causes of the likeliest set take away on the fit runs, in all, by run, by
    regime; intervals of 90 % from the posterior of coefficients.
    """
    scene = found.setting.scene
    runs = range(scene.fitted)
    groups = _groups(found, judged)
    if not groups:
        return ()
    rng = np.random.default_rng([seed, len(groups)])
    courses = _courses(found, every, recalibrated, list(groups.values()), rng)
    values = [shapley_values(scene.runs[i].gap - recalibrated.on(i), courses[i]) for i in runs]
    labels = [scene.runs[i].regime for i in runs]
    whole = np.sum([v.sum(axis=0) for v in values], axis=0)
    found_shares = _told(groups, whole, None, None)
    for i in runs:
        part = values[i].sum(axis=0)
        if scene.fitted > 1 and part[:, 0].sum() > LEAST_PART * whole[:, 0].sum():
            found_shares += _told(groups, part, scene.runs[i].run.name, None)
    for index, name in enumerate(Regimes.names):
        part = np.sum([v[label == index].sum(axis=0) for v, label in zip(values, labels)], axis=0)
        if part[:, 0].sum() > LEAST_PART * whole[:, 0].sum():
            found_shares += _told(groups, part, None, name)
    return tuple(found_shares)


def shapley_values(gap: FloatArray, courses: FloatArray) -> FloatArray:
    """What each cause takes away of the energy of each row [(deg/h)^2], by Shapley.

    A gap of shape (m,), courses of shape (m, causes, ...); the sum over rows is the cause's value.
    """
    left = gap.reshape(len(gap), *(1 for _ in courses.shape[1:]))
    return np.asarray(courses * (2.0 * left - courses.sum(axis=1, keepdims=True)))


def _groups(found: Inference, judged: Judgement) -> dict[str, list[Member]]:
    """Members of the likeliest set by cause: those of a known one together, all others as one."""
    groups: dict[str, list[Member]] = {}
    for m in judged.best.members:
        family = found.columns.families[m.family]
        groups.setdefault(family.id if family.kind == "known" else UNKNOWN, []).append(m)
    return groups


def _courses(
    found: Inference,
    every: Foretold,
    recalibrated: Foretold,
    groups: Sequence[Sequence[Member]],
    rng: np.random.Generator,
) -> list[FloatArray]:
    """What each group makes on each fit run beyond the constants: the mean first, then draws.

    Shape (m, groups, 1 + draws) for each run.
    """
    scene, held = found.setting.scene, found.field
    drawn = every.drawn(rng)
    parts = [
        np.stack([np.sum([every.part(i, m, drawn) for m in group], axis=0) for group in groups], axis=1)
        for i in range(scene.fitted)
    ]
    flat = held.whitening.stacked([p.reshape(len(p), -1) for p in parts])
    taken = recalibrated.posterior.covariance @ (held.fixed.T @ flat)
    return [
        p - (found.setting.fixed[i] @ taken).reshape(p.shape[0], len(groups), 1 + DRAWS)
        for i, p in enumerate(parts)
    ]


def _told(
    groups: Mapping[str, object], values: FloatArray, run: str | None, regime: str | None
) -> list[CauseShare]:
    """Shares of values of shape (groups, 1 + draws)."""
    total = values.sum(axis=0)
    shares = values / np.where(np.abs(total) > 0.0, total, np.inf)
    low, high = np.quantile(shares[:, 1:], (0.05, 0.95), axis=1)
    rows = zip(groups, shares[:, 0], low, high)
    return [
        CauseShare(name, run, regime, float(s), (float(min(a, s)), float(max(b, s))))
        for name, s, a, b in rows
    ]
