"""The model with what is named: constants and effects in their cards' forms, fitted together; as a twin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.special import expit

from fogml.arrays import FloatArray
from fogml.gap.card_form import Form, Optimum, Root, optimum
from fogml.gap.cards import Card, cards_of, in_form, made_beside, replaced
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import Posterior
from fogml.gap.model import EffectValue, TwinModel, with_effects, within_limits
from fogml.gap.posterior import Cause, Judgement, judge
from fogml.gap.result import Diagnosis
from fogml.gap.result_parts import ConstantFit
from fogml.gap.rows import READ
from fogml.numerals import with_error
from fogml.runs.run import Run
from fogml.twin.draws import parameter_values
from fogml.twin.nominal import NAMES
from fogml.twin.plant.fit import PlantFit, fit_plant
from fogml.twin.plant.standard import QUANTITIES
from fogml.twin.registry import effect
from fogml.twin.twin import Twin
from fogml.twin.uncertainty import Suspected, Uncertainty


@dataclass(frozen=True, eq=False)
class Fit:
    """A model with what is named: effects and constants as they go together, and what they make of every run.

    ``uncertainty`` is of both, none of a laboratory's own simulator; ``closeness`` is how well forms of
    effects fit the runs [nats], 0 without any.
    """

    effects: tuple[EffectValue, ...]
    constants: tuple[ConstantFit, ...]
    uncertainty: Uncertainty | None
    foretold: Foretold
    closeness: float = 0.0


@dataclass(frozen=True, eq=False)
class Explained:
    """A posterior, what is judged by it, each cause's card by its effect, and a model with what is named."""

    found: Inference
    judged: Judgement
    cards: Mapping[str, Card]
    fit: Fit


def explained(found: Inference, cost: float) -> Explained:
    """What a posterior names, at a cost of a false name over a missed one.

    What acts may look like a constant far off, at which effects would meet the wrong output. Then they are
    fitted at the constants that were expected, too, and what fits best is told.
    """
    judged = judge(found, cost)
    options = [found]
    if found.setting.widened:
        options.append(found.meeting({c.name: c.mean for c in found.setting.constants}))
    told = []
    for one in options:
        cards = cards_of(one, judged)
        told.append(Explained(one, judged, cards, fitted_model(one, judged.named, cards)))
    best = max(told, key=lambda option: option.fit.closeness)
    return replace(best, judged=replace(judged, unknown=_left_unknown(best)))


def _left_unknown(told: Explained) -> float:
    """Probability that something unknown acts, by what effects out of proportion to their amplitude leave.

    No node of a grid holds such an effect well where it is large, and what nodes leave looks unknown.
    """
    found, held = told.found, told.found.field
    forms = told.fit.foretold.forms.values()
    if all(form.declared.in_proportion for form, _ in forms):
        return told.judged.unknown
    others = [m for m in told.judged.best.members if found.kind(m) == "unknown"]
    made = np.sum([form.made(own) for form, own in forms], axis=0)
    left = made_beside(found, held.base, told.fit.foretold.replaced).data - made
    without, with_others = (
        replace(kept, data=left).log_evidence for kept in (held.base, held.beside(others))
    )
    odds = with_others - without + sum(found.search.log_odds[m.family] for m in others)
    return float(min(told.judged.unknown, expit(odds))) if others else told.judged.unknown


def fitted_model(found: Inference, named: Sequence[Cause], cards: Mapping[str, Card]) -> Fit:
    """Effects that are named, and the constants, as they go together: a model that has both replays so.

    Cards are of each cause beside all that acts, what is unknown, too. No model has that, and constants
    beside which something unknown makes up for a cause are others than beside the cause alone. Effects act
    as a replay has them; of one that the model had already it is all of it.
    """
    held, candidates = found.field, found.scene.candidates
    values = {cause.ids[0]: cards[cause.ids[0]].value for cause in named}
    others = [m for c in named if not in_form(candidates[c.ids[0]]) for m in c.members]
    forms = [
        Form(declared, held, value.amplitude, value.shape)
        for id, value in values.items()
        if in_form(declared := candidates[id])
    ]
    had = replaced(found, [form.declared.id for form in forms])
    base, design = made_beside(found, held.beside(others), had), held.design(others)
    if not forms:
        alone = Posterior.of(design, base.data)
        return _fit(found, cards, values, Foretold(found, tuple(others), alone))
    best = optimum(forms, Root(base))
    for form, fitted in zip(forms, best.effects):
        values[form.declared.id] = EffectValue(form.declared.id, fitted.amplitude, fitted.shape)
    posterior = _together(found, design, base.data, forms, best)
    by_id = {form.declared.id: (form, own) for form, own in zip(forms, best.unknowns)}
    foretold = Foretold(found, tuple(others), posterior, by_id, had)
    return replace(_fit(found, cards, values, foretold), closeness=best.fit)


def _together(
    found: Inference, design: FloatArray, data: FloatArray, forms: Sequence[Form], best: Optimum
) -> Posterior:
    """Coefficients of a design beside forms that fit best, and how far their unknowns are off."""
    parts = list(zip(forms, best.unknowns))
    made = np.column_stack([form.made(own) for form, own in parts])
    alone = Posterior.of(design, data - made.sum(axis=1))
    slopes = np.concatenate([form.slopes(own) for form, own in parts], axis=1)
    moved = -alone.covariance @ (design.T @ slopes)
    at = np.cumsum([0, *(len(own) for own in best.unknowns[:-1])])
    sizes = np.array([own[0] for own in best.unknowns])
    known = found.setting.priors.form_error * np.abs(sizes)
    in_proportion = made / np.where(sizes != 0.0, sizes, 1.0)
    # Constants move with the unknowns; with an error of the form by what is not in proportion to it alone.
    with_all = np.concatenate([moved, np.eye(slopes.shape[1])])
    with_form = with_all[:, at].copy()
    count = len(alone.mean)
    with_form[:count] += alone.covariance @ (design.T @ in_proportion)
    covariance = with_all @ best.covariance @ with_all.T + (known * with_form) @ (known * with_form).T
    covariance[:count, :count] += alone.covariance
    return Posterior(np.concatenate([alone.mean, np.zeros(slopes.shape[1])]), covariance)


def _fit(
    found: Inference, cards: Mapping[str, Card], values: Mapping[str, EffectValue], foretold: Foretold
) -> Fit:
    """Coefficients and unknowns in their units."""
    constants, count = found.setting.constants, len(found.setting.constants)
    forms, posterior = foretold.forms.values(), foretold.posterior
    scales = np.concatenate([found.setting.deviations, *(form.scales(own) for form, own in forms)])
    at = [*range(count), *range(len(posterior.mean) - len(scales) + count, len(posterior.mean))]
    own = posterior.covariance[np.ix_(at, at)] * np.outer(scales, scales)
    errors = np.sqrt(np.maximum(np.diagonal(own), 0.0))
    means = _replayed(found, values, foretold) if forms else posterior.mean
    fits = tuple(
        ConstantFit(c.name, c.unit, c.mean, c.sd, float(c.mean + sd * x), float(error))
        for c, sd, x, error in zip(constants, scales, means, errors)
    )
    effects = tuple(values.values())
    if tuple(c.name for c in constants) != NAMES:
        return Fit(effects, fits, None, foretold)
    names = [f"nominal.{name}" for name in NAMES]
    for form, _ in forms:
        id = form.declared.id
        for name in ("amplitude", *form.names):
            # What other shapes that fit as well differ by is part of the card's.
            wide = cards[id].shape_se.get(name, 0.0)
            own[len(names), len(names)] = max(own[len(names), len(names)], wide**2)
            names.append(f"effects.{id}.{name}")
    return Fit(effects, fits, Uncertainty(tuple(names), own), foretold)


def _replayed(found: Inference, values: Mapping[str, EffectValue], foretold: Foretold) -> FloatArray:
    """Coefficients beside effects as a replay with constants near these has them, shape (q,).

    Where an effect meets another constant than it was fitted with, constants take up what is left.
    """
    setting, count = found.setting, len(found.setting.constants)
    design = found.field.design(foretold.members)
    about = foretold.posterior.mean[: design.shape[1]]
    if not isinstance(found.model, TwinModel):
        return about
    twin = with_effects(found.plant, setting.values_of(about), tuple(values.values()))
    whitening = found.field.whitening
    left = whitening.stacked([r.gap_of(twin) for r in found.scene.fit])
    return Posterior.of(design, left + found.field.fixed[:, :count] @ about[:count]).mean


def better_twin(twin: Twin, found: Diagnosis, runs: Sequence[Run]) -> tuple[Twin, tuple[str, ...]]:
    """A diagnosed twin with what is known and not known of it, and what was fitted in sentences.

    Parameters
    ----------
    twin
        With the constants and effects that were found.
    found
        The diagnosis.
    runs
        Fit runs, for the plant; without any it stays as it was.
    """
    told, matrices, names = [], [], list[str]()
    if found.uncertainty is not None:
        names += found.uncertainty.names
        matrices.append(found.uncertainty.covariance)
    fitted, why_not = diagnosed_plant(twin, runs)
    if fitted is not None:
        twin = replace(twin, plant=fitted.plant)
        values = parameter_values(twin)
        scale = np.array([values[name] for name in fitted.names])
        names += fitted.names
        matrices.append(fitted.covariance * np.outer(scale, scale))
        deviations = scale * np.sqrt(np.diag(fitted.covariance))
        units = {f"plant.{quantity.name}": quantity.unit for quantity in QUANTITIES}
        sizes = ", ".join(
            f"{name.removeprefix('plant.')} {with_error(value, sd)} {units.get(name, '')}".rstrip()
            for name, value, sd in zip(fitted.names, scale, deviations)
        )
        told.append(f"Plant fitted to recorded temperatures: {sizes}")
    elif why_not:
        told.append(why_not)
    suspected = {}
    for f in (*found.found, *found.suspected):
        if not f.named and f.probability >= found.least_suspected and f.effect not in twin.settings:
            shape = {name: value.value for name, value in f.parameters.items()}
            amplitude, held = within_limits(f.effect, f.amplitude.value, shape, twin.grade)
            suspected[f.effect] = Suspected(f.probability, amplitude, held)
    if suspected:
        told.append(f"Suspected, and not on in twin.yaml: {', '.join(suspected)}")
    source = f"diagnosis of {' and '.join(found.fit)}"
    uncertainty = Uncertainty(tuple(names), block_diag(*matrices), source) if names else None
    return replace(twin, uncertainty=uncertainty, suspected=suspected), tuple(told)


def diagnosed_plant(twin: Twin, runs: Sequence[Run]) -> tuple[PlantFit | None, str]:
    """The plant fitted to what runs recorded, or none and, where it could be, why not.

    An effect that follows a temperature which no run recorded was found with that temperature as the twin's
    own plant has it; with another plant its numbers would no longer be right, so that one stays.
    """
    if not runs or not all("T_chamber" in run.columns for run in runs):
        return None, ""
    recorded = set.intersection(*(set(run.columns) for run in runs)) | set(READ)
    for id in twin.settings:
        lacking = sorted(n for n in effect(id).needs if n.startswith("T_") and n not in recorded)
        if lacking:
            return None, f"Plant as it was: {id} follows {lacking[0]}, which was not recorded"
    return fit_plant(twin, runs), ""
