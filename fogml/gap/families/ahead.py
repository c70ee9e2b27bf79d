"""What lies ahead: the run that would tell more, and what these runs would name of each candidate."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from fogml.gap.families.card import card_of
from fogml.gap.families.closing import Foretold
from fogml.gap.families.frame import Field
from fogml.gap.families.inference import Inference
from fogml.gap.families.posterior import Judgement, at_cost
from fogml.gap.families.repeating import repeat_run
from fogml.gap.families.search import Search
from fogml.gap.how_far_result import Rehearsed
from fogml.gap.model import EffectValue
from fogml.gap.result import NAMED, Found, SeparatingRun
from fogml.gap.separating import separating_run
from fogml.gap.shapes import corners
from fogml.gap.showing import MOST_PROGRAMMES, showing_run
from fogml.gap.twin_model import TwinModel
from fogml.runs.run import FloatArray
from fogml.twin.effect import NoiseEffect

MOST_MEMBERS = 4
"""Members of a class that a programme is looked for."""
FORMS = ("usual", "low", "high")
"""Shapes in the middle of their ranges, all at the low ends, all at the high ones."""


def next_run(
    found: Inference,
    judged: Judgement,
    items: Sequence[Found],
    undetectable: Sequence[str],
    seed: int,
    tell: Callable[[str], None],
    unknown: bool = False,
) -> SeparatingRun | None:
    """The programme that tells the members of the most probable class of several apart.

    Where each named effect stands alone and something `unknown` acts, the one that tells what that goes with;
    else the one that shows what these runs could not. None where there is nothing to tell, no programme does,
    or the model can't simulate one.
    """
    setting = found.setting
    several = any(f.named and len(f.members) > 1 for f in items)
    if unknown and not several:
        repeat = repeat_run(found, Foretold.of(found, judged.best.members, judged.best.members))
        if repeat is not None:
            return repeat
    if not isinstance(found.model, TwinModel):
        return None
    twin, noise = found.model.twin, found.field.whitening.noise
    facts = setting.scene.runs[0].run.facts
    open_ = next((f for f in items if f.named and len(f.members) > 1), None)
    if open_ is None:
        if not undetectable:
            return None
        return showing_run(twin, noise, setting.values, undetectable, seed=seed, progress=tell, facts=facts)
    members = _members(found, judged, open_)
    if len(members) < 2:
        return None
    return separating_run(
        twin,
        noise,
        setting.values,
        members,
        seed=seed,
        progress=tell,
        facts=facts,
        most=MOST_PROGRAMMES,
    )


def _members(found: Inference, judged: Judgement, item: Found) -> list[EffectValue]:
    """Members of a class as each would be in the other's place."""
    cause = next(c for c in judged.causes if c.ids[0] == item.effect)
    others = [m for m in judged.best.members if m not in cause.members]
    beside = found.field.beside([(m.node, m.size) for m in others])
    best = {found.columns.families[f].id: m for f, m in found.search.best_members(others).items()}
    values = []
    for id in item.members[:MOST_MEMBERS]:
        if id in best:
            shape = found.columns.nodes[best[id].node].shape
            values.append(card_of(id, found.setting, found.field, beside, shape).value)
    return [v for v in values if v.amplitude != 0.0]


def rehearse(
    search: Search, items: Sequence[Found] = (), cost_of_false_name: float = 1.0
) -> tuple[Rehearsed, ...]:
    """What a diagnosis of the runs of a search would name, miss or mistake if one candidate acted alone.

    Each is put into replays of these very runs, at its usual size and, if it was found, at that, in several
    forms. The data are what it is expected to make, without noise (G. Cowan et al., Eur. Phys. J. C 71 (2011)
    1554), judged beside the constants by the evidence of one cause.
    """
    setting = search.field.setting
    grade = setting.scene.grade
    sizes = {f.effect: abs(f.amplitude.value) for f in items if f.named}
    rows = []
    for f in search.families_of("known"):
        declared = setting.scene.candidates[search.families[f].id]
        if isinstance(declared, NoiseEffect) and not declared.steady:
            continue
        usual = declared.amplitude.typical(grade)  # type: ignore[arg-type]
        asked = [("usual", usual)] + ([("found", sizes[declared.id])] if declared.id in sizes else [])
        for form, shape in zip(FORMS, corners(declared, grade)):
            response = _response(search.field, declared.id, shape)
            for size, amplitude in asked:
                rows.append(_judged(search, f, form, size, amplitude * response, cost_of_false_name))
            if not declared.shape:
                break
    return tuple(rows)


def _response(held: Field, id: str, shape: dict[str, float]) -> FloatArray:
    """Whitened response of an effect to a unit of its amplitude on the fit runs."""
    scene, values = held.setting.scene, held.setting.values
    declared = scene.candidates[id]
    bare = {name: value for name, value in shape.items() if name in {q.name for q in declared.shape}}
    parts = [r.response(declared, bare, None, values) for r in scene.runs[: scene.fitted]]
    return held.whitening.stacked(parts)


def _judged(search: Search, family: int, form: str, size: str, data: FloatArray, cost: float) -> Rehearsed:
    priors, families = search.priors, search.families
    basis = search.field.base.basis
    length = math.sqrt(max(float(data @ data) - float(np.sum((basis.T @ data) ** 2)), 0.0))
    scores = search.alone_on(data)
    known = {f: s for f, s in scores.items() if families[f].kind == "known"}
    best = max(known, key=known.__getitem__)
    alike = sorted((f for f in known if known[f] > known[best] - priors.exchange), key=lambda f: -known[f])
    own, others, unknown = (
        float(np.logaddexp.reduce(np.array(told)))
        for told in (
            [known[f] for f in alike],
            [-np.inf, *(s for f, s in known.items() if f not in alike)],
            [0.0, *(s for f, s in scores.items() if f not in known)],
        )
    )
    probability = priors.believed(float(np.logaddexp(own, others)) - unknown, own - others)
    probability = at_cost(probability, cost)
    named = probability >= NAMED
    outcome = "missed" if not named else "named" if family in alike else "mistaken"
    members = tuple(families[f].id for f in alike) if named else ()
    return Rehearsed(families[family].id, form, size, length, outcome, members, probability)
