"""A gyro on a tilting fixture on a rate table, simulated: measurements as the procedure records them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.lab.misalignment import TableMeasurements
from fogml.lab.misalignment_segments import Rows
from fogml.lab.misalignment_states import DOCUMENT_ANGLES_DEG, STATES
from fogml.runs.facts import EARTH_RATE_DEG_H
from fogml.settings_check import check_whole


@dataclass(frozen=True)
class TableUnit:
    """A synthetic gyro in a fixture.

    Attributes
    ----------
    K
        Scale factor [output per deg/s].
    delta_x_deg, delta_y_deg
        Components of the input axis out of the reference axis [deg].
    fixture_error_deg
        Zero error of the tilt [deg].
    cross_tilt_deg
        Tilt of the fixture across [deg].
    bias
        Output at rest without Earth rate [output].
    drift_per_s
        Change of the bias [output per s].
    """

    K: float = 1.0
    delta_x_deg: float = 0.0
    delta_y_deg: float = 0.0
    fixture_error_deg: float = 0.0
    cross_tilt_deg: float = 0.0
    bias: float = 0.0
    drift_per_s: float = 0.0

    def input_axis(self, turn_deg: float) -> FloatArray:
        """The input axis in fixture coordinates, turned clockwise as seen from +z, shape (3,).

        Raises
        ------
        InputError
            If the components are no direction.
        """
        x, y = np.sin(np.radians(self.delta_x_deg)), np.sin(np.radians(self.delta_y_deg))
        if x * x + y * y > 1.0:
            raise InputError(
                "the two components of the misalignment are no direction: their squares exceed 1"
            )
        turn = np.radians(turn_deg)
        cosine, sine = np.cos(turn), np.sin(turn)
        z = np.sqrt(1.0 - x * x - y * y)
        return np.array([x * cosine + y * sine, -x * sine + y * cosine, z])

    def table_axis(self, tilt_deg: FloatArray) -> FloatArray:
        """The table's axis in fixture coordinates at tilts, shape (n, 3)."""
        tilt = np.radians(np.asarray(tilt_deg) + self.fixture_error_deg)
        across = np.radians(self.cross_tilt_deg)
        rows = [
            np.sin(tilt) * np.cos(across),
            np.full_like(tilt, np.sin(across)),
            np.cos(tilt) * np.cos(across),
        ]
        return np.stack(rows, axis=-1)


def measurements(
    unit: TableUnit,
    tilts_deg: Sequence[float],
    rates_deg_s: Sequence[float],
    *,
    noise: float = 0.0,
    tilt_noise_deg: float = 0.0,
    state_angles_deg: Sequence[float] = DOCUMENT_ANGLES_DEG,
    seed: int = 0,
    output_unit: str = "V",
) -> TableMeasurements:
    """Turns of all states, tilts and rates, with noise of each turn and of each tilt setting."""
    check_whole("seed", seed)
    random = np.random.default_rng(seed)
    state, tilt, rate = (
        v.ravel() for v in np.meshgrid(np.array(STATES, dtype=float), tilts_deg, rates_deg_s, indexing="ij")
    )
    settings = tilt_noise_deg * random.standard_normal((len(STATES), len(tilts_deg)))
    set_tilt = tilt + np.repeat(settings.ravel(), len(rates_deg_s))
    axes = np.array([unit.input_axis(turn) for turn in state_angles_deg])[state.astype(int) - 1]
    output = unit.K * rate * np.sum(axes * unit.table_axis(set_tilt), axis=-1)
    output += noise * random.standard_normal(len(output))
    return TableMeasurements(
        state,
        tilt,
        rate,
        output,
        output_unit,
        "synthetic",
        tuple(state_angles_deg),
        synthetic=True,
        place=np.arange(float(len(output))),
    )


def samples(
    unit: TableUnit,
    tilts_deg: Sequence[float],
    rates_deg_s: Sequence[float],
    *,
    latitude_deg: float = 30.0,
    rest_s: float = 20.0,
    turn_s: float = 40.0,
    acceleration_deg_s2: float = 20.0,
    sample_s: float = 0.1,
    noise: float = 0.0,
    state_angles_deg: Sequence[float] = DOCUMENT_ANGLES_DEG,
    seed: int = 0,
    output_unit: str = "V",
) -> tuple[Rows, FloatArray]:
    """Samples of whole sequences: for each state, tilt and rate rest, turn +, rest, turn -, rest.

    Earth rate turns with the table. The table is trapezoidal in its rate.

    Returns
    -------
    rows, time
        As a recorded file holds them; time [s], shape (n,).
    """
    check_whole("seed", seed)
    random = np.random.default_rng(seed)
    blocks = [_sequence_rates(abs(r), rest_s, turn_s, acceleration_deg_s2, sample_s) for r in rates_deg_s]
    one_tilt = np.concatenate(blocks)
    count = len(STATES) * len(tilts_deg)
    rate = np.tile(one_tilt, count)
    time = np.asarray(sample_s * np.arange(len(rate)), dtype=np.float64)
    state = np.repeat(np.repeat(np.array(STATES, dtype=float), len(tilts_deg)), len(one_tilt))
    tilt = np.repeat(np.tile(np.asarray(tilts_deg, dtype=float), len(STATES)), len(one_tilt))
    axis = np.array([unit.input_axis(turn) for turn in state_angles_deg])[state.astype(int) - 1]
    along = np.sum(axis * unit.table_axis(tilt), axis=-1)
    angle = np.radians(np.cumsum(rate) * sample_s)
    earth = EARTH_RATE_DEG_H / 3600.0
    latitude = np.radians(latitude_deg)
    across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    turning = earth * np.cos(latitude) * across * np.cos(angle)
    output = unit.K * (along * (rate + earth * np.sin(latitude)) + turning)
    output += unit.bias + unit.drift_per_s * time + noise * random.standard_normal(len(time))
    return Rows("synthetic", output_unit, state, tilt, rate, output, tuple(state_angles_deg)), time


def _sequence_rates(
    rate: float, rest_s: float, turn_s: float, acceleration: float, sample_s: float
) -> FloatArray:
    """Table rate of rest, turn +, rest, turn -, rest [deg/s]."""
    ramp = np.linspace(0.0, rate, max(2, round(rate / acceleration / sample_s) + 1))
    turn = np.concatenate([ramp[1:-1], np.full(round(turn_s / sample_s), rate), ramp[-2:0:-1]])
    rest = np.zeros(round(rest_s / sample_s))
    return np.concatenate([rest, turn, rest, -turn, rest])
