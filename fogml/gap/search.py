"""Which sets of effects explain the runs, with the unknown competing in every set.

Sets grow from the best ones by one effect at a time, up to four. In each set every effect's shape and
size are averaged over their priors with the others at their best, and best ones are found in turns.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from fogml.gap.evidence import Conditioned, Field, Term, by_candidate
from fogml.gap.priors import LENGTH_WEIGHTS, LENGTHS, SLACK, SLACK_FROM

MOST_EFFECTS = 4
SIZES = (0.4, 0.4, 0.15, 0.04, 0.01)
"""Prior probability of 0, 1, ... effects; all effects are equally likely."""
UNKNOWN = 0.25
"""Prior probability that something unknown acts besides."""
BEAM = (8, 6, 4)
"""Sets that grow further, by their size."""
BRANCHES = 5


@dataclass(frozen=True)
class Chosen:
    """An effect in a set: its best node and its best length."""

    candidate: str
    node: int
    length: float


@dataclass(frozen=True)
class Explanation:
    """A set of effects, with or without the unknown.

    Attributes
    ----------
    effects
        The effects at their best shapes.
    unknown
        The best group of the unknown and its length; None without it.
    log_evidence
        Over that of no effect and no unknown, shapes and sizes averaged.
    log_posterior
        With the prior of the set, not normalised.
    """

    effects: tuple[Chosen, ...]
    unknown: tuple[str, float] | None
    log_evidence: float
    log_posterior: float

    @property
    def ids(self) -> frozenset[str]:
        """Ids of the effects."""
        return frozenset(c.candidate for c in self.effects)


@dataclass
class Search:
    """The search over one field.

    Parameters
    ----------
    field_
        Inner products of everything.
    """

    field_: Field
    _held: dict[tuple[frozenset[str], bool], Explanation] = field(default_factory=dict)

    @cached_property
    def places(self) -> dict[str, np.ndarray]:
        """Nodes of each candidate."""
        return by_candidate(self.field_.basis.nodes)

    @cached_property
    def _empty(self) -> float:
        return self.field_.condition([]).log_evidence

    def run(self) -> list[Explanation]:
        """Every explanation that was tried, the most probable first."""
        front = [self.explanation(())]
        self.explanation((), unknown=True)
        for size in range(MOST_EFFECTS):
            grown: dict[frozenset[str], Explanation] = {}
            for found in front:
                for explained in self._grow(found):
                    grown[explained.ids] = explained
            if not grown:
                break
            ranked = sorted(grown.values(), key=lambda e: -max(e.log_posterior, self._with(e).log_posterior))
            front = ranked[: BEAM[min(size, len(BEAM) - 1)]]
            if size >= 2 and ranked[0].log_posterior < self.best.log_posterior - 6.0:
                break
        return sorted(self._held.values(), key=lambda e: -e.log_posterior)

    @property
    def best(self) -> Explanation:
        """The most probable explanation so far."""
        return max(self._held.values(), key=lambda e: e.log_posterior)

    def _with(self, found: Explanation) -> Explanation:
        return self._held[(found.ids, True)]

    def _grow(self, found: Explanation) -> Iterable[Explanation]:
        """Sets of one effect more: the best beside the set, and beside the set and the unknown."""
        more: dict[str, Chosen] = {}
        for held in (found, self._with(found)):
            gains = self.field_.condition(self.terms(held)).node_gains()
            scores = {
                id: float(logsumexp(gains[nodes])) for id, nodes in self.places.items() if id not in found.ids
            }
            for id in sorted(scores, key=scores.__getitem__, reverse=True)[:BRANCHES]:
                more.setdefault(id, self._best(id, gains))
        for chosen in more.values():
            yield self.explanation((*found.effects, chosen))
            self.explanation((*found.effects, chosen), unknown=True)

    def explanation(self, effects: Sequence[Chosen], *, unknown: bool = False) -> Explanation:
        """The explanation of a set, shapes found in turns from those given."""
        key = (frozenset(c.candidate for c in effects), unknown)
        if key not in self._held:
            self._held[key] = self._explained(list(effects), unknown)
        return self._held[key]

    def _explained(self, effects: list[Chosen], unknown: bool) -> Explanation:
        group = self._best_group(effects)[0] if unknown else None
        rounds = 1 if len(effects) < 2 and not unknown else 2
        averaged = 0.0
        for _ in range(rounds):
            averaged = 0.0
            for i, chosen in enumerate(effects):
                others = effects[:i] + effects[i + 1 :]
                held = self.field_.condition(self._terms(others, group))
                gains = held.node_gains()
                effects[i] = self._best(chosen.candidate, gains)
                own = gains[self.places[chosen.candidate]]
                averaged += float(logsumexp(own) - own.max()) + self._weight(effects[i], held)
            if unknown:
                group, gain = self._best_group(effects)
                averaged_unknown = gain
            else:
                averaged_unknown = 0.0
        evidence = (
            self.field_.condition(self._terms(effects, group)).log_evidence
            - self._empty
            + averaged
            + averaged_unknown
        )
        count, size = len(self.places), len(effects)
        prior = math.log(SIZES[size]) - math.log(math.comb(max(count, size), size))
        prior += math.log(UNKNOWN if unknown else 1.0 - UNKNOWN)
        return Explanation(tuple(effects), group, evidence, evidence + prior)

    def _best(self, id: str, gains: np.ndarray) -> Chosen:
        nodes = self.places[id]
        row, column = np.unravel_index(int(np.argmax(gains[nodes])), gains[nodes].shape)
        return Chosen(id, int(nodes[row]), float(LENGTHS[column]))

    def _weight(self, chosen: Chosen, held: Conditioned) -> float:
        """Logarithm of the prior weight of a node and a length, what its sign gains included."""
        node = self.field_.basis.nodes[chosen.node]
        place = int(np.flatnonzero(chosen.length == LENGTHS)[0])
        return float(node.log_weights[place] + held.sign_gains[chosen.node, place])

    def _best_group(self, effects: Sequence[Chosen]) -> tuple[tuple[str, float], float]:
        """The best group of the unknown and length beside a set, and what averaging adds to its evidence."""
        held = self.field_.condition(self._terms(effects, None))
        names = list(self.field_.basis.groups)
        gains = np.array([group_gains(held, name) for name in names])
        gains += np.log(LENGTH_WEIGHTS) - math.log(len(names))
        row, column = np.unravel_index(int(np.argmax(gains)), gains.shape)
        weight = math.log(LENGTH_WEIGHTS[column]) - math.log(len(names))
        averaged = float(logsumexp(gains) - gains.max()) + weight
        return (names[row], float(LENGTHS[column])), averaged

    def terms(self, found: Explanation) -> list[Term]:
        """An explanation's terms."""
        return self._terms(found.effects, found.unknown)

    def _terms(self, effects: Iterable[Chosen], group: tuple[str, float] | None) -> list[Term]:
        nodes, groups = self.field_.basis.nodes, self.field_.basis.groups
        terms = []
        for c in effects:
            terms.append(Term(nodes[c.node].columns, c.length))
            if c.length >= SLACK_FROM:
                terms.append(Term(self.field_.slack(c.node), SLACK * c.length))
        if group is not None:
            terms.append(Term(tuple(int(c) for c in groups[group[0]]), group[1]))
        return terms


def group_gains(held: Conditioned, name: str) -> np.ndarray:
    """Gain in log evidence of a group of the unknown at each length, shape (lengths,)."""
    places = held.field.basis.groups[name]
    gram = held.field.gram[np.ix_(places, places)] - held.half[:, places].T @ held.half[:, places]
    fit = held.field.gram[places, 0] - held.half[:, places].T @ held.half[:, 0]
    sizes, axes = np.linalg.eigh(0.5 * (gram + gram.T))
    sizes, along = np.maximum(sizes, 0.0), axes.T @ fit
    squares = LENGTHS[:, None] ** 2
    wider = 1.0 + squares * sizes
    return np.asarray(0.5 * (squares * along**2 / wider - np.log(wider)).sum(axis=1))
