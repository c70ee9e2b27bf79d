"""Headline figures of a diagnosis, what to mind about them, and how often a diagnosis is right."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from fogml.gap.result import Diagnosis, in_doubt
from fogml.gap.result_parts import WORSE, beyond_noise
from fogml.numerals import MISSING, listed, number, percent, plural, probability_words
from fogml.report.gap_words import (
    cause_words,
    closed_words,
    does_not_close,
    hardest,
    interval_words,
    title_of,
    verdict_words,
)
from fogml.report.page import Tile

_FAR_UNDER_FLOOR = 0.6
"""Rms over the floor under which the floor is in doubt."""


def headline_tiles(found: Diagnosis, names: dict[str, str]) -> list[Tile]:
    """Verdict, cause, confidence, what is unknown, and what is closed."""
    kind = {"explained": "met", "no_gap": "met", "unknown": "missed", "partly_explained": "words missed"}
    told = "missed" if does_not_close(found) else kind.get(found.verdict, "")
    doubt = in_doubt(found.verdict, found.found, found.unknown)
    if doubt is not None or (found.verdict == "no_gap" and beyond_noise(found.how_far)):
        told = ""
    tiles = [Tile("Verdict", verdict_words(found), "", _verdict_note(found), told)]
    tiles += [_cause_tile(found, names), _confidence_tile(found, names)]
    unknown = probability_words(found.unknown.probability)
    if not _is_unknown(found):
        tiles.append(Tile("Something unknown", unknown, "", "probability that no candidate explains all"))
    tiles.append(_closed_tile(found))
    return tiles


def _verdict_note(found: Diagnosis) -> str:
    if does_not_close(found):
        return "and the gap does not close"
    if in_doubt(found.verdict, found.found, found.unknown) is not None:
        return "not for certain"
    out = beyond_noise(found.how_far)
    return {
        "no_gap": "in the fitted runs; held out, more is left" if out else "within the noise",
        "explained": "each effect alone in its class",
        "ambiguous": "a class of several",
        "partly_explained": "something is left",
        "unknown": "no candidate explains it",
    }[found.verdict]


def _cause_tile(found: Diagnosis, names: dict[str, str]) -> Tile:
    named = found.named
    if not named:
        looks = found.unknown.looks_like
        quiet = f"nothing stands out of {'the fitted runs' if beyond_noise(found.how_far) else 'the noise'}"
        note = f"what is left {looks}" if looks else quiet
        return Tile("Cause", "none named", "", note, "wide")
    title = title_of(named[0].effect, names)
    if len(named) > 1:
        value = plural(len(named), "effect")
        return Tile("Cause", value, "", "; ".join(cause_words(f, names) for f in named), "wide")
    if len(named[0].members) > 1:
        return Tile("Cause", f"1 of {len(named[0].members)}", "", cause_words(named[0], names), "wide")
    return Tile("Cause", "1 effect", "", title, "wide")


def _confidence_tile(found: Diagnosis, names: dict[str, str]) -> Tile:
    if found.named:
        least = min(f.probability for f in found.named)
        note = "that it acts" if len(found.named) == 1 else "the least certain of those named"
        if any(len(f.members) > 1 for f in found.named) and len(found.named) == 1:
            note = "that one of them acts"
        return Tile("Confidence", probability_words(least), "", note)
    if _is_unknown(found):
        return Tile(
            "Confidence", probability_words(found.unknown.probability), "", "that something unknown acts"
        )
    likeliest = max(found.evidence, key=lambda e: e.probability, default=None)
    if likeliest is None or likeliest.probability < 0.01:
        return Tile("Likeliest effect", "under 1 %", "", f"any of {plural(len(found.evidence), 'candidate')}")
    title = title_of(likeliest.effect, names)
    return Tile("Likeliest effect", probability_words(likeliest.probability), "", title)


def _is_unknown(found: Diagnosis) -> bool:
    """Whether something unknown is likelier than not all that acts."""
    return found.verdict == "unknown" and found.unknown.probability >= 0.5


def _closed_tile(found: Diagnosis) -> Tile:
    if not found.how_far:
        return Tile("Closed", MISSING, "", "nothing was held out")
    item = hardest(found.how_far)
    on = f"{item.run}, kept-back part" if found.held_out_is_part else item.run
    if len(found.how_far) > 1:
        on = f"the least of {len(found.how_far)} held-out runs: {item.run}"
    if item.closed is None:
        return Tile("Closed", MISSING, "", f"can't be told: at the floor within its noise on {on}")
    if not found.named:
        return Tile("Closed", "0 %", "", f"nothing was added; {on}")
    interval = f"90 %: {interval_words(*item.closed_ci90)}; " if item.closed_ci90 else ""
    return Tile("Closed", closed_words(item), "", f"{interval}{on}")


def warnings(found: Diagnosis, names: dict[str, str]) -> list[str]:
    """What a reader must mind before trusting the verdict."""
    told = []
    if found.held_out_is_part:
        run = found.held_out[0] if found.held_out else "the last run"
        told.append(
            f"No run was held out. The last stretch of {run} was kept back for the figures: it shares "
            "power-on and conditions with what was fitted, so they flatter. Hold out a run of its own."
        )
    elif not found.how_far:
        told.append("No run could be held out: every figure here is of data that the twin was fitted to.")
    for item in found.how_far:
        if item.made_worse:
            told.append(
                f"Constants as fitted make the replay of {item.run} worse than those that were given: "
                f"{number(item.recalibrated)} deg/h after {number(item.before)}. Its runs may be of another "
                "state of the unit."
            )
        if found.named and item.after > WORSE * item.recalibrated:
            told.append(
                f"What was found makes the replay of {item.run} worse: {number(item.after)} deg/h where the "
                f"recalibrated twin leaves {number(item.recalibrated)}. Doubt it there."
            )
        if item.recalibrated < _FAR_UNDER_FLOOR * item.floor:
            told.append(
                f"On {item.run} the recalibrated twin leaves {number(item.recalibrated)} deg/h where the "
                f"noise model expects {number(item.floor)}: it overstates slow noise, and what is "
                "closed can't be told by it. A longer static run with --noise tells the noise better."
            )
    for run, reason in found.unusable:
        told.append(f"{run} was not used: {reason.removeprefix(f'{run}: ')}.")
    for f in found.named:
        if not f.consistent:
            told.append(
                f"{title_of(f.effect, names)} does not show with the same sign and size on every run that "
                "can show it: doubt it."
            )
    if found.noise.white is False:
        told.append(
            "The noise check fails on held-out data: intervals and probabilities may be too sure. "
            + "; ".join(found.noise.failed[:2]).capitalize()
            + "."
        )
    return told


ERROR_RATES = Path(__file__).with_name("error_rates.json")
_SHARE = ("value", "low", "high", "n")
_FIGURES = ("false_names", "unknown_misnamed", "nothing_named", "one_strong_right")


def error_rates(
    rows: Sequence[Mapping[str, Any]], cases: Mapping[str, int], seeds: Sequence[int], final: bool
) -> dict[str, Any]:
    """What of a table by reality tells how often the diagnosis is right.

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
    realities = listed(list(cases))
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
