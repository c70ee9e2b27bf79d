"""What truly happened in one run, in the form in which every reality tells it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

EARTH_DEG_H = 15.041067


class Told(Protocol):
    """A run's programme, as far as its files tell of it."""

    @property
    def text(self) -> str:
        """The chamber's part in words."""

    @property
    def powered_on(self) -> float:
        """Power-on on the run's clock [s]."""


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
