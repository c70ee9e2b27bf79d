"""Bias at each soak temperature of an acceptance test: on the way up, on the way down, the difference."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fogml.validation.results import RunJudgement, SoakBias
from fogml.validation.soaks import (
    EQUAL_TEMPERATURE_DEGC,
    Soak,
    hysteresis,
    temperature_sensitivity,
)

_APPROACH = {"up": "up", "down": "down", "none": "start"}


def soak_table(judged: Sequence[RunJudgement]) -> list[dict[str, Any]]:
    """One line a soak temperature, ascending: biases up, down and at the start [deg/h], and hysteresis.

    Of each run alone that holds several temperatures, where a run holds both ways; else of all runs
    together. Soaks of the same temperature and way are averaged.
    """
    groups = [(one.run, list(one.soaks)) for one in judged if one.soaks]
    if any({soak.approach for soak in soaks} >= {"up", "down"} for _, soaks in groups):
        groups = [(run, soaks) for run, soaks in groups if len(_by_temperature(soaks)) > 1]
    else:
        together = [soak for _, soaks in groups for soak in soaks]
        groups = [("all runs together" if len(groups) > 1 else groups[0][0], together)] if groups else []
    return [_line(run, group) for run, soaks in groups for group in _by_temperature(soaks)]


def soaks_tell(judged: Sequence[RunJudgement]) -> dict[str, tuple[float, float]]:
    """Temperature sensitivity and hysteresis of the soaks of all runs together, before and after."""
    soaks = [soak for one in judged for soak in one.soaks]
    held = [
        Soak(np.empty(0, np.intp), one.temperature, one.approach)  # type: ignore[arg-type]
        for one in soaks
    ]
    found = {}
    for key, figure in (("temperature_sensitivity", temperature_sensitivity), ("hysteresis", hysteresis)):
        pair = [figure(held, [getattr(one, when) for one in soaks]) for when in ("before", "after")]
        if pair[0] is not None and pair[1] is not None:
            found[key] = (pair[0], pair[1])
    return found


def _by_temperature(soaks: list[SoakBias]) -> list[list[SoakBias]]:
    order = sorted(soaks, key=lambda one: one.temperature)
    groups: list[list[SoakBias]] = []
    for soak in order:
        if groups and soak.temperature - groups[-1][0].temperature <= EQUAL_TEMPERATURE_DEGC:
            groups[-1].append(soak)
        else:
            groups.append([soak])
    return groups


def _line(run: str, group: list[SoakBias]) -> dict[str, Any]:
    line: dict[str, Any] = {
        "run": run,
        "temperature_degC": float(np.mean([one.temperature for one in group])),
    }
    for when in ("before", "after"):
        told: dict[str, float | None] = {}
        for approach, name in _APPROACH.items():
            values = [getattr(one, when) for one in group if one.approach == approach]
            told[name] = float(np.mean(values)) if values else None
        up, down = told["up"], told["down"]
        told["hysteresis"] = None if up is None or down is None else abs(up - down)
        line[when] = told
    return line
