"""Effects that the evidence names, with numbers: amplitudes and shapes fitted on the replay itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fogml.gap.evidence import Term
from fogml.gap.fitting import Fit, fit_model
from fogml.gap.model import Candidate, EffectValue
from fogml.gap.result import Estimate, Found
from fogml.gap.search import Search
from fogml.gap.shapes import is_angle
from fogml.gap.starting import starting_values
from fogml.twin.quantities import Quantity

if TYPE_CHECKING:
    from fogml.gap.classes import Ranked, Ranking
    from fogml.gap.preparing import Prepared

FORM_ERROR = 0.04
"""What an amplitude may differ by because no form is known exactly, of its size."""
FULL_TURN_DEG = 360.0


def fit_named(p: Prepared, candidates: Mapping[str, Candidate], search: Search, ranking: Ranking) -> Fit:
    """The model fitted with the effects that are named."""
    basis = search.field_.basis
    named = [r for r in ranking.effects if r.chosen.candidate in ranking.named]
    starts = starting_values(
        p.fit,
        p.whiteners,
        p.model.constants,
        basis.frame.values,
        [(r.chosen.candidate, basis.nodes[r.chosen.node].node) for r in named],
        candidates,
    )
    if not starts:
        return p.recalibrated
    return fit_model(
        p.fit, p.whiteners, p.model.constants, starts, candidates, p.model.grade, basis.frame.values
    )


def found_effects(
    candidates: Mapping[str, Candidate], search: Search, ranking: Ranking, fit: Fit
) -> tuple[tuple[Found, ...], Fit]:
    """Effects with numbers, and the fit with those of lines and draws that a replay can't show."""
    fitted = {e.id: e for e in fit.effects}
    errors = fit.standard_errors
    found = []
    for r in ranking.effects:
        id, declared = r.chosen.candidate, candidates[r.chosen.candidate]
        value = fitted.get(id)
        se = float(errors.get(f"{id}.amplitude", 0.0))
        shape_errors = {q.name: float(errors.get(f"{id}.{q.name}", 0.0)) for q in declared.shape}
        if value is None or se == 0.0:
            # Not fitted, or a line of any phase, which a replay can't show: the evidence has its size.
            value, se = _rough(r, search, candidates)
            shape_errors = {q.name: _spread(r, search, q) for q in declared.shape if q.name in value.shape}
            if id in fitted:
                fitted[id] = value
        se = math.hypot(se, FORM_ERROR * value.amplitude)
        found.append(
            Found(
                effect=id,
                stage=declared.stage,
                members=r.members,
                probability=r.probability,
                support=r.support,
                unrealised=r.unrealised,
                amplitude=Estimate(value.amplitude, se, declared.amplitude.unit),
                parameters={
                    q.name: Estimate(value.shape[q.name], shape_errors[q.name], q.unit)
                    for q in declared.shape
                    if q.name in value.shape
                },
            )
        )
    return tuple(found), replace(fit, effects=tuple(fitted.values()))


def _rough(ranked: Ranked, search: Search, candidates: Mapping[str, Candidate]) -> tuple[EffectValue, float]:
    """An effect at its best node, its size what the evidence takes it for, and that size's standard error."""
    node = search.field_.basis.nodes[ranked.chosen.node]
    declared = candidates[ranked.chosen.candidate]
    places = list(node.columns)
    held = search.field_.condition([Term(node.columns, ranked.chosen.length)])
    mean, _ = held.coefficients()
    length = math.sqrt(max(float(mean @ search.field_.gram[np.ix_(places, places)] @ mean), 0.0))
    sign = -1.0 if len(places) == 1 and node.sign == 0 and mean[0] < 0.0 else 1.0
    low, high = declared.amplitude.limits
    shape = {q.name: node.node.shape[q.name] for q in declared.shape if q.name in node.node.shape}
    return EffectValue(declared.id, float(np.clip(sign * length * node.size, low, high)), shape), node.size


def _spread(ranked: Ranked, search: Search, quantity: Quantity) -> float:
    """Standard error of a shape parameter by the evidence of the candidate's nodes, beside nothing else."""
    nodes, places = search.field_.basis.nodes, search.places[ranked.chosen.candidate]
    chosen, name = nodes[ranked.chosen.node].node, quantity.name
    if is_angle(quantity) and len({draw.get(name) for draw in chosen.draws}) > 1:
        return FULL_TURN_DEG / math.sqrt(12.0)
    apart = np.abs(np.array([nodes[i].node.shape.get(name, math.nan) for i in places]) - chosen.shape[name])
    gains = search.field_.condition([]).node_gains(places)[places].max(axis=1)
    weights = np.exp(gains - gains.max())
    among = float(weights @ apart**2 / weights.sum())
    # Between two nodes the parameter may be anywhere.
    step = float(apart[apart > 0.0].min()) if np.any(apart > 0.0) else 0.0
    return math.sqrt(among + step**2 / 12.0)
