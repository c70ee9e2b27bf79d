"""The score of the drift track: every entry's drift taken from the outputs that were kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fogml.benchmark.answers import DriftAnswer, read_drift
from fogml.benchmark.rounds import TrackFolder
from fogml.blind.folders import case_files
from fogml.blind.scoring.statistics import NOTHING, Estimate, mean, proportion
from fogml.models.baselines import MeanModel
from fogml.runs.reading import read_run
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


def drift_marks(
    folder: TrackFolder, cases: Mapping[str, Mapping[str, Any]], entries: Sequence[str], settling_s: float
) -> dict[str, list[DriftMark]]:
    """Every entry's marks, in the order of the cases, the first `settling_s` of held-out runs left out.

    Raises
    ------
    InputError
        If an entry lacks a case, or an answer is not one finite number a sample.
    """
    found: dict[str, list[DriftMark]] = {name: [] for name in entries}
    for case, told in cases.items():
        train = [read_run(path) for path in case_files(folder.cases / case).fit]
        test = read_run(folder.kept(case)[0])
        nothing = run_errors(MeanModel().fit(train), test)
        nothing = nothing.within(test.time - test.time[0] >= settling_s)
        for name in entries:
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
        "coverage": asdict(mean(covered)),
        "width": asdict(geometric_mean([m.width / m.nothing for m in marks if m.width])),
        "bytes": float(np.median(sizes)) if sizes else None,
        "failed": sum(bool(m.failure) for m in marks),
    }


def geometric_mean(values: Sequence[float]) -> Estimate:
    """The geometric mean with the interval of the central limit theorem for the logarithms."""
    if not values:
        return NOTHING
    found = mean(np.log(values))
    low, value, high = (None if v is None else float(np.exp(v)) for v in (found.low, found.value, found.high))
    return Estimate(value, low, high, found.n)
