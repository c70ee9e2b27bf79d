"""Which sets of effects explain the runs, with the unknown competing in every set.

Beside a set there may be nothing more, an unknown, or a small rest in the direction of an unknown that
is no more than what the effects' true forms differ from the catalogue's by.

Sets grow from the best ones by one effect at a time, up to four. In each set every effect's shape and
size are averaged over their priors with the others at their best, and best ones are found in turns.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fogml.gap.evidence import Conditioned, Field, Term, by_candidate, log_sum_exp
from fogml.gap.explanation import Chosen, Explanation, Rest
from fogml.gap.forms import Forms
from fogml.gap.priors import LENGTH_WEIGHTS, LENGTHS
from fogml.gap.terms import Terms
from fogml.gap.unlike import Unlike
from fogml.runs.run import FloatArray

MOST_EFFECTS = 4
SIZES = (0.4, 0.4, 0.15, 0.04, 0.01)
"""Prior probability of 0, 1, ... effects; all effects are equally likely."""
UNKNOWN = 0.25
"""Prior probability that something unknown acts besides."""
SECOND = 0.2
"""Prior probability that a second group is needed where an unknown acts."""
EXACT = 0.5
"""Prior probability that effects of a set have the catalogue's forms, to what the runs can show."""
FORM, FORM_ROOM = 0.3, 0.25
"""Prior probability of a rest of form where it can be seen, and its largest length over the effects'."""
BEAM = (5, 4, 3)
"""Sets that grow further, by their size."""
HOPELESS = 25.0
"""Sets that are so many nats behind the best one of their size don't grow."""
BEHIND = (4.0, 5.0, 6.0)
"""Sets of one effect, of two, and of more, don't grow where all are so many nats behind a smaller one."""
BRANCHES = 4
SIZES_PER_OCTAVE = 2
MATTERS = 8.0
"""Groups that are so many nats behind the best one, or gain less, are not compared with candidates."""


@dataclass
class Search:
    """The search over one field.

    Parameters
    ----------
    field_
        Inner products of everything.
    without
        Ids of candidates that are in no set.
    """

    field_: Field
    without: frozenset[str] = frozenset()
    _held: dict[tuple[frozenset[str], Rest], Explanation] = field(default_factory=dict)

    @cached_property
    def places(self) -> dict[str, np.ndarray]:
        """Nodes of each candidate."""
        held = by_candidate(self.field_.basis.nodes)
        return {id: nodes for id, nodes in held.items() if id not in self.without}

    @cached_property
    def _empty(self) -> float:
        return self.field_.condition([]).log_evidence

    @cached_property
    def parts(self) -> Terms:
        """What an explanation's parts are made of."""
        return Terms(self.field_)

    @cached_property
    def _unlike(self) -> Unlike:
        return Unlike(self.field_, self.without)

    @cached_property
    def _forms(self) -> Forms:
        return Forms(self.field_)

    def run(self) -> list[Explanation]:
        """Every explanation that was tried, the most probable first."""
        front = [self._best_of(())]
        for size in range(MOST_EFFECTS):
            grown: dict[frozenset[str], Explanation] = {}
            for found in front:
                for explained in self._grow(found):
                    grown[explained.ids] = explained
            if not grown:
                break
            ranked = sorted(grown.values(), key=lambda e: -e.log_posterior)
            top = ranked[0].log_posterior
            if top < self.best.log_posterior - BEHIND[min(size, len(BEHIND) - 1)]:
                break
            front = [e for e in ranked[: BEAM[min(size, len(BEAM) - 1)]] if e.log_posterior > top - HOPELESS]
        return sorted(self.tried, key=lambda e: -e.log_posterior)

    @property
    def tried(self) -> tuple[Explanation, ...]:
        """Every explanation so far."""
        return tuple(self._held.values())

    @property
    def best(self) -> Explanation:
        """The most probable explanation so far."""
        return max(self.tried, key=lambda e: e.log_posterior)

    def _best_of(self, effects: Sequence[Chosen]) -> Explanation:
        """The most probable explanation by a set, whatever acts beside it."""
        plain = self.explanation(effects)
        tried = [plain, self.explanation(effects, "unknown")]
        if _form_room(plain.effects) >= LENGTHS[0]:
            tried.append(self.explanation(effects, "form"))
        return max(tried, key=lambda e: e.log_posterior)

    def _grow(self, found: Explanation) -> Iterable[Explanation]:
        """Sets of one effect more: the best beside the set, and beside the set and the unknown."""
        more: dict[str, Chosen] = {}
        for held in (self._held[(found.ids, "nothing")], self._held[(found.ids, "unknown")]):
            conditioned = self.field_.condition(self.terms(held))
            gains = conditioned.node_gains()
            scores = {
                id: log_sum_exp(gains[nodes]) for id, nodes in self.places.items() if id not in found.ids
            }
            for id in sorted(scores, key=scores.__getitem__, reverse=True)[:BRANCHES]:
                more.setdefault(id, self.best_node(id, conditioned))
        for chosen in more.values():
            yield self._best_of((*found.effects, chosen))

    def explanation(self, effects: Sequence[Chosen], rest: Rest = "nothing") -> Explanation:
        """The explanation of a set and a rest, shapes found in turns from those given."""
        key = (frozenset(c.candidate for c in effects), rest)
        if key not in self._held:
            self._held[key] = self._explained(list(effects), rest)
        return self._held[key]

    def _explained(self, effects: list[Chosen], rest: Rest) -> Explanation:
        group = self._best_group(effects, rest)[0]
        rounds = 1 if len(effects) < 2 and rest == "nothing" else 2
        averaged = averaged_rest = 0.0
        for turn in range(rounds):
            averaged = 0.0
            for i, chosen in enumerate(effects):
                others = effects[:i] + effects[i + 1 :]
                held = self.field_.condition(self.parts.of(others, group))
                effects[i] = self.best_node(chosen.candidate, held)
                own = held.node_gains(self.places[chosen.candidate])[self.places[chosen.candidate]]
                averaged += log_sum_exp(own) - float(own.max()) + self._weight(effects[i], held)
            group, averaged_rest = self._best_group(effects, rest, last=turn == rounds - 1)
        likely, exact = self._of_either_form(effects, group)
        if rest == "unknown" and group is not None:
            averaged_rest += self._second(self.parts.of(effects, group, exact=exact))
        evidence = likely - self._empty + averaged + averaged_rest
        prior = self._log_prior(effects, rest)
        return Explanation(tuple(effects), rest, group, evidence, evidence + prior, exact)

    def _of_either_form(
        self, effects: Sequence[Chosen], group: tuple[str, float] | None
    ) -> tuple[float, bool]:
        """Evidence with room for other forms and without, averaged, and whether it is more without."""
        loose, bare = (self.parts.of(effects, group, exact=exact) for exact in (False, True))
        with_room = self.field_.condition(loose).log_evidence
        if len(bare) == len(loose):
            return with_room, False
        with_room += math.log1p(-EXACT)
        without = self.field_.condition(bare).log_evidence + math.log(EXACT)
        return float(np.logaddexp(without, with_room)), without > with_room

    def _log_prior(self, effects: Sequence[Chosen], rest: Rest) -> float:
        count, size = len(self.places), len(effects)
        prior = math.log(SIZES[size]) - math.log(math.comb(max(count, size), size))
        if rest == "unknown":
            return prior + math.log(UNKNOWN)
        prior += math.log(1.0 - UNKNOWN)
        if _form_room(effects) >= LENGTHS[0]:
            prior += math.log(FORM if rest == "form" else 1.0 - FORM)
        return prior

    def best_node(self, id: str, held: Conditioned) -> Chosen:
        """An effect at the node and the length that it gains the most with beside a conditioned field."""
        nodes = self.places[id]
        gains = held.node_gains(nodes)[nodes]
        row, column = np.unravel_index(int(np.argmax(gains)), gains.shape)
        node, length = int(nodes[row]), float(LENGTHS[column])
        size = held.response_size(node, length)
        # Sizes that are nearly alike share what is integrated out for one of them.
        size = 2.0 ** (round(SIZES_PER_OCTAVE * math.log2(max(size, 1.0))) / SIZES_PER_OCTAVE)
        return Chosen(id, node, length, min(size, length))

    def _weight(self, chosen: Chosen, held: Conditioned) -> float:
        """Logarithm of the prior weight of a node and a length, what its sign gains included."""
        node = self.field_.basis.nodes[chosen.node]
        place = int(np.flatnonzero(chosen.length == LENGTHS)[0])
        return float(node.log_weights[place] + held.sign_gains[chosen.node, place])

    def _best_group(
        self, effects: Sequence[Chosen], rest: Rest, *, last: bool = False
    ) -> tuple[tuple[str, float] | None, float]:
        """The best group for a rest beside a set and its length, and what averaging adds to its evidence."""
        names = list(self.field_.basis.groups)
        small = _form_room(effects) >= LENGTHS
        fit = small if rest == "form" else ~small
        if rest == "nothing" or not names or not fit.any():
            return None, 0.0
        gains, weights = self._weighed(self.parts.of(effects, None), fit, rest == "unknown" and last)
        if rest == "form":
            weights += self._forms.log_weights([(c.node, _form_room([c])) for c in effects])[:, fit]
        gains = gains + weights
        row, column = np.unravel_index(int(np.argmax(gains)), gains.shape)
        averaged = log_sum_exp(gains) - float(gains.max() - weights[row, column])
        return (names[row], float(LENGTHS[fit][column])), averaged

    def _second(self, terms: Sequence[Term]) -> float:
        """What a second group for the unknown adds to the evidence, averaged over there being none."""
        gains, weights = self._weighed(terms, np.ones(len(LENGTHS), dtype=np.bool_), True)
        return float(np.logaddexp(math.log1p(-SECOND), math.log(SECOND) + log_sum_exp(gains + weights)))

    def _weighed(self, terms: Sequence[Term], fit: np.ndarray, unlike: bool) -> tuple[np.ndarray, np.ndarray]:
        """Gains of the groups beside terms at the lengths that fit, and the logarithms of their weights.

        Weights are prior probabilities, less what signals that are a candidate's take away if `unlike`.
        """
        basis = self.field_.basis
        gains = self.field_.condition(terms).group_gains[:, fit]
        prices = np.array([basis.kinds[name].price for name in basis.groups])
        weights = np.log(LENGTH_WEIGHTS[fit] / LENGTH_WEIGHTS[fit].sum()) - prices[:, None]
        weights -= math.log(len(basis.groups))
        if unlike:
            weights += self._unlike_shares(terms, gains, weights, LENGTHS[fit])[:, None]
        return gains, weights

    def _unlike_shares(
        self, terms: Sequence[Term], gains: np.ndarray, weights: np.ndarray, lengths: np.ndarray
    ) -> np.ndarray:
        """What each group's probability loses for signals that are a candidate's, shape (groups,)."""
        names = list(self.field_.basis.groups)
        shares = np.zeros(len(names))
        weighed = gains + weights
        near = weighed.max(axis=1) > weighed.max() - MATTERS
        for i in np.flatnonzero(near & (gains.max(axis=1) > MATTERS)).tolist():
            group = (names[i], float(lengths[int(np.argmax(weighed[i]))]))
            held = self.field_.condition([*terms, self.parts.of_group(*group)])
            shares[i] = self._unlike.log_share(held, *group)
        return shares

    def form_share(self, found: Explanation) -> float:
        """Share of what the effects of an explanation gain that needs other forms than the catalogue's."""
        bare = self.parts.of(found.effects, None, exact=True)
        group = found.group if found.rest == "form" else None
        whole = self.parts.of(found.effects, group, exact=found.exact)
        gain = self.field_.condition(whole).log_evidence - self._empty
        return 1.0 - (self.field_.condition(bare).log_evidence - self._empty) / max(gain, 1e-9)

    def terms(self, found: Explanation) -> list[Term]:
        """An explanation's terms."""
        return self.parts.of(found.effects, found.group, exact=found.exact)

    def beside(self, found: Explanation, id: str) -> list[Term]:
        """The terms of an explanation without one of its effects."""
        others = [c for c in found.effects if c.candidate != id]
        return self.parts.of(others, found.group, exact=found.exact)

    def estimates(self, found: Explanation) -> dict[str, FloatArray]:
        """What each effect of an explanation, and its group, most probably makes, whitened, shape (n,)."""
        return {
            name: self.field_.columns(at) @ mean for name, (at, mean) in self._coefficients(found).items()
        }

    def lengths(self, found: Explanation) -> dict[str, float]:
        """Whitened length of what each effect of an explanation, and its group, most probably makes.

        Beside the constants.
        """
        gram, parts = self.field_.gram, self._coefficients(found)
        squares = {name: float(c @ gram[np.ix_(at, at)] @ c) for name, (at, c) in parts.items()}
        return {name: math.sqrt(max(square, 0.0)) for name, square in squares.items()}

    def _coefficients(self, found: Explanation) -> dict[str, tuple[list[int], FloatArray]]:
        """Columns of an explanation's effects and of its group, with their most probable coefficients."""
        parts = {c.candidate: self.parts.of([c], None, exact=found.exact) for c in found.effects}
        if found.group is not None:
            parts[found.group[0]] = [self.parts.of_group(*found.group)]
        if not parts:
            return {}
        mean, _ = self.field_.condition([t for terms in parts.values() for t in terms]).coefficients()
        held, first = {}, 0
        for name, terms in parts.items():
            places = [place for t in terms for place in t.columns]
            held[name] = (places, mean[first : first + len(places)])
            first += len(places)
        return held


def _form_room(effects: Sequence[Chosen]) -> float:
    """Largest whitened length of a rest that is no more than a matter of form."""
    return FORM_ROOM * max((c.size for c in effects), default=0.0)
