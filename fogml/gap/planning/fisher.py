"""What runs tell of constants and effects: Fisher information, and the standard errors that follow.

With whitened responses J of the output to all unknowns and normal priors of precision P the information is
``J'J + P``, its inverse V the covariance that a fit of all unknowns together expects. J is that at one shape
of each effect; the truth has another, which the prior draws towards the one planned with. Where that is off
by d the squared errors are ``V + V (P d d' P - P) V``, V at the truth; of a shape their mean over shapes as
the catalogue spreads them is promised.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.special import ndtri

from fogml.arrays import FloatArray
from fogml.errors import InputError, did_you_mean
from fogml.gap.model import EffectValue
from fogml.gap.planning.rehearsal import ExpectedRuns, Stage
from fogml.gap.rows import at_amplitude
from fogml.intervals import Z90
from fogml.twin.effect import Effect, NoiseEffect
from fogml.twin.registry import effect

Criterion = Literal["D", "A"]
_STEP = 0.01
"""Of an unknown's scale, for slopes."""
_FLAT = 1e-12
"""Precision of an amplitude's prior in usual sizes: it may be anything."""
_SHAPES = 16
"""Shapes that errors are averaged over: as few as tell a mean square to a few per cent."""
UNSEEN = 1e5
"""A standard error of this many usual sizes is none."""


@dataclass(frozen=True)
class Parameter:
    """An unknown: a constant by its name, or ``effect.amplitude`` and ``effect.parameter``.

    Attributes
    ----------
    name, unit
        What it is.
    value
        Where it is taken.
    scale
        Its size: the prior's standard deviation, or the usual amplitude.
    prior
        Standard deviation of its prior; None for an amplitude, which may be anything.
    """

    name: str
    unit: str
    value: float
    scale: float
    prior: float | None


@dataclass(frozen=True)
class Unknowns:
    """All that is fitted together: the constants, then each effect's amplitude and shape.

    Attributes
    ----------
    parameters
        In order.
    effects
        With the amplitudes and shapes at which they are taken.
    wanted
        Places of those that are asked for.
    """

    parameters: tuple[Parameter, ...]
    effects: tuple[EffectValue, ...]
    wanted: tuple[int, ...]

    def prior_information(self) -> FloatArray:
        """Information of the priors, in scales, shape (p, p)."""
        return np.diag([_FLAT if p.prior is None else (p.scale / p.prior) ** 2 for p in self.parameters])


def unknowns(on: Stage, names: Sequence[str]) -> Unknowns:
    """The unknowns that names ask for, with all that has to be fitted beside.

    Parameters
    ----------
    on
        The twin.
    names
        Constants, effects, or single parameters as ``effect.amplitude`` or ``effect.parameter``.

    Raises
    ------
    InputError
        If a name is unknown, or an effect is a random error.
    """
    grade = on.model.grade
    parameters = [Parameter(c.name, c.unit, c.mean, c.sd, c.sd) for c in on.model.constants]
    constants = {p.name for p in parameters}
    ids = list(dict.fromkeys(name.partition(".")[0] for name in names if name not in constants))
    effects = []
    for id in ids:
        value = usual_value(on, id, constants)
        effects.append(value)
        candidate = effect(id)
        size = abs(value.amplitude) or abs(candidate.amplitude.typical(grade))
        unit = candidate.amplitude.unit
        parameters.append(Parameter(f"{id}.amplitude", unit, value.amplitude, size, None))
        for quantity in candidate.shape:
            sd = _shape_sd(*quantity.range(grade))
            name = f"{id}.{quantity.name}"
            parameters.append(Parameter(name, quantity.unit, value.shape[quantity.name], sd, sd))
    known = {p.name: i for i, p in enumerate(parameters)}
    wanted: dict[int, None] = {}
    for name in names:
        places = [i for key, i in known.items() if key == name or key.partition(".")[0] == name]
        if not places:
            own = [key.partition(".")[2] for key in known if key.startswith(f"{name.partition('.')[0]}.")]
            raise InputError(
                f"--want {name}: effect '{name.partition('.')[0]}' has no such parameter; "
                f"{did_you_mean(name.partition('.')[2], own)}it has {', '.join(own)}"
            )
        wanted |= dict.fromkeys(places)
    return Unknowns(tuple(parameters), tuple(effects), tuple(sorted(wanted)))


def usual_value(on: Stage, id: str, constants: Sequence[str] | set[str] = ()) -> EffectValue:
    """An effect at the size and shape that the twin states, else at the usual ones of its grade.

    Raises
    ------
    InputError
        If there is none of this id, or it is a random error or drawn by chance.
    """
    try:
        declared = effect(id)
    except InputError as error:
        known = f"; constants are {', '.join(sorted(constants))}" if constants else ""
        raise InputError(f"{error}{known}") from None
    if isinstance(declared, NoiseEffect):
        raise InputError(
            f"effect '{id}' is a random error: no programme shows it better than a long static run; "
            "see fogml noise"
        )
    if declared.seeded:
        raise InputError(
            f"effect '{id}' is drawn by chance each time that the unit is used: how well its size is known "
            "goes with how often that is, not with a run's programme; diagnose several runs together"
        )
    return stated_or_usual(on, declared)


def stated_or_usual(on: Stage, declared: Effect) -> EffectValue:
    """An effect as the twin states it, else at the usual size and shape of its grade."""
    held, grade = on.model.twin.settings.get(declared.id), on.model.grade
    shape = declared.default_shape(grade)
    if held is None:
        return EffectValue(declared.id, declared.amplitude.typical(grade), shape)
    return EffectValue(declared.id, held.amplitude, {name: held.shape[name] for name in shape})


def responses(rehearsal: ExpectedRuns, of: Unknowns) -> FloatArray:
    """Whitened responses of the output to each unknown in its scale, shape (m, p)."""
    scales = {p.name: p.scale for p in of.parameters}
    blocks = [rehearsal.constants]
    for value in of.effects:
        declared, size = effect(value.id), value.amplitude
        scale = scales[f"{value.id}.amplitude"]
        if declared.in_proportion or size == 0.0:
            blocks.append(scale * rehearsal.white(value.id, [value.shape]))
        else:
            ends = _ends(size, scale, declared.amplitude.limits)
            shapes = [at_amplitude(declared, end, value.shape) for end in ends.tolist()]
            blocks.append(scale * np.diff(ends * rehearsal.white(value.id, shapes)) / np.ptp(ends))
        for quantity in declared.shape:
            scale = scales[f"{value.id}.{quantity.name}"]
            ends = _ends(value.shape[quantity.name], scale, quantity.limits)
            moved = ({**value.shape, quantity.name: end} for end in ends.tolist())
            shapes = [at_amplitude(declared, size, shape) for shape in moved]
            blocks.append(size * scale * np.diff(rehearsal.white(value.id, shapes)) / np.ptp(ends))
    return np.concatenate(blocks, axis=1)


def _ends(value: float, scale: float, limits: tuple[float, float]) -> FloatArray:
    """A step below a value and one above, within what is physical, shape (2,)."""
    return np.clip(value + _STEP * scale * np.array([-1.0, 1.0]), *limits)


def information(rehearsal: ExpectedRuns, of: Unknowns) -> FloatArray:
    """Fisher information of runs beside what is always a little off, priors included, in scales.

    Shape (p, p).
    """
    return rehearsal.beside_nuisances.gram(responses(rehearsal, of)) + of.prior_information()


def covariance(info: FloatArray) -> FloatArray:
    """Expected covariance, in scales, shape (p, p)."""
    # Brought to a unit diagonal first: informations differ by many powers of ten.
    root = 1.0 / np.sqrt(np.diag(info))
    inverse = np.linalg.inv(info * np.outer(root, root))
    return np.asarray(0.5 * (inverse + inverse.T) * np.outer(root, root))


def expected(rehearsal: ExpectedRuns, of: Unknowns) -> FloatArray:
    """Expected mean squares and products of a fit's errors, in scales, shape (p, p).

    Those of constants and amplitudes are of the shapes that are planned with, as a programme may show nothing
    of others; those of shapes are over the shapes as usual, and no more than is known beforehand.
    """
    planned = covariance(information(rehearsal, of))
    held = {(one.id, name): value for one in of.effects for name, value in one.shape.items()}
    if not held:
        return planned
    place = {p.name: i for i, p in enumerate(of.parameters)}
    rows = [place[".".join(key)] for key in held]
    prior = np.diag(of.prior_information())
    grade = rehearsal.stage.model.grade
    quantities = {(one.id, q.name): q for one in of.effects for q in effect(one.id).shape}
    squares = np.zeros(len(prior))
    for deviates in ndtri(_even_shares(_SHAPES, len(held))):
        true, pull = dict(held), np.zeros_like(planned)
        for (key, value), i, z in zip(held.items(), rows, deviates, strict=True):
            _, spread, log = quantities[key].law(grade)
            moved = value * math.exp(spread * z) if log else value + spread * z
            true[key] = float(np.clip(moved, *quantities[key].limits))
            if log:
                # Of a normal one the mean square off the plan is the prior's, and nothing is left.
                off = (true[key] - value) / of.parameters[i].scale
                pull[i, i] = (prior[i] * off) ** 2 - prior[i]
        shapes = [replace(one, shape={n: true[one.id, n] for n in one.shape}) for one in of.effects]
        found = covariance(information(rehearsal, replace(of, effects=tuple(shapes))))
        squares += np.diag(found + found @ pull @ found) / _SHAPES
    grown = np.ones(len(prior))
    own = np.diag(planned)[rows]
    grown[rows] = np.sqrt(np.maximum(np.minimum(squares[rows], 1.0 / prior[rows]) / own, 1.0))
    return np.asarray(planned * np.outer(grown, grown))


def _even_shares(count: int, wide: int) -> FloatArray:
    """Points that fill a unit cube evenly, shape (count, wide): multiples of the generalised golden ratio.

    M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
    """
    root = 1.5
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (wide + 1.0))
    steps = root ** -np.arange(1.0, wide + 1.0)
    return np.asarray((0.5 + np.arange(count)[:, None] * steps) % 1.0)


def merit(info: FloatArray, wanted: Sequence[int], criterion: Criterion) -> float:
    """Mean logarithm of what the wanted are known better than their scales.

    D: the geometric mean of the axes of the confidence ellipsoid counts, A: the root mean square of the
    standard errors.
    """
    block = covariance(info)[np.ix_(wanted, wanted)]
    if criterion == "A":
        return -0.5 * math.log(float(np.trace(block)) / len(block))
    return -0.5 * float(np.linalg.slogdet(block)[1]) / len(block)


def _shape_sd(low: float, high: float) -> float:
    """Standard deviation of a shape parameter's prior, as the fit of a diagnosis has it."""
    return max(0.5 * (high - low) / Z90, 1e-12)
