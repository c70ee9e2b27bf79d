"""Search of the family of programmes: one choice changed at a time, from several beginnings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fogml.gap.planning.programme_family import Design, Family
from fogml.settings_check import check_whole

HOUR_PRICE = 0.01
"""What an hour must pay: standard errors 1 % smaller, or distances 1 % longer."""
ITEM_PRICE = 0.03
"""What each thing that is done beside ramps and soaks must pay, likewise."""
MOST_RUNS = 600
"""Programmes that a search rehearses at most."""
RANDOM_STARTS = 4
RANDOM_CHANGES = 4
FINALISTS = 3
_LEAST_GAIN = 1e-3
_TELLING = 0.02
_SHORTER = ((0.75, 1.0), (0.5, 0.75), (0.0, 0.5))
"""Shares of the best programme's hours among which runners-up are sought."""


@dataclass(frozen=True)
class Tried:
    """A design, the logarithm of what it gives, the price of its hours not taken off, and those hours."""

    design: Design
    merit: float
    hours: float

    @property
    def worth(self) -> float:
        """Merit less the price of the hours and of each thing that is done."""
        return self.merit - HOUR_PRICE * self.hours - ITEM_PRICE * self.design.items


def search(
    family: Family,
    merit: Callable[[Design], float],
    *,
    seed: int = 0,
    most: int = MOST_RUNS,
    progress: Callable[[str], None] | None = None,
) -> list[Tried]:
    """Every design that was tried, the most worth first.

    From each beginning the design goes over to a neighbour, which differs in one choice, as long as one is
    better: a coordinate search in random order. Beginnings are a few that labs use, and random walks from the
    best so far.

    Parameters
    ----------
    family
        What may be tried.
    merit
        Logarithm of what a design gives, e.g. of a distance; the larger the better.
    seed
        Of the random walks.
    most
        Designs that are tried at most.
    progress
        Told how many were.
    """
    check_whole("seed", seed)
    check_whole("most", most, 1)
    rng = np.random.default_rng(seed)
    tried: dict[Design, Tried] = {}

    def value(design: Design) -> float:
        if design not in tried:
            tried[design] = Tried(design, merit(design), family.programme(design).total_hours)
            if progress:
                progress(f"programmes tried: {len(tried)}")
        return tried[design].worth

    def climb(design: Design, budget: int) -> None:
        until = min(len(tried) + budget, most)
        best = value(design)
        moved = True
        while moved and len(tried) < until:
            moved = False
            for near in family.neighbours(design, rng):
                if len(tried) >= until:
                    return
                if value(near) > best + _LEAST_GAIN:
                    design, best, moved = near, value(near), True
                    break

    starts = family.starts()
    for start in starts:
        value(start)
    share = most // (len(starts) + RANDOM_STARTS)
    for start in sorted(starts, key=lambda d: -tried[d].worth):
        climb(start, share)
    for _ in range(RANDOM_STARTS):
        design = max(tried.values(), key=lambda t: t.worth).design
        for _ in range(RANDOM_CHANGES):
            design = next(family.neighbours(design, rng))
        climb(design, share)
    climb(max(tried.values(), key=lambda t: t.worth).design, most)
    return sorted(tried.values(), key=lambda t: (-t.worth, t.hours))


def finely(tried: Sequence[Tried], merit: Callable[[Design], float]) -> list[Tried]:
    """The best design and runners-up with their merits by a finer reckoning, the most worth first.

    A runner-up is shorter than those before it, or gives more.
    """
    pool = [*tried[:FINALISTS], *_shorter(tried)]
    fine = [Tried(t.design, merit(t.design), t.hours) for t in dict.fromkeys(pool)]
    fine.sort(key=lambda t: (-t.worth, t.hours))
    kept: list[Tried] = []
    for one in fine:
        if not any(t.hours <= one.hours and t.merit >= one.merit - _TELLING for t in kept):
            kept.append(one)
    return kept


def _shorter(tried: Sequence[Tried]) -> list[Tried]:
    """Programmes shorter than the best that nothing as short beats, the most worth first."""
    front: list[Tried] = []
    best = -np.inf
    for one in sorted(tried, key=lambda t: (t.hours, -t.merit)):
        if one.merit > best + _TELLING:
            best = one.merit
            front.append(one)
    shares = [(tried[0].hours * share, tried[0].hours * upper) for share, upper in _SHORTER]
    found = [
        max((t for t in front if low <= t.hours < high), key=lambda t: t.worth, default=None)
        for low, high in shares
    ]
    return [t for t in found if t is not None]
