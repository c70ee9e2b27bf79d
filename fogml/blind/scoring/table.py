"""The table of figures: what each counts, over which cases, and what is wanted of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from fogml.blind.scoring.marks import Judged, Mark
from fogml.blind.scoring.statistics import (
    NOTHING,
    Estimate,
    calibration_error,
    mean,
    median,
    open_set,
    proportion,
    reliability,
)
from fogml.blind.truth import KINDS, STRATUM_NAMES

ENOUGH = 400
"""Cases that every wanted figure should rest on."""
_STRONG = 10.0
_ONE, _TWO, _THREE = ("one",), ("two",), ("three",)
_KNOWN = (*_ONE, *_TWO, *_THREE)
_UNKNOWN = ("unknown_left_out", "unknown_invented")
_MIXED = ("unknown_and_known",)
_OPEN = ("nothing", *_KNOWN, *_UNKNOWN, *_MIXED)

Measure = Callable[[Sequence[Mark]], Estimate]


@dataclass(frozen=True)
class Figure:
    """A row of the table.

    Attributes
    ----------
    key, words
        Name in ``score.json`` and gates; name on the page.
    measure
        The figure of a set of cases.
    kinds
        Kinds of case that it counts over.
    low, high
        What is wanted: at least, at most.
    above
        d' that a case's weakest effect must exceed.
    format
        How it reads: ``percent``, ``number`` or ``seconds``.
    prototype
        What a prototype reached.
    of_mix
        Whether it is one of the whole mix: cases that were drawn by their kind or strength would shift it.
    counts
        Whether a case of these kinds enters; all do if None.
    """

    key: str
    words: str
    measure: Measure
    kinds: tuple[str, ...]
    low: float | None = None
    high: float | None = None
    above: float = 0.0
    format: Literal["percent", "number", "seconds"] = "percent"
    prototype: str = ""
    of_mix: bool = False
    counts: Callable[[Mark], bool] | None = None

    def chosen(self, marks: Iterable[Mark]) -> list[Mark]:
        """The cases that it counts over."""
        held = [m for m in self.of_kind(marks) if self.above == 0.0 or m.d_prime > self.above]
        return held if self.counts is None else [m for m in held if self.counts(m)]

    def of_kind(self, marks: Iterable[Mark]) -> list[Mark]:
        """Those, of any d'."""
        return [m for m in marks if m.truth.kind in self.kinds and (m.truth.mix or not self.of_mix)]


def met(low: float | None, high: float | None, value: float | None) -> bool | None:
    """Whether a value is as wanted; None where nothing is wanted or there is no value."""
    if value is None or (low is None and high is None):
        return None
    return (low is None or value >= low) and (high is None or value <= high)


def share(hit: Callable[[Mark], bool]) -> Measure:
    """The share of cases with something."""
    return lambda marks: proportion([hit(m) for m in marks])


def pooled(hits: Callable[[Mark], Iterable[bool]]) -> Measure:
    """The share of hits over all cases together."""
    return lambda marks: proportion([hit for m in marks for hit in hits(m)])


def false_names(m: Mark) -> Iterable[bool]:
    """Whether each named effect is false."""
    # A failed case is one false name: not to answer must not be the better answer.
    return [True] if m.failure else [not item.right for item in m.named]


def curve(marks: Sequence[Mark]) -> Any:
    """The open-set curve of the cases, those with a wrong thermal structure left out."""
    chosen = [m for m in marks if m.truth.kind in _OPEN]
    return open_set([m.unknown for m in chosen], [bool(m.truth.unknown) for m in chosen])


def calibration(
    marks: Sequence[Mark], items_of: Callable[[Mark], Iterable[Judged]] = lambda m: m.items
) -> Any:
    """The reliability bins of every listed item, or of other items of each case."""
    items = [item for m in marks for item in items_of(m)]
    return reliability([item.probability for item in items], [item.right for item in items])


def case_ratio(marks: Sequence[Mark]) -> Estimate:
    """What is closed over what the true effects close, in the median case."""
    return median([float(np.mean(m.closed_ratios)) for m in marks if m.closed_ratios])


def _mean_overlap(marks: Sequence[Mark]) -> Estimate:
    return mean([m.overlap for m in marks if m.overlap is not None])


def _class_size(marks: Sequence[Mark]) -> Estimate:
    return mean([float(len(item.members)) for m in marks for item in m.named])


def seconds(marks: Sequence[Mark]) -> Estimate:
    """Time per case [s]."""
    return median([m.seconds for m in marks if m.seconds is not None])


FIGURES: tuple[Figure, ...] = (
    Figure(
        "nothing_named", "nothing missing: an effect named",
        share(lambda m: m.wrong_name), ("nothing",), high=0.02, prototype="3 %",
    ),
    Figure(
        "one_top", "one effect, d′ > 10: the first item's class holds it",
        share(lambda m: m.top), _ONE, low=0.98, above=_STRONG, prototype="95 %",
    ),
    Figure(
        "one_exact", "one effect, d′ > 10: class exact",
        share(lambda m: m.exact), _ONE, low=0.95, above=_STRONG, prototype="92 %",
    ),
    Figure(
        "one_top_strict", "one effect, d′ > 10: the first item is it",
        share(lambda m: m.top_strict), _ONE, above=_STRONG,
    ),
    Figure(
        "two_exact", "two effects: class exact",
        share(lambda m: m.exact), _TWO, low=0.92, prototype="86 %",
    ),
    Figure("three_exact", "three effects: class exact", share(lambda m: m.exact), _THREE),
    Figure(
        "false_discovery", "named effects that are false (FDR)",
        pooled(false_names), KINDS, high=0.05, prototype="11.5 %", of_mix=True,
    ),
    Figure(
        "unknown_wrong_name", "unknown, d′ > 10: a wrong name",
        share(lambda m: m.wrong_name), _UNKNOWN, high=0.05, above=_STRONG, prototype="~11 %",
    ),
    Figure(
        "mixed_known_kept", "unknown + known: known kept",
        share(lambda m: m.kept), _MIXED, low=0.9, prototype="65 %",
    ),
    Figure(
        "mixed_false_name", "unknown + known: false name",
        share(lambda m: m.wrong_name), _MIXED, high=0.08, prototype="20 %",
    ),
    Figure(
        "wrong_thermal_right", "wrong thermal structure: a right answer",
        share(lambda m: m.right_for_wrong_thermal), ("wrong_thermal",),
    ),
    Figure(
        "auroc", "open set on unknown.probability: AUROC",
        lambda marks: curve(marks).auroc, _OPEN, low=0.98, format="number", prototype="0.974", of_mix=True,
    ),
    Figure(
        "fpr95", "open set on unknown.probability: FPR95",
        lambda marks: curve(marks).fpr95, _OPEN, high=0.05, prototype="10 %", of_mix=True,
    ),
    Figure(
        "calibration_error", "expected calibration error",
        lambda marks: calibration_error(calibration(marks)), KINDS, high=0.03, format="number",
        prototype="0.077", of_mix=True,
    ),
    Figure(
        "calibration_error_named", "expected calibration error, named effects alone",
        lambda marks: calibration_error(calibration(marks, lambda m: m.named)), KINDS, format="number",
        of_mix=True,
    ),
    Figure(
        "calibration_error_suspected", "expected calibration error, with what is suspected",
        lambda marks: calibration_error(calibration(marks, lambda m: (*m.items, *m.suspected))), KINDS,
        format="number", of_mix=True,
    ),
    Figure(
        "suspected_right", "suspected and not named: right",
        pooled(lambda m: (item.right for item in m.suspected)), KINDS, of_mix=True,
    ),
    Figure(
        "closed_ratio", "closed / what the true effect, fitted, closes (median)",
        case_ratio, _KNOWN, low=0.97, format="number", prototype="0.96", of_mix=True,
    ),
    Figure(
        "coverage_closed", "coverage of the 90 % interval of closed",
        pooled(lambda m: m.closed_covered), _KNOWN, low=0.87, high=0.93, prototype="81 %", of_mix=True,
    ),
    Figure(
        "coverage_amplitude", "coverage of the 90 % interval of amplitudes",
        pooled(lambda m: m.amplitude_covered), (*_KNOWN, *_MIXED), low=0.87, high=0.93, prototype="81 %",
        of_mix=True,
    ),
    Figure(
        "overlap", "overlap (IoU) of segments with the true ones, d′ > 10 (mean)",
        _mean_overlap, (*_KNOWN, *_UNKNOWN, *_MIXED), low=0.7, above=_STRONG, format="number", of_mix=True,
    ),
    Figure("class_size", "mean class size", _class_size, KINDS, high=1.5, format="number", of_mix=True),
    Figure("seconds", "time per case (median)", seconds, KINDS, format="seconds", of_mix=True),
    Figure(
        "seconds_at_1_hz", "time per case sampled at 1 Hz (median)",
        lambda marks: seconds([m for m in marks if m.truth.sample_s <= 1.0]), KINDS, high=10.0,
        format="seconds", of_mix=True,
    ),
    Figure("failed", "cases that failed", share(lambda m: bool(m.failure)), KINDS, of_mix=True),
)  # fmt: skip
"""Every row of the table, in its order."""
BY_KEY = {figure.key: figure for figure in FIGURES}


def rows(marks: Sequence[Mark]) -> list[dict[str, Any]]:
    """Every figure with its interval, over all of its cases, by stratum and by kind."""
    found = []
    for figure in FIGURES:
        found.append(
            {
                **row(figure, marks, prototype=figure.prototype),
                "by_stratum": _split(figure, marks, STRATUM_NAMES, lambda m: m.truth.stratum),
                "by_kind": _split(figure, _evenly(figure, marks), figure.kinds, lambda m: m.truth.kind),
            }
        )
    return found


def row(figure: Figure, marks: Sequence[Mark], **more: str) -> dict[str, Any]:
    """What a score says of a figure over its cases."""
    chosen = figure.chosen(marks)
    estimate = figure.measure(chosen) if chosen else NOTHING
    return {
        "key": figure.key,
        "words": figure.words,
        "format": figure.format,
        "wanted": {"low": figure.low, "high": figure.high},
        **more,
        **asdict(estimate),
        "cases": len(chosen),
        "met": met(figure.low, figure.high, estimate.value),
        "enough": len(chosen) >= ENOUGH,
    }


def _evenly(figure: Figure, marks: Sequence[Mark]) -> Sequence[Mark]:
    """Cases of any d' alike: where strong ones count alone, those outside the mix may be nothing else."""
    return [m for m in marks if m.truth.mix] if figure.above else marks


def _split(
    figure: Figure, marks: Sequence[Mark], names: Iterable[str], name_of: Callable[[Mark], str]
) -> dict[str, Any]:
    """The figure for each name that has cases, of any d'."""
    of_kind = figure.of_kind(marks)
    parts = {name: [m for m in of_kind if name_of(m) == name] for name in names}
    return {name: asdict(figure.measure(part)) for name, part in parts.items() if part}
