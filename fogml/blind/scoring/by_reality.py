"""The first table of a score: what is wanted, by reality; and how single effects fare by distance of form.

A cause in a form far from the catalogue's that is called by its name is right; that it is called unknown is a
miss. What is named has a probability of one half or more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from fogml.blind.scoring.marks import Mark
from fogml.blind.scoring.statistics import Estimate, calibration_error, mean, proportion
from fogml.blind.scoring.table import (
    Figure,
    calibration,
    case_ratio,
    false_names,
    pooled,
    row,
    seconds,
    share,
)
from fogml.blind.truth import FORM_DISTANCES, KINDS

ALL = "all"
D_PRIMES = ((4.0, 8.0), (8.0, 12.0), (12.0, 20.0), (20.0, 60.0))
"""Windows of d' of the table by distance of form."""
_STRONG, _VERY_STRONG, _FAR = 10.0, 20.0, 0.9
_UNKNOWN = ("unknown_left_out", "unknown_invented")
_KNOWN = ("one", "two", "three")


def first_right(m: Mark) -> bool:
    """Whether the first effect that is named is one that is missing, by its class."""
    return bool(m.named) and m.named[0].right


def mass_on_true(m: Mark) -> float:
    """Probability on the true cause of a case with one, all that is listed scaled to 1 where it is more.

    As the DX 2025 competition measures a diagnosis: a class shares its probability evenly among its members.
    """
    if m.failure:
        return 0.0
    total = max(1.0, sum(item.probability for item in m.items) + m.unknown)
    if m.truth.unknown:
        return m.unknown / total
    true = m.truth.effects[0].id
    held = [item.probability / len(item.members) for item in m.items if true in item.members]
    return max(held, default=0.0) / total


def _between(low: float, high: float = np.inf) -> Callable[[Mark], bool]:
    return lambda m: low <= m.d_prime <= high


def _far(m: Mark) -> bool:
    cosine = m.truth.effects[0].cosine
    return cosine is not None and cosine < _FAR and m.d_prime > _VERY_STRONG


def each_kept(marks: Sequence[Mark]) -> Estimate:
    """The share of missing effects that may be named and are in a named class."""
    hits = []
    for m in marks:
        held = {id for item in m.named for id in item.members}
        hits += [effect.id in held for effect in m.truth.known]
    return proportion(hits)


def within_one(estimate: Estimate) -> Estimate:
    """A mean of probabilities, its interval cut at 0 and 1."""
    low, high = estimate.low, estimate.high
    return replace(
        estimate, low=None if low is None else max(low, 0.0), high=None if high is None else min(high, 1.0)
    )


WANTED = (
    Figure(
        "nothing_named", "nothing missing, something named",
        share(lambda m: bool(m.named) or bool(m.failure)), ("nothing",), high=0.02,
    ),
    Figure(
        "nothing_no_gap", "nothing missing: answered 'no gap'",
        share(lambda m: m.verdict == "no_gap"), ("nothing",),
    ),
    Figure(
        "one_strong_right", "one effect, d′ 20–60: first name's class right",
        share(first_right), ("one",), low=0.95, counts=_between(20.0, 60.0),
    ),
    Figure(
        "one_strong_exact", "one effect, d′ 20–60: exact",
        share(lambda m: m.exact), ("one",), low=0.90, counts=_between(20.0, 60.0),
    ),
    Figure(
        "one_weak_right", "one effect, d′ 8–12: first name's class right",
        share(first_right), ("one",), low=0.85, counts=_between(8.0, 12.0),
    ),
    Figure(
        "one_weak_exact", "one effect, d′ 8–12: exact",
        share(lambda m: m.exact), ("one",), low=0.80, counts=_between(8.0, 12.0),
    ),
    Figure(
        "one_far_right", "one effect, form under cosine 0.9, d′ > 20: first name's class right",
        share(first_right), ("one",), low=0.85, counts=_far,
    ),
    Figure(
        "pair_exact", "two effects, both d′ > 10: exact",
        share(lambda m: m.exact), ("two",), low=0.80, counts=_between(_STRONG),
    ),
    Figure("each_kept", "each of two or three effects kept", each_kept, ("two", "three")),
    Figure(
        "unknown_misnamed", "unknown, d′ > 10: a wrong name",
        share(lambda m: m.wrong_name), _UNKNOWN, high=0.08, counts=_between(_STRONG),
    ),
    Figure(
        "known_kept", "known beside an unknown: kept",
        share(lambda m: m.kept), ("unknown_and_known",), low=0.75,
    ),
    Figure(
        "beside_unknown_false", "known beside an unknown: a false name",
        share(lambda m: m.wrong_name), ("unknown_and_known",), high=0.10,
    ),
    Figure("false_names", "named effects that are false", pooled(false_names), KINDS, high=0.06),
    Figure(
        "mass_on_true", "mean probability on the true cause, one cause, d′ > 10 (as DX 2025)",
        lambda marks: within_one(mean([mass_on_true(m) for m in marks])), ("one", *_UNKNOWN),
        low=0.90, counts=_between(_STRONG), format="number",
    ),
    Figure(
        "closed_ratio", "closed over what the true signature closes (median)",
        case_ratio, _KNOWN, low=0.95, format="number",
    ),
    Figure(
        "calibration", "calibration error of what is listed",
        lambda marks: calibration_error(calibration(marks)), KINDS, high=0.03, format="number",
    ),
    Figure(
        "coverage", "coverage of 90 % intervals, of closed and of amplitudes",
        pooled(lambda m: (*m.closed_covered, *m.amplitude_covered)), (*_KNOWN, "unknown_and_known"),
        low=0.87, high=0.93,
    ),
    Figure(
        "wrong_thermal", "wrong thermal structure: a right answer",
        share(lambda m: m.right_for_wrong_thermal), ("wrong_thermal",),
    ),
    Figure("time", "time per case (median)", seconds, KINDS, format="seconds"),
    Figure("failed", "cases that failed", share(lambda m: bool(m.failure)), KINDS),
)  # fmt: skip
"""Every row of the table, in its order."""


def by_reality(marks: Sequence[Mark], even: Sequence[Mark] | None = None) -> dict[str, list[dict[str, Any]]]:
    """Rows of the table for all cases and for each reality by itself.

    Parameters
    ----------
    marks
        Of all cases.
    even
        Of those on which figures over several kinds of case rest, where some kinds have more cases than
        others; of all by default.
    """
    names = sorted({m.truth.reality for m in marks})
    together = marks if even is None else even
    of_one = [len(wanted.kinds) == 1 or wanted.kinds == _UNKNOWN for wanted in WANTED]

    def rows(of: Sequence[str]) -> list[dict[str, Any]]:
        alone, every = ([m for m in held if m.truth.reality in of] for held in (marks, together))
        return [row(wanted, alone if one else every) for wanted, one in zip(WANTED, of_one)]

    return {ALL: rows(names)} | {name: rows([name]) for name in names}


def by_form(marks: Sequence[Mark]) -> list[dict[str, Any]]:
    """Single effects by reality, distance of form and d': how often the first name's class is right.

    And how often the answer was exact, or that it is unknown, which is a miss.
    """
    found = []
    single = [m for m in marks if m.truth.kind == "one"]
    for reality in sorted({m.truth.reality for m in single}):
        own = [m for m in single if m.truth.reality == reality]
        for form in (*FORM_DISTANCES, None):
            for low, high in D_PRIMES:
                here = [
                    m for m in own if m.truth.effects[0].form_distance == form and low <= m.d_prime < high
                ]
                if here:
                    found.append(
                        {
                            "reality": reality,
                            "form": form,
                            "d_prime": [low, high],
                            "right": asdict(proportion([first_right(m) for m in here])),
                            "exact": asdict(proportion([m.exact for m in here])),
                            "unknown": asdict(proportion([m.verdict == "unknown" for m in here])),
                        }
                    )
    return found
