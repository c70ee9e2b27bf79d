"""What every baseline writes: the keys of ``gap.json`` that are scored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.signatures import Stack
from fogml.json_files import write_json
from fogml.outputs import whole_file
from fogml.signals.averages import block_averages
from fogml.signals.noise_model import NoiseModel

AVERAGING_S = 100.0
_SEGMENT_S = 600.0
# Averages of noise alone reach this many floors once in some ten thousand blocks.
_OVER_FLOOR = 2.0
_NAMED = 0.5
_LEAST_SHARE = 0.05


@dataclass(frozen=True)
class Finding:
    """An effect that a baseline lists."""

    id: str
    members: tuple[str, ...]
    probability: float
    amplitude: float
    se: float | None
    shape: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Prediction:
    """What a baseline makes of some runs: rows of the recalibrated twin and of its final model.

    Both are outputs over the nominal twin at its priors' means [deg/h], shape (n,).
    """

    stack: Stack
    recalibrated: FloatArray
    after: FloatArray


def write_answer(
    out: Path,
    findings: Sequence[Finding],
    unknown: float,
    fit: Prediction,
    held_out: Prediction,
    noise: NoiseModel,
    structural: FloatArray | None = None,
) -> None:
    """Write ``gap.json``; findings in any order, those of no probability left out.

    `structural` is the structural gap on the fit runs [deg/h], shape (n,), where it is known without
    noise.
    """
    listed = sorted((f for f in findings if f.probability > 0.0), key=lambda f: -f.probability)
    units = {id: c.amplitude.unit for id, c in fit.stack.model.candidates().items()}
    values = {
        "schema": "fogml.gap/1",
        "runs": {"fit": fit.stack.names, "held_out": held_out.stack.names},
        "verdict": _verdict(listed, unknown),
        "which": [
            {
                "effect": f.id,
                "class": list(f.members),
                "probability": f.probability,
                "amplitude": {"value": f.amplitude, "se": f.se, "unit": units[f.id]},
                "parameters": f.shape,
            }
            for f in listed
        ],
        "unknown": {"probability": unknown},
        "where": {"segments": _segments(fit, noise, structural)},
        "how_far": _how_far(held_out, noise),
    }
    with whole_file(out / "gap.json") as partial:
        write_json(partial, values, indent=1)


def floor_of(noise: NoiseModel, averaging_s: float = AVERAGING_S) -> float:
    """Standard deviation of the noise in averages, flicker at its Allan deviation [deg/h]."""
    return float(np.sqrt(noise.white_density / averaging_s + 2.0 * np.log(2.0) / np.pi * noise.B**2))


def _verdict(listed: Sequence[Finding], unknown: float) -> str:
    named = [f for f in listed if f.probability >= _NAMED]
    if not named:
        return "unknown" if unknown >= _NAMED else "no_gap"
    if unknown >= _NAMED:
        return "partly_explained"
    return "ambiguous" if any(len(f.members) > 1 for f in named) else "explained"


def _how_far(held_out: Prediction, noise: NoiseModel) -> list[dict[str, Any]]:
    stack, floor, rows = held_out.stack, floor_of(noise), []
    series = (stack.gap, stack.gap - held_out.recalibrated, stack.gap - held_out.after)
    for name, time, *values in zip(stack.names, stack.time, *(stack.split(s) for s in series)):
        averages = block_averages(time, *values, window_s=AVERAGING_S)
        before, recalibrated, after = (float(np.sqrt(np.mean(v**2))) for v in averages.values)
        below = recalibrated**2 - floor**2
        closed = (recalibrated**2 - after**2) / below if below > _LEAST_SHARE * floor**2 else None
        rows.append(
            {
                "run": name,
                "averaging_s": AVERAGING_S,
                "unit": "deg/h",
                "before": before,
                "recalibrated": recalibrated,
                "after": after,
                "floor": floor,
                "closed": closed,
                "closed_ci90": None,
            }
        )
    return rows


def _segments(fit: Prediction, noise: NoiseModel, structural: FloatArray | None) -> list[dict[str, Any]]:
    """Stretches of at least 600 s whose averages exceed the floor."""
    limit, found = floor_of(noise), []
    stack, gap = fit.stack, structural
    if gap is None:
        limit, gap = _OVER_FLOOR * limit, stack.gap - fit.recalibrated
    for name, time, values in zip(stack.names, stack.time, stack.split(gap)):
        averages = block_averages(time, values, window_s=AVERAGING_S)
        over = np.concatenate(([False], np.abs(averages.values[0]) > limit, [False]))
        edges = np.flatnonzero(np.diff(over.astype(np.int8)))
        for first, last in zip(edges[::2], edges[1::2]):
            begin = float(averages.time_s[first]) - 0.5 * AVERAGING_S
            end = float(averages.time_s[last - 1]) + 0.5 * AVERAGING_S
            if end - begin >= _SEGMENT_S:
                found.append({"run": name, "from_s": begin, "to_s": end})
    return found
