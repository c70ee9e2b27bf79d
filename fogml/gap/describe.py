"""What an unknown looks like, in plain words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fogml.gap.search import Search

if TYPE_CHECKING:
    from fogml.gap.classes import Ranking
    from fogml.gap.preparing import Prepared


def describe_unknown(p: Prepared, search: Search, ranking: Ranking) -> str:
    """Words of the best group; of the best beside what is named where the best explanation has none."""
    best = ranking.best
    if best.unknown is None and ranking.noise.gain > 3.0:
        return ranking.noise.looks_like
    named = [c for c in best.effects if c.candidate in ranking.named]
    shown = best if best.unknown is not None else search.explanation(named, "unknown")
    if shown.unknown is None:
        return ""
    return search.field_.basis.kinds[shown.unknown[0]].looks_like
