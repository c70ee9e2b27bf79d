"""The twin as a model that can be diagnosed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from fogml.gap.model import Candidate, Constant, EffectValue, GyroModel, NoisePrior
from fogml.twin.nominal import DELTA_WINDOW_S, NAMES, UNITS, NominalConstants
from fogml.twin.quantities import Grade
from fogml.twin.registry import effect, effects
from fogml.twin.twin import Twin
from fogml.twin.twin_file import save_twin


class TwinModel:
    """A twin, its nominal constants with their priors, and the catalogue's candidates.

    Parameters
    ----------
    twin
        The twin to start from; effects that are on in it are part of it and no candidates.
    lacks
        Ids of effects that the catalogue is taken not to hold: as if nobody knew of them.
    """

    memory_s = 2.0 * DELTA_WINDOW_S

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
            if declared.candidate and id not in on | self.lacks and not on & set(declared.conflicts)
        }

    def write(
        self,
        path: Path,
        constants: Mapping[str, float],
        effects: tuple[EffectValue, ...],
        noise: NoisePrior,
        standard_errors: Mapping[str, float],
    ) -> None:
        """Write a twin file: as `diagnosed`."""
        save_twin(self.diagnosed(constants, effects, noise, standard_errors), path)

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


def with_effects(twin: Twin, constants: Mapping[str, float], effects: tuple[EffectValue, ...]) -> Twin:
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
