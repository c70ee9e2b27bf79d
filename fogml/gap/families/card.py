"""A cause in its card's terms: the amplitude in its unit, and the shape, that come nearest to it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from fogml.gap.families.frame import Field, Setting
from fogml.gap.families.linear_gaussian import LinearGaussian
from fogml.gap.families.other_families import nodes_of, signature_of
from fogml.gap.families.rows import Rows
from fogml.gap.model import EffectValue
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
