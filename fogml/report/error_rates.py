"""How often a diagnosis is right: what the check on withheld effects found, told beside each diagnosis.

``error_rates.json`` holds the rates; ``python -m experiments.gap_blind DIR --final`` writes them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from fogml.gap.result import FAMILIES, NAMED, Diagnosis
from fogml.report.words import percent, plural

ERROR_RATES = Path(__file__).with_name("error_rates.json")
_STRONG = "with d′ over 10 (its length over the noise)"
_SHARE = ("value", "low", "high", "n")
_FIGURES = ("nothing_named", "one_top", "unknown_wrong_name")


def error_rates(score: Mapping[str, Any]) -> dict[str, Any]:
    """What of a blind score tells how often the diagnosis is right.

    Parameters
    ----------
    score
        Schema ``fogml.blind_score/1``, with the method ``diagnosis``.

    Returns
    -------
    dict
        ``cases``, ``seed``; ``named``, bands of the stated probability, each with the share found right;
        ``figures``, by the score's keys. Shares have 95 % intervals and the number that they rest on.
    """
    judged = score["methods"]["diagnosis"]
    bands, rows = judged["reliability"], {row["key"]: row for row in judged["rows"]}
    return {
        "cases": score["cases"],
        "seed": score["seed"],
        "named": [
            {"from": band["from"], "to": band["to"], "value": band["found"]}
            | {part: band[part] for part in _SHARE[1:]}
            for band in bands
            if band["from"] >= NAMED
        ],
        "figures": {
            key: {part: rows[key][part] for part in ("value", "low", "high", "n")} for key in _FIGURES
        },
    }


def error_sentences(found: Diagnosis) -> list[str]:
    """How often such findings were right on cases whose truth is known; first what was checked."""
    if found.method == FAMILIES:
        return [
            "The diagnosis on families was judged on development cases of two synthetic realities alone; "
            "names that it was sure of were mostly right there (see its method page). How often it errs on "
            "cases that nothing was developed on is not known yet. Take a name as a hint for the next run."
        ]
    rates = _held()
    figures = rates["figures"]
    told = [
        f"Checked on {plural(rates['cases'], 'synthetic case')} with their truth withheld, of one reality "
        "and its forms of effects, with the nominal twin and the catalogue's candidates. Constants of the "
        "diagnosis were chosen on cases of this reality, so the rates hold for it alone: in two other "
        "synthetic realities fewer than half of the clear single effects were named rightly, and up to a "
        "quarter of the names were false. Take a name as a hint for the next run.",
    ]
    if not found.named:
        return [
            *told,
            f"With nothing missing, an effect was named in {_of(figures['nothing_named'])}.",
            f"Where one effect of the catalogue acted, {_STRONG}, the right one or its class came first in "
            f"{_of(figures['one_top'])}.",
        ]
    given = sorted({_tenth(finding.probability) for finding in found.named}, reverse=True)
    told.extend(_band_sentence(tenth, rates["named"]) for tenth in given)
    told.append(
        f"Where nothing but something outside the candidates acted, {_STRONG}, a candidate was named all the "
        f"same in {_of(figures['unknown_wrong_name'])}."
    )
    return told


def _tenth(probability: float) -> int:
    """The band of a probability, as the score's: 8 from 0.8 on, 9 from 0.9 up to 1."""
    return min(math.floor(10.0 * probability), 9)


def _band_sentence(tenth: int, bands: Sequence[Mapping[str, Any]]) -> str:
    """How often names with such a probability were right, if any was given."""
    edges = f"given with {10 * tenth} to {10 * tenth + 10} %"
    for band in bands:
        if _tenth(band["from"]) == tenth:
            return (
                f"Of {plural(band['n'], 'name')} {edges}, {percent(band['value'])} were right "
                f"{_interval(band)}."
            )
    return f"No name was {edges} there: how often such a name is right is not known."


@cache
def _held() -> dict[str, Any]:
    return dict(json.loads(ERROR_RATES.read_text(encoding="utf-8")))


def _of(share: Mapping[str, Any]) -> str:
    return f"{percent(share['value'])} of {plural(share['n'], 'case')} {_interval(share)}"


def _interval(share: Mapping[str, Any]) -> str:
    return f"(95 % interval: {percent(share['low'])} to {percent(share['high'])})"
