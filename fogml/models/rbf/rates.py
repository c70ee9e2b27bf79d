"""How many rates of temperature the training runs hold, and what a network may make of them.

A run at one ramp rate tells the drift at that rate and at rest, nothing between or beyond. A
network bends as it likes there, and at another rate does worse than a term linear in the rate.
So with fewer than `RATES_THAT_TELL` rates the network sees temperatures only, and whatever
holds a rate enters linearly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.features.atoms import DEAD_BAND, RATE_UNIT_S

if TYPE_CHECKING:
    from fogml.features.atoms import Atom
    from fogml.features.features import Features

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

RATES_THAT_TELL = 3
"""Distinct rates at one temperature from which their form can be told; standing still counts as one."""
_SAME = 0.1
# Rates closer than this share of the fastest are one.
_SHARE = 0.05
# Share of the rows that a rate must hold; fewer are passing from one rate to another.
_BINS = 10
_FEWEST_IN_BIN = 0.01


def distinct_rates(rates: ArrayLike, temperature: ArrayLike | None = None) -> int:
    """Number of distinct rates of temperature, up and down counting as one, standing still as another.

    A rate counts where at least 5 % of the rows lie within a tenth of the fastest rate, or within
    the dead band of the direction, of each other. Chambers pass between rates gradually, near the
    turning points; with temperatures given, rates are counted at each tenth of their span and the
    median is returned, which is what matters to a function of both: a run up and down at one rate
    holds one at most temperatures, and two where it soaks too.

    Parameters
    ----------
    rates
        Rates [degC/min], shape (n,).
    temperature
        Temperatures at the same samples [degC], shape (n,); by default rates are counted over all.
    """
    speed = np.abs(np.asarray(rates, dtype=np.float64))
    if speed.size == 0:
        return 0
    width = max(_SAME * float(np.quantile(speed, 0.98)), DEAD_BAND)
    if temperature is None:
        return _clusters(np.sort(speed), width)
    degrees = np.asarray(temperature, dtype=np.float64)
    low, high = np.quantile(degrees, [0.01, 0.99])
    if high <= low:
        return _clusters(np.sort(speed), width)
    label = np.floor((degrees - low) / (high - low) * _BINS).astype(np.intp)
    fewest = _FEWEST_IN_BIN * len(speed)
    inside = [speed[label == number] for number in range(_BINS)]
    counts = [_clusters(np.sort(values), width) for values in inside if len(values) > fewest]
    return int(np.median(counts)) if counts else _clusters(np.sort(speed), width)


def _clusters(speed: FloatArray, width: float) -> int:
    """Number of clusters in sorted values, the densest interval of `width` taken away in turn."""
    fewest = max(1.0, _SHARE * len(speed))
    count = 0
    while len(speed):
        held = np.searchsorted(speed, speed + width, side="right") - np.arange(len(speed))
        start = int(np.argmax(held))
        if held[start] < fewest:
            break
        count += 1
        near = (speed > speed[start] - width / 2) & (speed < speed[start] + 1.5 * width)
        speed = speed[~near]
    return count


def rate_columns(features: Features) -> IndexArray:
    """Columns of the features that hold a rate, a difference in time or a direction."""
    moving = [any(atom.operator != "value" for atom in term.atoms) for term in features.terms]
    return np.flatnonzero(moving)


def training_rates(features: Features, atom_values: FloatArray) -> int | None:
    """Distinct rates of temperature in rows of atom values, shape (n, a); None without a rate atom.

    Counted at each temperature where a temperature is among the atoms. Of several rates the one
    with the fewest distinct values decides.
    """
    degrees = next((atom_values[:, i] for i, atom in enumerate(features.atoms) if _is_level(atom)), None)
    counts = [
        distinct_rates(atom_values[:, i] * _per_minute(atom, atom_values[:, i]), degrees)
        for i, atom in enumerate(features.atoms)
        if atom.operator in ("d", "diff")
    ]
    return min(counts, default=None)


def restrained_inputs(features: Features, atom_values: FloatArray) -> IndexArray:
    """Columns that a network may see, given what rates its training rows hold.

    Parameters
    ----------
    features
        Features whose columns the network gets.
    atom_values
        Values of the features' atoms in the training rows, shape (n, a).

    Returns
    -------
    Indices of the columns; all of them where there are enough rates, else those without a rate.
    """
    every = np.arange(len(features))
    rates = training_rates(features, atom_values)
    if rates is None or rates >= RATES_THAT_TELL:
        return every
    return np.setdiff1d(every, rate_columns(features))


def _is_level(atom: Atom) -> bool:
    """Whether an atom is a temperature rather than a difference of two."""
    return atom.operator == "value" and "-" not in atom.text


def _per_minute(atom: Atom, values: FloatArray) -> float:
    """Factor that turns an atom's value into a rate [degC/min], up to a constant where it has no window."""
    if atom.operator == "d":
        return 1.0
    length_s = atom.window.length_s if atom.window is not None else 0.0
    if length_s > 0.0:
        return RATE_UNIT_S / length_s
    # A first difference does not tell the sample interval: its fastest counts as 1 degC/min.
    fastest = float(np.quantile(np.abs(values), 0.98)) if len(values) else 0.0
    return 1.0 / fastest if fastest > 0.0 else 1.0
