"""A diagnosis in plain words: headline, verdict, causes, units."""

from __future__ import annotations

from collections.abc import Sequence

from fogml.gap.result import Diagnosis, Estimate, Found, in_doubt
from fogml.gap.result_parts import HowFar, beyond_noise
from fogml.numerals import listed, percent, probability_words, unit_words, with_error
from fogml.twin.registry import effects

_LIKELY_MEMBERS = 4


def verdict_words(found: Diagnosis) -> str:
    """The verdict as a word or two."""
    return found.verdict.replace("_", " ").capitalize()


def titles(found: Diagnosis) -> dict[str, str]:
    """Title of every candidate and of every effect of the catalogue, by id."""
    return {id: e.title for id, e in effects().items()} | {e.effect: e.title for e in found.evidence}


def title_of(id: str, names: dict[str, str]) -> str:
    """The title of an effect, its id in words where there is none."""
    return names.get(id, id.replace("_", " ").capitalize())


def estimate_words(value: Estimate) -> str:
    """``0.0210 ± 0.0010 deg/h``: two figures of the standard error decide how many are told."""
    return f"{with_error(value.value, value.se)} {unit_words(value.unit)}".rstrip()


def interval_words(low: float, high: float) -> str:
    """An interval of shares in percent."""
    ends = [f"{100 * end:.0f}" for end in (low, high)]
    return " … ".join("0" if end == "-0" else end for end in ends).replace("-", "−") + " %"


def closed_words(item: HowFar) -> str:
    """What is closed of the structural gap, in percent."""
    return percent(item.closed, 0)


def cause_words(found: Found, names: dict[str, str]) -> str:
    """An effect, or all of its class, as one cause."""
    members = [found.effect, *found.others]
    told = [title_of(m, names) for m in members]
    if len(told) <= _LIKELY_MEMBERS:
        return " or ".join(told)
    return " or ".join(told[: _LIKELY_MEMBERS - 1]) + f" or one of {len(told) - _LIKELY_MEMBERS + 1} more"


def does_not_close(found: Diagnosis) -> str:
    """The held-out run on which what was named closes nothing; empty where it closes some, or none tells."""
    told = [item for item in found.how_far if item.closed is not None]
    worst = min(told, key=lambda item: item.closed or 0.0, default=None)
    return worst.run if worst is not None and found.named and (worst.closed or 0.0) <= 0.0 else ""


def headline(found: Diagnosis) -> str:
    """The page's heading: verdict and cause in one line."""
    names = titles(found)
    named = [title_of(f.effect, names) for f in found.named]
    causes = " + ".join(named)
    if run := does_not_close(found):
        return f"Named, and the gap does not close on {run}: {causes}"
    match found.verdict:
        case "no_gap" if doubt := in_doubt(found.verdict, found.found, found.unknown):
            return f"No gap for certain; suspected: {cause_words(doubt, names)}"
        case "no_gap" if out := beyond_noise(found.how_far):
            return f"No cause stands out of the fitted runs; {out}"
        case "no_gap":
            return "No gap: the recalibrated twin and the gyro agree within the noise"
        case "explained":
            return f"Explained. Missing from the twin: {causes}"
        case "ambiguous":
            if len(named) == 1:
                return f"Ambiguous. Missing from the twin: {cause_words(found.named[0], names)}"
            return f"Ambiguous. Missing from the twin: {causes}, or what looks like them"
        case "partly_explained":
            return f"Partly explained. Missing from the twin: {causes}, and something unknown"
        case _:
            told = "explains it" if found.unknown.probability >= 0.5 else "is sure to explain it"
            return f"Unknown: the gap is there, and no candidate {told}"


def suspected_words(found: Diagnosis) -> list[str]:
    """The likely causes that are not sure enough for a name, in a sentence; none where there are none."""
    if not found.suspected:
        return []
    names = titles(found)
    told = [f"{cause_words(f, names)} ({probability_words(f.probability)})" for f in found.suspected]
    return [f"Suspected, and not sure enough to be named: {listed(told, 5)}."]


def held_out_words(found: Diagnosis, run: str) -> str:
    """A held-out run by name, or what was kept back for want of one."""
    return f"the last stretch of {run}, kept back" if found.held_out_is_part else f"{run}, held out"


def hardest(items: Sequence[HowFar]) -> HowFar:
    """The held-out run on which least is closed, or else on which most is left."""
    rated = [item for item in items if item.closed is not None]
    if rated:
        return min(rated, key=lambda item: item.closed if item.closed is not None else 1.0)
    return max(items, key=lambda item: item.after / item.floor if item.floor > 0.0 else item.after)


STATUS_WORDS = {
    "named": "named",
    "possible": "possible",
    "no_sign": "no sign of it",
    "undetectable": "these runs could not show it",
    "in_constants": "no trace of its own in these runs",
}
"""What became of a candidate."""


def subject_of(found: Diagnosis) -> str:
    """The unit and axis where the runs state them, else the fit runs."""
    unit = next((s.gyro for s in found.series if s.gyro), None)
    axis = next((s.axis for s in found.series if s.axis), None)
    if unit:
        return f"{unit}, axis {axis}" if axis else unit
    return listed(list(found.fit))
