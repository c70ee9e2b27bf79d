"""Priors of a mixed-effects model's sizes, and columns whose sizes mean what the priors say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.features.atoms import MEMORIES
from fogml.features.terms import Term


@dataclass(frozen=True)
class SizePriors:
    """Log-normal priors of the sizes, as shares of the standard deviation of the training averages.

    Attributes
    ----------
    linear, curved, other
        Medians for what is linear in a signal, its higher powers, and every other group of features: of a
        drift over temperature most is linear, a third curved, and rates, gradients and memories hold a
        tenth each (engineering values; tried on simulated units of the shipped tactical twin).
    shift, slow, fast
        Medians of a run's own shift, slow and faster drift.
    noise
        Median of the white noise of the averages.
    spread, own_spread, noise_spread
        Standard deviation of the logarithm of each size, of those of a run's own parts, and of the noise's: a
        factor of 2.2 either way, and of 20.
    offset
        Standard deviation of the constant; wide, so that it is free.
    """

    linear: float = 1.0
    curved: float = 0.3
    other: float = 0.1
    shift: float = 0.3
    slow: float = 0.2
    fast: float = 0.1
    noise: float = 0.05
    spread: float = 0.8
    own_spread: float = 0.8
    noise_spread: float = 3.0
    offset: float = 5.0


class ScaledColumns(NamedTuple):
    """Columns that are centred, scaled and pulled apart, and how they come from features.

    Attributes
    ----------
    shift
        Means of the features, shape (k,).
    mix
        Columns are ``(features - shift) @ mix``, shape (k, k).
    groups
        Group of each column, shape (k,).
    medians
        Prior median of each group's size, shape (g,).
    """

    shift: FloatArray
    mix: FloatArray
    groups: IndexArray
    medians: FloatArray


def basis_of(X: FloatArray, terms: Sequence[Term], priors: SizePriors) -> ScaledColumns:
    """Columns whose prior sizes mean something: standardised, powers orthogonal, memories as differences.

    A power of a signal is taken orthogonal to the lower ones over the training rows, and its prior falls as
    one over the degree; a lag or a play is taken as its difference from the signal it follows, in products
    too; a product with a signal as that with the signal less its mean. What is linear in a signal goes on
    with what lies beyond its bounds, which training rows can't tell.
    """
    shift, count = X.mean(axis=0), len(terms)
    medians: list[float] = []
    mix, groups = np.eye(count), np.empty(count, dtype=np.intp)
    place = {term.factors: i for i, term in enumerate(terms)}
    group_of: dict[object, int] = {}
    degrees = np.ones(count)

    def group(key: object, median: float) -> int:
        if key not in group_of:
            group_of[key] = len(medians)
            medians.append(median)
        return group_of[key]

    for i, term in enumerate(terms):
        (atom, power), *others = term.factors
        plain = atom.operator == "value" and not others
        if plain and power > 1:
            groups[i] = group(("curved", atom), priors.curved)
            degrees[i] = power
        elif plain and not atom.signal.is_difference:
            groups[i] = group(("linear", atom), priors.linear)
        elif atom.operator == "beyond":
            groups[i] = group(term, priors.other)
            continue
        elif atom.operator == "since_on" and not others:
            groups[i] = group("since_on", priors.other)
        else:
            groups[i] = group(term, priors.other)
        if atom.operator in MEMORIES and not others:
            followed = next((j for j, t in enumerate(terms) if _is_value_of(t, atom.signal)), None)
            if followed is not None and atom.operator != "since_on":
                mix[followed, i] = -1.0
        elif atom.operator == "value" and others and power == 1:
            partner = place.get(tuple(others))
            alone = next((j for j, t in enumerate(terms) if _is_value_of(t, atom.signal)), None)
            if partner is not None and alone is not None:
                mix[partner, i] -= shift[alone]
                other, _ = others[0]
                square = place.get(((atom, 2),))
                if other.operator in MEMORIES and other.signal == atom.signal and square is not None:
                    mix[square, i], mix[alone, i] = -1.0, shift[alone]
    centred = X - shift
    order = sorted(range(count), key=lambda i: degrees[i])
    for i in order:
        atom = terms[i].factors[0][0]
        if degrees[i] > 1:
            lower = [j for j in order if degrees[j] < degrees[i] and _same_signal(terms[j], atom)]
            if lower:
                columns = centred @ mix[:, lower]
                along, *_ = np.linalg.lstsq(columns, centred @ mix[:, i], rcond=None)
                mix[:, i] -= mix[:, lower] @ along
        size = float(np.sqrt(np.mean((centred @ mix[:, i]) ** 2)))
        still = size <= 1e-9 * (1.0 + float(np.abs(shift) @ np.abs(mix[:, i])))
        mix[:, i] *= 0.0 if still else 1.0 / (size * degrees[i])
    for i, term in enumerate(terms):
        atom = term.factors[0][0]
        followed = next((j for j, t in enumerate(terms) if _is_value_of(t, atom.signal)), None)
        if atom.operator == "beyond" and len(term.factors) == 1 and followed is not None:
            mix[i] = 0.0
            mix[i, followed] = mix[followed, followed]
    return ScaledColumns(shift, mix, groups, np.array(medians))


def _is_value_of(term: Term, signal: object) -> bool:
    (atom, power), *others = term.factors
    return not others and power == 1 and atom.operator == "value" and atom.signal == signal


def _same_signal(term: Term, atom: object) -> bool:
    return len(term.factors) == 1 and term.factors[0][0] == atom
