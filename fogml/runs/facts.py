"""Set-up facts of a run, and the Earth rate that follows from them."""

from __future__ import annotations

import math
import os
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError, field_validator

from fogml.errors import InputError, known_are, quoted
from fogml.readers import plain_path
from fogml.strict import Strict, first_fault
from fogml.yaml_text import read_yaml, yaml_text

EARTH_RATE_DEG_H = 15.041067
SIDE_SUFFIXES = (".yaml", ".yml")
_EXAMPLES = {
    "latitude": "39.9",
    "input_axis": "up, or input_axis: {heading: 30.0}",
    "table_axis": "up, or table_axis: {heading: 90.0, elevation: 0.0}",
    "scale_factor": '{value: 1.0, unit: "count per deg/h"}',
    "powered_on": "0.0",
    "started": "2026-03-02T08:00:00Z",
    "in_use_since": "2026-01-15T08:00:00Z",
    "compensated": "true",
}
SYNTHETIC = "synthetic"
"""What the notes of a simulated run begin with."""
NAMES = ("unit", "axis", "notes")
"""Facts that are names, as text however they are written."""


def _moment(value: Any) -> Any:
    """A moment from its text; a number is none, though it could be taken for seconds since 1970."""
    if not isinstance(value, str):
        return value
    try:
        return datetime.fromisoformat(value)
    except ValueError:
        raise ValueError("a date and time by ISO 8601 was expected") from None


class ScaleFactor(Strict):
    """Nominal K0: gyro [deg/h] = counts / value."""

    value: float
    unit: Literal["count per deg/h", "count per deg/s"] = "count per deg/h"

    @field_validator("value")
    @classmethod
    def _not_zero(cls, value: float) -> float:
        if value == 0.0:
            raise ValueError("a scale factor of 0 can't turn counts into a rate")
        return value

    @property
    def count_per_deg_h(self) -> float:
        """K0 in counts per deg/h."""
        return self.value if self.unit == "count per deg/h" else self.value / 3600.0


class Heading(Strict):
    """A horizontal input axis, in degrees clockwise from north."""

    heading: float


class Direction(Heading):
    """Any direction: degrees clockwise from north, and degrees above the horizon."""

    elevation: float = Field(default=0.0, ge=-90.0, le=90.0)


_Named = Literal["up", "down", "north", "south", "east", "west"]
InputAxis = _Named | Heading
TableAxis = _Named | Direction


class AxisFacts(Strict):
    """What a side file of three gyros may state of one."""

    input_axis: InputAxis | None = None
    table_axis: TableAxis | None = None
    scale_factor: ScaleFactor | None = None


class Facts(Strict):
    """The facts about the set-up that a side file may state. All optional.

    Latitude in degrees north; `powered_on` in seconds on the run's clock. The `table_axis` is what the table
    turns about, counter-clockwise; up where it is not stated. `compensated` says that the output is.
    `in_use_since` is when the unit's first run began, from which it ages. `axes` states facts of each gyro
    of a file that holds three.
    """

    unit: str | None = None
    axis: str | None = None
    latitude: float | None = Field(default=None, ge=-90.0, le=90.0)
    input_axis: InputAxis | None = None
    table_axis: TableAxis | None = None
    scale_factor: ScaleFactor | None = None
    axes: dict[Literal["x", "y", "z"], AxisFacts] | None = None
    powered_on: float | None = None
    started: Annotated[datetime | None, BeforeValidator(_moment)] = None
    in_use_since: Annotated[datetime | None, BeforeValidator(_moment)] = None
    compensated: bool | None = None
    notes: str | None = None

    @property
    def synthetic(self) -> bool:
        """Whether the run comes from a simulation: its notes begin with that word."""
        return (self.notes or "").lower().startswith(SYNTHETIC)

    @property
    def earth_rate_deg_h(self) -> float | None:
        """Earth rate along the input axis [deg/h], or None where the facts don't tell.

        15.041067 deg/h times the projection of the Earth's axis on the input axis.
        """
        if self.latitude is None or self.input_axis is None:
            return None
        latitude = math.radians(self.latitude)
        vertical, horizontal = math.sin(latitude), math.cos(latitude)
        if isinstance(self.input_axis, Heading):
            return EARTH_RATE_DEG_H * horizontal * math.cos(math.radians(self.input_axis.heading))
        projection = {
            "up": vertical,
            "down": -vertical,
            "north": horizontal,
            "south": -horizontal,
            "east": 0.0,
            "west": 0.0,
        }
        return EARTH_RATE_DEG_H * projection[self.input_axis]

    @property
    def epoch_s(self) -> float:
        """How long after the unit's first run began this one did [s]; 0 where the facts don't tell.

        Raises
        ------
        InputError
            If only one of the two moments has a time zone, or the run began first.
        """
        if self.started is None or self.in_use_since is None:
            return 0.0
        return _seconds_between(self.in_use_since, self.started, "in_use_since")

    def as_dict(self) -> dict[str, Any]:
        """The stated facts as YAML- and JSON-ready values."""
        return self.model_dump(mode="json", exclude_none=True)


def _seconds_between(earlier: datetime, later: datetime, what: str) -> float:
    """Time from one moment to another [s], refused where it is none."""
    try:
        found = (later - earlier).total_seconds()
    except TypeError:
        raise InputError(f"'{what}' and 'started': one has a time zone, the other none; add it") from None
    if found < 0.0:
        raise InputError(f"'started' is {later.isoformat()}, before '{what}', {earlier.isoformat()}")
    return found


def facts_from(values: Any, source: str) -> Facts:
    """Check set-up facts read from `source`."""
    if values is None:
        return Facts()
    if not isinstance(values, dict):
        raise InputError(f"{source}: set-up facts must be 'key: value' lines, found {type(values).__name__}")
    # A serial number is a name, also where it was stored as a number.
    names = {k: str(v) for k, v in values.items() if k in NAMES and type(v) in (int, float)}
    values = {**values, **names}
    try:
        return Facts.model_validate(values)
    except ValidationError as error:
        first = first_fault(error)
        key = str(first["loc"][0]) if first["loc"] else "?"
        if first["type"] == "extra_forbidden":
            known = known_are(key, Facts.model_fields, "known keys")
            raise InputError(f"{source}: unknown key {quoted(key)}; {known}") from None
        reason = f"{first['msg'].removeprefix('Value error, ')} (found {quoted(first['input'])})"
        example = f"; write e.g. {key}: {_EXAMPLES[key]}" if key in _EXAMPLES else ""
        raise InputError(f"{source}: key '{key}': {reason}{example}") from None


def side_file(run_path: Path) -> Path | None:
    """The side file beside a run: same stem, ``.yaml`` or else ``.yml``; None if there is none."""
    # A root has no name and so no side file.
    plain = plain_path(run_path)
    sides = (plain.with_suffix(suffix) for suffix in SIDE_SUFFIXES if plain.name)
    # A folder that can't be looked into holds none; reading the run says what is wrong.
    return next((side for side in sides if os.path.isfile(side)), None)


def read_side_file(run_path: Path) -> Facts:
    """The facts in the side file beside a run; none if there is none, or an import profile of that name.

    Raises
    ------
    InputError
        If it is not YAML, or states what is no set-up fact or a wrong value.
    """
    side = side_file(run_path)
    if side is None:
        return Facts()
    values = read_yaml(side, NAMES)
    is_profile = isinstance(values, dict) and str(values.get("schema", "")).startswith("fogml.import/")
    return Facts() if is_profile else facts_from(values, side.name)


def stated_facts(side: Path) -> Facts:
    """The facts in a file."""
    return facts_from(read_yaml(side, NAMES), side.name)


def side_file_text(facts: Facts) -> str:
    """The text of a side file that states `facts`."""
    return yaml_text(facts.as_dict())
