"""A judgement as the values of ``report.json`` and ``compare.json``."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from fogml.json_files import finite_json
from fogml.validation.advice import advice_on
from fogml.validation.certified import set_up, with_uncertainty
from fogml.validation.floors import left_is_noise
from fogml.validation.results import Judgement, LimitOutcome, Metrics, Repeatability, RunJudgement

if TYPE_CHECKING:
    from fogml.validation.compare import Comparison

TRAIN_SCHEMA = "fogml.train/1"
COMPARE_SCHEMA = "fogml.compare/1"

TURN_ON = "turn_on_time"


def judgement_json(judgement: Judgement) -> dict[str, Any]:
    """A judgement as JSON-ready values, schema ``fogml.train/1``."""
    values: dict[str, Any] = {"schema": TRAIN_SCHEMA, **_body(judgement)}
    return finite_json(values)


def comparison_json(comparison: Comparison) -> dict[str, Any]:
    """A comparison as JSON-ready values, schema ``fogml.compare/1``.

    ``models`` holds each judged model as in ``fogml.train/1``, ``failed`` the reason for each
    that could not be fitted or judged.
    """
    values = {
        "schema": COMPARE_SCHEMA,
        "models": {name: _body(judgement) for name, judgement in comparison.judgements.items()},
        "failed": dict(comparison.failed),
    }
    return finite_json(values)


def _body(judgement: Judgement) -> dict[str, Any]:
    values: dict[str, Any] = {
        "model": judgement.model,
        "train": [_run(run) for run in judgement.train],
        "test": [_run(run) for run in judgement.test],
    }
    if judgement.design_index is not None:
        outcome = judgement.design_index
        values["design_index"] = {"limit": outcome.limit, "value": outcome.value, "met": outcome.met}
    if judgement.repeatability is not None:
        values["repeatability"] = _repeatability(judgement.repeatability)
    values["limits"] = [_limit(outcome) for outcome in judgement.limits]
    values["met"] = judgement.met
    advice = advice_on(judgement)
    values |= {"verdict": advice.grade, "reasons": list(advice.reasons), "next_step": advice.next_step}
    values["notes"] = list(judgement.notes)
    if judgement.beside:
        values["beside"] = {
            name: {"test": [_run(run) for run in runs]} for name, runs in judgement.beside.items()
        }
    return values


def _run(judged: RunJudgement) -> dict[str, Any]:
    return {
        "run": judged.run,
        "unit": "deg/h",
        "averaging_s": judged.averaging_s,
        "before": _metrics(judged.before),
        "after": _metrics(judged.after),
        "floor": judged.floor,
        "floor_ci90": None if judged.floor_ci90 is None else list(judged.floor_ci90),
        "floor_source": judged.floor_source,
        "left_is_noise": left_is_noise(judged),
        "outside_training": judged.outside_training,
        "not_settled": judged.not_settled,
        "coverage": judged.coverage,
        "rms_by_regime": judged.series.by_regime(),
        "rows_used": judged.rows_used,
        "rows_left_out": judged.rows_left_out,
        "bias_reference": judged.bias_reference,
        "serial_number": judged.unit,
        "axis": judged.axis,
        "set_up": set_up(judged),
        "with_uncertainty": with_uncertainty(judged),
        "noise": judged.noise,
        "findings": [finding.as_dict() for finding in judged.findings],
        "notes": list(judged.notes),
    }


def _repeatability(found: Repeatability) -> dict[str, Any]:
    """Bias in deg/h, scale factor in ppm."""
    told = {"bias": found.bias, "scale_factor": found.scale_factor}
    return {
        "runs": found.runs,
        "over": "power cycles" if found.power_cycles else "runs",
        **{name: asdict(figure) for name, figure in told.items() if figure is not None},
    }


def _metrics(metrics: Metrics) -> dict[str, float | None]:
    held = {name: value for name, value in asdict(metrics).items() if value is not None}
    return held | {TURN_ON: _settled(held[TURN_ON])} if TURN_ON in held else held


def _limit(outcome: LimitOutcome) -> dict[str, Any]:
    values = asdict(outcome)
    return values | {"value": _settled(outcome.value)} if outcome.quantity == TURN_ON else values


def _settled(time_s: float | None) -> float | None:
    """A turn-on time [s]; null where the run does not settle, and the time is infinite."""
    return None if time_s is None or math.isinf(time_s) else time_s
