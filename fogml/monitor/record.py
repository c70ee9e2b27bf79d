"""What is kept of a run in service: a few figures of what its model leaves, and how far it can be trusted."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, fields
from datetime import UTC, datetime

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IntArray
from fogml.errors import InputError
from fogml.intervals import LEVEL, Z90
from fogml.models.base import DriftModel
from fogml.models.compensation import evaluate_blocks
from fogml.models.saved import model_hash
from fogml.monitor.figures import Averages, run_figures
from fogml.runs.checks import spoiling
from fogml.runs.findings import OF_OUTPUT, OF_TEMPERATURE, SPOILING, dead_words
from fogml.runs.run import Run
from fogml.runs.thermometers import leading_temperature
from fogml.runs.transitions import transition_mask
from fogml.runs.turning import turning
from fogml.signals import large
from fogml.signals.averages import AVERAGING_S, window_numbers

FIGURES = {
    "level": "deg/h",
    "temperature_slope": "deg/h/degC",
    "rate_slope": "deg/h/(degC/min)",
    "scatter": "ln(deg/h)",
    "scale_factor": "ppm",
}
"""Figures of what a model leaves on a run, with their units."""
LEAST_WINDOWS = 16
"""Averages that a run needs: as many as a fit of its noise does."""
_SETTLING = (
    "and most samples come before the model's memories are settled (a lag after three time constants, a play "
    "once T has moved by twice its half width); record so, or watch with a model without memory"
)


@dataclass(frozen=True)
class RunRecord:
    """A run as it is kept.

    Attributes
    ----------
    key
        SHA-256 over the run's columns, unit, axis, model and averaging time: a run that comes twice has the
        same, whatever else its side file says.
    unit, axis
        Serial number and axis; empty where the run states none.
    run
        Base name of its file.
    model
        Hash of the model.
    started
        When it began, by ISO 8601; empty where the run does not say.
    monitored
        When it was monitored, UTC, by ISO 8601.
    span_s
        Time from the first to the last sample [s].
    samples
        Number of samples.
    outside_training
        Share of the samples outside what the model was trained on.
    beyond_interval
        Share of the averages that lie beyond the model's 90 % interval about zero; NaN where training did not
        know Earth rate.
    half_width
        Mean half-width of that interval [deg/h].
    averaging_s
        Averaging time of the figures [s].
    level
        What is left in the middle of the trained temperatures at rest [deg/h]; of the run's where the model
        has no such range. By generalised least squares under the run's own noise; NaN where the table turns
        alike throughout.
    temperature_slope, rate_slope
        Slopes of what is left against temperature [deg/h/degC] and rate of temperature [deg/h/(degC/min)],
        fitted together; NaN where the run tells them less well than the model states them.
    scatter
        Natural logarithm of the deviation of an average from what those before it foretell [ln(deg/h)].
    scale_factor
        Error of the scale factor by the turns [ppm]; NaN where the table does not turn, or turns alike
        throughout.
    level_se, temperature_slope_se, rate_slope_se, scatter_se, scale_factor_se
        How well the run tells each: standard error in its unit, the noise being estimated from the same run.
    """

    key: str
    unit: str
    axis: str
    run: str
    model: str
    started: str
    monitored: str
    span_s: float
    samples: float
    outside_training: float
    beyond_interval: float
    half_width: float
    averaging_s: float
    level: float
    temperature_slope: float
    rate_slope: float
    scatter: float
    scale_factor: float
    level_se: float
    temperature_slope_se: float
    rate_slope_se: float
    scatter_se: float
    scale_factor_se: float

    @property
    def label(self) -> str:
        """Serial number and axis."""
        return f"{self.unit} {self.axis}".strip() or "unit without a name"


TEXTS = tuple(f.name for f in fields(RunRecord) if f.type == "str")
NUMBERS = tuple(f.name for f in fields(RunRecord) if f.type == "float")


def record_run(
    model: DriftModel,
    run: Run,
    *,
    averaging_s: float = AVERAGING_S,
    any_unit: bool = False,
    most_spoilt: float = 0.01,
) -> RunRecord:
    """What a model leaves on a run, which may be longer than memory (`fogml.signals.large`).

    Parameters
    ----------
    model
        A fitted model.
    run
        A run in service.
    averaging_s
        Averaging time of the figures [s].
    any_unit
        Allow a run of another unit or axis than the model's.
    most_spoilt
        Share of the samples that may be stuck, or at the ends of the output's range at rest: what fewer do
        lies within the noise of an average.

    Raises
    ------
    InputError
        If the run is empty, of another unit or axis, does not state the attitude that tells Earth rate while
        the model knows it, has samples further apart than the averaging time, fewer than `LEAST_WINDOWS`
        averages, one value in every sample, more spoilt samples than `most_spoilt`, or numbers that can't be
        what the run states of its output.
    """
    if len(run) == 0:
        raise InputError("the run holds no samples, there is nothing to monitor")
    facts, sha = run.facts, model_hash(model)
    recording = _Recording(model, run, averaging_s, any_unit)
    if (extremes := large.extremes(run.gyro))[0] == extremes[1]:
        raise InputError(f"{run.name}: {dead_words(extremes[0])}; it is not kept, record it again")
    if averaging_s < (1.0 - 1e-6) * run.sample_s:
        raise InputError(
            f"{run.name}: a sample every {run.sample_s:g} s makes no averages over "
            f"{averaging_s:g} s; set --averaging to that interval or more"
        )
    time, mean = recording.means.values()
    used, is_inside = recording.used(mean)
    recording.hold_usable(is_inside, most_spoilt)
    half = mean["half"][used]
    told = run_figures(
        Averages(
            time,
            mean["left"],
            mean["temperature"],
            mean["reference"],
            used,
            moving=mean["moving"] != 0.0,
            averaging_s=averaging_s,
        ),
        model,
        outside_deviation=0.0 if is_inside else float(np.sqrt(np.mean(half**2))) / Z90,
    )
    beyond = float(np.mean(np.abs(mean["left"][used]) > half))
    return RunRecord(
        key=_key(run, sha, averaging_s),
        unit=facts.unit or "",
        axis=facts.axis or "",
        run=run.name,
        model=sha,
        started=facts.started.isoformat() if facts.started else "",
        monitored=datetime.now(UTC).isoformat(timespec="seconds"),
        span_s=run.span_s,
        samples=float(len(run)),
        outside_training=recording.outside / len(run),
        beyond_interval=beyond if recording.earth_known else float("nan"),
        half_width=float(half.mean()),
        averaging_s=averaging_s,
        **told,
    )


def _key(run: Run, sha: str, averaging_s: float) -> str:
    """Digest of a recording, its unit and the model's `sha`."""
    digest = hashlib.sha256()
    about = (run.facts.unit or "", run.facts.axis or "", sha, run.gyro_unit, repr(averaging_s))
    for text in about:
        digest.update(f"{text}\0".encode())
    for name in sorted(run.columns):
        column, values = hashlib.sha256(), run.columns[name]
        for part in large.pieces(values):
            column.update(np.ascontiguousarray(values[part]).data)
        digest.update(f"{name}\0{column.hexdigest()}".encode())
    return digest.hexdigest()


class _Recording:
    """What is gathered of a recording, piece by piece."""

    def __init__(self, model: DriftModel, run: Run, averaging_s: float, any_unit: bool) -> None:
        # A model whose training did not tell Earth rate holds it, so that no run's is taken off once more.
        self.earth_known = model.card_.earth_known
        if self.earth_known and not run.earth_known:
            raise InputError(
                f"{run.name}: states no latitude and input_axis, but the model was trained with Earth rate "
                "known: the run's bias would hold it; state both in the run's side file"
            )
        self.run, self.averaging_s = run, averaging_s
        self.means = _Means(averaging_s, float(run.time[0]), run.sample_s)
        self.outside = self.unsettled = 0
        moving = turning(run) if "rate" in run.columns else np.zeros(len(run), dtype=bool)
        # Changes of the rate are told by all of the run: how noisy it is, how long they last.
        calm = ~transition_mask(run) if moving.any() else ~moving
        warmth = leading_temperature(run)
        blocks = (run[part] for part in large.pieces(run.time))
        told = evaluate_blocks(model, blocks, any_unit=any_unit)
        for part, (block, evaluation) in zip(large.pieces(run.time), told, strict=True):
            kept = evaluation.full & evaluation.settled
            self.unsettled += int(np.count_nonzero(~kept))
            reference = block.reference_deg_h if self.earth_known else 3600.0 * block.rate
            self.means.add(
                block.time,
                kept & calm[part],
                left=block.gyro_deg_h - reference - (0.0 if run.facts.compensated else evaluation.drift),
                temperature=np.zeros(len(block)) if warmth is None else warmth[part],
                reference=reference,
                half=model.intervals_.half_width(LEVEL, evaluation.excess),
                moving=moving[part].astype(np.float64),
                outside=evaluation.outside.astype(np.float64),
            )
            self.outside += int(np.count_nonzero(evaluation.outside & evaluation.full))

    def used(self, mean: Mapping[str, FloatArray]) -> tuple[BoolArray, bool]:
        """Averages that tell what is left, at rest where there are enough; and whether inside training."""
        rest = mean["moving"] == 0.0
        used = rest if rest.sum() >= LEAST_WINDOWS else np.ones(len(rest), dtype=bool)
        inside = used & (mean["outside"] < 0.5)
        # Outside the model states little that could change; a run of nothing else tells as little.
        used = inside if (is_inside := bool(inside.sum() >= LEAST_WINDOWS)) else used
        if used.sum() < LEAST_WINDOWS:
            raise InputError(
                f"{self.run.name}: holds {int(used.sum())} averages over {self.averaging_s:g} s whose "
                f"windows are full; {LEAST_WINDOWS} are needed to tell what the model leaves, "
                + (_SETTLING if 2 * self.unsettled > len(self.run) else "record longer or set --averaging")
            )
        return used, is_inside

    def hold_usable(self, is_inside: bool, most_spoilt: float) -> None:
        """Refuse a recording whose output is not the gyro's, or not what it is stated to be.

        A temperature that can't be is refused where it lies outside training: else the model bears it out.
        """
        counts: Counter[str] = Counter()
        for finding in spoiling(self.run):
            wrong = finding.code in OF_OUTPUT or (finding.code in OF_TEMPERATURE and not is_inside)
            if finding.code in SPOILING:
                counts[finding.code] += finding.count if finding.at_rest is None else finding.at_rest
            if wrong or counts[finding.code] > most_spoilt * len(self.run):
                raise InputError(f"{self.run.name}: {finding.message}; until that is right it is not kept")


class _Means:
    """Means over windows of samples that come in blocks."""

    def __init__(self, window_s: float, start_s: float, sample_s: float) -> None:
        self.window_s, self.start, self.sample_s = window_s, start_s, sample_s
        self.parts: list[tuple[IntArray, dict[str, FloatArray]]] = []

    def add(self, time: FloatArray, kept: BoolArray, **columns: FloatArray) -> None:
        """Add a block's samples; of those that are not kept none counts."""
        window = window_numbers(time[kept], self.start, self.sample_s, self.window_s).astype(np.int64)
        names, place = np.unique(window, return_inverse=True)
        sums: dict[str, FloatArray] = {
            name: np.asarray(np.bincount(place, values[kept], minlength=len(names)), dtype=np.float64)
            for name, values in {"count": np.ones(len(time)), "time": time, **columns}.items()
        }
        self.parts.append((np.asarray(names, dtype=np.int64), sums))

    def values(self) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Mean times [s] and columns of the windows that are at least half full, each of shape (m,)."""
        names, place = np.unique(np.concatenate([names for names, _ in self.parts]), return_inverse=True)
        columns = {name: np.concatenate([held[name] for _, held in self.parts]) for name in self.parts[0][1]}
        sums: dict[str, FloatArray] = {
            name: np.asarray(np.bincount(place, values, len(names)), dtype=np.float64)
            for name, values in columns.items()
        }
        counts = sums.pop("count")
        full = counts * self.sample_s >= 0.5 * self.window_s
        means = {name: total[full] / counts[full] for name, total in sums.items()}
        return means.pop("time"), means
