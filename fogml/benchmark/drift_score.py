"""The score of the drift track: every entry's drift taken from the outputs that were kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from fogml.benchmark.answers import DriftAnswer, read_drift
from fogml.benchmark.rounds import TrackFolder
from fogml.blind.folders import case_files
from fogml.blind.scoring.statistics import NOTHING, Estimate, mean, proportion
from fogml.models.baselines import MeanModel
from fogml.runs.reading import read_run
from fogml.validation.judge import judge_run
from fogml.validation.run_errors import RunErrors, run_errors

SETTLING_S = 128.0
"""Start of a held-out run that enters no figure: windows fill there [s]."""
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
    folder: TrackFolder, cases: Mapping[str, Mapping[str, Any]], entries: Sequence[str]
) -> dict[str, list[DriftMark]]:
    """Every entry's marks, in the order of the cases.

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
        nothing = nothing.within(test.time - test.time[0] >= SETTLING_S)
        for name in entries:
            answer = read_drift(folder.answers(name) / case, len(test))
            found[name].append(_mark(case, told["group"], nothing, answer, told["averaging_s"]))
    return found


def _mark(case: str, group: str, nothing: RunErrors, answer: DriftAnswer, averaging_s: float) -> DriftMark:
    """An answer's mark; `nothing` has the training runs' mean for a drift."""
    known = nothing.run.earth_known
    # The mean is what the model of it leaves: taken off before, so that both sides have their constant.
    constant = (float(nothing.drift[0]), 0.0)
    if answer.drift is None:
        judged = judge_run(nothing, averaging_s, constant, known)
        after = judged.before.rms
        return DriftMark(case, group, after, after, judged.floor, 0.0, None, None, answer.failure)
    half = np.zeros(len(answer.drift)) if answer.half_width is None else answer.half_width
    judged = judge_run(replace(nothing, drift=answer.drift, half_width=half), averaging_s, constant, known)
    series, stated = judged.series, answer.half_width is not None
    return DriftMark(
        case,
        group,
        judged.before.rms,
        judged.after.rms,
        judged.floor,
        float(np.mean(np.abs(series.after) <= series.upper)) if stated else None,
        float(np.mean(series.upper - series.lower)) if stated else None,
        answer.bytes,
    )


def drift_figures(marks: Sequence[DriftMark]) -> dict[str, Any]:
    """An entry's figures, of all cases and of each group."""
    groups = {ALL: list(marks)}
    for one in marks:
        groups.setdefault(one.group, []).append(one)
    return {name: _figures(own) for name, own in groups.items()}


def _figures(marks: Sequence[DriftMark]) -> dict[str, Any]:
    sizes = [m.bytes for m in marks if m.bytes is not None]
    covered = [m.coverage for m in marks if m.coverage is not None]
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
