"""One answer held against the truth of its case.

An item of ``which`` is *right* where its class holds an effect that is truly missing and may be
named; or a relative of one that was left out; or ``hidden_thermal_node`` where the twin's thermal
structure is what is wrong. A case that failed is a wrong answer in every figure that it enters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fogml.blind.scoring.answers import Answer, Gap, Listed
from fogml.blind.scoring.statistics import overlap
from fogml.blind.truth import Truth
from fogml.intervals import Z90

Relative = Callable[[str], bool]
"""Whether an effect's best-fitted signature can't be told from an unknown one's contribution."""
LEAST_CLOSED = 0.05
"""Where the true effects close less, what an answer closes over that says nothing."""
_RIGHT_VERDICTS = ("no_gap", "unknown")


@dataclass(frozen=True)
class Judged:
    """An item of ``which``: what it names, how certain, whether named, whether right."""

    effect: str
    members: tuple[str, ...]
    probability: float
    named: bool
    right: bool


@dataclass(frozen=True)
class Mark:
    """What one case adds to the figures.

    Attributes
    ----------
    truth
        Its truth.
    failure
        Why it failed; empty where it did not.
    verdict
        As answered; ``failed`` where it failed.
    items
        What was listed.
    unknown
        Probability of the unknown as answered; where the case failed, the wrong end.
    exact
        Whether each true effect is in a named class and nothing else is named.
    top, top_strict
        Whether the first item's class, or its effect, is a true one.
    kept
        Whether every effect that may be named is in a named class.
    overlap
        Length that found and true segments share over what either covers; None without true ones.
    closed_ratios
        ``closed`` over what the true effects close, per held-out run.
    closed_covered, amplitude_covered
        Whether each 90 % interval holds the true value.
    seconds, samples
        Time taken [s], and samples read.
    relatives
        Relatives of what was left out that it lists.
    code
        State of the code that answered.
    suspected
        What is more likely than not, and not named.
    """

    truth: Truth
    failure: str
    verdict: str
    items: tuple[Judged, ...]
    unknown: float
    exact: bool
    top: bool
    top_strict: bool
    kept: bool
    overlap: float | None = None
    closed_ratios: tuple[float, ...] = ()
    closed_covered: tuple[bool, ...] = ()
    amplitude_covered: tuple[bool, ...] = ()
    seconds: float | None = None
    samples: int | None = None
    relatives: tuple[str, ...] = ()
    code: str | None = None
    suspected: tuple[Judged, ...] = ()

    @property
    def named(self) -> tuple[Judged, ...]:
        """Items certain enough to count."""
        return tuple(item for item in self.items if item.named)

    @property
    def wrong_name(self) -> bool:
        """Whether something is named that is not right; a failed case counts as one."""
        return bool(self.failure) or any(not item.right for item in self.named)

    @property
    def d_prime(self) -> float:
        """d' of the weakest missing effect, which decides; 0 without one."""
        return min((effect.d_prime for effect in self.truth.effects), default=0.0)

    @property
    def right_for_wrong_thermal(self) -> bool:
        """Whether the answer is one of the right ones where the thermal structure is wrong."""
        if self.failure or self.wrong_name:
            return False
        return self.verdict in _RIGHT_VERDICTS or bool(self.named)


def mark(truth: Truth, answer: Answer, relative: Relative | None = None) -> Mark:
    """Hold an answer against the truth.

    Parameters
    ----------
    truth, answer
        Of one case.
    relative
        Asked of names that would be wrong, where a library effect was left out.
    """
    gap = answer.gap
    if gap is None:
        wrong_end = 0.0 if truth.unknown else 1.0
        return Mark(
            truth, answer.failure, "failed", (), wrong_end, False, False, False, False,
            overlap=0.0 if truth.segments else None,
            closed_ratios=_closed_ratios(truth, None),
            seconds=answer.seconds,
            code=answer.code,
        )  # fmt: skip
    asked = relative if any(effect.id is not None for effect in truth.unknown) else None
    relatives: list[str] = []

    def judged(item: Listed) -> Judged:
        right = bool(truth.right_names & set(item.members))
        if not right and asked is not None:
            near = [id for id in item.members if asked(id)]
            relatives.extend(near)
            right = bool(near)
        return Judged(item.effect, item.members, item.probability, item.named, right)

    items = tuple(judged(item) for item in gap.which)
    standing = _standing(truth, items)
    return Mark(
        truth=truth,
        failure="",
        verdict=gap.verdict,
        items=items,
        suspected=tuple(judged(item) for item in gap.suspected),
        unknown=gap.unknown.probability,
        **standing,
        overlap=_overlap(truth, gap),
        closed_ratios=_closed_ratios(truth, gap),
        closed_covered=_closed_covered(truth, gap) if standing["exact"] and not truth.unknown else (),
        amplitude_covered=_amplitude_covered(truth, gap.which),
        seconds=answer.seconds,
        samples=answer.samples,
        relatives=tuple(relatives),
        code=answer.code,
    )


def _standing(truth: Truth, items: tuple[Judged, ...]) -> dict[str, bool]:
    """How a list of items stands to the truth, by attributes of `Mark`."""
    known = {effect.id for effect in truth.known if effect.id}
    named = [item for item in items if item.named]
    kept = known <= {id for item in named for id in item.members}
    first = items[0] if items else None
    return {
        "exact": bool(known) and kept and all(item.right for item in named),
        "top": first is not None and bool(known & set(first.members)),
        "top_strict": first is not None and first.effect in known,
        "kept": kept,
    }


def _overlap(truth: Truth, gap: Gap) -> float | None:
    """Shared over covered length, over all fit runs; None where the truth has no segments."""
    if not truth.segments:
        return None
    shared = covered = 0.0
    for run in truth.runs.fit:
        found = [(part.from_s, part.to_s) for part in gap.where.segments or () if part.run == run]
        true = [(part.from_s, part.to_s) for part in truth.segments if part.run == run]
        both, either = overlap(found, true)
        shared, covered = shared + both, covered + either
    return shared / covered if covered else 0.0


def _closed_ratios(truth: Truth, gap: Gap | None) -> tuple[float, ...]:
    """What was closed over what the true effects close; 0 where the answer closes nothing."""
    answered = {part.run: part for part in gap.how_far} if gap else {}
    ratios = []
    for true in truth.closed:
        if true.closed is None or true.closed < LEAST_CLOSED:
            continue
        part = answered.get(true.run)
        ratios.append((part.closed or 0.0) / true.closed if part else 0.0)
    return tuple(ratios)


def _closed_covered(truth: Truth, gap: Gap) -> tuple[bool, ...]:
    true = {part.run: part.closed for part in truth.closed if part.closed is not None}
    covered = []
    for part in gap.how_far:
        low, high = part.closed_ci90 or (None, None)
        if part.run in true and low is not None and high is not None:
            covered.append(bool(low <= true[part.run] <= high))
    return tuple(covered)


def _amplitude_covered(truth: Truth, which: tuple[Listed, ...]) -> tuple[bool, ...]:
    """For named effects that are true themselves, where units and forms compare."""
    true = {effect.id: effect.amplitude for effect in truth.known}
    # (A, phase) and (-A, phase + 180 deg) are the same effect, whether or not the truth states the phase.
    turning = {e.id for e in truth.known if {"phase", "direction", "wander"} & set(e.shape)}
    covered = []
    for item in which:
        fitted, value = item.amplitude, true.get(item.effect)
        if not item.named or fitted is None or value is None or fitted.se is None:
            continue
        if fitted.unit == value.unit and np.isfinite(fitted.se):
            sign = -1.0 if item.effect in turning and fitted.value * value.value < 0.0 else 1.0
            covered.append(abs(sign * fitted.value - value.value) <= Z90 * fitted.se)
    return tuple(covered)
