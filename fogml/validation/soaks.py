"""Soaks of a run as bias points, and what they tell: temperature sensitivity and hysteresis.

Definitions: bias temperature sensitivity is the greatest ``|(B_i - B_m) / (T_i - T_m)|`` over
soaks, m the soak nearest 25 degC, pairs closer than 5 degC left out; thermal hysteresis is the
greatest ``|B_up - B_down|`` over soaks at equal temperature.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.runs.regimes import regimes
from fogml.runs.run import Run
from fogml.runs.temperature_motion import LEAST_TRAVEL_DEGC
from fogml.runs.thermometers import leading_temperature

ROOM_TEMPERATURE_DEGC = 25.0
LEAST_DIFFERENCE_DEGC = 5.0
"""Pairs of soaks closer than this tell no sensitivity."""
EQUAL_TEMPERATURE_DEGC = 1.0
"""Soaks no further apart than this count as equal in temperature."""

Approach = Literal["up", "down", "none"]


@dataclass(frozen=True)
class Soak:
    """One stay at a temperature.

    Attributes
    ----------
    rows
        Indices of its settled, usable rows, shape (m,).
    temperature
        Their mean temperature [degC].
    approach
        Whether a ramp up or down led to it; ``none`` at the start of a run, and where it was not seen.
    """

    rows: IndexArray
    temperature: float
    approach: Approach


def find_soaks(run: Run, used: BoolArray, least_s: float) -> tuple[Soak, ...]:
    """The soaks of a run that hold at least `least_s` seconds of usable samples.

    A stay that is broken by turns of the table or by a gap is one soak, of its rows at rest, unless
    temperature moved meanwhile.

    Parameters
    ----------
    used
        Rows that count, shape (n,).
    """
    temperature = leading_temperature(run)
    if temperature is None:
        return ()
    stays: list[tuple[Approach, list[IndexArray]]] = [("none", [])]
    for name, start, stop in regimes(run).segments():
        if name in ("ramp_up", "ramp_down"):
            stays.append(("up" if name == "ramp_up" else "down", []))
        elif name == "soak":
            rows = start + np.flatnonzero(used[start:stop])
            if stays[-1][1] and _moved(
                temperature, stays[-1][1][-1], rows, max(int(least_s / run.sample_s), 1)
            ):
                stays.append(("none", []))
            if len(rows):
                stays[-1][1].append(rows)
    soaks = []
    for approach, parts in stays:
        rows = np.concatenate(parts) if parts else np.empty(0, dtype=np.intp)
        if len(rows) and len(rows) * run.sample_s >= least_s:
            soaks.append(Soak(rows, float(temperature[rows].mean()), approach))
    return tuple(soaks)


def _moved(temperature: FloatArray, before: IndexArray, after: IndexArray, edge: int) -> bool:
    """Whether temperature moved between two parts of a stay, by the means of so many rows at their edges."""
    if not len(after):
        return False
    step = temperature[after[:edge]].mean() - temperature[before[-edge:]].mean()
    return bool(abs(step) >= LEAST_TRAVEL_DEGC)


def temperature_sensitivity(soaks: Sequence[Soak], biases: Sequence[float]) -> float | None:
    """Greatest ``|(B_i - B_m) / (T_i - T_m)|`` [deg/h/degC], None where no pair is far enough apart.

    Parameters
    ----------
    biases
        Mean error over each soak [deg/h], in the order of `soaks`.
    """
    if not soaks:
        return None
    temperatures = np.array([soak.temperature for soak in soaks])
    values = np.asarray(biases, dtype=np.float64)
    middle = int(np.argmin(np.abs(temperatures - ROOM_TEMPERATURE_DEGC)))
    differences = temperatures - temperatures[middle]
    apart = np.abs(differences) >= LEAST_DIFFERENCE_DEGC
    if not apart.any():
        return None
    return float(np.abs((values[apart] - values[middle]) / differences[apart]).max())


def hysteresis(soaks: Sequence[Soak], biases: Sequence[float]) -> float | None:
    """Greatest ``|B_up - B_down|`` [deg/h] over soaks at equal temperature, None without such a pair."""
    up = [i for i, soak in enumerate(soaks) if soak.approach == "up"]
    down = [i for i, soak in enumerate(soaks) if soak.approach == "down"]
    loops = [
        abs(biases[i] - biases[j])
        for i in up
        for j in down
        if abs(soaks[i].temperature - soaks[j].temperature) <= EQUAL_TEMPERATURE_DEGC
    ]
    return max(loops) if loops else None
