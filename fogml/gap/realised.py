"""Whether a named effect does what the evidence credits it with: the fitted replay against the columns.

Evidence is linear: a shape parameter that the response is in proportion to has a coefficient of its own,
and a large effect has room for another form. Together they may follow what no shape within its limits
makes. What the fitted effect itself does not bring is no evidence for it, but for something unknown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from fogml.gap.classes import LEAST_MARGIN, Ranking
from fogml.gap.confidence import named_probability
from fogml.gap.fitting import Fit
from fogml.gap.model import Candidate, drawn_per_run
from fogml.gap.preparing import Prepared
from fogml.gap.search import Search

FORM_SHARE = 0.1
"""Share of an effect's gain that its true form may owe to not being the catalogue's."""


def realised(
    p: Prepared, candidates: Mapping[str, Candidate], search: Search, ranking: Ranking, fit: Fit
) -> Ranking:
    """The ranking with margins of the fitted effects less what their own forms don't bring.

    The unknown becomes more probable by what the names become less so.

    Parameters
    ----------
    p
        The runs.
    candidates
        What may be named.
    search, ranking
        The search and its result.
    fit
        The named effects, fitted on the replay.
    """
    lost = unrealised(p, candidates, search, ranking, fit)
    alone = len(ranking.best.effects) == 1 and ranking.best.unknown is None
    effects, known = [], 1.0 - ranking.unknown
    for r in ranking.effects:
        nats = lost.get(r.chosen.candidate, 0.0)
        if nats == 0.0:
            effects.append(r)
            continue
        margin = r.margin - nats
        own = named_probability(margin, r.form_share, r.rest, r.chosen.length, alone=alone)
        probability = min(r.probability, own)
        known *= 1.0 - (r.probability - probability)
        if margin >= LEAST_MARGIN:
            effects.append(replace(r, margin=margin, probability=probability, unrealised=nats))
    effects.sort(key=lambda r: -r.probability)
    return replace(ranking, effects=tuple(effects), unknown=1.0 - known)


def unrealised(
    p: Prepared, candidates: Mapping[str, Candidate], search: Search, ranking: Ranking, fit: Fit
) -> dict[str, float]:
    """Gain of each fitted effect's columns that its fitted replay does not have, `FORM_SHARE` apart [nats].

    Gains are those over what everything else of the best explanation leaves; the size of the fitted
    effect is at its best.
    """
    frame = search.field_.basis.frame
    estimates = search.estimates(ranking.best)
    rest = frame.without_constants(frame.residual[:, 0] - sum(estimates.values(), 0.0))
    whole = [o.averaged(o.model.output(fit.constants, fit.effects)) for o in p.fit]
    lost = {}
    for effect in fit.effects:
        if effect.id not in estimates or drawn_per_run(candidates[effect.id]):
            # Of what each run draws anew a replay has one draw for all.
            continue
        others = tuple(e for e in fit.effects if e.id != effect.id)
        made = [
            (rows - o.averaged(o.model.output(fit.constants, others)))[:, None]
            for rows, o in zip(whole, p.fit)
        ]
        columns = frame.without_constants(estimates[effect.id])
        replay = frame.without_constants(frame.white(made)[:, 0])
        left = rest + columns
        credited = float(columns @ left - 0.5 * columns @ columns)
        along = max(float(replay @ left), 0.0)
        brought = 0.5 * along**2 / max(float(replay @ replay), 1e-300)
        lost[effect.id] = max((1.0 - FORM_SHARE) * credited - brought, 0.0)
    return lost
