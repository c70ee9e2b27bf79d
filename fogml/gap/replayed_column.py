"""A laboratory's own simulator by its output alone: the column ``replayed [deg/h]`` of the runs.

What a simulator gives for a run's inputs is all that a gap is counted from. How it answers to temperature,
which families of sensors' faults ask for, is what the nominal constants make of the column; what they leave
of it is taken off the recording, so that recorded less replayed stays what it is::

    gap = gyro - replayed = (gyro - replayed + stand_in) - stand_in
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from fogml.errors import InputError
from fogml.gap.model import TwinModel
from fogml.gap.result import Diagnosis
from fogml.gap.result_parts import Counterfactual, RunSeries
from fogml.runs.columns import REPLAYED
from fogml.runs.run import FloatArray, Run
from fogml.twin.nominal import NAMES, PRIOR_SD, nominal_columns
from fogml.twin.replay import inputs_of_run, replay
from fogml.twin.twin import Twin

PRIOR_ROWS = 1e-3
"""Weight of the constants' priors, in rows: enough to hold what no run shows at nought, and no more."""
NAME = "the runs' column 'replayed'"
_REPLAYED_SERIES = ("recorded", "replayed_before", "replayed_recalibrated", "replayed_after")
Shown = TypeVar("Shown", RunSeries, Counterfactual)


@dataclass(frozen=True, eq=False)
class ByColumn:
    """Runs and the model that a diagnosis of a column takes.

    Attributes
    ----------
    model
        The stand-in.
    fit, held_out
        Runs whose gyro, less the stand-in's replay, is recorded less the column.
    apart
        Column less the stand-in's replay [deg/h], by run.
    """

    model: TwinModel
    fit: list[Run]
    held_out: list[Run]
    apart: dict[str, tuple[FloatArray, FloatArray]]

    def shown(self, found: Diagnosis) -> Diagnosis:
        """A diagnosis with recorded and replayed series as they are, and with what was assumed."""
        said = (
            "Replayed is what the runs' column 'replayed' says; twin.yaml is the nominal twin nearest to it, "
            "with what was found.",
        )
        series = tuple(self._moved(s, _REPLAYED_SERIES) for s in found.series)
        others = tuple(self._moved(c, ("recorded", "replayed")) for c in found.counterfactuals)
        return replace(found, series=series, counterfactuals=others, assumed=(*said, *found.assumed))

    def _moved(self, shown: Shown, names: Sequence[str]) -> Shown:
        """Averages of a run, those of the names moved by what the column is apart from the stand-in."""
        if shown.run not in self.apart:
            return shown
        time, apart = self.apart[shown.run]
        whole = np.concatenate([[0.0], np.cumsum(apart)])
        half = 0.5 * shown.averaging_s * np.array([-1.0, 1.0])
        ends = np.searchsorted(time, shown.time_s[:, None] + half)
        count = np.maximum(ends[:, 1] - ends[:, 0], 1)
        mean = (whole[ends[:, 1]] - whole[ends[:, 0]]) / count
        return replace(shown, **{name: getattr(shown, name) + mean for name in names})


def has_column(runs: Sequence[Run]) -> bool:
    """Whether runs say what a simulator gives for them.

    Raises
    ------
    InputError
        If some do and others don't.
    """
    lacking = [run.name for run in runs if REPLAYED not in run.columns]
    if lacking and len(lacking) < len(runs):
        raise InputError(
            f"{', '.join(lacking)}: no column 'replayed [deg/h]', which the other runs have; replay every "
            "run, or none"
        )
    return not lacking


def by_column(twin: Twin, fit: Sequence[Run], held_out: Sequence[Run]) -> ByColumn:
    """The diagnosis of runs by their column ``replayed``.

    Parameters
    ----------
    twin
        Whose priors, sensors and plant hold; a nominal one.
    fit, held_out
        Runs that have the column, all of them.

    Raises
    ------
    InputError
        If the output is in counts without a scale factor.
    """
    stand_in = _nearest(twin, fit)
    apart, made = {}, []
    for run in (*fit, *held_out):
        rest = run.columns[REPLAYED] - replay(stand_in, run)
        apart[run.name] = run.time, rest
        columns = {name: values for name, values in run.columns.items() if name != REPLAYED}
        facts = run.facts.model_copy(update={"scale_factor": None})
        made.append(Run(run.name, {**columns, "gyro": run.gyro_deg_h - rest}, facts, "deg/h"))
    return ByColumn(TwinModel(stand_in), made[: len(fit)], made[len(fit) :], apart)


def _nearest(twin: Twin, runs: Sequence[Run]) -> Twin:
    """The nominal twin whose constants come nearest to the column over runs, by least squares."""
    scale = np.array([getattr(PRIOR_SD, name) for name in NAMES])
    parts = []
    for run in runs:
        inputs, _ = inputs_of_run(run)
        held = dict(nominal_columns(inputs))
        none = np.zeros(len(run))
        columns = np.column_stack([held.get(name, none) for name in NAMES]) * scale
        target = run.columns[REPLAYED] - replay(Twin(grade=twin.grade), run)
        parts.append((columns, target))
    rows = np.concatenate([np.concatenate([c for c, _ in parts]), PRIOR_ROWS**0.5 * np.eye(len(NAMES))])
    values = np.concatenate([*(t for _, t in parts), np.zeros(len(NAMES))])
    found = scale * np.linalg.lstsq(rows, values, rcond=None)[0]
    constants = dict(zip(NAMES, found.tolist()))
    return replace(twin, name=NAME, settings={}).with_nominal(**constants)
