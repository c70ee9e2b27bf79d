"""Effects that the evidence names, with numbers: amplitudes and shapes fitted on the replay itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fogml.gap.evidence import Term
from fogml.gap.fitting import Fit, fit_model
from fogml.gap.model import Candidate, EffectValue
from fogml.gap.result import Estimate, Found
from fogml.gap.search import Search
from fogml.gap.starting import starting_values

if TYPE_CHECKING:
    from fogml.gap.classes import Ranked, Ranking
    from fogml.gap.preparing import Prepared

FORM_ERROR = 0.12
"""What an amplitude may differ by because no form is known exactly, of its size."""


def found_effects(
    p: Prepared, candidates: Mapping[str, Candidate], search: Search, ranking: Ranking
) -> tuple[tuple[Found, ...], Fit]:
    """Effects with numbers, and the fit with those that are named."""
    basis = search.field_.basis
    named = [r for r in ranking.effects if r.probability >= 0.5 and r.chosen.candidate in ranking.best.ids]
    starts = starting_values(
        p.fit,
        p.whiteners,
        p.model.constants,
        p.recalibrated.constants,
        [(r.chosen.candidate, basis.nodes[r.chosen.node].node.shape) for r in named],
        candidates,
    )
    fit = p.recalibrated
    if starts:
        fit = fit_model(
            p.fit, p.whiteners, p.model.constants, starts, candidates, p.model.grade, p.recalibrated.constants
        )
    fitted = {e.id: e for e in fit.effects}
    errors = fit.standard_errors
    found = []
    for r in ranking.effects:
        id, declared = r.chosen.candidate, candidates[r.chosen.candidate]
        value = fitted.get(id)
        se = float(errors.get(f"{id}.amplitude", 0.0))
        if value is None or se == 0.0:
            # Not fitted, or a line of any phase, which a replay can't show.
            value, se = _rough(r, search, candidates)
        se = math.hypot(se, FORM_ERROR * value.amplitude)
        found.append(
            Found(
                effect=id,
                stage=declared.stage,
                members=r.members,
                probability=r.probability,
                margin=r.margin,
                form_share=r.form_share,
                rest=r.rest,
                length=r.chosen.length,
                amplitude=Estimate(value.amplitude, se, declared.amplitude.unit),
                parameters={
                    q.name: Estimate(value.shape[q.name], float(errors.get(f"{id}.{q.name}", 0.0)), q.unit)
                    for q in declared.shape
                    if q.name in value.shape
                },
            )
        )
    return tuple(found), fit


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
