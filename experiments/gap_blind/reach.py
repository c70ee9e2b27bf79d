"""What of a blind score's figures the data allow, from what each true form adds to the evidence.

Rows are those of ``limits-PART.json``: effects with their ``gain`` in nats, wrong answers with their
distance from the truth. Nobody who has to find an effect among 36 of unknown shape can name it from much
under 8 nats: a choice of 36 costs 4, its size and shape about as much.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from fogml.blind.scoring.statistics import open_set

SHOWN_NATS = 8.0
MISSED_FORMS = 0.05
"""Share of right effects that may be missed for their form."""
STRONG = 10.0
"""Least d' of the figures on strong effects."""
UNKNOWNS = ("unknown_left_out", "unknown_invented")
OPEN = (*UNKNOWNS, "unknown_and_known")
STRONG_OUTSIDE = ("one", *UNKNOWNS)
"""Kinds whose cases outside the mix are strong ones alone; see `config.yaml`."""
Row = dict[str, Any]


class Figure(NamedTuple):
    """A figure on cases of some kinds: words, kinds, least d'."""

    words: str
    kinds: Sequence[str]
    above: float
    known: bool = True
    """Whether its known effects count or its unknown ones."""
    alone: bool = True
    """Whether a wrong name spoils it."""


class Share(NamedTuple):
    """Of how many cases, the share for one who knows the true forms, and the share that was reached."""

    cases: int
    allowed: float
    reached: float


class OpenSet(NamedTuple):
    """How far unknowns are told from none: share of them hidden, what one who knows reaches, what was."""

    unknowns: int
    hidden: float
    allowed: tuple[float, float]
    reached: tuple[float, float]
    """Area under the curve; share of cases without an unknown over the threshold that 95 % of them reach."""


def shown(effects: Sequence[Row], figure: Figure, nats: float = SHOWN_NATS) -> Share | None:
    """Cases in which the data show every effect that counts with so many nats; in which the answer has all.

    None where there is no such case.
    """
    counted = list(_cases([r for r in effects if r["known"] == figure.known], figure).values())
    if not counted:
        return None
    allowed = np.mean([all(row["gain"] >= nats for row in rows) for rows in counted])
    has = [all(r["named"] and not (figure.alone and r["wrong_beside"]) for r in rows) for rows in counted]
    return Share(len(counted), float(allowed), float(np.mean(has)))


def wrongly_named(
    effects: Sequence[Row], wrong: Sequence[Row], figure: Figure, near_nats: float = SHOWN_NATS
) -> Share | None:
    """Cases with a wrong name that the truth is near to, which nobody can tell; with any wrong name."""
    counted = _cases(effects, figure)
    if not counted:
        return None
    nats = np.array([row["nats"] for row in wrong if row["wrong"] and row["case"] in counted])
    n = len(counted)
    return Share(n, int(np.sum(nats < near_nats)) / n, len(nats) / n)


def left_by_right_forms(forms: Sequence[Row]) -> float:
    """What the catalogue's form of an effect leaves of it at most, but for `MISSED_FORMS` of them [nats].

    Who doesn't know the true forms has to bear with so much, or else misses more of the effects.
    """
    return float(np.quantile([row["lost_nats"] for row in forms], 1.0 - MISSED_FORMS))


def false_names(known: Sequence[Row], wrong: Sequence[Row], mix: set[str]) -> Share:
    """Of all names in the mix where something acts: false ones that nobody can tell; all false ones."""
    right = sum(row["named"] for row in known if row["case"] in mix)
    false = [(len(row["wrong"]), row["nats"]) for row in wrong if row["case"] in mix]
    every = sum(n for n, _ in false)
    near = sum(n for n, nats in false if nats < SHOWN_NATS)
    names = max(right + every, 1)
    return Share(right + every, near / names, every / names)


def open_set_reach(effects: Sequence[Row], asked: Sequence[Row], above: float) -> OpenSet | None:
    """Unknowns of the mix over a d' against every case without one.

    An unknown that adds less than 8 nats ranks among the cases without one as chance has it, also for one
    who knows its form. With a share h hidden and all others told, the area under the curve is 1 - h / 2,
    and the threshold that 95 % of them reach is reached by a share 1 - 0.05 / h of the cases without one.
    """
    asked = [r for r in asked if r["mix"]]
    open_ = [r for r in effects if r["mix"] and not r["known"] and r["kind"] in OPEN]
    unknown = {r["case"]: r for r in open_ if r["d_prime"] > above}
    without = [r for r in asked if r["kind"] not in (*OPEN, "wrong_thermal")]
    if not unknown or not without:
        return None
    scores = [r["unknown"] for r in asked if r["case"] in unknown] + [r["unknown"] for r in without]
    found = open_set(scores, [True] * len(unknown) + [False] * len(without))
    hidden = float(np.mean([row["gain"] < SHOWN_NATS for row in unknown.values()]))
    allowed = (1.0 - 0.5 * hidden, max(0.0, 1.0 - 0.05 / max(hidden, 0.05)))
    return OpenSet(len(unknown), hidden, allowed, (found.auroc.value or 0.0, found.fpr95.value or 0.0))


def effects_and_wrong(cases: Iterable[Mapping[str, Any]]) -> tuple[list[Row], list[Row]]:
    """Every effect of what ``limits.py`` measured, and every wrong answer."""
    held = list(cases)
    effects = [row | {"mix": case["asked"]["mix"]} for case in held for row in case["effects"]]
    return effects, [case["wrong"] for case in held if case["wrong"] is not None]


def _cases(effects: Sequence[Row], figure: Figure) -> dict[str, list[Row]]:
    """Effects by case, of cases of the figure's kinds whose weakest effect has a d' above its limit.

    Of any d' are cases of the mix, where those outside it are strong ones.
    """
    held: dict[str, list[Row]] = {}
    for row in effects:
        if row["kind"] in figure.kinds and (figure.above or row["mix"] or row["kind"] not in STRONG_OUTSIDE):
            held.setdefault(row["case"], []).append(row)
    return {case: rows for case, rows in held.items() if min(row["d_prime"] for row in rows) > figure.above}
