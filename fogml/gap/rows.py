"""A run as rows: what was recorded and what drives it, as means over spans of time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.gap.own_simulator import OwnEffect, OwnOnRun
from fogml.gap.shapes import AT_AMPLITUDE
from fogml.runs.regimes import regimes
from fogml.runs.run import Run
from fogml.signals.smoothing import Smoothness, at_points, window_difference
from fogml.twin.effect import Effect
from fogml.twin.inputs import Inputs
from fogml.twin.nominal import (
    DELTA,
    DELTA_WINDOW_S,
    NominalConstants,
    bias_deg_h,
    scale_factor_ppm,
    temperature_slopes,
)
from fogml.twin.replay import Replayer
from fogml.twin.twin import Twin

READ_GROUPS = (("T", "T_in"), ("T_out",))
"""Temperatures that drive the model, by the sensors that err together."""
READ = tuple(name for group in READ_GROUPS for name in group)


def at_amplitude(declared: Effect, amplitude: float, shape: Mapping[str, float]) -> Mapping[str, float]:
    """A shape that asks for the response at an amplitude, where that is not in proportion to it."""
    return shape if declared.in_proportion or amplitude == 0.0 else {**shape, AT_AMPLITUDE: amplitude}


@dataclass(frozen=True, eq=False)
class Rows:
    """One run, m rows.

    Attributes
    ----------
    run
        As recorded.
    gap
        Recorded less the twin's replay at its priors' means, shape (m,) [deg/h].
    recorded
        Recorded less reference, shape (m,) [deg/h].
    end_s, row_s
        Where each row ends [s], shape (m,), and how long it lasts.
    weight
        Square root of the share of its samples that a row has, shape (m,).
    constants
        Response to a unit of each nominal constant, shape (m, 8) [deg/h].
    even, kept
        Inputs on even rows without a gap, temperatures smooth; which of them are rows.
    readings
        Temperatures as they were read, by name, on the even rows.
    smoothness
        How they were smoothed, by name.
    replay_errors
        What a lag of the readings of 1 s, and what smoothing leaves, make of the twin's own effects, shape
        (m, 2) [deg/h].
    own
        A laboratory's own simulator on the run, where that takes the twin's place.
    since_s
        Where what is judged begins on the run's clock [s]; what came before is its past.
    masked
        Samples left out, by why.
    cache
        Inputs that were worked out, by the temperatures and constants in them.
    """

    run: Run
    gap: FloatArray
    recorded: FloatArray
    end_s: FloatArray
    row_s: float
    weight: FloatArray
    constants: FloatArray
    even: Inputs
    kept: BoolArray
    readings: Mapping[str, FloatArray]
    smoothness: Mapping[str, Smoothness]
    by_sample: BySample
    replay_errors: FloatArray
    own: OwnOnRun | None = None
    since_s: float = 0.0
    masked: Mapping[str, int] = field(default_factory=dict)
    cache: dict[tuple[Any, ...], Inputs] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.gap)

    @property
    def turns(self) -> bool:
        """Whether the table turns."""
        angle = self.even.drives.get("angle")
        return bool(np.any(self.even.table_rate)) or (angle is not None and float(np.ptp(angle)) > 0.0)

    @cached_property
    def temperature(self) -> FloatArray:
        """T of each row [degC], shape (m,)."""
        return self.even.temperature("T")[self.kept]

    @cached_property
    def time_s(self) -> FloatArray:
        """Middle of each row [s], shape (m,)."""
        return self.end_s - 0.5 * self.row_s

    @cached_property
    def regime(self) -> NDArray[np.int8]:
        """Regime of each row; see `fogml.runs.regimes`."""
        labels = regimes(self.run).labels
        at = np.clip(np.searchsorted(self.run.time, self.time_s), 0, len(labels) - 1)
        return np.asarray(labels[at])

    @cached_property
    def per_ppm(self) -> FloatArray:
        """Response to a scale factor error of 1 ppm [deg/h], shape (m,)."""
        return 1e-6 * self.of(self.even.input_rate_deg_h * np.ones(len(self.kept)))

    def of(self, values: FloatArray) -> FloatArray:
        """Rows of what is given on the even ones, shape (e, ...) to (m, ...)."""
        return values[self.kept]

    def gap_of(self, twin: Twin) -> FloatArray:
        """Recorded output less the replay of a twin at the smooth temperatures [deg/h], shape (m,)."""
        smooth = self.by_sample.inputs(self.even, None).temperatures
        replayer = Replayer(self.run).with_temperatures({name: smooth[name] for name in self.readings})
        return self.of(self.by_sample.means(self.run.gyro_deg_h - replayer.output(twin)))

    def response(
        self,
        declared: Effect,
        shape: Mapping[str, float],
        temperatures: Mapping[str, FloatArray] | None = None,
        constants: Mapping[str, float] | None = None,
    ) -> FloatArray:
        """Of an effect per unit of its amplitude [deg/h], shape (m,).

        `temperatures` take the place of those of the even rows; `constants` are those at which an effect
        meets output and slopes. A shape that says `AT_AMPLITUDE` asks for what that amplitude makes of the
        output, over it.
        """
        about = shape.get(AT_AMPLITUDE)
        bare = {name: value for name, value in shape.items() if name != AT_AMPLITUDE}
        if isinstance(declared, OwnEffect):
            assert self.own is not None
            if about is None:
                return self.samples(self.own.response(declared.id, bare, constants or {}))
            return self.samples(self.own.changed(declared.id, bare, about, constants or {})) / about
        fast = {"rate", "angle", "output", "slopes", "earth"} & set(declared.needs)
        met = constants if {"output", "slopes"} & set(declared.needs) else None
        by_sample = self.turns and bool(fast or declared.stage in ("scale_factor", "rig", "loop"))
        inputs = self._inputs(by_sample, temperatures, met)
        values = np.asarray(
            declared.response(inputs, **bare)
            if about is None
            else declared.change(inputs, about, **bare) / about,
            dtype=np.float64,
        )
        if by_sample:
            return self.samples(values)
        return self.of(np.broadcast_to(values, self.kept.shape))

    def made(
        self,
        declared: Effect,
        amplitude: float,
        shape: Mapping[str, float],
        constants: Mapping[str, float] | None = None,
    ) -> FloatArray:
        """Of an effect at its amplitude [deg/h], shape (m,)."""
        return amplitude * self.response(declared, at_amplitude(declared, amplitude, shape), None, constants)

    def _inputs(
        self,
        by_sample: bool,
        temperatures: Mapping[str, FloatArray] | None,
        constants: Mapping[str, float] | None,
    ) -> Inputs:
        """Inputs at the samples, or on the even rows; worked out once.

        Arrays are kept with what they are told apart by, so that none takes another's place.
        """
        told = tuple((name, id(values)) for name, values in (temperatures or {}).items())
        key = (by_sample, told, None if constants is None else tuple(constants.values()))
        if key not in self.cache:
            if by_sample:
                inputs = self.by_sample.inputs(self.even, temperatures)
            elif temperatures:
                held = {**self.even.temperatures, **temperatures}
                inputs = replace(self.even, temperatures=held, cache={})
            else:
                inputs = self.even
            self.cache[key] = self._meeting(inputs, by_sample, constants)
        return self.cache[key].afresh()

    def samples(self, values: FloatArray) -> FloatArray:
        """Means of a series over the samples, shape (n,) to (m,)."""
        return self.of(self.by_sample.means(values))

    def _meeting(self, inputs: Inputs, by_sample: bool, constants: Mapping[str, float] | None) -> Inputs:
        """Inputs with the output of the model without effects, and its slopes, at constants."""
        if constants is None:
            return inputs
        if self.own is not None:
            over = (lambda values: values) if by_sample else self.by_sample.means
            told = {name: over(slope) for name, slope in self.own.slopes(constants).items()}
            return replace(inputs, output=over(self.own.output(constants)), slopes=told)
        nominal = NominalConstants(**dict(constants))
        output = (1.0 + 1e-6 * scale_factor_ppm(inputs, nominal)) * inputs.input_rate_deg_h
        output = output + bias_deg_h(inputs, nominal)
        return replace(inputs, output=np.asarray(output), slopes=temperature_slopes(inputs, nominal))


@dataclass(frozen=True, eq=False)
class BySample:
    """Samples of a run, the even row that each is in, and their mean square about its middle [s^2]."""

    recorded: Inputs
    row: IndexArray
    used: BoolArray
    counts: FloatArray
    spread: float
    cache: dict[int, tuple[FloatArray, FloatArray]] = field(default_factory=dict)

    def means(self, values: FloatArray) -> FloatArray:
        """Means of a series over even rows, shape (n,) to (e,); interpolated where there is no sample."""
        total = np.bincount(self.row[self.used], weights=values[self.used], minlength=len(self.counts))
        held = self.counts > 0
        means = np.divide(total, self.counts, out=np.zeros(len(total)), where=held)
        at = np.arange(len(total))
        return means if held.all() else np.where(held, means, np.interp(at, at[held], means[held]))

    def inputs(self, even: Inputs, temperatures: Mapping[str, FloatArray] | None) -> Inputs:
        """Inputs at the samples, with the even rows' temperatures."""
        held = {**even.temperatures, **(temperatures or {})}
        new = {name: values for name, values in held.items() if id(values) not in self.cache}
        for name, course in at_points(even.time, new, self.recorded.time, self.spread).items():
            self.cache[id(new[name])] = new[name], course
        smooth = {name: self.cache[id(values)][1] for name, values in held.items()}
        return replace(self.recorded.afresh(), temperatures=smooth, sensors={}, cache={})


def slopes(rows: Rows, constants: Mapping[str, float]) -> dict[str, FloatArray]:
    """Change of the nominal output with each temperature and with DeltaT, on the even rows."""
    if rows.own is not None:
        return {name: rows.by_sample.means(slope) for name, slope in rows.own.slopes(constants).items()}
    return temperature_slopes(rows.even.afresh(), NominalConstants(**dict(constants)))


def through_nominal(
    rows: Rows, told: Mapping[str, FloatArray], errors: Mapping[str, FloatArray]
) -> FloatArray:
    """What errors of temperatures [degC] on the even rows make of the replay, given slopes.

    Shape (m,) for errors of shape (e,); (m, k) for k errors side by side, shape (e, k).
    """
    total = np.zeros((len(rows.kept), *next((e.shape[1:] for e in errors.values()), ())))
    for name, slope in told.items():
        if name == DELTA:
            error = errors.get("T", errors.get("T_in"))
            if error is not None:
                ahead = 0.5 * rows.run.sample_s
                error = window_difference(rows.even.time, error, DELTA_WINDOW_S, ahead)
        else:
            error = errors.get(name, errors.get({"T": "T_in", "T_in": "T"}.get(name, name)))
        if error is not None:
            total = total + (slope if error.ndim == 1 else slope[:, None]) * error
    return rows.of(total)
