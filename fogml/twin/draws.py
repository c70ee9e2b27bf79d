"""Plausible twins: what a twin may be beside what it states, drawn from what is not known of it."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np

from fogml.errors import InputError
from fogml.twin.nominal import NAMES
from fogml.twin.plant.standard import QUANTITIES
from fogml.twin.registry import effect
from fogml.twin.twin import Twin


def drawn_twin(twin: Twin, seed: int, number: int) -> Twin:
    """One plausible twin, of a number, under the name ``NAME-NUMBER``.

    Constants, amplitudes, shapes and the plant go together as `twin.uncertainty` says, or, where a twin has
    none, its nominal constants are drawn from their own standard deviations; N, B and K from their factors;
    and each effect that is suspected is on with its probability. What is not physical is brought to the
    nearest value that is. The same seed and number give the same twin.
    """
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
    noise = {name: getattr(twin.noise, name) * factor for name, factor in factors.items()}
    changed = changed.with_noise(**noise)
    for id, held in twin.suspected.items():
        acts = rng.random() < held.probability
        if acts and not set(effect(id).conflicts) & set(changed.settings):
            changed = changed.with_effect(id, held.amplitude, **held.shape)
    return changed


def parameter_values(twin: Twin) -> dict[str, float]:
    """Every parameter that may be uncertain, by its place in a twin file."""
    plant = twin.plant
    values = {f"nominal.{name}": value for name, value in asdict(twin.nominal).items()}
    values |= {f"plant.{q.name}": float(getattr(plant.constants, q.name)) for q in QUANTITIES}
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
        raise InputError(f"uncertainty: the twin has no parameter '{name}'; it has {', '.join(values)}")
    value = values[name] + by
    section, _, rest = name.partition(".")
    if section == "nominal":
        return twin.with_nominal(**{rest: value})
    if section == "effects":
        id, _, key = rest.partition(".")
        declared, setting = effect(id), twin.settings[id]
        limits = {"amplitude": declared.amplitude.limits, **{q.name: q.limits for q in declared.shape}}
        held = float(np.clip(value, *limits[key]))
        shape = {**setting.shape, **({key: held} if key != "amplitude" else {})}
        return twin.with_effect(id, held if key == "amplitude" else setting.amplitude, **shape)
    plant = twin.plant
    if rest.startswith("heating."):
        heating = plant.heating
        if rest == "heating.steady":
            warm = max(value, 0.0)
            cold = heating.initial_w * warm / heating.steady_w if heating.steady_w > 0.0 else warm
            heating = replace(heating, steady_w=warm, initial_w=cold)
        else:
            heating = replace(heating, time_constant_s=max(value, 1.0))
        return replace(twin, plant=replace(plant, heating=heating))
    limits_of = {q.name: q.limits for q in QUANTITIES}
    constants = replace(plant.constants, **{rest: float(np.clip(value, *limits_of[rest]))})
    return replace(twin, plant=replace(plant, constants=constants))
