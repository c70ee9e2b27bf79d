"""The score of a round, as ``score.json`` holds it: every entry of every track, diagnoses' too."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import fogml
from fogml.benchmark.answers import DriftAnswer, read_drift
from fogml.benchmark.rounds import TRACKS, TrackFolder, check_kept, read_round
from fogml.blind.folders import OUTCOME, case_files, check_sums
from fogml.blind.run import check_answers_to
from fogml.blind.score import marks_of
from fogml.blind.scoring.answers import NAMED, read_answer
from fogml.blind.scoring.by_reality import each_kept, mass_on_true, within_one
from fogml.blind.scoring.marks import Mark
from fogml.blind.scoring.statistics import NOTHING, Estimate, mean, median, proportion
from fogml.blind.scoring.table import case_ratio, false_names, pooled
from fogml.blind.truth import read_truth
from fogml.errors import InputError
from fogml.models.baselines import MeanModel
from fogml.runs.reading import read_run
from fogml.settings_check import check_whole
from fogml.validation.floors import floor_of_run
from fogml.validation.metrics import RunMetrics
from fogml.validation.run_errors import RunErrors, run_errors

ALL = "all"


@dataclass(frozen=True)
class DriftMark:
    """One answer held against the output that was kept.

    Attributes
    ----------
    case, group
        Its number and which data it is of.
    nothing, after
        Rms of averages with the training runs' mean taken off, and with the answer's drift [deg/h].
    floor
        The noise in those averages [deg/h].
    coverage
        Share of averages within the stated 90 % intervals; None where none are stated.
    width
        Mean full width of those intervals [deg/h].
    bytes
        Size of the model, where it is told.
    failure
        Why the method gave no answer: it counts as doing nothing, its interval as holding nothing.
    """

    case: str
    group: str
    nothing: float
    after: float
    floor: float
    coverage: float | None
    width: float | None
    bytes: int | None
    failure: str = ""

    @property
    def ratio(self) -> float:
        """What is left over what doing nothing leaves."""
        return self.after / self.nothing

    @property
    def harmful(self) -> bool:
        """Whether it is worse than doing nothing by more than the noise."""
        return self.after > self.nothing + self.floor


def _drift_marks(
    folder: TrackFolder, cases: Mapping[str, Mapping[str, Any]], entries: Sequence[str], settling_s: float
) -> dict[str, list[DriftMark]]:
    """Every entry's marks, in the order of the cases, the first `settling_s` of held-out runs left out."""
    found: dict[str, list[DriftMark]] = {name: [] for name in entries}
    for case, told in cases.items():
        train = [read_run(path) for path in case_files(folder.cases / case).fit]
        test = read_run(folder.kept(case)[0])
        nothing = run_errors(MeanModel().fit(train), test)
        nothing = nothing.within(test.time - test.time[0] >= settling_s)
        for name in entries:
            check_answers_to(folder.answers(name) / case, folder.cases / case)
            answer = read_drift(folder.answers(name) / case, len(test))
            found[name].append(_mark(case, told["group"], nothing, answer, told["averaging_s"]))
    return found


def _mark(case: str, group: str, nothing: RunErrors, answer: DriftAnswer, averaging_s: float) -> DriftMark:
    """An answer's mark; `nothing` has the training runs' mean for a drift."""
    used = nothing.used
    metrics = RunMetrics(nothing.run, used, averaging_s, full=nothing.full)
    left = metrics.figures(nothing.after).rms
    floor = floor_of_run(nothing.run, used, nothing.before, averaging_s).value
    if answer.drift is None:
        return DriftMark(case, group, left, left, floor, 0.0, None, None, answer.failure)
    error = nothing.before - answer.drift
    covered = width = None
    if answer.half_width is not None:
        after, half = metrics.averages(error[used], answer.half_width[used]).values
        covered, width = float(np.mean(np.abs(after) <= half)), float(np.mean(2.0 * half))
    return DriftMark(case, group, left, metrics.figures(error).rms, floor, covered, width, answer.bytes)


def drift_figures(marks: Sequence[DriftMark]) -> dict[str, Any]:
    """An entry's figures, of all cases and of each group."""
    groups = {ALL: list(marks)}
    for one in marks:
        groups.setdefault(one.group, []).append(one)
    return {name: _figures(own) for name, own in groups.items()}


def _figures(marks: Sequence[DriftMark]) -> dict[str, Any]:
    sizes = [m.bytes for m in marks if m.bytes is not None]
    covered = [m.coverage for m in marks if m.coverage is not None]
    if all(m.coverage is None or m.failure for m in marks):
        covered = []  # an entry that states no interval has none to hold, its failed cases neither
    return {
        "cases": len(marks),
        "ratio": asdict(geometric_mean([m.ratio for m in marks])),
        "worst": max(m.ratio for m in marks),
        "harmful": asdict(proportion([m.harmful for m in marks])),
        "coverage": asdict(within_one(mean(covered))),
        "width": asdict(geometric_mean([m.width / m.nothing for m in marks if m.width])),
        "bytes": float(np.median(sizes)) if sizes else None,
        "failed": sum(bool(m.failure) for m in marks),
    }


def geometric_mean(values: Sequence[float]) -> Estimate:
    """The geometric mean with the interval of Student's t for the logarithms.

    With a value of zero, as of an answer without any error, it is zero and has none.
    """
    if not values:
        return NOTHING
    if min(values) == 0.0:
        return Estimate(0.0, None, None, len(values))
    found = mean(np.log(values))
    low, value, high = (None if v is None else float(np.exp(v)) for v in (found.low, found.value, found.high))
    return Estimate(value, low, high, found.n)


def _told_unknown(m: Mark) -> bool:
    """Whether a cause that no candidate stands for was called unknown, and nothing wrong was named."""
    return m.unknown >= NAMED and not m.wrong_name


def _mass(marks: Sequence[Mark]) -> Estimate:
    return within_one(mean([mass_on_true(m) for m in marks if len(m.truth.effects) == 1]))


FIGURES: dict[str, tuple[str, Callable[[Sequence[Mark]], Estimate]]] = {
    "found": ("known causes that are named, by class", each_kept),
    "false": ("named causes that are false", pooled(false_names)),
    "unknown": (
        "cases with an unknown cause: told as unknown, no wrong name",
        lambda marks: proportion([_told_unknown(m) for m in marks if m.truth.unknown]),
    ),
    "quiet": (
        "cases with nothing missing: nothing named",
        lambda marks: proportion([not m.wrong_name for m in marks if not m.truth.effects]),
    ),
    "mass_on_true": ("mean probability on the true cause, one cause (as DX 2025)", _mass),
    "closed": ("closed over what the true causes close (median)", case_ratio),
    "seconds": ("time per case [s] (median)", lambda marks: median([m.seconds for m in marks if m.seconds])),
}
"""Words and measure of each figure."""


def _diagnosis_marks(folder: TrackFolder, entries: Sequence[str], workers: int = 1) -> dict[str, list[Mark]]:
    """Every entry's marks, in the order of the cases; refused where an answer lacks or is not sound."""
    check_sums(folder.truth)
    truths = [read_truth(folder.truth / f"{name}.json") for name in folder.names()]
    for name in entries:
        for truth in truths:
            place = folder.answers(name) / truth.case
            answer = read_answer(place)
            # One that our own run tells as failed is an answer; one that is not there is none.
            if answer.gap is None and (not (place / OUTCOME).is_file() or "gap.json" in answer.failure):
                raise InputError(f"{place}: {answer.failure}; every case needs a sound gap.json")
    return marks_of(folder, list(entries), truths, workers=workers)


def diagnosis_figures(marks: Sequence[Mark]) -> dict[str, Any]:
    """An entry's figures, of all cases and of each reality."""
    groups = {ALL: list(marks)}
    for one in marks:
        groups.setdefault(one.truth.reality, []).append(one)
    return {
        name: {
            "cases": len(own),
            "failed": sum(bool(m.failure) for m in own),
            **{key: asdict(measure(own)) for key, (_, measure) in FIGURES.items()},
        }
        for name, own in groups.items()
    }


SCHEMA = "fogml.benchmark/1"


def score_round(directory: str | Path, entries: Sequence[str] = (), *, workers: int = 1) -> dict[str, Any]:
    """Score entries of a round; all that lie in its folder ``entries`` if none are named.

    Raises
    ------
    InputError
        If there is nothing to score, what was kept was changed, or an answer is missing or not finite.
    """
    check_whole("workers", workers, 1)
    home = Path(directory)
    told = read_round(home)
    check_kept(home, told)
    folders = {track: TrackFolder(home, track) for track in TRACKS}
    chosen = {
        track: [name for name in folder.methods() if not entries or name in entries]
        for track, folder in folders.items()
    }
    found = {name for names in chosen.values() for name in names}
    for name in entries:
        if name not in found:
            raise InputError(
                f"{home / 'entries' / name}: no such entry; run a method or put its answers there"
            )
    if not found:
        raise InputError(f"{home / 'entries'}: holds no answers; run a method first: fogml benchmark run")
    settling_s = told["design"]["settling_s"]
    drift = _drift_marks(folders["drift"], told["tracks"]["drift"], chosen["drift"], settling_s)
    named = _diagnosis_marks(folders["diagnosis"], chosen["diagnosis"], workers)
    return {
        "schema": SCHEMA,
        "version": fogml.__version__,
        "round": {
            "seed": told["seed"],
            "closed": told["closed"],
            "made_by": told["version"],
            "rules": told["rules"],
            "design": told["design"],
            "handout_sha256": round_hash(home),
        },
        "cases": {track: told["tracks"][track] for track in TRACKS},
        "drift": {
            name: {"figures": drift_figures(marks), "cases": [_case(asdict(m)) for m in marks]}
            for name, marks in drift.items()
        },
        "diagnosis": {
            name: {
                "figures": diagnosis_figures(marks),
                "cases": [{"case": m.truth.case, "kind": m.truth.kind, "verdict": m.verdict} for m in marks],
            }
            for name, marks in named.items()
        },
    }


def round_hash(home: Path) -> str:
    """SHA-256 of ``round.json``, which binds every answer: the round's own name."""
    return hashlib.sha256((home / "handout" / "round.json").read_bytes()).hexdigest()


def _case(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if key != "group" and value not in (None, "")}
