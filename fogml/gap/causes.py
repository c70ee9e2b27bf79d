"""Each cause that was found: in its card's terms, by run, whether it grows, and since when it acts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fogml.gap.cards import Card, beside_others
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import LinearGaussian
from fogml.gap.posterior import Cause
from fogml.gap.result import NAMED, Estimate, Found, Onset, RunAmplitude
from fogml.gap.scene import Scene
from fogml.gap.step_settings import Reported
from fogml.signals.distributions import chi2_sf


def found_cause(
    found: Inference, every: Foretold, cause: Cause, probability: float, card: Card, share: float
) -> Found:
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
        probability=probability,
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
        left_out=cause.left_out if probability >= NAMED else (),
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
