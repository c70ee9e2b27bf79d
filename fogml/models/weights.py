r"""Weights of descriptions of one drift, and their interval, by what is left on parts left out.

With predictions :math:`p_m` of the members and outputs z on a part left out, all less the mean of the
rows fitted to, the weights are

.. math:: \min_{w \ge 0,\ \sum w = 1}\ \operatorname{mean}_\text{parts}
          \frac{\overline{(z - \sum_m w_m p_m)^2}}{\min_m \overline{(z - p_m)^2}}
          + \kappa \sum_m (w_m - \bar w)^2,

stacked regression (Breiman, Machine Learning 24, 1996) with weights drawn together where members tie, times
the skill :math:`\sum \overline{pz} / \sum \overline{p^2}` of their sum p within 0 and 1: no compensation is
its limit 0. Of several runs those left out alone are asked: parts of a run are told by the rest of it
whatever it is that moved the drift, time included. There what a member adds to temperature alone must gain
beyond its standard error (`confirmed`): memory or a rate that one run tells by luck does harm on the next. So
must, where the runs hold too few rates of temperature, what it adds to the terms in the rate. Of
one run blocks of time are asked where its temperature moves both ways, as a half or a direction left out says
how a fit of the rest goes on, which is not how a fit of both does; else halves, which are all that there is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import NormalDist

import numpy as np
from scipy.optimize import minimize

from fogml.arrays import BoolArray, FloatArray
from fogml.models.combination import LEAST_WEIGHT, LeftOut
from fogml.models.intervals import LEVELS, Intervals, half_widths_of_runs, quantiles_of_parts
from fogml.models.table import TrainingTable
from fogml.models.unseen_noise import Unseen, unseen_noises

UNSEEN_SHIFT = 2.0**0.5
"""Widening where no run can be left out: how a run is shifted from the next is not seen in one, and is taken
to have the variance of what is left within it."""
DRAWN_TOGETHER = 0.02
"""Weight kappa of equal weights, against squared errors as shares of the best member's."""
WIDENING_PER_SPAN = 1.0
"""Growth of the half-width per box span outside the box, as a share of itself: errors of parts left out that
lie outside the box of the rest are compared with those inside at this ratio (development data: the shipped
thermal cycle, simulated tactical units)."""


def weights_of(
    parts: Sequence[LeftOut], members: int, both_ways: bool, beside: Sequence[int] = ()
) -> FloatArray:
    """Weights of members that left-out parts confirm, shape (m,); equal shares where there are none.

    Parameters
    ----------
    parts
        What members predict of each part.
    members
        Their number m.
    both_ways
        Whether temperature moves both ways in training.
    beside
        Places of members that others must improve on, one after the other (`confirmed`).
    """
    asked = asked_of(parts, both_ways)
    if asked and len(beside) and members > 1:
        kept = np.ones(members, dtype=np.bool_)
        for place in beside:
            kept &= confirmed(asked, place) | ~kept[place]
        parts = [replace(part, predicted=part.predicted[:, kept]) for part in parts]
        weights = np.zeros(members)
        weights[kept] = weights_of(parts, int(kept.sum()), both_ways)
        return weights
    equal = np.full(members, 1.0 / members)
    square, product = DRAWN_TOGETHER * (np.eye(members) - 1.0 / members), np.zeros(members)
    for part in asked:
        least = float(np.mean((part.told[:, None] - part.predicted) ** 2, axis=0).min())
        if least > 0.0:
            share = 1.0 / (len(part.told) * least * len(asked))
            square = square + share * part.predicted.T @ part.predicted
            product = product + share * part.predicted.T @ part.told
    size = max(float(np.trace(square)), 1e-300)
    found = minimize(
        lambda w: ((0.5 * w @ square @ w - product @ w) / size, (square @ w - product) / size),
        equal,
        jac=True,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * members,
        constraints=[{"type": "eq", "fun": lambda w: w.sum() - 1.0, "jac": lambda w: np.ones(members)}],
    )
    weights = np.clip(np.asarray(found.x), 0.0, 1.0)
    weights = np.where(weights < LEAST_WEIGHT, 0.0, weights)
    weights /= weights.sum()
    return weights * skill_of(asked, weights)


def confirmed(parts: Sequence[LeftOut], beside: int) -> BoolArray:
    """Which members' gains over one of them the K parts left out confirm, shape (m,); that one is among them.

    The mean of the logarithm of the ratio of rms, that one's over a member's, must exceed its standard error:
    of two runs both must gain.
    """
    left = np.array([np.mean((part.told[:, None] - part.predicted) ** 2, axis=0) for part in parts])
    gains = 0.5 * np.log(np.maximum(left[:, [beside]], 1e-300) / np.maximum(left, 1e-300))
    error = gains.std(axis=0, ddof=1) / np.sqrt(len(parts)) if len(parts) > 1 else 0.0
    found = np.asarray(gains.mean(axis=0) > error)
    found[beside] = True
    return found


def asked_of(parts: Sequence[LeftOut], both_ways: bool) -> list[LeftOut]:
    """Parts that tell what is left on another run: runs left out, else blocks, or halves of one way."""
    runs = [part for part in parts if part.kind == "runs"]
    return runs or [part for part in parts if part.kind == ("blocks" if both_ways else "halves")]


def shift_share(left: Sequence[FloatArray], told: Sequence[FloatArray]) -> float:
    r"""How far the mean of a run counts beside its course, 0 to 1, of runs left out.

    A run is shifted as a whole, by its power-on or its mounting, which nothing that a model knows foretells.
    What is left has the variance :math:`s^2` about the runs' means, and these the mean square :math:`b^2`.
    They count by the factor :math:`s/\sqrt{s^2 + b^2}`, near 1 where runs agree: so what tells courses is not
    drowned in shifts. Where it does not tell them, as of runs at one temperature each, means count whole.

    Parameters
    ----------
    left, told
        What is left of each run, and what is told of it [deg/h].
    """
    course, whole = (float(np.mean([np.var(one) for one in parts])) for parts in (left, told))
    shift = float(np.mean([np.mean(one) ** 2 for one in left]))
    return float(np.sqrt(course / (course + shift))) if 0.0 < course < (1.0 - LEAST_WEIGHT) * whole else 1.0


def shifts_apart(parts: Sequence[LeftOut]) -> list[LeftOut]:
    """Parts that are runs, their means by the `shift_share` of the member that tells their courses best."""
    runs = [part for part in parts if part.kind == "runs"]
    if not runs:
        return list(parts)
    lefts = [[part.told - part.predicted[:, m] for part in runs] for m in range(runs[0].predicted.shape[1])]
    best = min(lefts, key=lambda left: np.mean([np.var(one) for one in left]))
    share = shift_share(best, [part.told for part in runs])

    def apart(values: FloatArray) -> FloatArray:
        return values - (1.0 - share) * values.mean(axis=0)

    return [replace(part, told=apart(part.told), predicted=apart(part.predicted)) for part in runs]


def skill_of(parts: Sequence[LeftOut], weights: FloatArray) -> float:
    r"""Share of the weighed sum that left-out parts confirm, 0 to 1; all of it where there are none.

    With predictions p and outputs z of each part, both less the mean of the rows fitted to, it is the
    least-squares factor :math:`k = \sum \overline{p z}/\sum \overline{p^2}`, each part counting alike. A
    run is shifted as a whole, so K runs left out are K observations, and k counts where it is beyond its
    standard error :math:`(\sum \overline{(z - k p)^2} / (K \sum \overline{p^2}))^{1/2}`; else nothing is
    confirmed.
    """
    sums = [(part.predicted @ weights, part.told) for part in parts]
    product = sum(float(np.mean(predicted * told)) for predicted, told in sums)
    square = sum(float(np.mean(predicted * predicted)) for predicted, _ in sums)
    if not square > 0.0:
        return 1.0
    skill = product / square
    if all(part.kind == "runs" for part in parts):
        left = sum(float(np.mean((told - skill * predicted) ** 2)) for predicted, told in sums)
        if skill < (left / (len(parts) * square)) ** 0.5:
            return 0.0
    skill = float(np.clip(skill, 0.0, 1.0))
    return skill if skill >= LEAST_WEIGHT else 0.0


def intervals_of(
    parts: Sequence[LeftOut],
    weights: FloatArray,
    table: TrainingTable,
    both_ways: bool,
    errors: FloatArray,
) -> Intervals:
    """Half-widths from what is left on runs left out; of one run on its parts, widened.

    Of several runs they are those of `half_widths_of_runs`. Of one it is the widest of the kinds of its
    parts, each with the slow noise that it does not show, times `UNSEEN_SHIFT`: of blocks, and of directions
    where its temperature moves both ways, else of halves.

    There what is left on a row counts relative to its standard error, over that of a fit to all rows: a
    direction left out is told by less. Runs left out count as they are.

    Parameters
    ----------
    parts, weights
        What members predict of each part, and their weights, shape (m,).
    table
        The averages.
    both_ways
        Whether temperature moves both ways in training; else nothing can be verified of the way back, and
        the variance of the drift that the runs hold is added.
    errors
        Standard errors of what the members predict of the averages, fitted to all of them [deg/h], (n, m).
    """
    runs = [part for part in parts if part.kind == "runs"]
    shown = ("directions", "blocks") if both_ways else ("halves", "blocks")
    kinds = ["runs"] if runs else [kind for kind in shown if any(part.kind == kind for part in parts)]
    if runs:
        half = half_widths_of_runs([part.told - part.predicted @ weights for part in runs])
    else:
        widest = [
            unseen.widened(quantiles_of_parts(_lefts(parts, weights, kind, errors), np.array(LEVELS)), LEVELS)
            for kind, unseen in zip(kinds, _unseen(parts, weights, table, kinds), strict=True)
        ]
        half = UNSEEN_SHIFT * np.max([np.zeros(len(LEVELS)), *widest], axis=0)
    if not both_ways or not parts:
        drift = float(table.y.std())
        back = np.array([drift * NormalDist().inv_cdf(0.5 + level / 2.0) for level in LEVELS])
        half = np.hypot(half, back if runs else UNSEEN_SHIFT * back)
    told = f"{' and '.join(kinds)} left out" if kinds else "none"
    averaging_s, half_widths = float(table.averaging_s), tuple(half.tolist())
    return Intervals(averaging_s, half_widths, len(table), told, LEVELS, WIDENING_PER_SPAN)


def _unseen(
    parts: Sequence[LeftOut], weights: FloatArray, table: TrainingTable, kinds: Sequence[str]
) -> list[Unseen]:
    """Slow noise on another run that the parts of each kind do not show."""
    if not kinds:
        return []
    predicted = np.full(len(table), table.y.mean())
    for part in parts:
        if part.kind == kinds[-1]:
            _, held = part.fold
            predicted[held] = table.y[held] - part.told + part.predicted @ weights
    return unseen_noises(table, predicted, [[p.fold for p in parts if p.kind == kind] for kind in kinds])


def _lefts(parts: Sequence[LeftOut], weights: FloatArray, kind: str, errors: FloatArray) -> list[FloatArray]:
    """Sizes of what is left on each part of a kind [deg/h], as of a fit to all rows."""
    found = []
    for part in parts:
        if part.kind == kind:
            left = np.abs(part.told - part.predicted @ weights)
            apart, all_told = part.errors @ weights, errors[part.fold[1]] @ weights
            wider = apart > all_told
            left[wider] *= all_told[wider] / apart[wider]
            found.append(left)
    return found
