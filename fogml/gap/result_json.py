"""The content of ``gap.json``, schema ``fogml.gap/1``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from fogml.gap.result import Diagnosis, Found
    from fogml.gap.result_parts import TemperatureExcess

SCHEMA = "fogml.gap/1"


def gap_values(found: Diagnosis) -> dict[str, Any]:
    """A diagnosis as plain values, ready for JSON."""
    same = ("noise", "evidence", "what_if", "nearest", "headline", "shares", "rehearsal", "compensation")
    values = {
        "schema": SCHEMA,
        "runs": {
            "fit": found.fit,
            "held_out": found.held_out,
            "noise": found.noise_run,
            "held_out_is_part_of_last_run": found.held_out_is_part,
            "unusable": [{"run": run, "reason": reason} for run, reason in found.unusable],
        },
        "model": found.model,
        "verdict": found.verdict,
        "which": [_found(f) for f in found.found],
        "suspected": [_found(f) for f in found.suspected],
        "unknown": found.unknown,
        "where": {**vars(found.where), "temperature": [_bin(t) for t in found.where.temperature]},
        "how_far": found.how_far,
        "undetectable": found.undetectable,
        "separating_run": found.separating_run,
        "constants": {
            c.name: {"value": c.value, "se": c.se, "unit": c.unit, "prior": [c.prior_mean, c.prior_sd]}
            for c in found.constants
        },
        **{name: getattr(found, name) for name in same},
        "assumed": found.assumed,
    }
    return {key: _plain(value) for key, value in values.items()}


def _found(found: Found) -> dict[str, Any]:
    odds = ("against_unknown", "among_known", "log_share")
    same = ("probability", "prior_probability", "amplitude", "parameters", "stage", "by_run", "consistent")
    return {
        "effect": found.effect,
        "class": found.members,
        "left_out": found.left_out,
        **{name: getattr(found, name) for name in same},
        "grows_per_day": found.grows,
        "onset": found.onset,
        "log_odds": None if found.log_odds is None else dict(zip(odds, found.log_odds)),
        "share": found.share,
        "place": found.place,
        "times_usual": found.times_usual,
    }


def _bin(found: TemperatureExcess) -> dict[str, Any]:
    same = {name: getattr(found, name) for name in ("significant", "mean_up", "mean_down")}
    ends = {"from": found.from_degc, "to": found.to_degc}
    return {**ends, "excess_rms": found.excess_rms, "unit": "deg/h", **same}


def _plain(values: Any) -> Any:
    """Dataclasses and mappings as dictionaries, tuples as lists, numpy numbers as Python's."""
    if is_dataclass(values) and not isinstance(values, type):
        values = vars(values)
    if isinstance(values, Mapping):
        return {key: _plain(value) for key, value in values.items()}
    if isinstance(values, list | tuple):
        return [_plain(value) for value in values]
    return values.item() if isinstance(values, np.generic) else values
