"""The content of ``gap.json``, schema ``fogml.gap/1``."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from fogml.gap.result import Diagnosis, Found
    from fogml.gap.result_parts import Where

SCHEMA = "fogml.gap/1"


def gap_values(diagnosis: Diagnosis) -> dict[str, Any]:
    """A diagnosis as plain values, ready for JSON."""
    return {
        "schema": SCHEMA,
        "runs": {
            "fit": list(diagnosis.fit),
            "held_out": list(diagnosis.held_out),
            "noise": diagnosis.noise_run,
            "held_out_is_part_of_last_run": diagnosis.held_out_is_part,
            "unusable": [{"run": run, "reason": reason} for run, reason in diagnosis.unusable],
        },
        "model": diagnosis.model,
        "verdict": diagnosis.verdict,
        "which": [_found(found) for found in diagnosis.found],
        "suspected": [_found(found) for found in diagnosis.suspected],
        "unknown": asdict(diagnosis.unknown),
        "where": _where(diagnosis.where),
        "how_far": [_plain(asdict(item)) for item in diagnosis.how_far],
        "undetectable": list(diagnosis.undetectable),
        "separating_run": None
        if diagnosis.separating_run is None
        else _plain(asdict(diagnosis.separating_run)),
        "constants": {
            c.name: {"value": c.value, "se": c.se, "unit": c.unit, "prior": [c.prior_mean, c.prior_sd]}
            for c in diagnosis.constants
        },
        "noise": _plain(asdict(diagnosis.noise)),
        "evidence": [_plain(asdict(item)) for item in diagnosis.evidence],
        "what_if": [_plain(asdict(item)) for item in diagnosis.what_if],
        "nearest": [_plain(asdict(item)) for item in diagnosis.nearest],
        "headline": list(diagnosis.headline),
        "shares": [_plain(asdict(item)) for item in diagnosis.shares],
        "rehearsal": [_plain(asdict(item)) for item in diagnosis.rehearsal],
        "compensation": None if diagnosis.compensation is None else _plain(asdict(diagnosis.compensation)),
        "assumed": list(diagnosis.assumed),
    }


def _found(found: Found) -> dict[str, Any]:
    return {
        "effect": found.effect,
        "class": list(found.members),
        "left_out": list(found.left_out),
        "probability": found.probability,
        "amplitude": asdict(found.amplitude),
        "parameters": {name: asdict(value) for name, value in found.parameters.items()},
        "stage": found.stage,
        "by_run": [asdict(item) for item in found.by_run],
        "consistent": found.consistent,
        "grows_per_day": found.grows,
        "onset": None if found.onset is None else asdict(found.onset),
        "log_odds": None
        if found.log_odds is None
        else dict(zip(("against_unknown", "among_known", "log_share"), found.log_odds)),
        "share": found.share,
        "place": found.place,
        "times_usual": found.times_usual,
    }


def _where(where: Where) -> dict[str, Any]:
    return {
        "stage": [_plain(asdict(item)) for item in where.stage],
        "regime": [_plain(asdict(item)) for item in where.regime],
        "temperature": [
            {
                "from": t.from_degc,
                "to": t.to_degc,
                "excess_rms": t.excess_rms,
                "unit": "deg/h",
                "significant": t.significant,
                "mean_up": t.mean_up,
                "mean_down": t.mean_down,
            }
            for t in where.temperature
        ],
        "timescale": [_plain(asdict(item)) for item in where.timescale],
        "segments": [asdict(item) for item in where.segments],
    }


def _plain(values: Any) -> Any:
    """Tuples as lists, numpy numbers as Python's."""
    if isinstance(values, dict):
        return {key: _plain(value) for key, value in values.items()}
    if isinstance(values, list | tuple):
        return [_plain(value) for value in values]
    if isinstance(values, np.generic):
        return values.item()
    return values
