"""The content of ``gap.json``, schema ``fogml.gap/1``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from fogml.gap.result import Diagnosis, Found
    from fogml.gap.result_parts import Where

SCHEMA = "fogml.gap/1"


def gap_values(found: Diagnosis) -> dict[str, Any]:
    """A diagnosis as plain values, ready for JSON."""
    return {
        "schema": SCHEMA,
        "runs": {
            "fit": list(found.fit),
            "held_out": list(found.held_out),
            "noise": found.noise_run,
            "held_out_is_part_of_last_run": found.held_out_is_part,
            "unusable": [{"run": run, "reason": reason} for run, reason in found.unusable],
        },
        "model": found.model,
        "verdict": found.verdict,
        "which": [_found(f) for f in found.found],
        "suspected": [_found(f) for f in found.suspected],
        "unknown": _plain(found.unknown),
        "where": _where(found.where),
        "how_far": _plain(found.how_far),
        "undetectable": list(found.undetectable),
        "separating_run": _plain(found.separating_run),
        "constants": {
            c.name: {"value": c.value, "se": c.se, "unit": c.unit, "prior": [c.prior_mean, c.prior_sd]}
            for c in found.constants
        },
        **{
            name: _plain(getattr(found, name))
            for name in ("noise", "evidence", "what_if", "nearest", "headline", "shares", "rehearsal")
        },
        "compensation": _plain(found.compensation),
        "assumed": list(found.assumed),
    }


def _found(found: Found) -> dict[str, Any]:
    odds = ("against_unknown", "among_known", "log_share")
    same = ("probability", "prior_probability", "amplitude", "parameters", "stage", "by_run", "consistent")
    return {
        "effect": found.effect,
        "class": list(found.members),
        "left_out": list(found.left_out),
        **{name: _plain(getattr(found, name)) for name in same},
        "grows_per_day": found.grows,
        "onset": _plain(found.onset),
        "log_odds": None if found.log_odds is None else dict(zip(odds, found.log_odds)),
        "share": found.share,
        "place": found.place,
        "times_usual": found.times_usual,
    }


def _where(where: Where) -> dict[str, Any]:
    return {
        "stage": _plain(where.stage),
        "regime": _plain(where.regime),
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
        "timescale": _plain(where.timescale),
        "segments": _plain(where.segments),
    }


def _plain(values: Any) -> Any:
    """Dataclasses and mappings as dictionaries, tuples as lists, numpy numbers as Python's."""
    if is_dataclass(values) and not isinstance(values, type):
        values = asdict(values)
    if isinstance(values, Mapping):
        return {key: _plain(value) for key, value in values.items()}
    if isinstance(values, list | tuple):
        return [_plain(value) for value in values]
    return values.item() if isinstance(values, np.generic) else values
