"""A repeat run for what is not known: whether it goes with temperature, with power-on, or comes anew."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.gap.families.closing import Foretold
from fogml.gap.families.inference import Inference
from fogml.gap.families.rows import Rows
from fogml.gap.result import SeparatingRun
from fogml.gap.separating import LEAST_DISTANCE
from fogml.runs.run import FloatArray
from fogml.twin.programme import Programme, programme_from

LATER_H = (1.0, 2.0, 4.0)
"""How much later than the power the chamber's programme may begin [h]."""
SETTLED_DEGC = 1.0
"""A course of temperature is straight between corners to this."""
OFF_H = 1.0
"""How long the power is off before, so that the unit is cold [h]."""
MOST_STEPS = 60
TOLD = ("temperature", "power-on", "time")


def repeat_run(found: Inference, every: Foretold) -> SeparatingRun | None:
    """The run in which the unknown shows most, again, with the power on some hours before the chamber moves.

    What goes with temperature comes that much later after power-on than it did, what goes with power-on does
    not, and what comes anew each time does neither. None where the unknown is too short for that in all runs.

    Parameters
    ----------
    found
        The inference.
    every
        All causes of the likeliest set.
    """
    scene = found.setting.scene
    unknown = [m for m in every.members if found.columns.families[m.family].kind == "unknown"]
    if not unknown:
        return None
    courses = [np.sum([every.of_member(i, m) for m in unknown], axis=0) for i in range(scene.fitted)]
    lengths = [_length(found, i, course) for i, course in enumerate(courses)]
    run = int(np.argmax(lengths))
    rows, course = scene.runs[run], courses[run]
    best: tuple[float, float] | None = None
    for hours in LATER_H:
        late = np.interp(rows.time_s - 3600.0 * hours, rows.time_s, course)
        apart = min(_length(found, run, late - course), _length(found, run, late), lengths[run])
        if best is None or apart > best[0]:
            best = apart, hours
    assert best is not None
    distance, hours = best
    if distance < LEAST_DISTANCE:
        return None
    soak = f"soak at {_start(rows):g} degC for"
    course_again, fastest = _steps(rows)
    steps = [f"{soak} {OFF_H:g} h", {f"{soak} {hours:g} h": ["power on"]}, *course_again]
    values: dict[str, Any] = {
        "schema": "fogml.programme/1",
        "name": "repeat-run",
        "start_temperature": f"{_start(rows):g} degC",
        "power": "off",
        "steps": steps,
    }
    if fastest > Programme.fastest_rate:
        values["fastest_rate"] = f"{fastest:.3g} degC/min"
    programme = programme_from(values, "repeat-run")
    total = OFF_H + hours + float(rows.run.span_s) / 3600.0
    told = (f"{soak} {OFF_H:g} h, power off", f"{soak} {hours:g} h, power on", *course_again)
    return SeparatingRun(TOLD, programme.as_yaml(), float(distance), total, told)


def _length(found: Inference, run: int, course: FloatArray) -> float:
    """Whitened length beside the constants of a course on one run."""
    scene, base = found.setting.scene, found.field.base
    parts = [course if i == run else np.zeros(len(scene.runs[i])) for i in range(scene.fitted)]
    white = found.field.whitening.stacked(parts)
    return math.sqrt(max(float(white @ white) - float(np.sum((base.basis.T @ white) ** 2)), 0.0))


def _course(rows: Rows) -> tuple[FloatArray, FloatArray]:
    """Time and temperature of what the chamber did, as far as it is recorded."""
    name = "T_chamber" if "T_chamber" in rows.readings else "T"
    return rows.even.time, rows.even.temperature(name)


def _start(rows: Rows) -> float:
    return float(round(float(_course(rows)[1][0]), 1))


def _steps(rows: Rows) -> tuple[list[str], float]:
    """The recorded course in sentences: soaks, and ramps from corner to corner; its fastest [degC/min]."""
    time, x = _course(rows)
    corners = _corners(time, x, SETTLED_DEGC)
    wider = SETTLED_DEGC
    while len(corners) > MOST_STEPS:
        wider *= 1.5
        corners = _corners(time, x, wider)
    said: list[str] = []
    at, soaked, fastest = _start(rows), 0.0, 0.0
    for one, other in pairwise(corners):
        minutes, to = float(time[other] - time[one]) / 60.0, float(round(float(x[other]), 1))
        if abs(to - at) < wider:
            soaked += minutes
            continue
        if soaked:
            said.append(f"soak at {at:g} degC for {max(soaked, 1.0):.0f} min")
        speed = float(f"{abs(to - at) / minutes:.3g}")
        fastest = max(fastest, speed)
        said.append(f"ramp to {to:g} degC at {speed:g} degC/min")
        at, soaked = to, 0.0
    return [*said, f"soak at {at:g} degC for {max(soaked, 1.0):.0f} min"], fastest


def _corners(time: FloatArray, x: FloatArray, within: float) -> Sequence[int]:
    """Corners of a line that stays near a course (D. Douglas and T. Peucker, Cartographica 10 (1973) 112)."""
    kept: NDArray[np.bool_] = np.zeros(len(x), dtype=np.bool_)
    kept[[0, -1]] = True
    todo = [(0, len(x) - 1)]
    while todo:
        low, high = todo.pop()
        if high - low < 2:
            continue
        line = np.interp(time[low : high + 1], time[[low, high]], x[[low, high]])
        off = np.abs(x[low : high + 1] - line)
        far = int(np.argmax(off))
        if off[far] > within:
            kept[low + far] = True
            todo += [(low, low + far), (low + far, high)]
    return np.flatnonzero(kept).tolist()
