"""How an oracle with the catalogue's forms trades effects that it names against wrong names for unknowns.

Rows are those of ``one_or_unknown-PART.json``: ``kind``, ``effect``, the energy ``whole``, and of the
``single`` candidate and the ``pair`` of them that leave the least what they leave (``left``, both in nats)
and whether naming them ``counts``: for one effect whether that is right, for an unknown whether it is wrong.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from fogml.runs.run import FloatArray

EXPONENTS = (0.0, 0.25, 0.5, 0.75, 1.0)
WRONG_WANTED, FIRST_WANTED = 0.05, 0.98
COUNTED_AS_NAMED = "sensor_quantisation"
Row = Mapping[str, Any]


class Trade(NamedTuple):
    """An oracle's figures.

    At each limit, from the strictest on, shape (k,): the share of single effects that are named rightly, and
    of unknowns that have a wrong name.
    """

    limits: FloatArray
    first: FloatArray
    wrong: FloatArray

    def first_at(self, wrong: float) -> float:
        """The largest share of effects named with no more wrong names."""
        return float(self.first[self.wrong <= wrong + 1e-12].max(initial=0.0))

    def wrong_at(self, first: float) -> float:
        """The least share of wrong names with no fewer effects named; 1 where so many never are."""
        return float(self.wrong[self.first >= first - 1e-12].min(initial=1.0))


def trade(rows: Sequence[Row], second: float, exponent: float) -> Trade:
    """An oracle's figures at every limit.

    Parameters
    ----------
    rows
        As measured.
    second
        What a second effect has to take away [nats].
    exponent
        g above: 0 for a limit in nats, 1 for one on the share.
    """
    judged = [(row["kind"] == "one", *_judged(row, second, exponent)) for row in rows]
    limits = sorted({score for _, score, _ in judged})

    def share(one: bool) -> FloatArray:
        held = [(score, counts) for kind, score, counts in judged if kind == one]
        counted = np.sort([score for score, counts in held if counts])
        return np.searchsorted(counted, limits, side="right") / max(len(held), 1)

    return Trade(np.array(limits), share(True), share(False))


def best_trade(rows: Sequence[Row], second: float) -> tuple[float, Trade]:
    """The exponent that names the most effects at the wanted share of wrong names, and its figures."""
    trades = {g: trade(rows, second, g) for g in EXPONENTS}
    best = max(EXPONENTS, key=lambda g: trades[g].first_at(WRONG_WANTED))
    return best, trades[best]


def missed(rows: Sequence[Row], second: float, wrong: float) -> Counter[str]:
    """Effects that an oracle does not name rightly at so many wrong names, and how often."""
    exponent, held = best_trade(rows, second)
    limit = float(held.limits[held.wrong <= wrong].max(initial=0.0))
    found: Counter[str] = Counter()
    for row in rows:
        score, counts = _judged(row, second, exponent)
        found[row["effect"]] += row["kind"] == "one" and not (counts and score <= limit)
    return +found


def _judged(row: Row, second: float, exponent: float) -> tuple[float, bool]:
    """L / E**g of what an oracle takes, and whether naming it counts."""
    if row["kind"] == "one" and row["effect"] == COUNTED_AS_NAMED:
        return 0.0, True
    single, pair = row["single"], row["pair"]
    taken = pair if pair is not None and pair["left"] <= single["left"] - second else single
    return float(taken["left"] / row["whole"] ** exponent), bool(taken["counts"])
