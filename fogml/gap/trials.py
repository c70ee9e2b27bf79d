"""Noise and explanation together: the search under several fits of the noise, and which of them stands.

What moves slowly may be noise or something that acts. The noise is fitted to the runs, tried as it was
known before, and fitted again beside what a search found. The trial stands in which noise and explanation
are the most probable together; what the others hold for likely counts in its probabilities.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fogml.gap.basis import Basis, build_basis
from fogml.gap.classes import Ranking, rank
from fogml.gap.events import event_groups
from fogml.gap.evidence import Field
from fogml.gap.explanation import Explanation
from fogml.gap.found import fit_named
from fogml.gap.frame import Frame
from fogml.gap.model import Candidate, drawn_per_run
from fogml.gap.near_library import near_library
from fogml.gap.noise import Noise, tension
from fogml.gap.preparing import Prepared, Progress, with_noise_beside
from fogml.gap.quieter import log_joint, louder, quieter
from fogml.gap.search import Search
from fogml.runs.run import FloatArray

AVERAGING_TIMES_S = (10.0, 100.0, 3000.0)
NOISE_MATTERS = 0.1
"""Change of an Allan variance's logarithm from which a search is done again."""
MOST_DRAWS = 4
MOST_LINEARISED, BETTER = 2, 2.0
"""How often effects on inputs are linearised again, and by how much that has to be better [nats]."""
REACH = 100.0
"""How far behind a trial with known noise may be so that its noise is fitted again beside it [nats]."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A search under one fit of the noise."""

    prepared: Prepared
    basis: Basis
    search: Search
    explanations: Sequence[Explanation]
    ranking: Ranking

    @cached_property
    def log_joint(self) -> float:
        """Of the runs, the best explanation and the noise together."""
        return log_joint(self.prepared, self.search, self.ranking)

    @cached_property
    def absolute(self) -> list[Explanation]:
        """The explanations on a scale that all trials share."""
        return _moved(self.explanations, self._log_runs)

    def beside(self, others: Sequence[Explanation]) -> Trial:
        """The same with probabilities that count what other trials hold for likely, on the shared scale."""
        if not others:
            return self
        rivals = _moved(others, -self._log_runs)
        return replace(self, ranking=_ranked(self.prepared, self.search, self.explanations, rivals))

    def without(self, ids: frozenset[str]) -> Ranking:
        """What the same evidence says where some candidates are none."""
        search = Search(self.search.field_, ids)
        return _ranked(self.prepared, search, search.run())

    @property
    def _log_runs(self) -> float:
        return self.log_joint - self.ranking.best.log_posterior


def _moved(explanations: Sequence[Explanation], nats: float) -> list[Explanation]:
    return [replace(e, log_posterior=e.log_posterior + nats) for e in explanations]


def best_trial(p: Prepared, candidates: Mapping[str, Candidate], tell: Progress) -> Trial:
    """The trial that stands, with the probabilities of all.

    Parameters
    ----------
    p
        The runs with the noise fitted to them.
    candidates
        What may be named.
    tell
        Told what is being done.
    """
    # Of those that don't stand the explanations alone are kept: a basis is large.
    others: list[Explanation] = []
    running = _trials(p, candidates, tell)
    best = next(running)
    for trial in running:
        best, worse = (trial, best) if trial.log_joint > best.log_joint else (best, trial)
        others += worse.absolute
    return best.beside(others)


def _trials(p: Prepared, candidates: Mapping[str, Candidate], tell: Progress) -> Iterator[Trial]:
    """A search under each noise to start from, and with the noise fitted beside what it found."""
    top = -math.inf
    for start, words, alone in (
        (p, "the noise of the runs", False),
        (quieter(p), "the noise as it is known", False),
        (louder(p), "whatever moves slowly taken for noise", True),
    ):
        if start is None or (alone and not _differ(p.noise, start.noise)):
            continue
        tell(f"searching with {words}")
        trial = _trial(start, candidates, start.recalibrated.constants, tell)
        top = max(top, trial.log_joint)
        yield trial
        if trial.log_joint > top - REACH:
            for again in _again(trial, candidates, tell, alone=alone):
                top = max(top, again.log_joint)
                yield again


def _trial(
    p: Prepared,
    candidates: Mapping[str, Candidate],
    values: Mapping[str, float],
    tell: Progress,
    beside: Sequence[FloatArray] | None = None,
) -> Trial:
    """Everything whitened and searched, constants linearised at their values.

    Candidates are screened `beside` columns of each run as well.
    """
    frame = Frame(p.fit, p.whiteners, p.model.constants, values)
    near = near_library(p.fit, candidates, values, p.model.grade)
    basis = build_basis(
        frame,
        candidates,
        (*p.groups, *near, *event_groups(frame)),
        p.model.grade,
        lambda id: tell(f"whitening candidates: {id}"),
        beside,
    )
    tell("searching sets of effects")
    search = Search(Field(basis))
    explanations = search.run()
    return Trial(p, basis, search, explanations, _ranked(p, search, explanations))


def _ranked(
    p: Prepared, search: Search, explanations: Sequence[Explanation], rivals: Sequence[Explanation] = ()
) -> Ranking:
    return rank(search, explanations, tension(p.noise, p.noise_prior), rivals)


def _again(
    trial: Trial, candidates: Mapping[str, Candidate], tell: Progress, *, alone: bool = False
) -> Iterator[Trial]:
    """The search with the noise fitted beside what a trial found; none where that changes nothing.

    What was taken for noise may have been the effect, and the constants may have made up for it. Where
    something is left beside an effect, candidates were screened beside nothing, too.
    """
    p, best = trial.prepared, trial.ranking.best
    if not best.effects and best.unknown is None:
        return
    tell("fitting the noise beside what was found")
    values = p.recalibrated.constants
    if best.effects:
        values = fit_named(p, candidates, trial.search, trial.ranking).constants
    effects = _of_effects(trial, candidates)
    again = with_noise_beside(p, _with_unknown(trial, effects), alone=alone)
    on_inputs = not alone and _act_on_inputs(candidates, trial.ranking)
    left = not alone and bool(best.effects) and best.unknown is not None
    if not (_differ(p.noise, again.noise) or on_inputs or left):
        return
    for _ in range(MOST_LINEARISED):
        before, trial = trial.log_joint, _trial(again, candidates, values, tell, effects)
        yield trial
        if not (on_inputs and trial.ranking.named and trial.log_joint > before + BETTER):
            return
        # The constants may not have come all the way: those that coarse sensors hide do so by and by.
        values = fit_named(again, candidates, trial.search, trial.ranking).constants


def _of_effects(trial: Trial, candidates: Mapping[str, Candidate]) -> list[FloatArray]:
    """For each run columns of what the effects of the best explanation can do, shape (m, k)."""
    p, basis, best = trial.prepared, trial.basis, trial.ranking.best
    blocks = []
    for r, o in enumerate(p.fit):
        columns = [np.zeros((len(o), 0))]
        for c in best.effects:
            shapes = basis.nodes[c.node].node.draws[:MOST_DRAWS]
            own = np.column_stack([o.response(c.candidate, s, basis.frame.values) for s in shapes])
            # One that each run draws anew has columns of its own on each.
            apart = drawn_per_run(candidates[c.candidate])
            columns += [own * (i == r) for i in range(len(p.fit))] if apart else [own]
        blocks.append(np.concatenate(columns, axis=1))
    return blocks


def _with_unknown(trial: Trial, blocks: Sequence[FloatArray]) -> list[FloatArray]:
    """Columns of each run with those of the best explanation's unknown."""
    unknown = trial.ranking.best.unknown
    if unknown is None:
        return list(blocks)
    own = trial.basis.kinds[unknown[0]].columns
    return [np.concatenate([block, more], axis=1) for block, more in zip(blocks, own)]


def _differ(first: Noise, second: Noise) -> bool:
    """Whether the noise differs by more than matters, about the averaging time of the figures."""
    taus = np.array(AVERAGING_TIMES_S)
    ratio = second.model.allan_variance(taus) / first.model.allan_variance(taus)
    return bool(np.any(np.abs(np.log(ratio)) > NOISE_MATTERS))


def _act_on_inputs(candidates: Mapping[str, Candidate], ranking: Ranking) -> bool:
    """Whether a member of a class that was found depends on where the constants are."""
    stages = {candidates[m].stage for r in ranking.effects for m in r.members}
    return bool(stages & {"sensor", "logger", "loop", "readout"})
