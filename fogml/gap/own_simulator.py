"""A laboratory's own simulator in the twin's place: any `fogml.gap.model.GyroModel`, or its output alone.

It replays runs and says how its constants act; what its candidates are is told by the catalogue's family of
that id, or else by the responses that it gives over a grid of their shapes.

Of one that gives its output alone, the column ``replayed [deg/h]``, that is all that a gap is counted from.
How it answers to temperature, which families of sensors' faults ask for, is what the nominal constants make
of the column; what they leave of it is taken off the recording, so that recorded less replayed stays::

    gap = gyro - replayed = (gyro - replayed + stand_in) - stand_in
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, known_are
from fogml.gap.model import AnyModel, Candidate, EffectValue, GyroModel, ModelOnRun, TwinModel
from fogml.gap.result import Diagnosis
from fogml.gap.result_parts import RunSeries
from fogml.runs.columns import REPLAYED
from fogml.runs.lateness import late_rate
from fogml.runs.names import named_apart
from fogml.runs.run import Run
from fogml.twin.effect import Effect
from fogml.twin.effect_guard import as_series
from fogml.twin.inputs import Inputs
from fogml.twin.nominal import NAMES, PRIOR_SD, nominal_columns
from fogml.twin.quantities import GRADES
from fogml.twin.registry import clashing, effects
from fogml.twin.replay import inputs_of_run, replay
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin


class OwnEffect(Effect):
    """A candidate of a model, with what families ask of the catalogue's effects."""

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Not known apart from a run: see `OwnOnRun.response`."""
        raise TypeError(f"{self.id}: the model itself responds, on its runs")

    @property
    def in_proportion(self) -> bool:
        return not self.amplitudes


@dataclass(frozen=True, eq=False)
class OwnOnRun:
    """A model with a run's inputs, its temperatures smooth.

    Those are moved by ``step_degc``, up and down, for the slope of a replay. Slopes, and what is a little
    off, are worked out once for constants.
    """

    model: GyroModel
    run: Run
    step_degc: float
    slopes_at: dict[tuple[float, ...], dict[str, FloatArray]] = field(default_factory=dict)
    off_at: dict[tuple[float, ...], Mapping[str, FloatArray]] = field(default_factory=dict)

    @cached_property
    def on(self) -> ModelOnRun:
        """The model on the run."""
        return self.model.on(self.run)

    def output(self, constants: Mapping[str, float]) -> FloatArray:
        """The replay [deg/h], shape (n,)."""
        return self._told(self.on.output(constants), "output")

    def _told(self, found: Any, what: str) -> FloatArray:
        """What the simulator gave for the run, shape (n,); refused by name where that is no series."""
        count = len(self.run)
        told = as_series(found, count, f"{self.run.name}: {what} of the simulator '{self.model.name}'")
        return np.broadcast_to(told, (count,))

    def slopes(self, constants: Mapping[str, float]) -> dict[str, FloatArray]:
        """Change of the replay with each recorded temperature [deg/h/degC], shape (n,) each.

        By central differences, all of a run's temperature moved at once: a response to its rate has none.
        """
        key = tuple(constants.values())
        if key not in self.slopes_at:
            groups = {name: self.run.sensors(name) for name in ("T", "T_in", "T_out")}
            if groups["T_in"] == groups["T"]:
                del groups["T_in"]
            self.slopes_at[key] = {n: self._slope(held, constants) for n, held in groups.items() if held}
        return self.slopes_at[key]

    def _slope(self, sensors: Sequence[str], constants: Mapping[str, float]) -> FloatArray:
        up, down = (
            self.model.on(
                self.run.with_columns(**{name: self.run.columns[name] + step for name in sensors})
            ).output(constants)
            for step in (self.step_degc, -self.step_degc)
        )
        ends = (self._told(end, "output at another temperature") for end in (up, down))
        return np.asarray(np.subtract(*ends) / (2.0 * self.step_degc))

    def columns(self) -> FloatArray:
        """Response to a unit of each constant, shape (n, c); 0 where the run can't show one."""
        told, found = self.on.columns(), np.zeros((len(self.run), len(self.model.constants)))
        for column, constant in zip(found.T, self.model.constants):
            column += self._told(told.get(constant.name, 0.0), f"response to '{constant.name}'")
        return found

    def nuisances(self, constants: Mapping[str, float]) -> Mapping[str, FloatArray]:
        """What is always a little off, one standard deviation of each [deg/h], shape (n,)."""
        key = tuple(constants.values())
        if key not in self.off_at:
            off = self.on.nuisances(constants)
            self.off_at[key] = {n: self._told(v, f"nuisance '{n}'") for n, v in off.items()}
        return self.off_at[key]

    def response(self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]) -> FloatArray:
        """Of a candidate, per unit of its amplitude [deg/h], shape (n,)."""
        return self._told(self.on.response(id, shape, constants), f"response to '{id}'")

    def changed(
        self, id: str, shape: Mapping[str, float], amplitude: float, constants: Mapping[str, float]
    ) -> FloatArray:
        """What a candidate makes of the output at an amplitude [deg/h], shape (n,)."""
        value = EffectValue(id, amplitude, shape)
        return self._told(self.on.output(constants, (value,)), f"output with '{id}'") - self.output(constants)


def candidates_of(model: AnyModel) -> dict[str, Effect]:
    """What may be named: a model's own candidates, or the catalogue's where it offers none.

    Of the catalogue's none that can't be on beside what a twin has.
    A candidate that bears an id of the catalogue's has that one's family, and its own sizes.
    """
    catalogue = {id: declared for id, declared in effects().items() if declared.candidate}
    if isinstance(model, TwinModel):
        known = {id: declared for id, declared in catalogue.items() if id not in model.lacks}
        return {id: declared for id, declared in known.items() if not clashing(declared, model.twin.settings)}
    offered = dict(model.candidates())
    return {id: _declared(c, catalogue.get(id)) for id, c in offered.items()} if offered else catalogue


def _check(model: GyroModel) -> None:
    """Refuse what a simulator says of itself that a diagnosis can't go on with."""
    what = f"the simulator '{model.name}'"
    if model.grade not in GRADES:
        raise InputError(f"{what}: grade is {model.grade!r}; {known_are(str(model.grade), GRADES, 'grades')}")
    if not 0.0 <= model.memory_s < math.inf:
        raise InputError(f"{what}: memory_s is {model.memory_s!r}; a number of 0 or above is needed")
    names = [c.name for c in model.constants]
    for c in model.constants:
        if names.count(c.name) > 1 or not (math.isfinite(c.mean) and 0.0 <= c.sd < math.inf):
            raise InputError(
                f"{what}: constant '{c.name}' has mean {c.mean!r} and sd {c.sd!r}, and stands there "
                f"{names.count(c.name)} times; a finite mean, an sd of 0 or above, and once is needed"
            )
    for name, value in vars(model.noise).items():
        if not (1.0 if name.startswith("factor") else 0.0) <= value < math.inf:
            raise InputError(
                f"{what}: {name} of its noise is {value!r}; of 0 or above, a factor of 1 or above"
            )


def _declared(candidate: Candidate, alike: Effect | None) -> Effect:
    """A candidate as an effect; `alike` is the catalogue's of its id."""
    if candidate is alike:
        return candidate
    told: dict[str, Any] = {
        name: getattr(candidate, name, {} if name == "confused_with" else ())
        for name in ("id", "title", "stage", "amplitude", "shape", "confused_with")
    }
    told |= {
        "drawn_per_run": bool(getattr(candidate, "drawn_per_run", False)),
        "told_by": tuple(getattr(candidate, "told_by", ())),
        "amplitudes": tuple(getattr(candidate, "amplitudes", ())),
        "family": alike.family if alike else "signature",
        "place": getattr(candidate, "place", alike.place if alike else ""),
    }
    return type("Own", (OwnEffect,), told)()


def plant_of(model: AnyModel) -> Twin:
    """The twin whose plant tells temperatures that were not recorded: the model's, or the nominal one.

    Raises
    ------
    InputError
        If what a model says of itself is nothing that a diagnosis can go on with.
    """
    if isinstance(model, TwinModel):
        return model.twin
    _check(model)
    return load_twin("nominal")


PRIOR_ROWS = 1e-3
"""Weight of the constants' priors, in rows: enough to hold what no run shows at nought, and no more."""
NAME = "the runs' column 'replayed'"
_REPLAYED_SERIES = ("recorded", "replayed_before", "replayed_recalibrated", "replayed_after")


@dataclass(frozen=True, eq=False)
class ByColumn:
    """The stand-in, and runs whose gyro, less the stand-in's replay, is recorded less the column.

    ``apart`` holds times [s] and column less the stand-in's replay [deg/h], by run; ``late`` a sentence of
    each run whose column follows the table's rate late or early.
    """

    model: TwinModel
    fit: list[Run]
    held_out: list[Run]
    apart: dict[str, tuple[FloatArray, FloatArray]]
    late: tuple[str, ...]

    def shown(self, found: Diagnosis) -> Diagnosis:
        """A diagnosis with recorded and replayed series as they are, and with what was assumed."""
        said = (
            "Replayed is what the runs' column 'replayed' says; twin.yaml is the nominal twin nearest to it, "
            "with what was found.",
        )
        series = tuple(map(self._moved, found.series))
        told = replace(found, headline=(*found.headline, *self.late), assumed=(*said, *found.assumed))
        return replace(told, series=series)

    def _moved(self, shown: RunSeries) -> RunSeries:
        """Averages of a run, recorded and replayed moved by what the column is apart from the stand-in."""
        if shown.run not in self.apart:
            return shown
        time, apart = self.apart[shown.run]
        whole = np.concatenate([[0.0], np.cumsum(apart)])
        half = 0.5 * shown.averaging_s * np.array([-1.0, 1.0])
        ends = np.searchsorted(time, shown.time_s[:, None] + half)
        count = np.maximum(ends[:, 1] - ends[:, 0], 1)
        mean = (whole[ends[:, 1]] - whole[ends[:, 0]]) / count
        return replace(shown, **{name: getattr(shown, name) + mean for name in _REPLAYED_SERIES})


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
        If the output is in counts without a scale factor, or the column is the output itself.
    """
    fit, held_out = named_apart(fit, held_out)
    runs = (*fit, *held_out)
    if same := [run.name for run in runs if np.array_equal(run.columns[REPLAYED], run.gyro_deg_h)]:
        raise InputError(f"{same[0]}, column 'replayed': is the recorded output itself, not a simulator's")
    stand_in = _nearest(twin, fit)
    apart, made = {}, []
    for run in runs:
        rest = run.columns[REPLAYED] - replay(stand_in, run)
        apart[run.name] = run.time, rest
        columns = {name: values for name, values in run.columns.items() if name != REPLAYED}
        facts = run.facts.model_copy(update={"scale_factor": None})
        made.append(Run(run.name, {**columns, "gyro": run.gyro_deg_h - rest}, facts, "deg/h"))
    late = tuple(f"{run.name}: {f.message}." for run in runs for f in late_rate(run, REPLAYED))
    return ByColumn(TwinModel(stand_in), made[: len(fit)], made[len(fit) :], apart, late)


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
