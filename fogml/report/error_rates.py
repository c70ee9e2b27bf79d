"""How often a diagnosis is right: what the check on withheld effects found, told beside each diagnosis.

``error_rates.json`` holds the rates: ``python -m experiments.gap_blind DIR --final`` writes them
of cases that nothing was developed on.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from fogml.gap.result import Diagnosis
from fogml.report.words import listed, percent, plural

ERROR_RATES = Path(__file__).with_name("error_rates.json")
_SHARE = ("value", "low", "high", "n")
_FIGURES = ("false_names", "unknown_misnamed", "nothing_named", "one_strong_right")


def error_rates(
    rows: Sequence[Mapping[str, Any]], cases: Mapping[str, int], seeds: Sequence[int], final: bool
) -> dict[str, Any]:
    """What of a table by reality tells how often the diagnosis is right.

    Parameters
    ----------
    rows
        Those of all cases, as `fogml.blind.scoring.by_reality` gives them.
    cases
        How many are of each reality.
    seeds
        That the cases were drawn with.
    final
        Whether nothing was developed on them.

    Returns
    -------
    dict
        ``cases``, ``seeds``, ``final``; ``figures``, by the rows' keys: shares with 95 % intervals and the
        number that they rest on.
    """
    held = {row["key"]: row for row in rows}
    return {
        "cases": dict(cases),
        "seeds": list(seeds),
        "final": final,
        "figures": {key: {part: held[key][part] for part in _SHARE} for key in _FIGURES},
    }


def error_sentences(found: Diagnosis) -> list[str]:
    """How often such findings were right on cases whose truth is known; first what was checked."""
    rates = _held()
    figures, cases = rates["figures"], rates["cases"]
    realities = listed([f"the {name} one" for name in cases])
    what = "synthetic case" if rates["final"] else "development case"
    told = [
        f"Checked on {plural(sum(cases.values()), what)} with their truth withheld, of "
        f"{plural(len(cases), 'simulated reality', 'simulated realities')} ({realities})"
        + (
            "."
            if rates["final"]
            else ": synthetic all of them, and the diagnosis was worked on with these in view, so that it "
            "may err more often elsewhere."
        )
        + " Take a name as a hint for the next run."
    ]
    if found.named:
        told += [
            f"Of the causes named there, {_of(figures['false_names'], 'name')} were false.",
            "Where nothing but something unknown acted, with d′ over 10 (its length over the noise), a cause "
            f"was named all the same in {_of(figures['unknown_misnamed'], 'case')}.",
        ]
    else:
        told += [
            f"With nothing missing, a cause was named in {_of(figures['nothing_named'], 'case')}.",
            "Where one effect of the catalogue acted, with d′ from 20 to 60 (its length over the noise), the "
            f"right one or its class came first in {_of(figures['one_strong_right'], 'case')}.",
        ]
    return told


@cache
def _held() -> dict[str, Any]:
    return dict(json.loads(ERROR_RATES.read_text(encoding="utf-8")))


def _of(share: Mapping[str, Any], what: str) -> str:
    if share["value"] is None:
        return f"none of 0 {what}s"
    interval = f"(95 % interval: {percent(share['low'])} to {percent(share['high'])})"
    return f"{percent(share['value'])} of {plural(share['n'], what)} {interval}"
