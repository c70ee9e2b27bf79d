"""Each cause that was found: in its card's terms, by run, whether it grows, and since when it acts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.catalogue import nodes_of, signature_of
from fogml.gap.field import Field, Member, apart
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import LinearGaussian, Posterior
from fogml.gap.model import EffectValue
from fogml.gap.node_values import NodeValue, node_value
from fogml.gap.posterior import Cause, Judgement
from fogml.gap.result import NAMED, Estimate, Found, RunAmplitude
from fogml.gap.result_parts import Onset
from fogml.gap.rows import Rows
from fogml.gap.scene import Scene
from fogml.gap.settings import Reported
from fogml.gap.shapes import AT_AMPLITUDE, GridNode, is_angle, is_line
from fogml.runs.steps import FINEST_STEP_DEGC, WHOLE, recorded_step
from fogml.signals.distributions import chi2_sf
from fogml.twin.effect import Effect


@dataclass(frozen=True)
class Card:
    """An effect's amplitude and shape with standard errors."""

    value: EffectValue
    amplitude_se: float
    shape_se: Mapping[str, float]


def cards_of(found: Inference, judged: Judgement) -> dict[str, Card]:
    """Each cause's card, by its effect."""
    return {
        c.ids[0]: card_of(c.ids[0], found.field, _beside(found, judged.best.members, c), _lines(found, c))
        for c in judged.causes
    }


def _beside(found: Inference, members: Sequence[Member], cause: Cause) -> LinearGaussian:
    """The data beside constants and all members but a cause's."""
    return found.field.beside(m for m in members if m not in cause.members)


def _lines(found: Inference, cause: Cause) -> Mapping[str, float]:
    """Shape that a cause's family tells, such as a period."""
    return found.columns.nodes[cause.member.node].shape


def card_of(id: str, field: Field, beside: LinearGaussian, lines: Mapping[str, float]) -> Card:
    """The catalogue's form of an effect that fits best beside everything else.

    Parameters
    ----------
    id
        Of the effect.
    field
        Runs, and what is whitened.
    beside
        The data beside constants and all other causes.
    lines
        Shape that the cause's family tells, such as a period.
    """
    setting, scene = field.setting, field.setting.scene
    declared = scene.candidates[id]
    shape = declared.default_shape(scene.grade) | {
        q.name: float(lines[q.name]) for q in declared.shape if isinstance(lines.get(q.name), float)
    }
    if declared.drawn_per_run or declared.family in ("line", "power_cycles"):
        return _drawn(declared, shape, field, beside)
    most = setting.priors.reported.card_nodes
    nodes = _near_lines(declared, nodes_of(declared, scene, setting.values), lines)[:most]
    build = signature_of(declared, nodes)
    by_run = [[b.columns for b in islice(build(r, scene, setting.values), most)] for r in scene.fit]
    stacked = field.whitening.stacked([np.concatenate(columns, axis=1) for columns in by_run])
    told_by = []
    largest = max(map(abs, declared.amplitude.limits))
    at = 0
    for i, first in enumerate(by_run[0]):
        width, node = first.shape[1], nodes[i % len(nodes)]
        columns = stacked[:, at : at + width]
        at += width
        gram, fits = beside.gram(columns), beside.fits(columns)
        # What would stay below a standard deviation at the greatest amplitude that there is can't be told.
        scale = np.sqrt(np.maximum(np.diagonal(gram), 0.0))
        scale = np.where(scale * largest >= 1.0, scale, np.inf)
        scales = np.outer(scale, scale)
        coefficients = (np.linalg.pinv(gram / scales, rcond=1e-6, hermitian=True) / scales) @ fits
        back = np.where(np.isfinite(scale), 1.0, 0.0)[:, None] * np.linalg.inv(node.mix)
        told_by.append((0.5 * float(fits @ coefficients), node, coefficients, back.T @ gram @ back))
    found: list[tuple[float, NodeValue]] = []
    most_gained = -math.inf
    for gain, node, coefficients, information in sorted(told_by, key=lambda told: -told[0]):
        if gain < most_gained - setting.priors.hopeless:
            break
        value = node_value(declared, node, node.mix @ coefficients, information)
        found.append((gain - 0.5 * value.misfit - value.count, value))
        most_gained = max(most_gained, found[-1][0])
    gains = np.array([gain for gain, _ in found])
    best = found[int(np.argmax(gains))][1]
    weights = np.exp(gains - gains.max())
    weights /= weights.sum()
    told = best.shape
    amplitude = float(np.clip(best.amplitude, -largest, largest))
    sizes = np.clip([value.amplitude for _, value in found], -largest, largest)
    form = setting.priors.form_error * amplitude
    se = math.sqrt(best.amplitude_se**2 + float(weights @ (sizes - amplitude) ** 2) + form**2)
    angles = {q.name for q in declared.shape if is_angle(q)}
    shape_se = {}
    for name, x in told.items():
        off = np.array([value.shape.get(name, x) - x for _, value in found])
        off = (off + 180.0) % 360.0 - 180.0 if name in angles else off
        shape_se[name] = math.hypot(best.shape_se.get(name, 0.0), math.sqrt(float(weights @ off**2)))
    shape |= {k: v for k, v in told.items() if k != AT_AMPLITUDE}
    if not declared.amplitude.signed:
        amplitude = abs(amplitude)
    if getattr(declared, "digitises", False):
        amplitude, se = _step(scene.fit, amplitude, se)
    amplitude = float(np.clip(amplitude, *declared.amplitude.limits))
    return Card(EffectValue(id, amplitude, shape), se, shape_se)


def _near_lines(declared: Effect, nodes: Sequence[GridNode], lines: Mapping[str, Any]) -> Sequence[GridNode]:
    """Nodes by how near their period or frequency is to the one that a family tells, if it tells one."""
    for quantity in filter(is_line, declared.shape):
        kind = "period" if "period" in quantity.name else "frequency"
        told = lines.get(quantity.name, lines.get(kind))
        if isinstance(told, float) and told > 0.0:
            return sorted(nodes, key=lambda node: abs(math.log(node.shape[quantity.name] / told)))
    return nodes


def _step(runs: Sequence[Rows], amplitude: float, se: float) -> tuple[float, float]:
    """The coarsest step of the recorded temperatures and what it is uncertain by, where they show one."""
    held = [recorded_step(r.run.columns[name]) for r in runs for name in r.run.temperature_columns]
    step = max(held, default=0.0)
    return (step, 0.5 * WHOLE * step) if step >= FINEST_STEP_DEGC else (amplitude, se)


def _drawn(declared: Effect, shape: Mapping[str, float], field: Field, beside: LinearGaussian) -> Card:
    """The spread over runs of an effect that each draws anew: a standard deviation, or a line's amplitude."""
    runs = field.setting.scene.fit
    own = []
    for rows in runs:
        if declared.family == "line":
            phase = 2.0 * np.pi * shape["frequency"] * rows.time_s
            own.append(np.column_stack([np.sin(phase), np.cos(phase)]))
        else:
            own.append(rows.response(declared, shape, None, field.setting.values)[:, None])
    columns = field.whitening.stacked(apart(own, len(runs)))
    inverse = np.linalg.pinv(beside.gram(columns), rcond=1e-6, hermitian=True)
    each = (inverse @ beside.fits(columns)).reshape(len(runs), -1)
    size = float(np.sqrt(np.mean(np.sum(each**2, axis=1))))
    noise = float(np.sqrt(np.trace(inverse)) / len(runs))
    se = math.hypot(noise, size / math.sqrt(2.0 * max(len(runs) - 1, 1)))
    amplitude = float(np.clip(size, *declared.amplitude.limits))
    return Card(EffectValue(declared.id, amplitude, dict(shape)), se, {})


def fitted_values(
    found: Inference, judged: Judgement, named: Sequence[Cause], cards: Mapping[str, Card]
) -> tuple[EffectValue, ...]:
    """What the model with the named causes has of each: of an effect that it had already, all of it."""
    had = {declared.id: (declared, setting) for declared, setting in found.plant.on}
    values = []
    for cause in named:
        id = cause.ids[0]
        if id not in had:
            values.append(cards[id].value)
            continue
        declared, setting = had[id]
        beside = _beside(found, judged.best.members, cause)
        more = setting.amplitude * found.field.response(declared, setting.shape)
        whole = replace(beside, data=beside.data + more)
        values.append(card_of(id, found.field, whole, _lines(found, cause)).value)
    return tuple(values)


def found_cause(
    found: Inference, every: Foretold, cause: Cause, probability: float, card: Card, share: float
) -> Found:
    """A cause as reports have it; `every` foretells all causes together."""
    scene, settings = found.scene, found.setting.priors.reported
    declared = scene.candidates[cause.ids[0]]
    _, high = declared.amplitude.range(scene.grade)
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
        consistent=agree(by_run, settings.disagree),
        grows=growth(scene, by_run, settings.grows),
        onset=onset(found, every, cause),
        share=share,
        place=declared.place,
        times_usual=abs(card.value.amplitude) / high,
        log_odds=(cause.odds, cause.within, cause.log_share),
        left_out=cause.left_out if probability >= NAMED else (),
    )


def _by_run(found: Inference, cause: Cause, amplitude: float) -> tuple[RunAmplitude, ...]:
    """Amplitude that each run asks for, constants free in each, the form and the rest as found."""
    held = found.field
    design = held.design(cause.members)
    first = held.fixed.shape[1]
    course = design[:, first:] @ Posterior.of(design, held.base.data).mean[first:]
    rows = []
    for r, span in zip(found.scene.fit, found.setting.spans):
        fixed, part, data = held.fixed[span], course[span], held.base.data[span]
        basis, _ = np.linalg.qr(fixed + 1e-12)
        beside = part - basis @ (basis.T @ part)
        size = float(beside @ beside)
        if size > found.setting.priors.reported.shown:
            scale = float(beside @ data) / size
            se = float(np.hypot(size**-0.5, found.setting.priors.form_error * scale))
            rows.append(RunAmplitude(r.run.name, amplitude * scale, abs(amplitude) * se))
    return tuple(rows)


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


def onset(found: Inference, every: Foretold, cause: Cause) -> Onset | None:
    """Where a cause begins that these runs show from some time on, and not before; None where from the first.

    Its course, nought before, has to hold more than the whole course does by what exchanging a cause costs
    and the choice among the times.
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
    beside = _beside(found, every.members, cause)
    white = held.whitening.stacked(columns)
    length = np.sum(white**2, axis=0) - np.sum((beside.basis.T @ white) ** 2, axis=0)
    shown = length > settings.shown
    gains = np.where(shown, 0.5 * beside.fits(white) ** 2 / np.where(shown, length, 1.0), 0.0)
    best = int(np.argmax(gains))
    gain = float(gains[best] - gains[0])
    if gain < found.setting.priors.exchange + np.log(len(places)):
        return None
    run, row = places[best]
    return Onset(scene.runs[run].run.name, float(scene.runs[run].time_s[row]), gain)


def energy(found: Inference, every: Foretold, member: Member) -> float:
    """Squares of what a cause makes on the fit runs [(deg/h)^2]."""
    parts: list[FloatArray] = [every.of_member(i, member) for i in range(found.scene.fitted)]
    return float(sum(np.sum((p - p.mean()) ** 2) for p in parts))
