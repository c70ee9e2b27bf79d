"""Twins drawn: plausible ones beside what a twin states, units of a type, and repeats of a unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from fogml.errors import InputError, did_you_mean
from fogml.settings_check import check_whole
from fogml.twin.effect import Effect
from fogml.twin.noise import QUANTITIES as NOISE
from fogml.twin.noise import NoiseConstants, generator
from fogml.twin.nominal import NAMES, NominalConstants
from fogml.twin.nominal import QUANTITIES as NOMINAL
from fogml.twin.plant.heat import HEATING
from fogml.twin.plant.standard import QUANTITIES as THERMAL
from fogml.twin.registry import clashing, effect
from fogml.twin.twin import EffectSetting, Twin

_NOISE = {q.name: q for q in NOISE}
_CONSTANTS = {
    f"{section}.{q.name}": q
    for section, quantities in (("nominal", NOMINAL), ("plant", THERMAL), ("plant.heating", HEATING))
    for q in quantities
}


def drawn_twin(twin: Twin, seed: int, number: int) -> Twin:
    """One plausible twin, of a number, under the name ``NAME-NUMBER``.

    Constants, amplitudes, shapes and the plant go together as `twin.uncertainty` says, or, where a twin has
    none, its nominal constants are drawn from their own standard deviations; N, B and K from their factors;
    and each effect that is suspected is on with its probability. What is not physical is brought to the
    nearest value that is. The same seed and number give the same twin.
    """
    check_whole("seed", seed)
    check_whole("number", number)
    rng = np.random.default_rng([seed, number, 0x7714])
    if twin.uncertainty is not None:
        off = twin.uncertainty.drawn(rng)
    else:
        deviations = asdict(twin.nominal_sd)
        off = {f"nominal.{n}": deviations[n] * float(rng.standard_normal()) for n in NAMES}
    changed = replace(
        twin,
        name=f"{twin.name}-{number}",
        description=f"Drawn from {twin.name}",
        uncertainty=None,
        suspected={},
    )
    for name, by in off.items():
        changed = moved(changed, name, by)
    factors = {
        name: float(np.exp(np.log(factor) * rng.standard_normal()))
        for name, factor in twin.noise_factor.items()
    }
    noise = {n: _NOISE[n].within(getattr(twin.noise, n) * factor) for n, factor in factors.items()}
    changed = changed.with_noise(**noise)
    for id, held in twin.suspected.items():
        acts = rng.random() < held.probability
        if acts and not clashing(effect(id), changed.settings):
            changed = changed.with_effect(id, held.amplitude, **held.shape)
    return changed


def parameter_values(twin: Twin) -> dict[str, float]:
    """Every parameter that may be uncertain, by its place in a twin file."""
    plant = twin.plant
    values = {f"nominal.{name}": value for name, value in asdict(twin.nominal).items()}
    values |= {f"plant.{q.name}": float(getattr(plant.constants, q.name)) for q in THERMAL}
    values |= {
        "plant.heating.steady": plant.heating.steady_w,
        "plant.heating.time_constant": plant.heating.time_constant_s,
    }
    for id, setting in twin.settings.items():
        values[f"effects.{id}.amplitude"] = setting.amplitude
        values |= {f"effects.{id}.{name}": value for name, value in setting.shape.items()}
    return values


def moved(twin: Twin, name: str, by: float) -> Twin:
    """A twin with one parameter moved, within what is physical.

    Raises
    ------
    InputError
        If there is no such parameter.
    """
    values = parameter_values(twin)
    if name not in values:
        hint = did_you_mean(name, values)
        raise InputError(f"uncertainty: the twin has no parameter '{name}'; {hint}it has {', '.join(values)}")
    value = values[name] + by
    if name in _CONSTANTS:
        value = _CONSTANTS[name].within(value)
    section, _, rest = name.partition(".")
    if section == "nominal":
        return twin.with_nominal(**{rest: value})
    if section == "effects":
        id, _, key = rest.partition(".")
        declared, setting = effect(id), twin.settings[id]
        held = {"amplitude": declared.amplitude, **{q.name: q for q in declared.shape}}[key].within(value)
        shape = {**setting.shape, **({key: held} if key != "amplitude" else {})}
        return twin.with_effect(id, held if key == "amplitude" else setting.amplitude, **shape)
    plant = twin.plant
    if rest.startswith("heating."):
        heating = plant.heating
        if rest == "heating.steady":
            cold = heating.initial_w * value / heating.steady_w if heating.steady_w > 0.0 else value
            cold = _CONSTANTS["plant.heating.initial"].within(cold)
            heating = replace(heating, steady_w=value, initial_w=cold)
        else:
            heating = replace(heating, time_constant_s=value)
        return replace(twin, plant=replace(plant, heating=heating))
    return replace(twin, plant=replace(plant, constants=replace(plant.constants, **{rest: value})))


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
    check_whole("count", count, 1)
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
    check_whole("repeats", count, 1)
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
