"""Each cause that was found: in its card's terms, by run, whether it grows, and since when it acts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from fogml.gap.families.card import Card, card_of
from fogml.gap.families.closing import Foretold
from fogml.gap.families.inference import Inference
from fogml.gap.families.linear_gaussian import Posterior
from fogml.gap.families.posterior import Cause, Judgement
from fogml.gap.families.search import Member
from fogml.gap.how_far_result import Onset
from fogml.gap.model import EffectValue
from fogml.gap.result import NAMED, Estimate, Found, RunAmplitude
from fogml.runs.run import FloatArray

SHOWN = 9.0
"""Squared whitened length from which on a run alone shows a cause."""
DISAGREE = 0.01
"""Chance of sizes as unlike as those of the runs under which they don't agree."""
GROWS = 3.0
"""Standard errors from 0 of the change of a size with time from which on it grows or fades."""
ONSETS = 8
"""Times in each run at which a cause may have begun."""


def cards_of(found: Inference, judged: Judgement) -> dict[str, Card]:
    """Each cause's card, by its effect."""
    return {c.ids[0]: _card(found, judged, c) for c in judged.causes}


def _card(found: Inference, judged: Judgement, cause: Cause) -> Card:
    others = [(m.node, m.size) for m in judged.best.members if m not in cause.members]
    shape = found.columns.nodes[cause.member.node].shape
    return card_of(cause.ids[0], found.setting, found.field, found.field.beside(others), shape)


def fitted_values(
    found: Inference, judged: Judgement, named: Sequence[Cause], cards: Mapping[str, Card]
) -> tuple[EffectValue, ...]:
    """What the model with the named causes has of each: of an effect that it had already, all of it."""
    had = {declared.id: (declared, setting) for declared, setting in found.plant.on}
    runs = found.setting.scene.runs[: found.setting.scene.fitted]
    values = []
    for cause in named:
        id = cause.ids[0]
        if id not in had:
            values.append(cards[id].value)
            continue
        declared, setting = had[id]
        unit = [r.response(declared, setting.shape, None, found.setting.values) for r in runs]
        others = [(m.node, m.size) for m in judged.best.members if m not in cause.members]
        beside = found.field.beside(others)
        whole = replace(beside, data=beside.data + setting.amplitude * found.field.whitening.stacked(unit))
        shape = found.columns.nodes[cause.member.node].shape
        values.append(card_of(id, found.setting, found.field, whole, shape).value)
    return tuple(values)


def found_cause(
    found: Inference, every: Foretold, cause: Cause, probability: float, card: Card, share: float
) -> Found:
    """A cause as reports have it; `every` foretells all causes together."""
    scene = found.setting.scene
    declared = scene.candidates[cause.ids[0]]
    _, high = declared.amplitude.range(scene.grade)  # type: ignore[arg-type]
    by_run = _by_run(found, cause, card.value.amplitude)
    return Found(
        effect=cause.ids[0],
        stage=declared.stage,
        members=cause.ids,
        probability=probability,
        amplitude=Estimate(card.value.amplitude, card.amplitude_se, declared.amplitude.unit),
        parameters={
            q.name: Estimate(card.value.shape[q.name], card.shape_se.get(q.name, 0.0), q.unit)
            for q in declared.shape
            if q.name in card.value.shape
        },
        by_run=by_run,
        consistent=_agree(by_run),
        grows=_grows(found, by_run),
        onset=_onset(found, every, cause),
        share=share,
        place=declared.place,
        times_usual=abs(card.value.amplitude) / high,
        log_odds=(cause.odds, cause.within, cause.log_share),
        left_out=cause.left_out if probability >= NAMED else (),
    )


def _by_run(found: Inference, cause: Cause, amplitude: float) -> tuple[RunAmplitude, ...]:
    """Amplitude that each run asks for, constants free in each, the form and the rest as found."""
    held = found.field
    design = held.design([(m.node, m.size) for m in cause.members])
    first = held.fixed.shape[1]
    course = design[:, first:] @ Posterior.of(design, held.base.data).mean[first:]
    rows = []
    for r, span in zip(found.setting.scene.runs, found.setting.spans):
        fixed, part, data = held.fixed[span], course[span], held.base.data[span]
        basis, _ = np.linalg.qr(fixed + 1e-12)
        beside = part - basis @ (basis.T @ part)
        size = float(beside @ beside)
        if size > SHOWN:
            scale = float(beside @ data) / size
            se = float(np.hypot(size**-0.5, found.setting.priors.form_error * scale))
            rows.append(RunAmplitude(r.run.name, amplitude * scale, abs(amplitude) * se))
    return tuple(rows)


def _agree(by_run: Sequence[RunAmplitude]) -> bool:
    """Whether runs agree in a size, by the squares of what they differ from its mean by."""
    if len(by_run) < 2:
        return True
    values, weights = np.array([r.value for r in by_run]), np.array([r.se for r in by_run]) ** -2
    apart = values - np.average(values, weights=weights)
    return bool(chi2.sf(float(weights @ apart**2), len(by_run) - 1) > DISAGREE)


def _grows(found: Inference, by_run: Sequence[RunAmplitude]) -> float | None:
    """Change of a size a day, in its unit; None where time makes none, or is not told."""
    scene = found.setting.scene
    begun = {r.run.name: b / 86400.0 for r, b in zip(scene.runs, scene.begun_s)}
    days = np.array([begun[r.run] for r in by_run])
    if not scene.order_known or len(by_run) < 2 or float(np.ptp(days)) <= 0.0:
        return None
    values, weights = np.array([r.value for r in by_run]), np.array([r.se for r in by_run]) ** -2
    late = days - np.average(days, weights=weights)
    spread = float(weights @ late**2)
    slope = float(weights @ (late * values)) / spread
    return slope if abs(slope) * spread**0.5 > GROWS else None


def _onset(found: Inference, every: Foretold, cause: Cause) -> Onset | None:
    """Where a cause begins that these runs show from some time on, and not before; None where from the first.

    Its course, nought before, has to hold more than the whole course does by what exchanging a cause costs
    and the choice among the times.
    """
    scene, held = found.setting.scene, found.field
    order = sorted(range(scene.fitted), key=lambda i: scene.begun_s[i])
    courses = [np.sum([every.of_member(i, m) for m in cause.members], axis=0) for i in range(scene.fitted)]
    places = [(i, len(courses[i]) * part // ONSETS) for i in order for part in range(ONSETS)]
    columns = [np.zeros((len(c), len(places))) for c in courses]
    for j, (run, row) in enumerate(places):
        for i in order[order.index(run) :]:
            first = row if i == run else 0
            columns[i][first:, j] = courses[i][first:]
    beside = held.beside([(m.node, m.size) for m in every.members if m not in cause.members])
    white = held.whitening.stacked(columns)
    length = np.sum(white**2, axis=0) - np.sum((beside.basis.T @ white) ** 2, axis=0)
    shown = length > SHOWN
    gains = np.where(shown, 0.5 * beside.fits(white) ** 2 / np.where(shown, length, 1.0), 0.0)
    best = int(np.argmax(gains))
    gain = float(gains[best] - gains[0])
    if gain < found.setting.priors.exchange + np.log(len(places)):
        return None
    run, row = places[best]
    return Onset(scene.runs[run].run.name, float(scene.runs[run].time_s[row]), gain)


def energy(found: Inference, every: Foretold, member: Member) -> float:
    """Squares of what a cause makes on the fit runs [(deg/h)^2]."""
    parts: list[FloatArray] = [every.of_member(i, member) for i in range(found.setting.scene.fitted)]
    return float(sum(np.sum((p - p.mean()) ** 2) for p in parts))
