"""Judging a fitted drift model: on the runs it was trained on, and on runs it has never seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.models.base import NOT_FULL
from fogml.numerals import percent
from fogml.runs.exchange import runs_of
from fogml.runs.findings import Finding
from fogml.runs.noise_of_run import noise_report
from fogml.runs.regimes import regimes
from fogml.runs.run import Run
from fogml.runs.thermometers import leading_temperature
from fogml.runs.turning import check_noise_run
from fogml.signals.averages import AVERAGING_S
from fogml.signals.floor import Floor
from fogml.signals.shared import shared_samples
from fogml.validation.floors import floor_of_run, out_of_reach
from fogml.validation.limits import check_design_index, check_limits, outcome_of
from fogml.validation.metrics import RunMetrics, check_turn_on_band, repeatability_of
from fogml.validation.results import AveragedSeries, Judgement, RunJudgement
from fogml.validation.run_errors import RunErrors, run_errors, training_means

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

_NOISE, _SHARED = "_validation_noise", "_validation_shared"


def judge(
    model: DriftModel,
    train_runs: Run | Sequence[Run],
    test_runs: Run | Sequence[Run],
    *,
    averaging_s: float = AVERAGING_S,
    design_index: float | None = None,
    limits: Mapping[str, float] | None = None,
    turn_on_band: float | None = None,
    any_unit: bool = False,
    beside: Sequence[DriftModel] = (),
    notes: Sequence[str] = (),
    noise: Run | None = None,
) -> Judgement:
    """Judge a fitted model on its training runs and on test runs.

    The error before is the output less the reference rate; after, less the model's drift too.
    Where Earth rate is not known for every run, the mean over the training runs is taken from
    both, each its own, so that the bias tells how far the constant moved since training. The
    figures are of the rows that models are fitted to: windows full, transitions of the turntable
    cut, and at rest where a run both stands and turns; the turns tell the scale factor.

    Parameters
    ----------
    model
        A fitted drift model.
    train_runs, test_runs
        What it was fitted on, and what it is judged on.
    averaging_s
        Averaging time of every figure [s].
    design_index
        Greatest ``after.rms`` allowed on the test runs [deg/h].
    limits
        Greatest absolute values allowed of other figures of `after`, by the names in
        :class:`~fogml.validation.results.Metrics`, or of repeatability over the test runs.
    turn_on_band
        Band about the settled bias that tells the turn-on time of runs that state their power-on
        [deg/h].
    any_unit
        Judge runs of another unit or axis than the model's as well.
    beside
        Fitted models that this one is compared with: only rows whose windows are full for them
        too count, so that all are judged on the same rows.
    notes
        What else the judgement should say.
    noise
        A static run whose noise makes the floor; by default each run's own, drift apart.

    Raises
    ------
    InputError
        For a limit that is unknown or that no test run tells, for a run of another unit or axis,
        and for a run too short for two averages.
    """
    train, test = runs_of(train_runs), runs_of(test_runs)
    if not train or not test:
        raise InputError("a judgement needs at least one training run and one test run")
    limits = check_limits(limits or {})
    check_design_index(design_index)
    check_turn_on_band(turn_on_band, (*train, *test))
    train_errors = [_within(run_errors(model, run, any_unit=True), beside) for run in train]
    test_errors = [_within(run_errors(model, run, any_unit=any_unit), beside) for run in test]
    return judgement_of(
        model,
        train_errors,
        test_errors,
        averaging_s=averaging_s,
        design_index=design_index,
        limits=limits,
        turn_on_band=turn_on_band,
        notes=notes,
        noise=noise,
    )


def judgement_of(
    model: DriftModel,
    train: Sequence[RunErrors],
    test: Sequence[RunErrors],
    *,
    averaging_s: float,
    design_index: float | None = None,
    limits: Mapping[str, float] | None = None,
    turn_on_band: float | None = None,
    notes: Sequence[str] = (),
    noise: Run | None = None,
) -> Judgement:
    """The judgement of a model from its errors on training runs and on test runs, as in :func:`judge`."""
    limits = limits or {}
    train_runs, test_runs = [e.run for e in train], [e.run for e in test]
    earth_known = all(run.earth_known for run in (*train_runs, *test_runs))
    constant = (0.0, 0.0) if earth_known else training_means(train)
    if noise is not None:
        check_noise_run(noise)

    def judged(one: RunErrors, seen: tuple[Finding, ...] = ()) -> RunJudgement:
        found = judge_run(one, averaging_s, constant, earth_known, turn_on_band, noise, seen)
        return replace(found, noise=_noise(one.run))

    judged_train = tuple(judged(e) for e in train)
    judged_test = tuple(judged(e, _seen(e.run, train_runs, model)) for e in test)
    return Judgement(
        model=model.describe(),
        train=judged_train,
        test=judged_test,
        design_index=outcome_of("rms", design_index, judged_test) if design_index is not None else None,
        limits=tuple(outcome_of(name, limit, judged_test) for name, limit in limits.items()),
        notes=(*notes, *index_notes(judged_test, design_index), *_notes(train_runs, test_runs)),
        repeatability=repeatability_of(judged_test),
    )


def index_notes(test: Sequence[RunJudgement], design_index: float | None) -> tuple[str, ...]:
    """For each test run on which the noise alone is over the design index, that no model can meet it."""
    if design_index is None:
        return ()
    told = [
        out_of_reach(design_index, [_floor(run)], [len(run.series.time)], run.averaging_s, run.run)
        for run in test
    ]
    return tuple(f"{text}." for text in told if text)


def _floor(run: RunJudgement) -> Floor:
    return Floor(run.floor, *(run.floor_ci90 or (run.floor, run.floor)))


def _within(errors: RunErrors, models: Sequence[DriftModel]) -> RunErrors:
    for model in models:
        errors = errors.within(model.evaluate(errors.run).full)
    return errors


def _seen(run: Run, train: Sequence[Run], model: DriftModel) -> tuple[Finding, ...]:
    """Whether a test run holds samples of a training run, on whatever clock, or is one by the card."""
    known: dict[str, float] = run.__dict__.setdefault(_SHARED, {})  # models are judged on the same runs
    for other in train:
        if other.hash not in known:
            known[other.hash] = shared_samples(run.gyro, other.gyro)
    shares = [(other.name, known[other.hash]) for other in train]
    shares += [(trained.name, 1.0) for trained in model.card_.runs if trained.sha256 == run.hash]
    for name, share in shares:
        if share:
            what = "the same samples as" if share == 1.0 else f"samples of (about {percent(share, 0)})"
            message = (
                f"holds {what} training run {name}: its figures say how well the model was fitted, "
                "not how well it holds"
            )
            return (Finding("seen_in_training", message, count=round(share * len(run))),)
    return ()


def judge_run(
    errors: RunErrors,
    averaging_s: float,
    constant: tuple[float, float],
    earth_known: bool,
    turn_on_band: float | None = None,
    noise: Run | None = None,
    seen: tuple[Finding, ...] = (),
) -> RunJudgement:
    """The judgement of one run from a model's errors on it, without Allan terms, which take most of the time.

    Parameters
    ----------
    errors
        Of the run.
    averaging_s
        Averaging time of every figure [s].
    constant
        What is taken off the errors before and after [deg/h]: the training runs' means, or nothing.
    earth_known
        Whether Earth rate is known, so that nothing has to be taken off.
    turn_on_band, noise
        As of `judge`.
    seen
        Findings on training runs that hold the same samples.
    """
    run, used = errors.run, errors.used
    metrics = RunMetrics(run, used, averaging_s, full=errors.full, turn_on_band=turn_on_band)
    before = errors.before - constant[0]
    after = errors.after - constant[1]
    outside = int(np.count_nonzero(errors.outside & used))
    share = outside / int(used.sum())
    findings = (*run.findings, *seen)
    if outside:
        message = (
            f"{percent(share)} of the samples lie outside the temperatures and rates that the model was "
            "trained on"
        )
        findings = (*findings, Finding("outside_training", message, count=outside))
    floor = floor_of_run(run, used, errors.before, averaging_s, noise)
    scale_se, scale_half = metrics.scale_factor_spread(after)
    return RunJudgement(
        run=run.name,
        unit=run.facts.unit,
        axis=run.facts.axis,
        averaging_s=averaging_s,
        before=metrics.figures(before),
        after=metrics.figures(after),
        floor=floor.value,
        floor_ci90=(floor.lower, floor.upper) if floor.upper > 0.0 else None,
        floor_source=floor.source,
        outside_training=share,
        coverage=metrics.coverage(after, errors.half_width, errors.interval_averaging_s),
        rows_used=int(used.sum()),
        rows_left_out=int((~used).sum()),
        bias_reference="earth rate" if earth_known else "training mean",
        series=_series(errors, metrics, before, after),
        findings=findings,
        notes=(*((run.facts.notes,) if run.facts.notes else ()), *errors.notes, *metrics.notes),
        power_on_known=run.facts.powered_on is not None,
        facts=run.facts,
        short_averages=metrics.short_averages,
        short_freedom=metrics.short_freedom(after),
        scale_factor_se=scale_se,
        scale_factor_half_width=scale_half,
        soaks=metrics.soak_biases(before, after),
        not_settled=float((errors.flag[used] == NOT_FULL).mean()),
        table_rates=(float(run.rate.min()), float(run.rate.max())) if "rate" in run.columns else None,
    )


def _noise(run: Run) -> dict[str, Any] | None:
    """Allan terms and raw minimum of a run, found once for it."""
    if _NOISE not in run.__dict__:
        try:
            report = noise_report(run)
        except InputError:
            report = None
        run.__dict__[_NOISE] = report and {name: report[name] for name in ("terms", "minimum")}
    found: dict[str, Any] | None = run.__dict__[_NOISE]
    return found


def _series(errors: RunErrors, metrics: RunMetrics, before: FloatArray, after: FloatArray) -> AveragedSeries:
    run, used = errors.run, errors.used
    held = leading_temperature(run)
    temperature = np.full(len(run), np.nan) if held is None else held
    columns = [temperature, before, after, errors.half_width]
    averages = metrics.averages(*(column[used] for column in columns))
    temperature, before, after, half_width = averages.values
    # A window is named after the regime and the flag of its middle sample.
    middle = np.flatnonzero(used)[(averages.starts + averages.stops) // 2]
    found = regimes(run)
    rate = np.gradient(temperature, averages.time_s) * 60.0
    return AveragedSeries(
        time=averages.time_s,
        temperature=temperature,
        rate=rate,
        before=before,
        after=after,
        drift=before - after,
        lower=-half_width,
        upper=half_width,
        regime=np.asarray(found.names, dtype=np.str_)[found.labels[middle]],
        flag=np.asarray(errors.flag[middle], dtype=np.int8),
    )


def _notes(train: Sequence[Run], test: Sequence[Run]) -> tuple[str, ...]:
    runs = (*train, *test)
    unknown = sorted({run.name for run in runs if not run.earth_known})
    if not unknown:
        return ()
    if any(run.earth_known for run in runs):
        return (
            f"Earth rate is known for some runs and not for {', '.join(unknown)}: biases are given relative "
            "to the training runs' mean and hold the difference; state latitude and input_axis in the "
            "side file of each run.",
        )
    return (
        "Earth rate is not known (no latitude and input_axis in the side files): a constant is estimated, "
        "and biases are relative to the training runs' mean.",
    )
