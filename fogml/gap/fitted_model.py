"""The model with what is named: constants and effects in their cards' forms, fitted together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.card_form import Form, Optimum, Root, optimum
from fogml.gap.cards import Card, in_form, made_already, whole_card
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import Posterior
from fogml.gap.model import EffectValue, TwinModel, with_effects
from fogml.gap.posterior import Cause, Judgement
from fogml.gap.result import ConstantFit
from fogml.twin.nominal import NAMES
from fogml.twin.twin import Uncertainty


@dataclass(frozen=True, eq=False)
class Fit:
    """A model with what is named.

    Attributes
    ----------
    effects, constants
        As they go together.
    uncertainty
        Of both; none of a laboratory's own simulator.
    """

    effects: tuple[EffectValue, ...]
    constants: tuple[ConstantFit, ...]
    uncertainty: Uncertainty | None


def fitted_model(
    found: Inference, judged: Judgement, named: Sequence[Cause], cards: Mapping[str, Card]
) -> Fit:
    """Effects that are named, and the constants, as they go together: a model that has both replays so.

    Cards are of each cause beside all that acts, what is unknown, too. No model has that, and constants
    beside which something unknown makes up for a cause are others than beside the cause alone. Effects act
    as a replay has them; of one that the model had already it is all of it.
    """
    held, candidates = found.field, found.scene.candidates
    had = {declared.id for declared, _ in found.plant.on}
    by_id = {cause.ids[0]: cause for cause in named}
    whole = {id: whole_card(found, judged, c) if id in had else cards[id] for id, c in by_id.items()}
    values = {id: card.value for id, card in whole.items()}
    others = [m for c in named if not in_form(candidates[c.ids[0]]) for m in c.members]
    base, design = held.beside(others), held.design(others)
    base = replace(base, data=base.data + np.sum([made_already(found, id) for id in by_id], axis=0))
    forms = []
    for id, value in values.items():
        if in_form(declared := candidates[id]):
            forms.append(Form(declared, held, value.amplitude, value.shape))
    if not forms:
        alone = Posterior.of(design, base.data)
        return _fit(found, whole, values, alone, [], [])
    best = optimum(forms, Root(base))
    for form, fitted in zip(forms, best.effects):
        values[form.declared.id] = EffectValue(form.declared.id, fitted.amplitude, fitted.shape)
    posterior = _together(found, values, design, base.data, forms, best)
    return _fit(found, whole, values, posterior, forms, best.unknowns)


def _together(
    found: Inference,
    values: Mapping[str, EffectValue],
    design: FloatArray,
    data: FloatArray,
    forms: Sequence[Form],
    best: Optimum,
) -> Posterior:
    """Coefficients of a design beside forms that fit best; covariance of both, theirs first."""
    parts = list(zip(forms, best.unknowns))
    made = np.column_stack([form.made(own) for form, own in parts])
    alone = Posterior.of(design, data - made.sum(axis=1))
    slopes = np.concatenate([form.slopes(own) for form, own in parts], axis=1)
    moved = -alone.covariance @ (design.T @ slopes)
    at = np.cumsum([0, *(len(own) for own in best.unknowns[:-1])])
    sizes = np.array([own[0] for own in best.unknowns])
    known = found.setting.priors.form_error * np.abs(sizes)
    in_proportion = made / np.where(sizes != 0.0, sizes, 1.0)
    mean = alone.mean
    if isinstance(found.model, TwinModel):
        mean = _beside(found, design, values, alone.mean)
    # Constants move with the unknowns; with an error of the form by what is not in proportion to it alone.
    unknowns = np.eye(slopes.shape[1])
    with_all = np.concatenate([moved, unknowns])
    with_form = with_all[:, at].copy()
    with_form[: len(mean)] += alone.covariance @ (design.T @ in_proportion)
    covariance = with_all @ best.covariance @ with_all.T + (known * with_form) @ (known * with_form).T
    covariance[: len(mean), : len(mean)] += alone.covariance
    return Posterior(mean, covariance)


def _fit(
    found: Inference,
    cards: Mapping[str, Card],
    values: Mapping[str, EffectValue],
    posterior: Posterior,
    forms: Sequence[Form],
    unknowns: Sequence[FloatArray],
) -> Fit:
    """Coefficients and unknowns in their units."""
    constants, count = found.setting.constants, len(found.setting.constants)
    scales = np.concatenate([found.setting.deviations, *map(Form.scales, forms, unknowns)])
    free = [*range(count), *range(len(posterior.mean), len(posterior.covariance))]
    own = posterior.covariance[np.ix_(free, free)] * np.outer(scales, scales)
    errors = np.sqrt(np.maximum(np.diagonal(own), 0.0))
    fits = tuple(
        ConstantFit(c.name, c.unit, c.mean, c.sd, float(c.mean + sd * x), float(error))
        for c, sd, x, error in zip(constants, scales, posterior.mean, errors)
    )
    effects = tuple(values.values())
    if tuple(c.name for c in constants) != NAMES:
        return Fit(effects, fits, None)
    names = [f"nominal.{name}" for name in NAMES]
    for form in forms:
        id = form.declared.id
        for name in ("amplitude", *form.names):
            # What other shapes that fit as well differ by is part of the card's.
            wide = cards[id].shape_se.get(name, 0.0)
            own[len(names), len(names)] = max(own[len(names), len(names)], wide**2)
            names.append(f"effects.{id}.{name}")
    return Fit(effects, fits, Uncertainty(tuple(names), own))


def _beside(
    found: Inference, design: FloatArray, values: Mapping[str, EffectValue], about: FloatArray
) -> FloatArray:
    """Coefficients beside effects as a replay with constants `about` some has them, shape (q,).

    Where an effect meets another constant than it was fitted with, constants take up what is left.
    """
    setting, count = found.setting, len(found.setting.constants)
    at = {c.name: float(c.mean + sd * x) for c, sd, x in zip(setting.constants, setting.deviations, about)}
    twin = with_effects(found.plant, at, tuple(values.values()))
    whitening = found.field.whitening
    left = whitening.stacked([r.gap_of(twin) for r in found.scene.fit])
    return Posterior.of(design, left + found.field.fixed[:, :count] @ about[:count]).mean
