"""A cause in its card's terms: the amplitude in its unit, and the shape, that come nearest to it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from scipy.stats import chi2

from fogml.gap.frame import Field, Setting
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import LinearGaussian, Posterior
from fogml.gap.model import EffectValue
from fogml.gap.other_families import nodes_of, signature_of
from fogml.gap.posterior import Cause, Judgement
from fogml.gap.result import NAMED, Estimate, Found, RunAmplitude
from fogml.gap.result_parts import Onset
from fogml.gap.rows import Rows
from fogml.gap.search import Member
from fogml.gap.shapes import AT_AMPLITUDE, Node, is_angle
from fogml.runs.run import FloatArray
from fogml.runs.steps import FINEST_STEP_DEGC, WHOLE, recorded_step
from fogml.twin.effect import Effect

MOST_NODES = 400


@dataclass(frozen=True)
class Card:
    """An effect's amplitude and shape with standard errors, and what its form gains [nats]."""

    value: EffectValue
    amplitude_se: float
    shape_se: Mapping[str, float]
    held: float


def card_of(
    id: str, setting: Setting, field: Field, beside: LinearGaussian, lines: Mapping[str, float]
) -> Card:
    """The catalogue's form of an effect that fits best beside everything else.

    Parameters
    ----------
    id
        Of the effect.
    setting, field
        Runs, and what is whitened.
    beside
        The data beside constants and all other causes.
    lines
        Shape that the cause's family tells, such as a period.
    """
    scene = setting.scene
    declared = scene.candidates[id]
    shape = declared.default_shape(scene.grade) | {  # type: ignore[arg-type]
        q.name: float(lines[q.name]) for q in declared.shape if isinstance(lines.get(q.name), float)
    }
    if declared.drawn_per_run or declared.family == "line" or declared.family == "power_cycles":
        return _drawn(declared, shape, setting, field, beside)
    nodes = nodes_of(declared, scene, setting.values)
    runs = scene.runs[: scene.fitted]
    build = signature_of(declared)
    blocks = [list(islice(build(rows, scene, setting.values), MOST_NODES)) for rows in runs]
    count = len(blocks[0])
    best: tuple[float, int, FloatArray, FloatArray] | None = None
    gains, values = [], []
    stacked = field.whitening.stacked(
        [np.concatenate([b.columns for b in held[:count]], axis=1) for held in blocks]
    )
    at = 0
    for i in range(count):
        width = blocks[0][i].columns.shape[1]
        columns = stacked[:, at : at + width]
        at += width
        gram, fits = beside.gram(columns), beside.fits(columns)
        scale = np.sqrt(np.maximum(np.diagonal(gram), 1e-300))
        inverse = np.linalg.pinv(gram / np.outer(scale, scale), rcond=1e-6, hermitian=True) / np.outer(
            scale, scale
        )
        coefficients = inverse @ fits
        gain = 0.5 * float(fits @ coefficients) - width
        gains.append(gain)
        node = nodes[i % len(nodes)]
        values.append(_value(declared, node, node.mix @ coefficients))
        if best is None or gain > best[0]:
            best = gain, i, coefficients, inverse
    assert best is not None
    _, i, coefficients, inverse = best
    node = nodes[i % len(nodes)]
    value = values[i]
    amplitude, told = value
    spread = node.mix @ inverse @ node.mix.T
    se = math.sqrt(max(float(np.ones(len(spread)) @ spread @ np.ones(len(spread))), 0.0))
    weights = np.exp(np.clip(np.array(gains) - max(gains), -50.0, 0.0))
    weights /= weights.sum()
    sizes = np.array([a for a, _ in values])
    se = math.sqrt(
        se**2 + float(weights @ (sizes - amplitude) ** 2) + (setting.priors.form_error * amplitude) ** 2
    )
    shape_se = {
        name: math.sqrt(float(weights @ np.array([(v.get(name, x) - x) ** 2 for _, v in values])))
        for name, x in told.items()
    }
    shape |= {k: v for k, v in told.items() if k != AT_AMPLITUDE}
    if not declared.amplitude.signed and amplitude < 0.0:
        amplitude = abs(amplitude)
    if getattr(declared, "digitises", False):
        amplitude, se = _step(runs, amplitude, se)
    amplitude = float(np.clip(amplitude, *declared.amplitude.limits))
    return Card(EffectValue(id, amplitude, shape), se, shape_se, max(best[0], 0.0))


def _step(runs: Sequence[Rows], amplitude: float, se: float) -> tuple[float, float]:
    """The coarsest step of the recorded temperatures and what it is uncertain by, where they show one."""
    held = [recorded_step(r.run.columns[name]) for r in runs for name in r.run.temperature_columns]
    step = max(held, default=0.0)
    return (step, 0.5 * WHOLE * step) if step >= FINEST_STEP_DEGC else (amplitude, se)


def _value(declared: Effect, node: Node, weights: FloatArray) -> tuple[float, dict[str, float]]:
    """Amplitude and shape of a node's draws with weights."""
    turns = node.turns
    angles = [q for q in declared.shape if is_angle(q)]
    told = {k: float(v) for k, v in node.shape.items()}
    if angles and turns == 2:
        table = weights.reshape(-1, 2).sum(axis=0)
        amplitude = float(np.hypot(*table))
        told[angles[0].name] = float(np.degrees(np.arctan2(table[1], table[0])) % 360.0)
        return amplitude, told
    if turns > 1:
        return float(np.abs(weights).max()), told
    amplitude = float(weights.sum())
    for k in range(1, len(node.draws)):
        for q in declared.shape:
            step = float(node.draws[k].get(q.name, 0.0)) - float(node.draws[0].get(q.name, 0.0))
            if step and amplitude:
                moved = float(node.draws[0][q.name]) + step * float(weights[k]) / amplitude
                low, high = q.range("tactical")
                told[q.name] = float(np.clip(moved, low - (high - low), high + (high - low)))
    return amplitude, told


def _drawn(
    declared: Effect, shape: Mapping[str, float], setting: Setting, field: Field, beside: LinearGaussian
) -> Card:
    """The spread over runs of an effect that each draws anew: a standard deviation, or a line's amplitude."""
    scene = setting.scene
    runs = scene.runs[: scene.fitted]
    parts: list[list[FloatArray]] = []
    for r, rows in enumerate(runs):
        if declared.family == "line":
            phase = 2.0 * np.pi * shape["frequency"] * rows.time_s
            own = np.column_stack([np.sin(phase), np.cos(phase)])
        else:
            own = rows.response(declared, shape, None, setting.values)[:, None]
        wide = np.zeros((len(rows), own.shape[1] * len(runs)))
        wide[:, r * own.shape[1] : (r + 1) * own.shape[1]] = own
        parts.append([wide])
    columns = field.whitening.stacked([np.concatenate(p, axis=1) for p in parts])
    gram, fits = beside.gram(columns), beside.fits(columns)
    inverse = np.linalg.pinv(gram, rcond=1e-6, hermitian=True)
    found = inverse @ fits
    each = found.reshape(len(runs), -1)
    size = float(np.sqrt(np.mean(np.sum(each**2, axis=1))))
    noise = float(np.sqrt(np.trace(inverse)) / len(runs))
    se = math.hypot(noise, size / math.sqrt(2.0 * max(len(runs) - 1, 1)))
    amplitude = float(np.clip(size, *declared.amplitude.limits))
    return Card(EffectValue(declared.id, amplitude, dict(shape)), se, {}, 0.0)


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
