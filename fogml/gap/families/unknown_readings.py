"""Errors of thermometers that no catalogue holds, through the nominal: as many kinds as errors of a bias."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from fogml.gap.families.family import Block
from fogml.gap.families.places import DIRECTION_DEGC_MIN, Scene, lag, rate
from fogml.gap.families.rows import Rows, slopes, through_nominal
from fogml.gap.families.thermal_families import bumps
from fogml.runs.run import FloatArray
from fogml.signals.recursions import play_kernel

GROUPS = (("T", "T_in"), ("T_out",))
"""Sensors that err apart."""
ALL = ("T", "T_in", "T_out")
SLACK_DEGC = (0.1, 0.3, 1.0)
"""What a sensor that sticks has to move by before it moves on: it errs by as much, and more would be seen."""
LARGEST_DEGC = 0.3
"""Usual most that a thermometer is wrong by: class A of IEC 60751 between -40 and 70 degC."""
HEALS_S = (1800.0, 7200.0, 30000.0)
STEPS, SINGLE_STEPS, WAVES = 20, 12, 12
Constants = Mapping[str, float]


def reading_errors(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Errors that go with temperature, its direction or its past: the same on every run."""
    of_all = {n: _of_temperature(rows, scene, n) for n in ALL if n in rows.readings}
    for group in (*GROUPS, ALL):
        of_each = {n: kinds for n, kinds in of_all.items() if n in group}
        for columns in _through(rows, constants, of_each, (10, 5, 15, *(1 for _ in 2 * SLACK_DEGC))):
            yield Block(columns)


def reading_errors_in_time(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Errors that wander, or go in steps, in a run's own time."""
    place = np.arange(len(rows.even.time)) / len(rows.even.time)
    waves = np.cos(np.pi * place[:, None] * np.arange(1, WAVES + 1))
    steps = (place[:, None] >= (np.arange(STEPS) + 1.0) / (STEPS + 1.0)).astype(np.float64)
    single = [
        (place[:, None] >= (i + 1.0) / (SINGLE_STEPS + 1.0)).astype(np.float64) for i in range(SINGLE_STEPS)
    ]
    for group in GROUPS:
        of_each = {n: [waves, steps, *single] for n in group if n in rows.readings}
        widths = (WAVES, STEPS, *(1 for _ in single))
        for i, columns in enumerate(_through(rows, constants, of_each, widths)):
            yield Block(columns, weight=1.0 if i < 2 else 1.0 / SINGLE_STEPS)


def _of_temperature(rows: Rows, scene: Scene, name: str) -> list[FloatArray]:
    """Errors of one reading by its course [degC], shape (e, k) each."""
    time, x = rows.even.time, np.ascontiguousarray(rows.even.temperatures[name])
    levels = bumps(x, *scene.range_degc, 5)
    ways = np.tanh(rate(time, x) / DIRECTION_DEGC_MIN)[:, None]
    spent = np.cumsum(levels, axis=0) / len(levels)
    healing = [lag(time, level, s) for level in levels.T for s in HEALS_S]
    # What a sensor that sticks would have read is near what another place did.
    other = rows.even.temperature("T_out" if name != "T_out" and "T_out" in rows.readings else "T_case")
    ways_stuck = [
        (play_kernel(np.ascontiguousarray(y), s, np.nan)[0] - y) / s for y in (x, other) for s in SLACK_DEGC
    ]
    stuck = [way[:, None] for way in ways_stuck]
    return [np.column_stack([levels, ways * levels]), spent, np.column_stack(healing), *stuck]


def _through(
    rows: Rows, constants: Constants, of_each: Mapping[str, list[FloatArray]], widths: tuple[int, ...]
) -> Iterator[FloatArray]:
    """Kinds of errors of a group's readings, each through the nominal, shape (m, k); 0 without a reading."""
    told = slopes(rows, constants)
    for i, width in enumerate(widths):
        errors = {name: kinds[i] for name, kinds in of_each.items()}
        yield through_nominal(rows, told, errors) if errors else np.zeros((len(rows), width))
