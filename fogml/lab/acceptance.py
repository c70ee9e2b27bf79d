"""The acceptance report of one gyro: figures that its runs tell, before and after compensation, and limits.

Each figure is the one of `fogml.validation` and of ``fogml lab rate``: nothing is defined a second time here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.errors import InputError
from fogml.json_files import finite_json
from fogml.lab.acceptance_limits import Limits
from fogml.lab.acceptance_rows import QUANTITIES, TERMS
from fogml.lab.acceptance_soaks import soak_table, soaks_tell
from fogml.lab.rate_json import rate_json
from fogml.models.table import usable_rows
from fogml.runs.noise_of_run import moving_temperatures, noise_report
from fogml.runs.run import Run
from fogml.signals.averages import AVERAGING_S
from fogml.validation.judge import judge_run
from fogml.validation.repeatability import repeatability_of
from fogml.validation.results import RunJudgement
from fogml.validation.run_errors import RunErrors, run_errors

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

SCHEMA = "fogml.acceptance/1"
ACCEPTED, REJECTED, INCOMPLETE, NO_LIMITS = "accepted", "rejected", "incomplete", "no_limits"


@dataclass(frozen=True)
class Figure:
    """What the runs tell of a quantity: before and after compensation, the run it is from, and a remark."""

    before: float
    after: float
    of: str
    remark: str = ""


def acceptance_json(
    runs: Sequence[Run],
    model: DriftModel | None = None,
    limits: Limits | None = None,
    *,
    averaging_s: float = AVERAGING_S,
    turn_on_band: float | None = None,
    noise: Run | None = None,
    date: str | None = None,
) -> dict[str, Any]:
    """The acceptance report of one gyro.

    Parameters
    ----------
    runs
        Of one unit and axis: static, over temperature, on a rate table, in any number.
    model
        The drift model that the unit is used with; without it figures are of the output as it is.
    limits
        What the customer allows, of the figures after compensation.
    averaging_s
        Averaging time [s].
    turn_on_band
        Band about the settled bias that tells the turn-on time [deg/h].
    noise
        A static run for the noise terms; by default the longest of `runs` whose temperature is constant.
    date
        Date of issue.

    Returns
    -------
    dict
        Schema ``fogml.acceptance/1``. ``verdict`` is ``accepted``, ``rejected`` where a limit is missed,
        ``incomplete`` where none is and one was not tested, or the model has seen a run, and ``no_limits``.

    Raises
    ------
    InputError
        For runs of several units or axes, or of another than the model's, and for a run too short.
    """
    limits = limits or Limits()
    _check_one_gyro(runs)
    errors = [_errors(run, model) for run in runs]
    judged = [
        judge_run(one, averaging_s, (0.0, 0.0), one.run.earth_known, turn_on_band, noise) for one in errors
    ]
    after = [_compensated(one) for one in errors]
    figures = dict(_figures(runs, after, judged, noise))
    rows = [_row(one, figures.get(one.key), limits, model is not None) for one in QUANTITIES]
    seen = _seen(runs, model)
    verdict, reasons = _verdict(rows, limits, seen)
    earth = all(run.earth_known for run in runs)
    notes = [] if earth else ["Earth rate is not known (latitude, input_axis): the bias holds it."]
    notes += [f"{name}: the model was trained on this run" for name in seen]
    notes += list(dict.fromkeys(note for one in judged for note in one.notes))
    values: dict[str, Any] = {
        "schema": SCHEMA,
        "serial_number": runs[0].facts.unit,
        "axis": runs[0].facts.axis,
        "date": date,
        "synthetic": any(run.facts.synthetic for run in runs),
        "averaging_s": averaging_s,
        "runs": [_run(run, one) for run, one in zip(runs, judged, strict=True)],
        "model": None if model is None else _model(model),
        "limits": _limits(limits),
        "soaks": soak_table(judged),
        "rows": rows,
        "verdict": verdict,
        "reasons": reasons,
        "notes": notes,
    }
    return finite_json(values)


def _check_one_gyro(runs: Sequence[Run]) -> None:
    if not runs:
        raise InputError("no run is given; name the runs of one gyro")
    for what in ("unit", "axis"):
        held = sorted({str(getattr(run.facts, what)) for run in runs})
        if len(held) > 1:
            raise InputError(f"an acceptance report is of one gyro; the runs are of {what} {', '.join(held)}")


def _errors(run: Run, model: DriftModel | None) -> RunErrors:
    if model is not None:
        return run_errors(model, run)
    full = np.ones(len(run), dtype=np.bool_)
    used, notes = usable_rows(run, full)
    nothing = np.zeros(len(run))
    return RunErrors(run, run.error_deg_h, nothing, nothing, np.zeros(len(run), np.int8), full, used, notes)


def _compensated(errors: RunErrors) -> Run:
    """The run as it is after compensation."""
    columns = {**errors.run.columns, "gyro": errors.run.gyro_deg_h - errors.drift}
    return Run.derived(errors.run.name, columns, errors.run.facts, "deg/h")


def _figures(
    before: Sequence[Run], after: Sequence[Run], judged: Sequence[RunJudgement], noise: Run | None
) -> Iterator[tuple[str, Figure]]:
    """Each quantity that the runs tell."""
    for key in _OF_RUNS:
        told = [one for one in judged if getattr(one.after, key) is not None]
        if told:
            worst = max(told, key=lambda one: abs(getattr(one.after, key)))
            yield key, Figure(getattr(worst.before, key), getattr(worst.after, key), worst.run)
    for key, pair in soaks_tell(judged).items():
        if all(getattr(one.after, key) is None for one in judged):
            yield key, Figure(*pair, "all runs together")
    spread = repeatability_of(judged)
    if spread is not None:
        over = f"{spread.runs} {'power cycles' if spread.power_cycles else 'runs'}"
        yield "bias_repeatability", Figure(spread.bias.before, spread.bias.after, over)
        if spread.scale_factor is not None:
            figure = spread.scale_factor
            yield "scale_factor_repeatability", Figure(figure.before, figure.after, over)
    yield from _of_rates(before, after)
    yield from _of_noise(before, after, noise)


_OF_RUNS = (
    "bias",
    "bias_stability",
    "bias_stability_10s",
    "temperature_sensitivity",
    "hysteresis",
    "scale_factor_error",
    "scale_factor_nonlinearity",
    "scale_factor_asymmetry",
    "turn_on_time",
)
"""Figures of `fogml.validation.results.Metrics`, the largest of any run."""


def _of_rates(before: Sequence[Run], after: Sequence[Run]) -> Iterator[tuple[str, Figure]]:
    """What the tests on a rate table tell."""
    try:
        told = [rate_json(runs, source="") for runs in (before, after)]
    except InputError:
        return
    names = ", ".join(run.name for run in before if "rate" in run.columns)
    sensed = [one["temperature_sensitivity"] for one in told]
    if all(sensed):
        before_ppm, after_ppm = (one["ppm_per_degC"] for one in sensed)
        remark = f"{len(sensed[0]['temperature'])} temperatures"
        yield "scale_factor_temperature_sensitivity", Figure(before_ppm, after_ppm, names, remark)
    for key in ("threshold", "resolution"):
        unseen, seen = (None if one[key] is None else one[key]["below_deg_h"] for one in told)
        if unseen is not None and seen is not None:
            over = told[1][key]["above_deg_h"]
            yield key, Figure(unseen, seen, names, f"above {over:.3g}" if over else "at most")


def _of_noise(before: Sequence[Run], after: Sequence[Run], noise: Run | None) -> Iterator[tuple[str, Figure]]:
    """Noise terms of a static run: that which is named, else the longest at constant temperature."""
    pairs = [(noise, noise)] if noise is not None else list(zip(before, after, strict=True))
    static = [pair for pair in pairs if not pair[0].rate.any() and not moving_temperatures(pair[0])]
    if not static:
        return
    pair = max(static, key=lambda one: one[0].span_s)
    try:
        told = [noise_report(run)["terms"] for run in pair]
    except InputError:
        return
    for key, letter in TERMS.items():
        found, compensated = (one[letter]["value"] for one in told)
        if found is not None and compensated is not None:
            low, high = told[0][letter]["ci"]
            yield key, Figure(found, compensated, pair[0].name, f"90 % of {low:.3g} to {high:.3g}")


def _row(quantity: Any, found: Figure | None, limits: Limits, compensated: bool) -> dict[str, Any]:
    limit = limits.by_quantity.get(quantity.key)
    row: dict[str, Any] = {
        "quantity": quantity.key,
        "name": quantity.name,
        "ieee_952": quantity.ieee_952,
        "clause": quantity.clause or None,
        "gjb_2426a": quantity.gjb_2426a or None,
        "unit": quantity.unit,
        "tested": found is not None,
        "before": None if found is None else found.before,
        "after": None if found is None or not compensated else found.after,
        "of": None if found is None else found.of,
        "remark": f"not tested: needs {quantity.needs}" if found is None else found.remark,
        "limit": None if limit is None else limit.as_json(),
        "met": None,
    }
    if limit is not None and found is not None:
        row["met"] = bool(limit.holds(found.after))
    return row


def _seen(runs: Sequence[Run], model: DriftModel | None) -> list[str]:
    known = set() if model is None else {one.sha256 for one in model.card_.runs}
    return [run.name for run in runs if run.hash in known]


def _verdict(rows: Sequence[Mapping[str, Any]], limits: Limits, seen: Sequence[str]) -> tuple[str, list[str]]:
    if not limits.by_quantity:
        return NO_LIMITS, ["no limits are stated"]
    limited = [row for row in rows if row["limit"] is not None]
    missed = [f"{row['name']} is over its limit" for row in limited if row["met"] is False]
    lacking = [f"{row['name']} has a limit and was not tested" for row in limited if row["met"] is None]
    fitted = [f"{name} is a training run of the model, which says nothing of another run" for name in seen]
    if missed:
        return REJECTED, [*missed, *lacking, *fitted]
    if lacking or fitted:
        return INCOMPLETE, [*lacking, *fitted]
    return ACCEPTED, [f"all {len(limited)} limits are met"]


def _run(run: Run, judged: RunJudgement) -> dict[str, Any]:
    started = run.facts.started
    temperature = judged.series.temperature
    ends = [temperature.min(), temperature.max()]
    return {
        "run": run.name,
        "sha256": run.hash,
        "started": None if started is None else started.isoformat(),
        "span_h": run.span_s / 3600.0,
        "temperature_degC": [None if np.isnan(end) else float(end) for end in ends],
        "table_rate_deg_s": judged.table_rates,
        "bias_reference": "earth rate" if run.earth_known else "zero",
        "outside_training": judged.outside_training,
    }


def _model(model: DriftModel) -> dict[str, Any]:
    from fogml.models.saved import model_hash

    return {
        "kind": model.kind,
        "features": list(model.feature_names),
        "sha256": model_hash(model),
        "trained_on": [{"run": one.name, "sha256": one.sha256} for one in model.card_.runs],
    }


def _limits(limits: Limits) -> dict[str, Any] | None:
    if limits.file is None:
        return None
    return {
        "file": limits.file,
        "sha256": limits.sha256,
        "customer": limits.customer,
        "document": limits.document,
    }
