"""The model with what is named: constants and effects in their cards' forms, fitted together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.card_form import Form, Root, optimum
from fogml.gap.cards import Card, beside_others, card_of, in_form, told_by_family
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import Posterior
from fogml.gap.model import EffectValue, TwinModel, with_effects
from fogml.gap.posterior import Cause, Judgement
from fogml.gap.result import ConstantFit
from fogml.gap.shapes import AT_AMPLITUDE


def fitted_model(
    found: Inference, judged: Judgement, named: Sequence[Cause], cards: Mapping[str, Card]
) -> tuple[tuple[EffectValue, ...], tuple[ConstantFit, ...]]:
    """Effects that are named, and the constants, as they go together: a model that has both replays so.

    Cards are of each cause beside all that acts, what is unknown, too. No model has that, and constants
    beside which something unknown makes up for a cause are others than beside the cause alone. Effects act
    as a replay has them; of one that the model had already it is all of it.
    """
    held, candidates = found.field, found.scene.candidates
    had = {declared.id: (declared, setting) for declared, setting in found.plant.on}
    values = {}
    more = np.zeros(len(held.base.data))
    for cause in named:
        id = cause.ids[0]
        values[id] = cards[id].value
        if id in had:
            declared, setting = had[id]
            own = setting.amplitude * held.response(declared, setting.shape)
            more += own
            beside = beside_others(found, judged.best.members, cause)
            whole = replace(beside, data=beside.data + own)
            values[id] = card_of(id, held, whole, told_by_family(found, cause)).value
    others = [m for c in named if not in_form(candidates[c.ids[0]]) for m in c.members]
    base = held.beside(others)
    data = base.data + more
    forms = []
    for id, value in values.items():
        if in_form(declared := candidates[id]):
            # What is not in proportion to its amplitude is taken about it.
            about = {AT_AMPLITUDE: value.amplitude} if declared.amplitudes and value.amplitude else {}
            forms.append(Form(declared, held, value.amplitude, {**value.shape, **about}))
    design = held.design(others)
    if not forms:
        return tuple(values.values()), _constants(found, Posterior.of(design, data))
    best = optimum(forms, Root(replace(base, data=data)))
    for form, fitted in zip(forms, best.effects):
        values[form.declared.id] = EffectValue(form.declared.id, fitted.amplitude, fitted.shape)
    parts = list(zip(forms, best.unknowns))
    made = np.sum([form.made(own) for form, own in parts], axis=0)
    alone = Posterior.of(design, data - made)
    slopes = np.concatenate([form.slopes(own) for form, own in parts], axis=1)
    moved = alone.covariance @ (design.T @ slopes)
    covariance = alone.covariance + moved @ best.covariance @ moved.T
    told = tuple(values.values())
    if isinstance(found.model, TwinModel):
        alone = Posterior.of(design, _replayed(found, told, alone.mean))
    return told, _constants(found, replace(alone, covariance=covariance))


def _replayed(found: Inference, values: Sequence[EffectValue], coefficients: FloatArray) -> FloatArray:
    """Whitened data that constants alone have to make beside the effects, as a replay has them, shape (n,).

    Where an effect is not quite in proportion to its size, or meets another constant than it was fitted
    with, constants take up what is left.
    """
    setting, count = found.setting, len(found.setting.constants)
    at = {
        c.name: float(c.mean + sd * x)
        for c, sd, x in zip(setting.constants, setting.deviations, coefficients)
    }
    twin = with_effects(found.plant, at, values)
    left = [r.gap_of(twin) for r in found.scene.fit]
    return found.field.whitening.stacked(left) + found.field.fixed[:, :count] @ coefficients[:count]


def _constants(found: Inference, posterior: Posterior) -> tuple[ConstantFit, ...]:
    """The constants, before and after."""
    errors = np.sqrt(np.maximum(np.diagonal(posterior.covariance), 0.0))
    return tuple(
        ConstantFit(c.name, c.unit, c.mean, c.sd, float(c.mean + sd * x), float(sd * error))
        for c, sd, x, error in zip(found.setting.constants, found.setting.deviations, posterior.mean, errors)
    )
