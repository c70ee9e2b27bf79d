"""Set-up facts of a run, and the Earth rate that follows from them."""

from __future__ import annotations

import math
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fogml.errors import InputError

EARTH_RATE_DEG_H = 15.041067


class ScaleFactor(BaseModel):
    """Nominal K0: gyro [deg/h] = counts / value."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    value: float
    unit: Literal["count per deg/h", "count per deg/s"] = "count per deg/h"

    @property
    def count_per_deg_h(self) -> float:
        """K0 in counts per deg/h."""
        return self.value if self.unit == "count per deg/h" else self.value / 3600.0


class Heading(BaseModel):
    """A horizontal input axis, in degrees clockwise from north."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    heading: float


class Facts(BaseModel):
    """The facts about the set-up that a side file may state. All optional.

    Latitude in degrees north; `powered_on` in seconds on the run's clock.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    unit: str | None = None
    axis: str | None = None
    latitude: float | None = Field(default=None, ge=-90.0, le=90.0)
    input_axis: Literal["up", "down", "north", "south", "east", "west"] | Heading | None = None
    scale_factor: ScaleFactor | None = None
    powered_on: float | None = None
    started: datetime | None = None
    notes: str | None = None

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

    def as_dict(self) -> dict[str, Any]:
        """The stated facts as YAML- and JSON-ready values."""
        return self.model_dump(mode="json", exclude_none=True)


def facts_from(values: Any, source: str) -> Facts:
    """Check set-up facts read from `source`.

    Raises
    ------
    InputError
        Naming the key, what was found and what is accepted.
    """
    if values is None:
        return Facts()
    if not isinstance(values, dict):
        raise InputError(f"{source}: set-up facts must be 'key: value' lines, found {type(values).__name__}")
    # YAML reads a serial number such as 0417 as an integer; a serial number is a name.
    names = {k: str(v) for k, v in values.items() if k in ("unit", "axis") and isinstance(v, int | float)}
    values = {**values, **names}
    try:
        return Facts.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        key = str(first["loc"][0]) if first["loc"] else "?"
        if first["type"] == "extra_forbidden":
            known = ", ".join(Facts.model_fields)
            raise InputError(f"{source}: unknown key '{key}'; known keys are {known}") from None
        raise InputError(f"{source}: key '{key}': {first['msg']} (found {first['input']!r})") from None


def read_side_file(run_path: Path) -> Facts:
    """The facts in the side file beside a run (same stem, .yaml or .yml); none if absent."""
    for suffix in (".yaml", ".yml"):
        side = run_path.with_suffix(suffix)
        if side.is_file():
            return facts_from(read_yaml(side), side.name)
    return Facts()


def side_file_text(facts: Facts) -> str:
    """The text of a side file that states `facts`."""
    import yaml

    return yaml.safe_dump(facts.as_dict(), sort_keys=False, allow_unicode=True)


def read_yaml(path: Path) -> Any:
    """The content of a YAML file.

    Raises
    ------
    InputError
        Naming the file and the line, if it is not YAML.
    """
    import yaml

    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        place = getattr(error, "problem_mark", None)
        where = f", line {place.line + 1}" if place is not None else ""
        raise InputError(f"{path.name}{where}: not readable as YAML; correct or remove it") from None
