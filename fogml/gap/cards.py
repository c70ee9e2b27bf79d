"""Causes in their cards' terms: amplitude and shape by least squares, standard errors from the curvature."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
from scipy.linalg import null_space
from scipy.special import softmax

from fogml.gap.card_form import Fitted, Form, Optimum, Root, optimum
from fogml.gap.catalogue import nodes_of, power_cycles, signature_of
from fogml.gap.field import Field, Member, apart
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import LinearGaussian
from fogml.gap.model import EffectValue
from fogml.gap.posterior import Cause, Judgement
from fogml.gap.rows import Rows
from fogml.gap.shapes import GridNode, is_line
from fogml.runs.steps import FINEST_STEP_DEGC, WHOLE, recorded_step
from fogml.twin.effect import Effect
from fogml.twin.twin import EffectSetting

Start = tuple[str, float, Mapping[str, float]]
"""Name of the place that drives an effect, amplitude and shape."""


@dataclass(frozen=True)
class Card:
    """An effect's amplitude and shape with standard errors; `had` is what the model has of the amplitude."""

    value: EffectValue
    amplitude_se: float
    shape_se: Mapping[str, float]
    had: float = 0.0

    @property
    def lacking(self) -> float:
        """Amplitude that the model has too little."""
        return self.value.amplitude - self.had


def cards_of(found: Inference, judged: Judgement) -> dict[str, Card]:
    """Each cause's card, by its effect: all of it, with what the model has already."""
    cards = {}
    for cause in judged.causes:
        id = cause.ids[0]
        beside = beside_others(found, judged.best.members, cause)
        had = replaced(found, [id])
        card = card_of(id, found.field, made_beside(found, beside, had), told_by_family(found, cause))
        cards[id] = replace(card, had=sum(setting.amplitude for _, setting in had))
    return cards


def replaced(found: Inference, ids: Collection[str]) -> tuple[tuple[Effect, EffectSetting], ...]:
    """What the model has of effects already, in whose place all of each is fitted."""
    return tuple((declared, setting) for declared, setting in found.plant.on if declared.id in ids)


def made_beside(
    found: Inference, beside: LinearGaussian, had: Sequence[tuple[Effect, EffectSetting]]
) -> LinearGaussian:
    """Data with what effects make that the model has already."""
    made = [found.field.made(declared, setting.amplitude, setting.shape) for declared, setting in had]
    return replace(beside, data=beside.data + np.sum(made, axis=0)) if made else beside


def beside_others(found: Inference, members: Sequence[Member], cause: Cause) -> LinearGaussian:
    """The data beside constants and all members but a cause's."""
    return found.field.beside(m for m in members if m not in cause.members)


def told_by_family(found: Inference, cause: Cause) -> Mapping[str, Any]:
    """Shape that a cause's family tells, such as a period."""
    return found.columns.nodes[cause.member.node].shape


def in_form(declared: Effect) -> bool:
    """Whether an amplitude is fitted, the same on all runs: no spread over them, no step read off."""
    return not (_spreads(declared) or declared.digitises)


def _spreads(declared: Effect) -> bool:
    return declared.drawn_per_run or declared.family in ("line", "power_cycles")


def card_of(id: str, field: Field, beside: LinearGaussian, told: Mapping[str, Any]) -> Card:
    """The catalogue's form of an effect that fits best beside everything else.

    `beside` is the data beside constants and all other causes, `told` a shape that its family tells.

    Notes
    -----
    The best nodes of the effect's grid are where least squares begin. What distinct optima differ by, each
    as likely as it fits, is part of the standard errors, and so is that no form is known exactly.
    """
    setting, scene = field.setting, field.setting.scene
    declared = scene.candidates[id]
    if _spreads(declared):
        return _drawn(declared, told, field, beside)
    angles = [q.name for q in declared.shape if q.all_round]
    optima: list[Optimum] = []
    places: list[str] = []
    root = Root(beside)
    for place, amplitude, shape in _starts(declared, field, beside, told):
        found = optimum([Form(declared, field, amplitude, shape, place)], root)
        # Two of one place that make the same of the runs, to less than noise, are one. Of two places that do,
        # with other shapes, these runs can't say which it is.
        alike = (other for other, at in zip(optima, places) if at == place)
        if all(float(np.linalg.norm(found.made - other.made)) > 1.0 for other in alike):
            optima.append(found)
            places.append(place)
    _, usual = declared.amplitude.range(scene.grade)
    every = [found.effects[0] for found in optima]
    sizes = np.array([one.amplitude for one in every])
    fits = np.array([found.fit for found in optima]) + setting.priors.log_usual(np.abs(sizes) / usual)
    best = every[int(np.argmax(fits))]
    weights = softmax(fits)
    values = [_facing(best, one, angles) for one in every]
    amplitude, form_se = best.amplitude, setting.priors.form_error * best.amplitude
    off = np.array([size - amplitude for size, _ in values])
    se = math.sqrt(best.amplitude_se**2 + float(weights @ off**2) + form_se**2)
    shape_se = {}
    for name, value in best.shape.items():
        off = np.array([shape[name] - value for _, shape in values])
        off = (off + 180.0) % 360.0 - 180.0 if name in angles else off
        shape_se[name] = math.hypot(best.shape_se[name], math.sqrt(float(weights @ off**2)))
    unknown = [name for name in angles if best.shape_se[name] >= 180.0]
    across = dict(best.shape) | {name: best.shape[name] + 90.0 for name in unknown}
    ways = [field.made(declared, amplitude, shape) for shape in (best.shape, across) if unknown]
    if ways and np.any(ways[0] != ways[1]):
        # What shows is the part along one direction; of two in three the whole is up to twice as large.
        se = math.hypot(se, amplitude)
    if declared.digitises:
        amplitude, se = _step(scene.fit, amplitude, se)
    return Card(EffectValue(id, amplitude, best.shape), se, shape_se)


def _starts(declared: Effect, field: Field, beside: LinearGaussian, told: Mapping[str, Any]) -> list[Start]:
    """Of the nodes of an effect's grid that explain most the place that drives them, amplitude and shape."""
    setting, scene = field.setting, field.setting.scene
    reported = setting.priors.reported
    nodes = _near_lines(declared, nodes_of(declared, scene), told)[: reported.card_nodes]
    build = signature_of(declared, nodes)
    by_run = [list(islice(build(r, scene), reported.card_nodes)) for r in scene.fit]
    stacked = field.whitening.stacked([np.concatenate([b.columns for b in own], axis=1) for own in by_run])
    least = max(map(abs, declared.amplitude.limits)) ** -2.0
    angles = [q.name for q in declared.shape if q.all_round]
    _, usual = declared.amplitude.range(scene.grade)
    tried: list[tuple[float, Start]] = []
    at = 0
    for i, block in enumerate(by_run[0]):
        node, width = nodes[i % len(nodes)], block.columns.shape[1]
        columns = stacked[:, at : at + width]
        at += width
        gram, fits = beside.gram(columns), beside.fits(columns)
        # What would stay below a standard deviation at the greatest amplitude that there is tells nothing.
        scale = np.sqrt(np.maximum(np.diagonal(gram), max(least, 1e-300)))
        inverse = np.linalg.pinv(gram / np.outer(scale, scale), rcond=1e-6, hermitian=True)
        weights = node.mix @ (inverse @ (fits / scale) / scale)
        gain = 0.5 * float(fits / scale @ inverse @ (fits / scale))
        # Of the node's directions the one that most goes along, turned round where it opposes.
        sizes = weights.reshape(-1, node.turns).sum(axis=0)
        way = int(np.argmax(np.abs(sizes)))
        size, shape = float(sizes[way]), node.draws[way]
        if node.turns > 1 and size < 0.0:
            size, shape = _opposite(size, shape, angles)
        gain += float(setting.priors.log_usual(np.abs(sizes[way]) / usual))
        tried.append((gain, (str(block.shape["place"]), size, shape)))
    tried.sort(key=lambda one: -one[0])
    starts = [start for _, start in tried[: reported.card_starts]]
    # What is not in proportion to its amplitude fits well next to no amplitude but its own.
    usual_shape = declared.default_shape(scene.grade)
    starts += [(starts[0][0], amplitude, usual_shape) for amplitude in declared.amplitudes]
    # The opposite direction of the opposite sign is another answer where a part does not turn.
    place, size, shape = starts[0]
    both = angles and declared.amplitude.signed
    return [*starts, (place, *_opposite(size, shape, angles))] if both else starts


def _opposite(
    amplitude: float, shape: Mapping[str, float], angles: Sequence[str]
) -> tuple[float, Mapping[str, float]]:
    """The opposite sign and direction, which make the same of all that turns with it."""
    return -amplitude, {**shape, **{name: shape[name] + 180.0 for name in angles}}


def _facing(best: Fitted, other: Fitted, angles: Sequence[str]) -> tuple[float, Mapping[str, float]]:
    """Amplitude and shape of a fit, in the sign of another where there is a direction."""
    opposed = bool(angles) and other.amplitude * best.amplitude < 0.0
    told = other.amplitude, other.shape
    return _opposite(*told, angles) if opposed else told


def _near_lines(declared: Effect, nodes: Sequence[GridNode], told: Mapping[str, Any]) -> Sequence[GridNode]:
    """Nodes by how near their period or frequency is to one that a family tells, such of it first."""
    for quantity in filter(is_line, declared.shape):
        name, kind = quantity.name, "period" if "period" in quantity.name else "frequency"
        line = told.get(name, told.get(kind))
        if isinstance(line, float) and line > 0.0:
            near = sorted(nodes, key=lambda node: abs(math.log(node.shape[name] / line)))
            nearest = [node for node in near if node.shape[name] == near[0].shape[name]]
            at = {name: float(np.clip(line, *quantity.limits))}
            of_it = [
                replace(node, shape={**node.shape, **at}, draws=tuple({**draw, **at} for draw in node.draws))
                for node in nearest
            ]
            return [*of_it, *near]
    return nodes


def _step(runs: Sequence[Rows], amplitude: float, se: float) -> tuple[float, float]:
    """The coarsest step of the recorded temperatures and what it is uncertain by, where they show one."""
    held = [recorded_step(r.run.columns[name]) for r in runs for name in r.run.temperature_columns]
    step = max(held, default=0.0)
    return (step, 0.5 * WHOLE * step) if step >= FINEST_STEP_DEGC else (amplitude, se)


def _drawn(declared: Effect, told: Mapping[str, Any], field: Field, beside: LinearGaussian) -> Card:
    """The spread over runs of an effect that each draws anew: a standard deviation, or a line's amplitude.

    Constants of power cycles are told by what sets them apart: what is common to all is the bias.
    """
    scene = field.setting.scene
    runs, shape = scene.fit, declared.default_shape(scene.grade)
    shape |= {name: float(told[name]) for name in shape if isinstance(told.get(name), float)}
    cycles = declared.family == "power_cycles"
    own = []
    for rows in runs:
        if declared.family == "line":
            phase = 2.0 * np.pi * shape["frequency"] * rows.time_s
            own.append(np.column_stack([np.sin(phase), np.cos(phase)]))
        elif cycles:
            own.append(next(power_cycles(rows, scene)).columns)
        else:
            own.append(rows.response(declared, shape, None, field.setting.values)[:, None])
    columns = field.whitening.stacked(apart(own, len(runs)))
    count = free = len(runs)
    if cycles:
        columns = columns[:, columns.any(axis=0)]
        count = columns.shape[1]
        # Draws less their mean, of which there is one fewer.
        free = max(count - 1, 1)
        columns = columns @ null_space(np.ones((1, count)))
    inverse = np.linalg.pinv(beside.gram(columns), rcond=1e-6, hermitian=True)
    each = inverse @ beside.fits(columns)
    size = math.sqrt(float(each @ each) / free)
    noise = math.sqrt(float(np.trace(inverse)) / (free * max(len(each), 1)))
    se = math.hypot(noise, size / math.sqrt(2.0 * max(count - 1, 1)))
    amplitude = float(np.clip(size, *declared.amplitude.limits))
    return Card(EffectValue(declared.id, amplitude, dict(shape)), se, {})
