"""Each cause that was found: in its card's terms, by run, growth and onset; and its share of the gap."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.cards import Card, beside_others
from fogml.gap.field import Member
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import LinearGaussian
from fogml.gap.posterior import Cause, Judgement
from fogml.gap.result import NAMED, Estimate, Found, Onset, RunAmplitude
from fogml.gap.result_parts import CauseShare
from fogml.gap.scene import Scene
from fogml.gap.step_settings import Reported
from fogml.intervals import TAILS
from fogml.runs.regimes import Regimes
from fogml.signals.distributions import chi2_sf


def found_cause(found: Inference, every: Foretold, cause: Cause, card: Card, share: float) -> Found:
    """A cause as reports have it; `every` foretells all causes together."""
    scene, settings = found.scene, found.setting.priors.reported
    declared = scene.candidates[cause.ids[0]]
    _, high = declared.amplitude.range(scene.grade)
    size = Estimate(card.lacking, card.amplitude_se, declared.amplitude.unit)
    by_run, begun = _by_run(found, every, cause, card.lacking), onset(found, every, cause, size)
    acting = since(scene, by_run, begun)
    return Found(
        effect=cause.ids[0],
        stage=declared.stage,
        members=cause.ids,
        probability=cause.probability,
        prior_probability=found.search.prior_probability(cause.ids),
        amplitude=size,
        parameters={
            q.name: Estimate(card.value.shape[q.name], card.shape_se.get(q.name, 0.0), q.unit)
            for q in declared.shape
            if q.name in card.value.shape
        },
        by_run=by_run,
        consistent=agree(acting, settings.disagree),
        grows=growth(scene, acting, settings.grows),
        onset=begun,
        share=share,
        place=declared.place,
        times_usual=abs(card.lacking) / high,
        log_odds=(cause.odds, cause.within, cause.log_share),
        left_out=cause.left_out if cause.probability >= NAMED else (),
    )


def _by_run(found: Inference, every: Foretold, cause: Cause, amplitude: float) -> tuple[RunAmplitude, ...]:
    """Amplitude that each run asks for beside all else, which is anew in each; the form as found."""
    held = found.field
    rest = held.design(m for m in every.members if m not in cause.members)
    courses = zip(every.members, held.courses(every.members, every.posterior.mean))
    course = np.sum([values for m, values in courses if m in cause.members], axis=0)
    rows = []
    for r, span in zip(found.scene.fit, found.setting.spans):
        alone = LinearGaussian.of(held.base.data[span]).beside(rest[span])
        part = course[span][:, None]
        size = float(alone.gram(part)[0, 0])
        if size > found.setting.priors.reported.shown:
            scale = float(alone.fits(part)[0]) / size
            se = float(np.hypot(size**-0.5, found.setting.priors.form_error * scale))
            rows.append(RunAmplitude(r.run.name, amplitude * scale, abs(amplitude) * se))
    return tuple(rows)


def since(scene: Scene, by_run: Sequence[RunAmplitude], begun: Onset | None) -> tuple[RunAmplitude, ...]:
    """Sizes of the runs through all of which a cause acts."""
    if begun is None:
        return tuple(by_run)
    names = [scene.runs[i].run.name for i in scene.in_time]
    first = names.index(begun.run)
    if begun.time_s > float(scene.runs[scene.in_time[first]].time_s[0]):
        first += 1
    return tuple(r for r in by_run if r.run in names[first:])


def agree(by_run: Sequence[RunAmplitude], least: float = Reported.disagree) -> bool:
    """Whether runs agree in a size, by the squares of what they differ from its mean by."""
    if len(by_run) < 2:
        return True
    values, weights = np.array([r.value for r in by_run]), np.array([r.se for r in by_run]) ** -2
    off = values - np.average(values, weights=weights)
    return bool(chi2_sf(float(weights @ off**2), len(by_run) - 1) > least)


def growth(scene: Scene, by_run: Sequence[RunAmplitude], least: float = Reported.grows) -> float | None:
    """Change of a size a day, in its unit; None where time makes none, or is not told."""
    begun = {r.run.name: b / 86400.0 for r, b in zip(scene.runs, scene.begun_s)}
    days = np.array([begun[r.run] for r in by_run])
    if not scene.order_known or len(by_run) < 2 or float(np.ptp(days)) <= 0.0:
        return None
    values, weights = np.array([r.value for r in by_run]), np.array([r.se for r in by_run]) ** -2
    late = days - np.average(days, weights=weights)
    spread = float(weights @ late**2)
    slope = float(weights @ (late * values)) / spread
    return slope if abs(slope) * spread**0.5 > least else None


def onset(found: Inference, every: Foretold, cause: Cause, amplitude: Estimate) -> Onset | None:
    """Where a cause begins that these runs show from some time on, and not before; None where from the first.

    Its course, nought before, has to hold more than the whole course does by what exchanging a cause costs
    and the choice among the times. `amplitude` is its size over all runs.
    """
    held, settings = found.field, found.setting.priors.reported
    scene = found.setting.scene
    order, count = scene.in_time, settings.onsets
    courses = [np.sum([every.of_member(i, m) for m in cause.members], axis=0) for i in range(scene.fitted)]
    places = [(i, len(courses[i]) * part // count) for i in order for part in range(count)]
    columns = [np.zeros((len(c), len(places))) for c in courses]
    for j, (run, row) in enumerate(places):
        for i in order[order.index(run) :]:
            first = row if i == run else 0
            columns[i][first:, j] = courses[i][first:]
    beside = beside_others(found, every.members, cause)
    white = held.whitening.stacked(columns)
    length = np.sum(white**2, axis=0) - np.sum((beside.basis.T @ white) ** 2, axis=0)
    shown = length > settings.shown
    gains = np.where(shown, 0.5 * beside.fits(white) ** 2 / np.where(shown, length, 1.0), 0.0)
    best = int(np.argmax(gains))
    gain = float(gains[best] - gains[0])
    if gain < found.setting.priors.exchange + np.log(len(places)):
        return None
    run, row = places[best]
    scale = float(beside.fits(white[:, [best]])[0] / length[best])
    se = float(np.hypot(length[best] ** -0.5, found.setting.priors.form_error * scale))
    begun_s = float(scene.runs[run].time_s[row])
    size = replace(amplitude, value=amplitude.value * scale, se=abs(amplitude.value) * se)
    return Onset(scene.runs[run].run.name, begun_s, gain, size)


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
    causes. Known causes are told apart; all others are ``unknown``. All is whitened, as the fit that the
    courses come of: a random walk has most of the plain energy and none of a cause, and what they take away
    of that may be nothing or less.
    """
    scene, least = found.scene, found.setting.priors.reported.least_part
    groups: dict[str, list[Member]] = {}
    for m in judged.best.members:
        id = found.columns.families[m.family].id if found.kind(m) == "known" else "unknown"
        groups.setdefault(id, []).append(m)
    if not groups:
        return ()
    rng = np.random.default_rng([seed, len(groups)])
    left = found.field.base.data - found.field.fixed @ recalibrated.posterior.mean
    values = shapley_values(left, _group_courses(found, every, recalibrated, list(groups.values()), rng))
    by_run = [values[span] for span in found.setting.spans]
    whole = values.sum(axis=0)
    parts: list[tuple[str | None, str | None, FloatArray]] = []
    if scene.fitted > 1:
        parts += [(r.run.name, None, v.sum(axis=0)) for r, v in zip(scene.fit, by_run)]
    for index, name in enumerate(Regimes.names):
        inside = [v[r.regime == index].sum(axis=0) for r, v in zip(scene.fit, by_run)]
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
) -> FloatArray:
    """What each group makes on the fit runs beyond the constants, whitened: the mean first, then draws.

    Shape (n, groups, 1 + draws).
    """
    field = found.field
    courses = dict(zip(every.members, field.courses(every.members, every.drawn(rng))))
    parts = np.stack([np.sum([courses[m] for m in group], axis=0) for group in groups], axis=1)
    flat = parts.reshape(len(parts), -1)
    taken = recalibrated.posterior.covariance @ (field.fixed.T @ flat)
    return np.asarray((flat - field.fixed @ taken).reshape(parts.shape))


def energy(found: Inference, every: Foretold, recalibrated: Foretold, member: Member) -> float:
    """Squares of what a cause makes on the fit runs beyond the constants [(deg/h)^2]."""
    field, made = found.field, [every.of_member(i, member)[:, None] for i in range(found.scene.fitted)]
    taken = recalibrated.posterior.covariance @ (field.fixed.T @ field.whitening.stacked(made))
    left = [p - found.setting.fixed[i] @ taken for i, p in enumerate(made)]
    return float(sum(np.sum((p - run.errors_in(p)) ** 2) for p, run in zip(left, field.whitening.runs)))


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
