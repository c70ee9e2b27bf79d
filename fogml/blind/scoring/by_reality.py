"""The first table of a score: what is wanted, by reality; and how single effects fare by distance of form.

A cause in a form far from the catalogue's that is called by its name is right; that it is called unknown is a
miss. What is named has a probability of one half or more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from fogml.blind.scoring.marks import Mark
from fogml.blind.scoring.statistics import Estimate, calibration_error, mean, proportion
from fogml.blind.scoring.table import (
    calibration,
    case_ratio,
    false_names,
    pooled,
    row,
    seconds,
    share,
)
from fogml.blind.truth import FORM_DISTANCES

ALL = "all"
D_PRIMES = ((4.0, 8.0), (8.0, 12.0), (12.0, 20.0), (20.0, 60.0))
"""Windows of d' of the table by distance of form."""
_STRONG, _VERY_STRONG, _FAR = 10.0, 20.0, 0.9
_UNKNOWN = ("unknown_left_out", "unknown_invented")
_KNOWN = ("one", "two", "three")


@dataclass(frozen=True)
class Wanted:
    """A row.

    Attributes
    ----------
    key, words
        Name in ``score.json``; name on the page.
    counts
        Whether a case enters.
    measure
        The figure of those that do.
    low, high
        What is wanted: at least, at most.
    format
        How it reads.
    """

    key: str
    words: str
    counts: Callable[[Mark], bool]
    measure: Callable[[Sequence[Mark]], Estimate]
    low: float | None = None
    high: float | None = None
    format: str = "percent"


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


def _of(*kinds: str, low: float = 0.0, high: float = np.inf) -> Callable[[Mark], bool]:
    return lambda m: m.truth.kind in kinds and low <= m.d_prime <= high


def _far(m: Mark) -> bool:
    cosine = m.truth.effects[0].cosine if m.truth.kind == "one" else None
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


def _always(m: Mark) -> bool:
    return True


WANTED = (
    Wanted(
        "nothing_named", "nothing missing, something named", _of("nothing"),
        share(lambda m: bool(m.named) or bool(m.failure)), high=0.02,
    ),
    Wanted(
        "nothing_no_gap", "nothing missing: answered 'no gap'", _of("nothing"),
        share(lambda m: m.verdict == "no_gap"),
    ),
    Wanted(
        "one_strong_right", "one effect, d′ 20–60: first name's class right",
        _of("one", low=20.0, high=60.0), share(first_right), low=0.95,
    ),
    Wanted(
        "one_strong_exact", "one effect, d′ 20–60: exact",
        _of("one", low=20.0, high=60.0), share(lambda m: m.exact), low=0.90,
    ),
    Wanted(
        "one_weak_right", "one effect, d′ 8–12: first name's class right",
        _of("one", low=8.0, high=12.0), share(first_right), low=0.85,
    ),
    Wanted(
        "one_weak_exact", "one effect, d′ 8–12: exact",
        _of("one", low=8.0, high=12.0), share(lambda m: m.exact), low=0.80,
    ),
    Wanted(
        "one_far_right", "one effect, form under cosine 0.9, d′ > 20: first name's class right",
        _far, share(first_right), low=0.85,
    ),
    Wanted(
        "pair_exact", "two effects, both d′ > 10: exact",
        _of("two", low=_STRONG), share(lambda m: m.exact), low=0.80,
    ),
    Wanted("each_kept", "each of two or three effects kept", _of("two", "three"), each_kept),
    Wanted(
        "unknown_misnamed", "unknown, d′ > 10: a wrong name",
        _of(*_UNKNOWN, low=_STRONG), share(lambda m: m.wrong_name), high=0.08,
    ),
    Wanted(
        "known_kept", "known beside an unknown: kept",
        _of("unknown_and_known"), share(lambda m: m.kept), low=0.75,
    ),
    Wanted(
        "beside_unknown_false", "known beside an unknown: a false name",
        _of("unknown_and_known"), share(lambda m: m.wrong_name), high=0.10,
    ),
    Wanted("false_names", "named effects that are false", _always, pooled(false_names), high=0.06),
    Wanted(
        "mass_on_true", "mean probability on the true cause, one cause, d′ > 10 (as DX 2025)",
        _of("one", *_UNKNOWN, low=_STRONG), lambda marks: within_one(mean([mass_on_true(m) for m in marks])),
        low=0.90, format="number",
    ),
    Wanted(
        "closed_ratio", "closed over what the true signature closes (median)", _of(*_KNOWN),
        case_ratio, low=0.95, format="number",
    ),
    Wanted(
        "calibration", "calibration error of what is listed", _always,
        lambda marks: calibration_error(calibration(marks)), high=0.03, format="number",
    ),
    Wanted(
        "coverage", "coverage of 90 % intervals, of closed and of amplitudes",
        _of(*_KNOWN, "unknown_and_known"),
        pooled(lambda m: (*m.closed_covered, *m.amplitude_covered)), low=0.87, high=0.93,
    ),
    Wanted(
        "wrong_thermal", "wrong thermal structure: a right answer", _of("wrong_thermal"),
        share(lambda m: m.right_for_wrong_thermal),
    ),
    Wanted(
        "time", "time per case (median)", _always, seconds, format="seconds",
    ),
    Wanted("failed", "cases that failed", _always, share(lambda m: bool(m.failure))),
)  # fmt: skip
"""Every row of the table, in its order."""


def by_reality(marks: Sequence[Mark]) -> dict[str, list[dict[str, Any]]]:
    """Rows of the table for all cases and for each reality by itself."""
    names = sorted({m.truth.reality for m in marks})
    parts = {ALL: list(marks)} | {name: [m for m in marks if m.truth.reality == name] for name in names}
    return {name: [_row(wanted, part) for wanted in WANTED] for name, part in parts.items()}


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


def _row(wanted: Wanted, marks: Sequence[Mark]) -> dict[str, Any]:
    here = [m for m in marks if wanted.counts(m)]
    return row(wanted, here, wanted.measure(here))
