"""Sets of causes by their evidence: one noise first, in a beam; the best sets then at every noise."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from fogml.arrays import FloatArray
from fogml.gap.field import Blocks, Field, Member
from fogml.gap.linear_gaussian import log_sum_exp, prior_factor


@dataclass(frozen=True)
class Explanation:
    """A set of causes.

    Attributes
    ----------
    members
        The causes.
    log_prior
        Of the set.
    log_evidence
        At one noise, members' nodes and sizes averaged over beside each other.
    spread
        What averaging, and signs that physics gives, add to the evidence at the nodes and sizes that stand
        for the members.
    by_noise
        Log evidence, with the noise's prior, at each noise.
    shared
        What other units say of the causes that it names.
    """

    members: tuple[Member, ...]
    log_prior: float
    log_evidence: float
    spread: float = 0.0
    by_noise: tuple[float, ...] = ()
    shared: float = 0.0

    @property
    def key(self) -> tuple[int, ...]:
        """Families, in order."""
        return tuple(sorted(m.family for m in self.members))

    @property
    def score(self) -> float:
        """Logarithm of the posterior, up to a constant."""
        evidence = log_sum_exp(np.array(self.by_noise)) if self.by_noise else self.log_evidence
        return self.log_prior + self.shared + evidence


@dataclass(frozen=True, eq=False)
class _Held:
    """Members that are integrated out: their rows of inner products, sizes, a factor, the data along it."""

    rows: list[FloatArray]
    size: FloatArray
    factor: FloatArray
    along: FloatArray
    log_evidence: float


class Search:
    """Finds explanations of data, with columns at the noise that fits best."""

    def __init__(self, held: Field) -> None:
        self.field = held
        self.priors = held.setting.priors
        self.families = held.columns.families
        self.log_odds = self._log_odds()
        self.cached_rows: dict[int, FloatArray] = {}
        self._across = held.base.basis.T @ held.white
        self._fits = self._fits_to(held.base.data)
        self.blocks = Blocks(held, self._across)

    def explanations(self) -> list[Explanation]:
        """The sets worth keeping, the likeliest first.

        Sets without a known cause go on in a beam of their own: what several unknown families explain
        together competes with a name, however far ahead names are on the way there.
        """
        nothing = Explanation((), 0.0, self.field.base.log_evidence)
        found: dict[tuple[int, ...], Explanation] = {(): nothing}
        candidates = [f for f in self.blocks.rows if self.families[f].kind != "left_out"]
        level, best = [nothing], nothing.score
        for count in range(1, self.priors.most_causes + 1):
            grown: dict[tuple[int, ...], Explanation] = {}
            for explanation in level:
                joining = [f for f in candidates if self._may_join(explanation, f)]
                for other in self._each_more(explanation, joining).values():
                    if other.key not in grown or other.score > grown[other.key].score:
                        grown[other.key] = other
            ranked = sorted(grown.values(), key=lambda e: -e.score)
            beam = self.priors.beam if count < 3 else max(self.priors.beam // 2, 1)
            if count > 1:
                most = self.priors.search.refined
                near = [e for e in ranked[:most] if e.score > best - self.priors.hopeless]
                near += [e for e in ranked[most:] if not self.names(e)][: beam // 2]
                refined = {e.key: self._refined(e) for e in near}
                ranked = sorted([refined.get(e.key, e) for e in ranked], key=lambda e: -e.score)
            found |= {e.key: e for e in ranked}
            best = max(best, max((e.score for e in ranked), default=-math.inf))
            # Of a set in several forms the likeliest goes on.
            sets = list({frozenset(e.key): e for e in reversed(ranked)}.values())[::-1]
            level = [e for e in sets[:beam] if count == 1 or e.score > best - self.priors.hopeless]
            level += [e for e in sets[beam:] if not self.names(e)][: beam // 2]
            if not level:
                break
        kept = [e for e in found.values() if e.score > best - 2.0 * self.priors.hopeless or not e.members]
        return sorted(kept, key=lambda e: -e.score)

    def names(self, explanation: Explanation) -> set[int]:
        """Families of a set that may be named."""
        return {f for f in explanation.key if self.families[f].kind == "known"}

    def alone(self) -> Mapping[int, float]:
        """Gain of each family over nothing, averaged over nodes and sizes [nats]."""
        return self._averaged_alone(self._fits)

    def alone_on(self, data: FloatArray) -> Mapping[int, float]:
        """Log posterior of each family alone on other whitened data, shape (n,); that of nothing is 0."""
        alone = self._averaged_alone(self._fits_to(data))
        return {f: gain + self.log_odds[f] for f, gain in alone.items()}

    def on(self, data: FloatArray, most_causes: int) -> Search:
        """The same search on other whitened data, shape (n,), for sets of so many causes at most."""
        other, held = copy(self), copy(self.field)
        held.base = replace(held.base, data=data)
        other.field, other.priors = held, replace(self.priors, most_causes=most_causes)
        other._fits = other._fits_to(data)
        return other

    def _averaged_alone(self, fits: FloatArray) -> dict[int, float]:
        table = self.blocks.gains(np.empty((0, len(fits))), fits).sum(axis=0) + self.blocks.prior
        return {f: log_sum_exp(table[rows]) for f, rows in self.blocks.rows.items()}

    def _fits_to(self, data: FloatArray) -> FloatArray:
        """Inner products of all columns with whitened data beside the constants, shape (columns,)."""
        held = self.field
        return np.asarray(held.white.T @ data - self._across.T @ (held.base.basis.T @ data))

    def best_members(self, beside: Sequence[Member]) -> dict[int, Member]:
        """The node and size that stand for each family beside members."""
        gains = self.blocks.gains(*self._beside(self._held(beside)))
        return {f: self._averaged(f, gains[:, rows])[0] for f, rows in self.blocks.rows.items()}

    def exchanged(self, explanation: Explanation, family: int) -> dict[int, Explanation]:
        """The set with a known family exchanged for each other one that may be named, where near."""
        rest = self.without(explanation, {family})
        forms = explanation.key.count(family)
        found = {}
        for f, grown in self._each_more(rest, self.families_of("known")).items():
            own = explanation.log_prior + explanation.log_evidence
            if f in explanation.key or grown.score < own - 2.0 * self.priors.hopeless:
                continue
            found[f] = self._refined(grown)
            if forms > 1 and self._forms(f) > 1:
                found[f] = max(
                    found[f], self._refined(self._each_more(found[f], [f])[f]), key=lambda e: e.score
                )
        return found

    def unexplained(self, explanation: Explanation, families: set[int]) -> list[Explanation]:
        """Sets in which something unknown, a mixture of forms, or nothing, stands in for known families."""
        rest = self._refined(self.without(explanation, families))
        others = [*self.families_of("unknown"), *self.families_of("plant"), *self.names(rest)]
        sets = [rest]
        for _ in range(2):
            start = sets[0]
            more = self._each_more(start, [f for f in others if self._may_join(start, f)])
            ranked = sorted(more.values(), key=lambda e: -e.score)[: self.priors.search.alternatives]
            sets = sorted([*map(self._refined, ranked), *sets], key=lambda e: -e.score)
            if sets[0] is start:
                break
        return sets

    def instead(self, explanation: Explanation, family: int, others: Sequence[int]) -> dict[int, Explanation]:
        """The set with a known family exchanged for each of some others."""
        rest = self.without(explanation, {family})
        return {f: self._refined(e) for f, e in self._each_more(rest, others).items()} if others else {}

    def grown(self, explanation: Explanation, families: Sequence[int]) -> Explanation:
        """The set with some families more, one after the other, then chosen again beside each other."""
        for f in families:
            explanation = self._each_more(explanation, [f])[f]
        return self._refined(explanation) if families else explanation

    def families_of(self, kind: str) -> list[int]:
        """Families of a kind that have blocks."""
        return [f for f in self.blocks.rows if self.families[f].kind == kind]

    def without(self, explanation: Explanation, families: set[int]) -> Explanation:
        """The set without some families, at the one noise."""
        members = tuple(m for m in explanation.members if m.family not in families)
        prior = sum(self._odds(members[:i], m.family) for i, m in enumerate(members))
        return Explanation(members, prior, self._held(members).log_evidence)

    def _odds(self, members: Sequence[Member], f: int) -> float:
        """Of a family beside members: a second one of a known family, or unknown, is a mixture of forms."""
        if any(m.family == f for m in members):
            return self.priors.log_odds(self.priors.mixed_forms)
        kinds = {self.families[m.family].kind for m in members}
        if self.families[f].kind == "unknown" and "unknown" in kinds:
            return self.priors.log_odds(self.priors.mixed_forms / len(self.families_of("unknown")))
        return float(self.log_odds[f])

    def _may_join(self, explanation: Explanation, f: int) -> bool:
        if f not in explanation.key:
            return True
        known = self.families[f].kind == "known" and self._forms(f) > 1
        return known and explanation.key.count(f) < 2

    def _forms(self, f: int) -> int:
        """How many nodes a family has."""
        return self.blocks.rows[f].stop - self.blocks.rows[f].start

    def _each_more(self, explanation: Explanation, joining: Sequence[int]) -> dict[int, Explanation]:
        """The set with each of some families more."""
        held = self._held(explanation.members)
        across, fits = self._beside(held)
        if len(joining) > 1:
            every = self.blocks.gains(across, fits)
            gains = {f: every[:, self.blocks.rows[f]] for f in joining}
        else:
            gains = {f: self.blocks.gains_of(f, across, fits) for f in joining}
        return {f: self._grown(explanation, held, f, gains[f]) for f in joining}

    def _grown(self, rest: Explanation, held: _Held, f: int, gains: FloatArray) -> Explanation:
        member, averaged, spread = self._averaged(f, gains)
        return Explanation(
            (*rest.members, member),
            rest.log_prior + self._odds(rest.members, f),
            held.log_evidence + averaged + rest.spread,
            rest.spread + spread,
        )

    def _averaged(self, f: int, gains: FloatArray) -> tuple[Member, float, float]:
        """The node and size that stand for a family, its gain averaged over all, and how much that adds.

        To the gain without a sign: members beside which others are met are held without one.
        """
        rows = self.blocks.rows[f]
        table = gains.sum(axis=0) + self.blocks.prior[rows]
        row, column = divmod(int(np.argmax(table)), table.shape[1])
        averaged = log_sum_exp(table)
        at = rows.start + row
        member = Member(f, self.blocks.nodes[at], float(self.blocks.lengths[at, column]))
        return member, averaged, averaged - float(gains[0, row, column])

    def _refined(self, explanation: Explanation) -> Explanation:
        """Each member's node and size chosen again beside the others, and averaged over there."""
        members = list(explanation.members)
        spreads = [0.0] * len(members)
        total = explanation.log_evidence
        for i, member in enumerate(members):
            held = self._held([m for j, m in enumerate(members) if j != i])
            span = self.blocks.spans[member.family]
            gains = self.blocks.gains_of(member.family, *self._beside(held, span), first=span.start)
            members[i], averaged, spreads[i] = self._averaged(member.family, gains)
            total = held.log_evidence + averaged - spreads[i]
        return replace(
            explanation, members=tuple(members), log_evidence=total + sum(spreads), spread=sum(spreads)
        )

    def _row(self, node: int) -> FloatArray:
        """Inner products of a node's columns with all columns beside the constants, shape (k, columns)."""
        if node not in self.cached_rows:
            own = self.field.block(node).T @ self.field.white
            self.cached_rows[node] = own - self._across[:, self.field.at[node]].T @ self._across
        return self.cached_rows[node]

    def _held(self, members: Sequence[Member]) -> _Held:
        """The data beside constants and members, by inner products alone."""
        spans = [self.field.at[m.node] for m in members]
        at = np.concatenate([np.arange(s.start, s.stop) for s in spans] or [np.arange(0)])
        size = np.concatenate(
            [np.full(s.stop - s.start, m.size) for s, m in zip(spans, members)] or [np.empty(0)]
        )
        rows = [self._row(m.node) for m in members]
        gram = np.concatenate([row[:, at] for row in rows] or [np.empty((0, 0))]) * np.outer(size, size)
        factor = prior_factor(gram)
        along = solve_triangular(factor, size * self._fits[at], lower=True) if members else np.empty(0)
        gained = 0.5 * float(along @ along) - float(np.log(np.diagonal(factor)).sum())
        return _Held(rows, size, factor, along, self.field.base.log_evidence + gained)

    def _beside(self, held: _Held, span: slice = slice(None)) -> tuple[FloatArray, FloatArray]:
        """Of columns: inner products with what is held beyond the constants, and with the data beside it."""
        if not held.rows:
            return np.empty((0, len(self._fits[span]))), self._fits[span]
        rows = np.concatenate([row[:, span] for row in held.rows])
        across = solve_triangular(held.factor, held.size[:, None] * rows, lower=True, check_finite=False)
        return across, self._fits[span] - across.T @ held.along

    def prior_probability(self, ids: Sequence[str]) -> float:
        """That one of these candidates acts, before the data."""
        odds = [x for f, x in zip(self.families, self.log_odds) if f.kind == "known" and f.id in ids]
        return min(float(np.sum(1.0 / (1.0 + np.exp(-np.array(odds))))), 0.5)

    def _log_odds(self) -> FloatArray:
        priors = self.priors
        mass = {"known": priors.expected_causes, "unknown": priors.unknown, "plant": priors.other_plant}
        each = {kind: m / max(sum(f.kind == kind for f in self.families), 1) for kind, m in mass.items()}
        # What is left out is as likely as any candidate.
        each["left_out"] = each["known"]
        return np.array([priors.log_odds(min(each[f.kind], 0.5)) for f in self.families])
