"""What truly happened in one run, in the form in which every reality tells it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.blind.frame.nominal import WINDOW_S, delta_of_record

EARTH_DEG_H = 15.041067


class Told(Protocol):
    """A run's programme, as far as its files tell of it."""

    @property
    def text(self) -> str:
        """The chamber's part in words."""

    @property
    def powered_on(self) -> float:
        """Power-on on the run's clock [s]."""

    @property
    def duration_s(self) -> float:
        """How long the run lasts [s]."""

    @property
    def turns(self) -> Sequence[tuple[float, float, float]]:
        """Turns of the table: start and end [s], rate [deg/s]."""


@dataclass(frozen=True)
class SetUp:
    """How the unit is mounted: `heading` in deg for a horizontal axis, None for an upright one."""

    latitude: float
    heading: float | None

    @property
    def earth_deg_h(self) -> float:
        """Earth rate along the input axis [deg/h]."""
        lat = np.radians(self.latitude)
        if self.heading is None:
            return float(EARTH_DEG_H * np.sin(lat))
        return float(EARTH_DEG_H * np.cos(lat) * np.cos(np.radians(self.heading)))


@dataclass(frozen=True, eq=False)
class World:
    """Everything that truly happened in one run, at its n samples.

    Attributes
    ----------
    time
        s, shape (n,).
    nodes
        True temperatures [degC] by the run format's names, ``T_coil`` (mean of the winding), and others
        of the reality's own plant, each of shape (n,).
    rates
        Their rates [degC/min].
    shell_rates
        Rates of the winding's parts [degC/min], in the reality's own order, shape (n, parts).
    deltas
        Mean over the last 64 s less that over the 64 s before of ``T_in`` and ``T_out`` [degC].
    table_rate
        Mean over the sample [deg/s]; `angle` [deg] at its end, not wrapped.
    drives
        ``supply`` V, ``power`` W, ``humidity`` %, ``vibration`` g, ``compressor``, ``heater``, ``fan``
        0 to 1, ``B_x`` ``B_y`` ``B_z`` uT.
    time_on
        Time since power-on [s].
    programme
        What it was told to do.
    place
        Number of the run among the unit's.
    since_first
        Time from the beginning of the unit's first run to this one's [s].
    past
        Where the winding's temperature turned before the run, oldest first [degC], as far as it is told.
    """

    time: FloatArray
    sample_s: float
    nodes: dict[str, FloatArray]
    rates: dict[str, FloatArray]
    shell_rates: FloatArray
    deltas: dict[str, FloatArray]
    table_rate: FloatArray
    angle: FloatArray
    drives: dict[str, FloatArray]
    time_on: FloatArray
    set_up: SetUp
    programme: Told
    place: int
    since_first: float = 0.0
    past: tuple[float, ...] = ()

    @cached_property
    def rate_deg_h(self) -> FloatArray:
        """True rate about the input axis, table and Earth [deg/h], shape (n,)."""
        return 3600.0 * self.table_rate + self.set_up.earth_deg_h

    def mean_cosine(self, harmonic: float, phase_deg: float) -> FloatArray:
        """Mean of cos(harmonic * angle - phase) over each sample, shape (n,)."""
        end = harmonic * np.radians(self.angle) - np.radians(phase_deg)
        half = 0.5 * harmonic * np.radians(self.table_rate * self.sample_s)
        return np.cos(end - half) * np.sinc(half / np.pi)


@dataclass(frozen=True, eq=False)
class Course:
    """Finer times `t` [s] that a plant is worked out at, from before a run to its end, `step_s` apart.

    `at` are the places of the run's n samples among them.
    """

    programme: Told
    sample_s: float
    step_s: float
    t: FloatArray
    at: IntArray

    @classmethod
    def of(cls, programme: Told, sample_s: float, finest_s: float, longest_before_s: float) -> Course:
        """From power-on or so long before the run, and two windows before it at least."""
        per = max(int(np.ceil(sample_s / finest_s)), 1)
        step_s = sample_s / per
        wanted_s = max(min(-programme.powered_on, longest_before_s), 2.0 * WINDOW_S + sample_s)
        before = int(np.ceil(wanted_s / sample_s)) * per
        count = round(programme.duration_s / sample_s)
        t = np.asarray(step_s * np.arange(-before, count * per, dtype=np.float64))
        return cls(programme, sample_s, step_s, t, before + per * np.arange(count, dtype=np.int64))

    @cached_property
    def table_rate(self) -> FloatArray:
        """Rate of the table at the run's samples [deg/s], shape (n,); a later turn has the word."""
        time = self.t[self.at]
        rates = np.zeros(len(time))
        for start, stop, rate in self.programme.turns:
            rates[(time > start + 1e-6) & (time < stop + 1e-6)] = rate
        return rates

    @cached_property
    def angle(self) -> FloatArray:
        """The table's angle [deg] at the end of each sample, shape (n,)."""
        return np.cumsum(self.table_rate * self.sample_s)

    def world(self, full: dict[str, FloatArray], winding: FloatArray, **more: Any) -> World:
        """What happened, of temperatures of nodes and of the winding's parts at the finer times."""
        time, at, per_minute = self.t[self.at], self.at, 60.0 / self.step_s
        return World(
            time=time,
            sample_s=self.sample_s,
            nodes={name: values[at] for name, values in full.items()},
            rates={name: per_minute * np.gradient(values)[at] for name, values in full.items()},
            shell_rates=per_minute * np.gradient(winding, axis=0)[at],
            # By the samples, as a replay has it: what a coarse interval hides of DeltaT is no effect.
            deltas={name: delta_of_record(time, full[name][at]) for name in ("T_in", "T_out")},
            table_rate=self.table_rate,
            angle=self.angle,
            time_on=time - self.programme.powered_on,
            programme=self.programme,
            **more,
        )
