"""How many rates of temperature the training runs hold, and what a network may make of them.

A run at one ramp rate tells the drift at that rate and at rest, nothing between or beyond. A
network bends as it likes there, and at another rate does worse than a term linear in the rate.
So with fewer than `RATES_THAT_TELL` rates the network sees temperatures only, and whatever
holds a rate enters linearly.

Basis functions die away beyond the training rows and would take with them what they hold of the
rate. A drift's dependence on the rate goes on, and what is linear in it (Shupe) goes on linearly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.arrays import FloatArray, IndexArray
from fogml.features.atoms import DEAD_BAND, RATE_UNIT_S
from fogml.features.box import is_rate_or_gradient

if TYPE_CHECKING:
    from fogml.features.atoms import Atom
    from fogml.features.features import Features


@dataclass(frozen=True)
class Edge:
    """The trained range of inputs that hold a rate.

    Attributes
    ----------
    columns
        Indices of those inputs, shape (r,).
    low, high
        Their range, zero included, shape (r,).
    """

    columns: IndexArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, inputs: FloatArray, columns: IndexArray) -> Edge:
        """The range of training rows, shape (n, k), rounded outwards to float32."""
        held = inputs[:, columns]
        low, high = np.minimum(held.min(axis=0), 0.0), np.maximum(held.max(axis=0), 0.0)
        return cls(columns, _outwards(low, -np.inf), _outwards(high, np.inf))

    @classmethod
    def none(cls) -> Edge:
        """No inputs that hold a rate."""
        return cls(np.empty(0, dtype=np.intp), np.empty(0), np.empty(0))

    def crossed(self, inputs: FloatArray) -> IndexArray:
        """Indices of the rows beyond the range."""
        beyond = np.zeros(len(inputs), dtype=np.bool_)
        for column, low, high in zip(self.columns, self.low, self.high, strict=True):
            values = inputs[:, column]
            beyond |= (values < low) | (values > high)
        return np.flatnonzero(beyond)

    def drawn_in(self, inputs: FloatArray) -> FloatArray:
        """Rows with all rates scaled down together until they are in range; shape as `inputs`.

        Together, since rates and their products with temperatures keep their proportions when
        a ramp gets faster.
        """
        rates = inputs[:, self.columns]
        edge = np.where(rates > 0.0, self.high, self.low)
        share = np.where((rates > self.high) | (rates < self.low), edge / np.where(rates, rates, 1.0), 1.0)
        drawn = inputs.copy()
        drawn[:, self.columns] = rates * share.min(axis=1, keepdims=True)
        return drawn

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The range as an array for saving, shape (2, r); nothing where there are no such inputs."""
        return {"edge": np.stack([self.low, self.high]).astype(np.float32)} if len(self.columns) else {}


def _outwards(values: FloatArray, towards: float) -> FloatArray:
    """Values rounded to float32 no nearer to zero than they are."""
    single = values.astype(np.float32)
    short = np.abs(single.astype(np.float64)) < np.abs(values)
    return np.where(short, np.nextafter(single, np.float32(towards)), single).astype(np.float64)


RATES_THAT_TELL = 3
"""Distinct rates at one temperature from which a network may tell how the drift bends with the rate."""
_SAME = 0.15
# Rates closer than this share of the fastest are one.
_SHARE = 0.1
# Share of the temperature travelled that a rate must hold; less is passing from one rate to another.
_BINS = 10


def distinct_rates(rates: ArrayLike, temperature: ArrayLike | None = None) -> int:
    """Number of distinct rates at which the temperature moves; up and down at one rate count once.

    Rates are one where they differ by less than 15 % of the fastest, or than the dead band of the
    direction. Each is weighed by the temperature travelled at it, so that a fast ramp counts as
    much as a slow one over the same span, and counts from 10 % on. Standing still does not count.

    With temperatures given, rates are counted in each tenth of their span and the median is
    returned. That is what matters to a function of both: chambers change from rate to rate
    gradually near the turning points, and a programme that crosses one half at one rate and the
    other half at another tells no more than one rate anywhere.

    Parameters
    ----------
    rates
        Rates [degC/min], shape (n,).
    temperature
        Temperatures at the same samples [degC], shape (n,); by default rates are counted over all.
    """
    speed = np.abs(np.asarray(rates, dtype=np.float64))
    moving = speed > DEAD_BAND
    speed = speed[moving]
    if speed.size == 0:
        return 0
    width = max(_SAME * float(np.quantile(speed, 0.98)), DEAD_BAND)
    if temperature is None:
        return _clusters(speed, width)
    degrees = np.asarray(temperature, dtype=np.float64)[moving]
    low, high = float(degrees.min()), float(degrees.max())
    part = np.floor((degrees - low) / ((high - low) or 1.0) * _BINS).clip(0, _BINS - 1)
    counts = [_clusters(speed[part == number], width) for number in range(_BINS) if np.any(part == number)]
    return int(np.median(counts))


def _clusters(speed: FloatArray, width: float) -> int:
    """Number of clusters, the interval of `width` with the largest sum being taken away in turn."""
    speed = np.sort(speed)
    least = _SHARE * float(speed.sum())
    count = 0
    while len(speed):
        sums = np.concatenate([[0.0], np.cumsum(speed)])
        held = sums[np.searchsorted(speed, speed + width, side="right")] - sums[:-1]
        start = int(np.argmax(held))
        if held[start] < least:
            break
        count += 1
        near = (speed > speed[start] - width / 2) & (speed < speed[start] + 1.5 * width)
        speed = speed[~near]
    return count


def followed_columns(features: Features) -> IndexArray:
    """Columns of the features that grow with the rate: of a rate, or a difference between sensors."""
    grows = [any(is_rate_or_gradient(atom) for atom in term.atoms) for term in features.terms]
    return np.flatnonzero(grows)


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
    Indices of the columns; all of them where there are enough rates, else those of the first
    temperature alone: the others differ from it by the rate.
    """
    rates = training_rates(features, atom_values)
    if rates is None or rates >= RATES_THAT_TELL:
        return np.arange(len(features))
    level = next((atom for atom in features.atoms if _is_level(atom)), None)
    return np.flatnonzero([set(term.atoms) == {level} for term in features.terms])


def _is_level(atom: Atom) -> bool:
    """Whether an atom is a temperature rather than a difference of two."""
    return atom.operator == "value" and not is_rate_or_gradient(atom)


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
