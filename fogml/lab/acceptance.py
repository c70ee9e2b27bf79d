"""The acceptance report of one gyro: figures that its runs tell, before and after compensation, and limits.

Each figure is the one of `fogml.validation` and of ``fogml lab rate``: nothing is defined a second time here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.errors import InputError, listed
from fogml.json_files import finite_json
from fogml.lab.acceptance_figures import Figure, figures_of, small_rates, soak_table
from fogml.lab.acceptance_rows import QUANTITIES, Limits
from fogml.models.table import usable_rows
from fogml.runs.findings import IMPLAUSIBLE, SATURATION
from fogml.runs.names import named_apart
from fogml.runs.run import Run
from fogml.runs.turning import check_noise_run, turning
from fogml.signals.averages import AVERAGING_S, block_averages
from fogml.validation.advice import Asked
from fogml.validation.judge import judge_run
from fogml.validation.results import RunJudgement
from fogml.validation.run_errors import RunErrors, run_errors

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

SCHEMA = "fogml.acceptance/1"
ACCEPTED, REJECTED, INCOMPLETE, NO_LIMITS = "accepted", "rejected", "incomplete", "no_limits"


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
        A static run for the noise terms; by default the longest of `runs` whose temperature is constant. Of
        one whose temperature moves, K and R are not told.
    date
        Date of issue.

    Returns
    -------
    dict
        Schema ``fogml.acceptance/1``. ``verdict`` is ``accepted``, ``rejected`` where a limit is missed,
        ``incomplete`` where none is and one was not tested, an output stands still or saturates, or the
        model has seen a run, and ``no_limits``.

    Raises
    ------
    InputError
        For runs of several units or axes, or of another than the model's, and a noise run that turns.
    """
    limits = limits or Limits()
    _check_one_gyro(runs)
    if noise is not None:
        check_noise_run(noise)
    (runs,) = named_apart(runs)
    errors = [_errors(run, model) for run in runs]
    brief = {one.run.name for one in errors if not _rests(one, averaging_s)}
    turned = {one.run.name for one in errors if one.run.name in brief and turning(one.run).any()}
    judged = []
    for one in errors:
        known, apart = one.run.earth_known, averaging_s
        if one.run.name in turned:
            # Its turns tell what they tell without an average of its rests.
            one = replace(one, used=np.ones_like(one.used))
        if one.run.name in brief:
            apart = min(averaging_s, max(0.25 * one.run.span_s, one.run.sample_s) or averaging_s)
        judged.append(judge_run(one, apart, (0.0, 0.0), known, turn_on_band, noise))
    after = [_compensated(one) for one in errors]
    figures = dict(figures_of(runs, after, judged, noise, limits, turned, brief))
    rows = [_row(one, figures.get(one.key), limits, model is not None) for one in QUANTITIES]
    seen = _seen(runs, model)
    still = [f"{one.run}: the output stands still: {one.still[0]}" for one in judged if one.still]
    cut = [(one.run, one.saturated) for one in judged if one.saturated]
    still += [f"{name}: {told}" for name, (told, share) in cut if share >= Asked().saturated]
    verdict, reasons = _verdict(rows, limits, seen, still)
    told = (*IMPLAUSIBLE, SATURATION)  # the table may turn faster than the gyro can
    notes = [f"{run.name}: {one.message}" for run in runs for one in run.findings if one.code in told]
    notes += _of_earth(runs)
    notes += [f"{name}: the model was trained on this run" for name in seen]
    notes += _left_out([one for one in errors if one.run.name not in turned]) + _near(rows, limits)
    for names, rest, others in (
        (turned, "the table rests for", "scale factor, threshold and resolution"),
        (brief - turned, "the run holds", "noise terms and bias stability over 10 s"),
    ):
        if names:
            notes.append(
                f"{listed(sorted(names), 3)}: {rest} less than two averages over {averaging_s:g} s "
                f"(--averaging), which tells no bias; {others} are told all the same"
            )
    small = {run.name for run in runs if small_rates(run)}
    if small:
        notes.append(
            f"{listed(sorted(small), 3)}: rates about zero, as a test of the threshold; bias and bias "
            "stability are of other runs where there are any"
        )
    turned = {note for one in errors for note in usable_rows(one.run, one.full)[1]}
    notes += list(dict.fromkeys(note for one in judged for note in one.notes if note not in turned))
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
        "soaks": soak_table([one for one in judged if one.run not in small | brief]),
        "rows": rows,
        "verdict": verdict,
        "reasons": reasons,
        "notes": notes,
    }
    return finite_json(values)


def _of_earth(runs: Sequence[Run]) -> list[str]:
    unknown = sorted({run.name for run in runs if not run.earth_known})
    if not unknown:
        return []
    if not any(run.earth_known for run in runs):
        return ["Earth rate is not known (latitude, input_axis): the bias holds it."]
    return [
        f"{listed(unknown, 3)}: Earth rate is not known (latitude, input_axis), so that bias, its "
        "repeatability and what soaks of several runs tell are of the others"
    ]


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
    nothing, good = np.zeros(len(run)), np.zeros(len(run), np.int8)
    return RunErrors(run, run.error_deg_h, nothing, nothing, good, good != 0, full, used, notes)


def _rests(errors: RunErrors, averaging_s: float) -> bool:
    """Whether a run tells a bias: it rests for two averages."""
    if averaging_s < errors.run.sample_s:
        return True
    resting = errors.used & ~turning(errors.run)
    return len(block_averages(errors.run.time[resting], window_s=averaging_s)) > 1


def _left_out(errors: Sequence[RunErrors]) -> list[str]:
    """What figures of the bias leave out, of all runs in one line."""
    out = {one.run.name: int((one.full & ~one.used).sum()) for one in errors}
    held = [name for name, count in out.items() if count]
    if not held:
        return []
    return [
        f"{listed(held, 3)}: bias and bias stability are of the table at rest; {sum(out.values())} samples "
        "while it turns or changes its rate are left out"
    ]


def _near(rows: Sequence[Mapping[str, Any]], limits: Limits) -> list[str]:
    """Figures that other runs of the same gyro may bring to the other side of their limit, in one line."""
    near = []
    for row in rows:
        limit, within = limits.by_quantity.get(row["quantity"]), row["ci90"]
        if limit is None or within is None:
            continue
        figure = row["before"] if row["after"] is None else row["after"]
        if len({limit.holds(value) for value in (figure, *within)}) > 1:
            near.append(row["name"])
    if not near:
        return []
    return [
        f"{listed(near, 3)}: the limit lies within the figure's 90 % interval. Figures are compared with "
        "limits as they are, without a guard band: other runs of this gyro may decide otherwise"
    ]


def _compensated(errors: RunErrors) -> Run:
    """The run as it is after compensation."""
    columns = {**errors.run.columns, "gyro": errors.run.gyro_deg_h - errors.drift}
    return Run.derived(errors.run.name, columns, errors.run.facts, "deg/h")


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
        "at_most": found is not None and found.at_most,
        "at_least": found is not None and found.at_least,
        "ci90": None if found is None or found.ci90 is None else list(found.ci90),
        "of": None if found is None else found.of,
        "remark": f"not tested: needs {quantity.needs}" if found is None else found.remark,
        "limit": None if limit is None else limit.as_json(),
        "met": None,
    }
    if limit is not None and found is not None:
        holds = bool(limit.holds(found.after))
        row["met"] = None if (found.at_least if holds else found.at_most) else holds
    return row


def _seen(runs: Sequence[Run], model: DriftModel | None) -> list[str]:
    known = set() if model is None else {one.sha256 for one in model.card_.runs}
    return [run.name for run in runs if run.hash in known]


def _verdict(
    rows: Sequence[Mapping[str, Any]], limits: Limits, seen: Sequence[str], still: Sequence[str]
) -> tuple[str, list[str]]:
    if not limits.by_quantity:
        return NO_LIMITS, [*still, "nothing is accepted or rejected"]
    limited = [row for row in rows if row["limit"] is not None]
    missed = [f"{row['name']} is {_beyond(row)} its limit" for row in limited if row["met"] is False]
    lacking = [_lacking(row) for row in limited if row["met"] is None]
    fitted = [f"{name} is a training run of the model, which says nothing of another run" for name in seen]
    if missed:
        return REJECTED, [*still, *missed, *lacking, *fitted]
    if still or lacking or fitted:
        return INCOMPLETE, [*still, *lacking, *fitted]
    return ACCEPTED, [f"all limits are met ({len(limited)})"]


def _beyond(row: Mapping[str, Any]) -> str:
    figure, low = row["before"] if row["after"] is None else row["after"], row["limit"]["from"]
    return "below" if low is not None and figure < low else "over"


def _lacking(row: Mapping[str, Any]) -> str:
    if row["tested"]:
        told = "least a figure that is within" if row["at_least"] else "most a figure that is over"
        return f"{row['name']} is only known to be at {told} its limit"
    return f"{row['name']} has a limit and was not tested"


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
