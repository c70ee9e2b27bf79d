"""Chamber and table programmes: plain sentences in YAML, or the same steps in Python."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from fogml.errors import InputError, did_you_mean, known_are, other_schema, quoted
from fogml.numerals import number_text
from fogml.runs.facts import Facts, facts_from
from fogml.twin.schedule import Schedule, schedule
from fogml.twin.sentences import parse_action, parse_quantity, parse_step
from fogml.twin.steps import Action, Repeat, Step
from fogml.yaml_text import read_yaml, yaml_text

SCHEMA = "fogml.programme/1"
PROGRAMME_FOLDER = Path(__file__).parent / "programmes"

# Key of a programme file to (field, dimension, unit written).
_QUANTITIES = {
    "start_temperature": ("temperature", "degC"),
    "fastest_rate": ("temperature rate", "degC/min"),
    "table_acceleration": ("table acceleration", "deg/s2"),
}
_KEYS = ("schema", "name", "description", *_QUANTITIES, "input_axis", "power", "steps")


@dataclass(frozen=True, eq=False)
class Programme:
    """What chamber, table and power supply do, step after step.

    Attributes
    ----------
    steps
        The steps, with their actions.
    name, description
        For reports.
    start_temperature
        Chamber air at the beginning [degC]; the unit is at rest with it.
    fastest_rate
        Fastest rate of the chamber [degC/min].
    table_acceleration
        Acceleration of the table [deg/s^2].
    powered
        Whether the unit is on at the beginning, since long before. None: on, unless the first
        that the steps say of the power is that it goes on.
    input_axis
        How the gyro is mounted for it, as in the facts of a run; None: however the run's facts say.

    Raises
    ------
    InputError
        Naming the step that can't be done.
    """

    steps: Sequence[Step]
    name: str = "programme"
    description: str = ""
    start_temperature: float = 25.0
    fastest_rate: float = 5.0
    table_acceleration: float = 50.0
    powered: bool | None = None
    input_axis: Any = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "steps", tuple(self.steps))
        limits = {"start_temperature": (-100.0, 150.0), "fastest_rate": (1e-3, 1e3)}
        limits["table_acceleration"] = (1e-2, 1e5)
        for key, (low, high) in limits.items():
            value = getattr(self, key)
            if not (math.isfinite(value) and low <= value <= high):
                unit = _QUANTITIES[key][1]
                raise InputError(
                    f"{self.name}: '{key}' is {value:g} {unit}; it lies between {low:g} and {high:g} {unit}"
                )
        _ = self.schedule

    @cached_property
    def schedule(self) -> Schedule:
        """What happens when."""
        return schedule(
            self.steps,
            start_temperature=self.start_temperature,
            fastest_rate=self.fastest_rate,
            table_acceleration=self.table_acceleration,
            powered=self.powered,
            name=self.name,
        )

    @property
    def total_s(self) -> float:
        """How long it lasts [s]."""
        return self.schedule.total_s

    @property
    def total_hours(self) -> float:
        """How long it lasts [h]."""
        return self.total_s / 3600.0

    def named(self, name: str) -> Programme:
        """The same programme under another name."""
        return replace(self, name=name)

    def as_dict(self) -> dict[str, Any]:
        """The programme as YAML- and JSON-ready values, which `programme_from` reads back."""
        values: dict[str, Any] = {"schema": SCHEMA, "name": self.name}
        if self.description:
            values["description"] = self.description
        for key, (_, unit) in _QUANTITIES.items():
            values[key] = f"{number_text(getattr(self, key))} {unit}"
        if self.input_axis is not None:
            values["input_axis"] = Facts(input_axis=self.input_axis).model_dump(mode="json")["input_axis"]
        if self.powered is not None:
            values["power"] = "on" if self.powered else "off"
        return {**values, "steps": [_as_value(step) for step in self.steps]}

    def as_yaml(self) -> str:
        """The text of a programme file."""
        return yaml_text(self.as_dict(), width=1000)


def programme_names() -> tuple[str, ...]:
    """Names of the programmes that ship."""
    return tuple(sorted(path.stem for path in PROGRAMME_FOLDER.glob("*.yaml")))


def load_programme(source: str | Path | Mapping[str, Any] | Sequence[Any]) -> Programme:
    """A programme by its name, from a YAML file, or from values such as a list of sentences.

    Raises
    ------
    InputError
        Naming the file, the key or the step, and pointing at what was not understood.
    """
    if not isinstance(source, str | Path):
        return programme_from(source)
    text = str(source)
    path = PROGRAMME_FOLDER / f"{text}.yaml" if text in programme_names() else Path(text)
    if not path.is_file():
        raise InputError(
            f"{text}: no such programme; {did_you_mean(text, programme_names())}give a YAML file or one of "
            f"{', '.join(programme_names())}"
        )
    return programme_from(read_yaml(path, schema=SCHEMA), path.name)


def programme_from(values: Any, source: str = "programme") -> Programme:
    """A programme from the values of a YAML file, or from a list of steps."""
    if isinstance(values, list | tuple):
        values = {"schema": SCHEMA, "steps": list(values)}
    if not isinstance(values, Mapping):
        raise InputError(f"{source}: a programme is a list of steps, or 'key: value' lines")
    for key in values:
        if key not in _KEYS:
            known = known_are(str(key), _KEYS, "known keys")
            raise InputError(f"{source}: unknown key {quoted(key)}; {known}")
    if values.get("schema", SCHEMA) != SCHEMA:
        raise InputError(f"{source}: {other_schema(values['schema'], SCHEMA, '')}")
    settings: dict[str, Any] = {}
    for key, (dimension, _) in _QUANTITIES.items():
        if key in values:
            settings[key] = _pointed(parse_quantity, f"{source}, key '{key}'", values[key], dimension)
    if "input_axis" in values:
        settings["input_axis"] = facts_from({"input_axis": values["input_axis"]}, source).input_axis
    if "power" in values:
        settings["powered"] = _power(values["power"], source)
    # Under the file's name until all is checked, so that messages state it.
    programme = Programme(
        steps=_steps(values.get("steps"), source, "step "),
        name=source,
        description=str(values.get("description", "")),
        **settings,
    )
    return programme.named(str(values.get("name", Path(source).stem)))


def _power(value: Any, source: str) -> bool:
    known = {True: True, False: False, "on": True, "off": False}
    if not isinstance(value, bool | str) or value not in known:
        raise InputError(f"{source}: 'power' is {quoted(value)}; it is on or off at the beginning")
    return known[value]


def _steps(values: Any, source: str, above: str) -> tuple[Step, ...]:
    if not isinstance(values, list) or not values:
        place = f", {above.strip().rstrip('.')}" if above != "step " else ""
        raise InputError(f"{source}{place}: a list of steps is needed, such as '- soak at 25 degC for 1 h'")
    return tuple(_step(value, source, f"{above}{number}") for number, value in enumerate(values, start=1))


def _step(value: Any, source: str, label: str) -> Step:
    """A step from its sentence, or from ``sentence: [actions]`` or ``repeat N times: [steps]``."""
    owner, inner = f"{source}, {label}", None
    if isinstance(value, Mapping) and len(value) == 1:
        ((value, inner),) = value.items()
    step: Step = _pointed(parse_step, owner, value)
    if isinstance(step, Repeat):
        return Repeat(step.count, _steps(inner, source, f"{label}."))
    if inner is None:
        return step
    sentences = inner if isinstance(inner, list) else [inner]
    actions: list[Action] = [
        _pointed(parse_action, f"{owner}, action {number}", sentence)
        for number, sentence in enumerate(sentences, start=1)
    ]
    return replace(step, actions=tuple(actions))


def _pointed(parse: Any, owner: str, value: Any, *more: Any) -> Any:
    """Parse a sentence; faults name the owner."""
    if not isinstance(value, str):
        raise InputError(f"{owner}: a sentence was expected, found {quoted(value)}")
    try:
        return parse(value, *more)
    except InputError as error:
        raise InputError(f"{owner}: {error}") from None


def _as_value(step: Step) -> Any:
    if isinstance(step, Repeat):
        return {str(step): [_as_value(inner) for inner in step.steps]}
    return {str(step): [str(action) for action in step.actions]} if step.actions else str(step)
