"""What a diagnosis asks of a model of a gyro: any that offers this can take the twin's place.

A model is linear in a few constants with priors, replays a run's inputs, and offers candidate
effects, each linear in its amplitude at given shape parameters.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol, runtime_checkable

import numpy as np

from fogml.arrays import FloatArray
from fogml.frozen import FrozenMappings
from fogml.runs.run import Run
from fogml.twin.nominal import NAMES, UNITS, NominalConstants
from fogml.twin.quantities import Grade, Quantity
from fogml.twin.registry import clashing, effect, effects
from fogml.twin.twin import Twin


@dataclass(frozen=True)
class Constant:
    """A constant of the model with its normal prior.

    ``mean`` and ``sd`` are in ``unit``.
    """

    name: str
    unit: str
    mean: float
    sd: float


@dataclass(frozen=True)
class NoisePrior:
    """Coefficients of the noise and the factors of their log-normal priors.

    ``N`` deg/sqrt(h), ``B`` deg/h, ``K`` deg/h/sqrt(h); a factor of 1 holds a coefficient fixed.
    """

    N: float
    B: float
    K: float
    factor_N: float = 3.0
    factor_B: float = 3.0
    factor_K: float = 3.0


@dataclass(frozen=True)
class EffectValue(FrozenMappings):
    """An effect with numbers: its amplitude and its shape parameters in the card's units."""

    id: str
    amplitude: float
    shape: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "shape", MappingProxyType(dict(self.shape)))


@runtime_checkable
class Candidate(Protocol):
    """An effect that a diagnosis may name; every `fogml.twin.effect.Effect` is one.

    It may have ``drawn_per_run``, ``told_by``, ``amplitudes`` and ``place`` besides, as effects have them.
    """

    @property
    def id(self) -> str:
        """Name in reports."""

    @property
    def title(self) -> str:
        """A few words."""

    @property
    def stage(self) -> Any:
        """Where in the chain it acts, one of `fogml.twin.effect.STAGES`."""

    @property
    def amplitude(self) -> Quantity:
        """The linear coefficient: unit, usual range, limits, whether either sign occurs."""

    @property
    def shape(self) -> tuple[Quantity, ...]:
        """Parameters that the response is not linear in, with their usual ranges."""

    @property
    def confused_with(self) -> Mapping[str, str]:
        """Id of a look-alike to what separates the two; may be empty."""


class ModelOnRun(Protocol):
    """A model with the inputs that one run recorded."""

    def response(self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]) -> FloatArray:
        """Change of the output [deg/h] per unit of a candidate's amplitude, about 0, shape (n,)."""

    def columns(self) -> Mapping[str, FloatArray]:
        """Response of the output [deg/h] to a unit of each constant, each of shape (n,).

        A constant that this run can't show may be left out.
        """

    def output(self, constants: Mapping[str, float], effects: tuple[EffectValue, ...] = ()) -> FloatArray:
        """The replay: noise-free output [deg/h], shape (n,)."""

    def nuisances(self, constants: Mapping[str, float]) -> Mapping[str, FloatArray]:
        """What is always a little off, one standard deviation of each [deg/h], shape (n,); may be empty.

        The names must be the same on every run that has them.
        """


class GyroModel(Protocol):
    """A model of a gyro that can be diagnosed."""

    @property
    def name(self) -> str:
        """For reports."""

    @property
    def grade(self) -> Any:
        """Whose ranges are the usual sizes of candidates: ``tactical`` or ``navigation``."""

    @property
    def memory_s(self) -> float:
        """How far back a replay looks [s]: that much after a start or a gap it can't know."""

    @property
    def constants(self) -> tuple[Constant, ...]:
        """The constants, shared by all runs of a unit, with their priors."""

    @property
    def noise(self) -> NoisePrior:
        """What is known of the noise."""

    def candidates(self) -> Mapping[str, Candidate]:
        """Effects to choose from, by id."""

    def on(self, run: Run) -> ModelOnRun:
        """The model with a run's inputs.

        Raises
        ------
        InputError
            If the run lacks what the model needs.
        """

    def write(
        self,
        path: Path,
        constants: Mapping[str, float],
        effects: tuple[EffectValue, ...],
        noise: NoisePrior,
        standard_errors: Mapping[str, float],
    ) -> None:
        """Write the fitted model with the effects added, ready to replay."""


class TwinModel:
    """A twin, its nominal constants with their priors, and the catalogue's candidates.

    Parameters
    ----------
    twin
        The twin to start from; effects that are on in it are part of it. A diagnosis asks whether their sizes
        are wrong; `candidates` has none of them.
    lacks
        Ids of effects that the catalogue is taken not to hold: as if nobody knew of them.
    """

    def __init__(self, twin: Twin, lacks: Iterable[str] = ()) -> None:
        self.twin, self.lacks = twin, frozenset(lacks)
        self.name = twin.name
        self.grade = twin.grade

    @property
    def constants(self) -> tuple[Constant, ...]:
        """The nominal constants about the twin's values."""
        values, deviations = asdict(self.twin.nominal), asdict(self.twin.nominal_sd)
        return tuple(Constant(name, UNITS[name], values[name], deviations[name]) for name in NAMES)

    @property
    def noise(self) -> NoisePrior:
        """The twin's noise and its factors."""
        noise, factor = self.twin.noise, self.twin.noise_factor
        return NoisePrior(noise.N, noise.B, noise.K, factor["N"], factor["B"], factor["K"])

    def candidates(self) -> Mapping[str, Candidate]:
        """Candidates of the catalogue that are not on yet and don't conflict with what is."""
        on = set(self.twin.settings)
        return {
            id: declared
            for id, declared in effects().items()
            if declared.candidate and id not in on | self.lacks and not clashing(declared, on)
        }

    def diagnosed(
        self,
        constants: Mapping[str, float],
        effects: tuple[EffectValue, ...],
        noise: NoisePrior,
        standard_errors: Mapping[str, float],
    ) -> Twin:
        """The twin with constants as fitted, their standard errors as priors, effects on."""
        twin = with_effects(self.twin, constants, effects)
        deviations = asdict(self.twin.nominal_sd) | {
            name: float(value) for name, value in standard_errors.items() if value > 0.0
        }
        return replace(
            twin,
            name=f"{self.twin.name}-diagnosed",
            description="Fitted to recordings, with the effects that a diagnosis named",
            nominal_sd=NominalConstants(**deviations),
            noise=replace(self.twin.noise, N=float(noise.N), B=float(noise.B), K=float(noise.K)),
            noise_factor={"N": noise.factor_N, "B": noise.factor_B, "K": noise.factor_K},
            uncertainty=None,
        )


AnyModel = TwinModel | GyroModel
"""What can be diagnosed: the twin, whose own inputs the families know, or another model in its place."""


def with_effects(twin: Twin, constants: Mapping[str, float], effects: Sequence[EffectValue]) -> Twin:
    """The twin with constants set and effects on, each within what is physical."""
    changed = twin.with_nominal(**{name: float(value) for name, value in constants.items()})
    for value in effects:
        amplitude, held = within_limits(value.id, value.amplitude, value.shape, twin.grade)
        changed = changed.with_effect(value.id, amplitude, **held)
    return changed


def within_limits(
    id: str, amplitude: float, shape: Mapping[str, float], grade: Grade
) -> tuple[float, dict[str, float]]:
    """Amplitude and shape of an effect brought to what is physical; of a shape not told the usual one."""
    declared = effect(id)
    held = {q.name: float(np.clip(shape[q.name], *q.limits)) for q in declared.shape if q.name in shape}
    return float(np.clip(amplitude, *declared.amplitude.limits)), declared.default_shape(grade) | held
