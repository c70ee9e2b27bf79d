"""Units of one type, drawn from the priors of a twin, and repeats of a unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from fogml.errors import InputError
from fogml.twin.effect import Effect
from fogml.twin.noise import NoiseConstants, generator
from fogml.twin.nominal import NominalConstants
from fogml.twin.twin import EffectSetting, Twin


@dataclass(frozen=True, eq=False)
class Unit:
    """A unit that was drawn.

    Attributes
    ----------
    serial_number
        Such as ``tactical-003``.
    constants
        Its twin: what the unit keeps.
    runs
        One twin for each time that it is used: the constants, and anew what differs from one
        power-on to the next.
    """

    serial_number: str
    constants: Twin
    runs: tuple[Twin, ...]


def draw_units(twin: Twin, count: int, *, repeats: int = 1, seed: int = 0) -> tuple[Unit, ...]:
    """Draw units, each with its repeats.

    Nominal constants are normal about the twin's with the standard deviations that it states, noise
    coefficients log-normal about its with their factors. An effect that is on has its amplitude and
    shape from the catalogue's prior for the twin's grade. Plant, sensors and surroundings belong to
    type and laboratory and stay. Unit number k is the same whatever `count` is.

    Parameters
    ----------
    twin
        The type.
    count
        Number of units.
    repeats
        How often each is used: each repeat is another power-on.
    seed
        Of all draws.

    Raises
    ------
    InputError
        If a number is below 1, or the seed negative.
    """
    _at_least_one("units", count)
    units = []
    for number in range(count):
        rng = generator(seed, number)
        serial = f"{twin.name}-{number + 1:03d}"
        unit = replace(
            twin.named(serial),
            nominal=_nominal(twin, rng),
            noise=_noise(twin, rng),
            settings={declared.id: _drawn(declared, twin, rng) for declared, _ in twin.on},
        )
        units.append(Unit(serial, unit, repeat_unit(unit, repeats, seed=int(rng.integers(2**63)))))
    return tuple(units)


def repeat_unit(unit: Twin, count: int, *, seed: int = 0) -> tuple[Twin, ...]:
    """The same unit, used several times: what is drawn at each power-on differs, constants do not.

    The amplitude of such an effect, as `unit` states it, is its standard deviation over power-ons. What a
    simulation draws from its own seed stays: give each repeat a seed of its own there.

    Raises
    ------
    InputError
        If the count is below 1, or the seed negative.
    """
    _at_least_one("repeats", count)
    repeats = []
    for number in range(count):
        rng = generator(seed, number)
        settings: dict[str, EffectSetting] = dict(unit.settings)
        for declared, setting in unit.on:
            if declared.drawn_per_run and not declared.seeded:
                drawn = declared.amplitude.within(setting.amplitude * rng.standard_normal())
                settings[declared.id] = replace(setting, amplitude=drawn)
        repeats.append(replace(unit, settings=settings))
    return tuple(repeats)


def _nominal(twin: Twin, rng: np.random.Generator) -> NominalConstants:
    mean, sd = asdict(twin.nominal), asdict(twin.nominal_sd)
    return NominalConstants(**{name: mean[name] + sd[name] * float(rng.standard_normal()) for name in mean})


def _noise(twin: Twin, rng: np.random.Generator) -> NoiseConstants:
    factors: Mapping[str, float] = twin.noise_factor
    drawn = {
        name: value * math.exp(math.log(factors.get(name, 1.0)) * float(rng.standard_normal()))
        for name, value in twin.noise.as_dict().items()
    }
    return NoiseConstants(**drawn)


def _drawn(declared: Effect, twin: Twin, rng: np.random.Generator) -> EffectSetting:
    amplitude = declared.amplitude.draw(rng, twin.grade)
    return EffectSetting(amplitude, {q.name: q.draw(rng, twin.grade) for q in declared.shape})


def _at_least_one(what: str, count: int) -> None:
    if count < 1:
        raise InputError(f"{what}: {count} is asked for; at least 1 is needed")
