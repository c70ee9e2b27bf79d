"""Twin files, schema ``fogml.twin/1``: every constant as ``name: {value: ..., unit: ...}``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from fogml.errors import InputError, did_you_mean, known_are
from fogml.outputs import whole_file
from fogml.twin.draws import moved
from fogml.twin.noise import QUANTITIES as NOISE
from fogml.twin.noise import NoiseConstants
from fogml.twin.nominal import PRIOR_SD, NominalConstants
from fogml.twin.nominal import QUANTITIES as NOMINAL
from fogml.twin.optics import COIL, RECEIVER, Coil, Receiver
from fogml.twin.plant.coil import LINE, CoilEnds, RadialLine
from fogml.twin.plant.coil import QUANTITIES as ENDS
from fogml.twin.plant.heat import AIRFLOW, HEATING, Airflow, SelfHeating
from fogml.twin.plant.standard import QUANTITIES as THERMAL
from fogml.twin.plant.standard import ThermalConstants
from fogml.twin.quantities import Quantity, with_unit
from fogml.twin.registry import effect
from fogml.twin.set_up import (
    SENSOR_QUANTITIES,
    SURROUNDING_QUANTITIES,
    Plant,
    SensorErrors,
    Sensors,
    Surroundings,
)
from fogml.twin.twin import EffectSetting, Twin
from fogml.twin.twin_schema import PROBABILITY, TWIN_FILE, Stated, message
from fogml.twin.uncertainty import Suspected, Uncertainty
from fogml.yaml_text import read_yaml, yaml_text

SCHEMA = "fogml.twin/1"
TWIN_FOLDER = Path(__file__).parent / "twins"
_OTHER_UNITS = {
    "s": {"min": 60.0, "h": 3600.0, "d": 86400.0},
    "m": {"km": 1e3, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9},
}
"""By a documented unit: others that are understood, in it."""
_PER_KELVIN = re.compile(r"(?<=[/(])K(?![A-Za-z])")


def twin_names() -> tuple[str, ...]:
    """Names of the twins that ship."""
    return tuple(sorted(path.stem for path in TWIN_FOLDER.glob("*.yaml")))


def as_twin(twin: Twin | str | Path) -> Twin:
    """A twin, or the twin of a name or file.

    Raises
    ------
    InputError
        If it is neither, or `load_twin` refuses it.
    """
    if isinstance(twin, Twin):
        return twin
    if not isinstance(twin, str | Path):
        raise InputError(f"a twin, or the name or file of one, is needed, found {type(twin).__name__}")
    return load_twin(twin)


def load_twin(source: str | Path | Mapping[str, Any]) -> Twin:
    """A twin by its name, from a YAML file, or from the values of one.

    Raises
    ------
    InputError
        Naming the file and the key: unknown, in another unit, or not physical.
    """
    if isinstance(source, Mapping):
        return twin_from(source)
    text = str(source)
    path = TWIN_FOLDER / f"{text}.yaml" if text in twin_names() else Path(text)
    if not path.is_file():
        hint = did_you_mean(text, twin_names())
        raise InputError(f"{text}: no such twin; {hint}give a YAML file or one of {', '.join(twin_names())}")
    return twin_from(read_yaml(path, schema=SCHEMA), path.name)


def save_twin(twin: Twin, path: str | Path) -> None:
    """Write a twin file that `load_twin` reads back as the same twin."""
    with whole_file(path) as partial:
        partial.write_text(yaml_text(twin_dict(twin)), encoding="utf-8")


def twin_from(values: Any, source: str = "twin") -> Twin:
    """A twin from the values of a twin file."""
    if not isinstance(values, Mapping):
        raise InputError(f"{source}: a twin file holds 'key: value' lines; see configs/twin/nominal.yaml")
    try:
        stated: Any = TWIN_FILE.model_validate(dict(values))
    except ValidationError as error:
        raise InputError(message(error, source)) from None
    nominal = _values(source, "nominal", stated.nominal, NOMINAL)
    deviations = {q.name: getattr(stated.nominal, q.name) for q in NOMINAL}
    noise = _values(source, "noise", stated.noise, NOISE)
    factors = {q.name: getattr(stated.noise, q.name) for q in NOISE}
    try:
        twin = Twin(
            name=stated.name or Path(source).stem,
            description=stated.description,
            grade=stated.grade,
            nominal=NominalConstants(**nominal),
            nominal_sd=NominalConstants(
                **asdict(PRIOR_SD)
                | {name: held.sd for name, held in deviations.items() if held and held.sd is not None}
            ),
            noise=NoiseConstants(**noise),
            noise_factor={name: held.factor for name, held in factors.items() if held and held.factor},
            coil=Coil(
                **_values(source, "coil", stated.coil, COIL),
                winding=stated.coil.winding,
                layers=stated.coil.layers,
            ),
            receiver=Receiver(**_values(source, "receiver", stated.receiver, RECEIVER)),
            plant=_plant(source, stated.plant),
            sensors=_sensors(source, stated.sensors),
            surroundings=Surroundings(
                **_values(source, "surroundings", stated.surroundings, SURROUNDING_QUANTITIES)
            ),
            settings={id: _setting(source, id, entry) for id, entry in stated.effects.items()},
            uncertainty=_uncertainty(stated),
            suspected={id: _suspected(source, id, entry) for id, entry in stated.suspected.items()},
        )
        # Raises where plant and effects don't fit together.
        _ = twin.network
        for name in twin.uncertainty.names if twin.uncertainty else ():
            moved(twin, name, 0.0)
        return twin
    except InputError as error:
        told = str(error).removeprefix(f"{source}: ")
        raise InputError(f"{source}: {told}") from None


def twin_dict(twin: Twin) -> dict[str, Any]:
    """A twin as the YAML- and JSON-ready values of its file."""

    def section(quantities: Iterable[Quantity], held: Any) -> dict[str, Any]:
        return {q.name: {"value": getattr(held, q.name), "unit": q.unit} for q in quantities}

    nominal = section(NOMINAL, twin.nominal)
    for name, entry in nominal.items():
        entry["sd"] = getattr(twin.nominal_sd, name)
    noise = section(NOISE, twin.noise)
    for name, factor in twin.noise_factor.items():
        noise[name]["factor"] = factor
    plant = {"order": twin.plant.order, **section(THERMAL, twin.plant.constants)}
    heating = twin.plant.heating
    parts = {
        "steady": heating.steady_w,
        "initial": heating.initial_w,
        "time_constant": heating.time_constant_s,
    }
    plant["heating"] = {q.name: {"value": parts[q.name], "unit": q.unit} for q in HEATING}
    plant["airflow"] = section(AIRFLOW, twin.plant.airflow)
    if twin.plant.line is not None:
        plant["line"] = section(LINE, twin.plant.line) | {"layers": twin.plant.line.layers}
    if twin.plant.ends is not None:
        plant["ends"] = section(ENDS, twin.plant.ends)
    single = {
        name: section(SENSOR_QUANTITIES, errors) | ({"reads": dict(errors.reads)} if errors.reads else {})
        for name, errors in twin.sensors.single.items()
    }
    values: dict[str, Any] = {"schema": SCHEMA, "name": twin.name}
    if twin.description:
        values["description"] = twin.description
    coil = section(COIL, twin.coil) | {"winding": twin.coil.winding, "layers": twin.coil.layers}
    values |= {"grade": twin.grade, "nominal": nominal, "noise": noise, "coil": coil}
    values["receiver"] = section(RECEIVER, twin.receiver)
    values["plant"] = plant
    values["sensors"] = section(SENSOR_QUANTITIES, twin.sensors.common) | (
        {"single": single} if single else {}
    )
    values["surroundings"] = section(SURROUNDING_QUANTITIES, twin.surroundings)
    if twin.settings:
        values["effects"] = {
            declared.id: _effect_values(declared.id, setting.amplitude, setting.shape)
            for declared, setting in twin.on
        }
    if twin.uncertainty is not None:
        values["uncertainty"] = {
            "source": twin.uncertainty.source,
            "parameters": list(twin.uncertainty.names),
            "covariance": twin.uncertainty.covariance.tolist(),
        }
    if twin.suspected:
        values["suspected"] = {
            id: {"probability": held.probability, **_effect_values(id, held.amplitude, held.shape)}
            for id, held in twin.suspected.items()
        }
    return values


def _effect_values(id: str, amplitude: float, shape: Mapping[str, float]) -> dict[str, Any]:
    declared = effect(id)
    told = {"amplitude": {"value": amplitude, "unit": declared.amplitude.unit}}
    return told | {q.name: {"value": shape[q.name], "unit": q.unit} for q in declared.shape}


def _plant(source: str, stated: Any) -> Plant:
    heating = _values(source, "plant.heating", stated.heating, HEATING)
    steady = heating.get("steady", 0.0)
    line, ends = stated.line, stated.ends
    return Plant(
        constants=ThermalConstants(**_values(source, "plant", stated, THERMAL)),
        order=stated.order,
        heating=SelfHeating(steady, heating.get("initial", steady), heating.get("time_constant", 1200.0)),
        airflow=Airflow(**_values(source, "plant.airflow", stated.airflow, AIRFLOW)),
        line=None
        if line is None
        else RadialLine(**_values(source, "plant.line", line, LINE), layers=line.layers),
        ends=None if ends is None else CoilEnds(**_values(source, "plant.ends", ends, ENDS)),
    )


def _sensors(source: str, stated: Any) -> Sensors:
    common = _values(source, "sensors", stated, SENSOR_QUANTITIES)
    shared = SensorErrors(**common, reads={})
    single = {}
    for name, held in stated.single.items():
        own = _values(source, f"sensors.single.{name}", held, SENSOR_QUANTITIES)
        single[name] = replace(shared, **own, reads=held.reads)
    return Sensors(shared, single)


def _uncertainty(stated: Any) -> Uncertainty | None:
    told = stated.uncertainty
    if told is None:
        return None
    rows, names = told.covariance, tuple(told.parameters)
    if any(len(row) != len(rows) for row in rows):
        raise InputError("uncertainty: rows of the covariance are of different lengths")
    matrix = np.array(rows, dtype=np.float64).reshape(len(rows), len(rows))
    found = Uncertainty(names, matrix, told.source)
    # Rows and columns are in the units in which the file states the values.
    factors = np.array([_stated_factor(name, stated) for name in names])
    return replace(found, covariance=found.covariance * np.outer(factors, factors))


def _stated_factor(name: str, stated: Any) -> float:
    """Of the unit that a file states a parameter in to the documented one."""
    held = stated
    for key in name.split("."):
        held = held.get(key) if isinstance(held, Mapping) else getattr(held, key, None)
    unit = held.unit if isinstance(held, Stated) else None
    return next((others[unit] for others in _OTHER_UNITS.values() if unit in others), 1.0)


def _suspected(source: str, id: str, entry: Mapping[str, Stated]) -> Suspected:
    if "probability" not in entry:
        raise InputError(f"nothing is given for 'suspected.{id}.probability'")
    rest = {name: held for name, held in entry.items() if name != "probability"}
    setting = _setting(source, id, rest, "suspected")
    probability = _value(source, f"suspected.{id}.probability", entry["probability"], PROBABILITY)
    return Suspected(probability, setting.amplitude, setting.shape)


def _setting(source: str, id: str, entry: Mapping[str, Stated], section: str = "effects") -> EffectSetting:
    declared = effect(id)
    known = {"amplitude": declared.amplitude, **{q.name: q for q in declared.shape}}
    values = {}
    for name, held in entry.items():
        if name not in known:
            told = known_are(name, known, "known keys")
            raise InputError(f"unknown key '{section}.{id}.{name}'; {told}")
        values[name] = _value(source, f"{section}.{id}.{name}", held, known[name])
    amplitude, shape = declared.checked(values)
    return EffectSetting(amplitude, shape)


def _values(source: str, section: str, stated: Any, quantities: Iterable[Quantity]) -> dict[str, float]:
    """Values of a section in the documented units, for what is stated."""
    values = {}
    for quantity in quantities:
        held = getattr(stated, quantity.name)
        if held is not None:
            values[quantity.name] = _value(source, f"{section}.{quantity.name}", held, quantity)
    return values


def _value(source: str, key: str, held: Stated, quantity: Quantity) -> float:
    unit = _PER_KELVIN.sub("degC", held.unit.replace("°", "deg")) if held.unit else quantity.unit
    factor = 1.0 if unit == quantity.unit else _OTHER_UNITS.get(quantity.unit, {}).get(unit)
    if factor is None:
        raise InputError(f"{source}: key '{key}' has unit '{held.unit}'; {quantity.unit} is needed")
    low, high = quantity.limits
    value = factor * held.value
    if not low <= value <= high:
        raise InputError(
            f"{source}: key '{key}' is {with_unit(held.value, unit)}, which is not physical; it lies between "
            f"{low:g} and {with_unit(high, quantity.unit)}"
        )
    return value
