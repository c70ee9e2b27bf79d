"""What to measure next, where runs leave a class of several effects, or could not show some at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from fogml.gap.model import Candidate
from fogml.gap.preparing import Prepared
from fogml.gap.result import Found, SeparatingRun
from fogml.gap.search import Search
from fogml.gap.separating import separating_run
from fogml.gap.showing import showing_run
from fogml.gap.starting import starting_values
from fogml.gap.twin_model import TwinModel

MOST_MEMBERS = 4
MOST_PROGRAMMES = 200
"""Programmes that a diagnosis tries for a class; `fogml plan` tries three times as many."""


def next_run(
    p: Prepared,
    found: Sequence[Found],
    undetectable: Sequence[str],
    candidates: Mapping[str, Candidate],
    search: Search,
    seed: int,
    tell: Callable[[str], None],
) -> SeparatingRun | None:
    """The programme that tells the members of the most probable class of several apart.

    Where each named effect stands alone, the one that shows what these runs could not. None where there is
    nothing to tell, no programme does, or the model can't simulate.
    """
    model = p.model
    if not isinstance(model, TwinModel):
        return None
    values, facts = p.recalibrated.constants, p.fit[0].run.facts
    open_ = next((f for f in found if f.named and len(f.members) > 1), None)
    if open_ is None:
        if not undetectable:
            return None
        return showing_run(
            model.twin, p.noise.model, values, undetectable, seed=seed, progress=tell, facts=facts
        )
    members = []
    for id in open_.members[:MOST_MEMBERS]:
        nodes = search.places.get(id)
        if nodes is None:
            continue
        gains = search.field_.condition([]).node_gains()[nodes]
        node = search.field_.basis.nodes[nodes[int(gains.max(axis=1).argmax())]]
        members += starting_values(p.fit, p.whiteners, model.constants, values, [(id, node.node)], candidates)
    if len(members) < 2:
        return None
    return separating_run(
        model.twin,
        p.noise.model,
        values,
        members,
        seed=seed,
        progress=tell,
        facts=facts,
        most=MOST_PROGRAMMES,
    )
