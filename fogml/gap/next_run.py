"""What to measure next, where runs leave a class of several effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from fogml.gap.model import Candidate
from fogml.gap.preparing import Prepared
from fogml.gap.result import Found, SeparatingRun
from fogml.gap.search import Search
from fogml.gap.separating import separating_run
from fogml.gap.starting import starting_values
from fogml.gap.twin_model import TwinModel

MOST_MEMBERS = 4


def next_run(
    p: Prepared,
    found: Sequence[Found],
    candidates: Mapping[str, Candidate],
    search: Search,
    seed: int,
    tell: Callable[[str], None],
) -> SeparatingRun | None:
    """The programme that tells the members of the most probable class of several apart.

    None where each named effect stands alone, no programme does, or the model can't simulate.
    """
    model = p.model
    open_ = next((f for f in found if f.named and len(f.members) > 1), None)
    if open_ is None or not isinstance(model, TwinModel):
        return None
    values = p.recalibrated.constants
    members = []
    for id in open_.members[:MOST_MEMBERS]:
        nodes = search.places.get(id)
        if nodes is None:
            continue
        gains = search.field_.condition([]).node_gains()[nodes]
        node = search.field_.basis.nodes[nodes[int(gains.max(axis=1).argmax())]]
        members += starting_values(
            p.fit, p.whiteners, model.constants, values, [(id, node.node.shape)], candidates
        )
    if len(members) < 2:
        return None
    run = p.fit[0].run
    return separating_run(
        model.twin,
        p.noise.model,
        values,
        members,
        seed=seed,
        progress=tell,
        facts=run.facts,
    )
