"""The schema ``fogml.twin/1``: which keys a twin file has, and what is said of a wrong one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, Field, ValidationError, create_model

from fogml.errors import known_are, quoted
from fogml.strict import Strict, first_fault
from fogml.twin.noise import QUANTITIES as NOISE
from fogml.twin.nominal import QUANTITIES as NOMINAL
from fogml.twin.optics import COIL, RECEIVER, Winding
from fogml.twin.plant.coil import LINE
from fogml.twin.plant.coil import QUANTITIES as ENDS
from fogml.twin.plant.heat import AIRFLOW, HEATING
from fogml.twin.plant.standard import LARGEST_ORDER
from fogml.twin.plant.standard import QUANTITIES as THERMAL
from fogml.twin.quantities import Grade, Quantity, limited
from fogml.twin.set_up import SENSOR_QUANTITIES, SURROUNDING_QUANTITIES

_SCHEMA: Any = Literal["fogml.twin/1"]
PROBABILITY = limited("probability", "1", 0.0, 1.0)


class Stated(Strict):
    """A constant: its value, its unit, and the spread of its prior where it has one."""

    value: float
    unit: str | None = None


class _WithDeviation(Stated):
    sd: float | None = Field(default=None, ge=0.0)


class _WithFactor(Stated):
    factor: float | None = Field(default=None, ge=1.0)


def _plain(value: Any) -> Any:
    """A bare number is a value in the documented unit."""
    return value if isinstance(value, dict | Stated) else {"value": value}


def _section(
    name: str, quantities: Iterable[Quantity], kind: type[Stated] = Stated, **more: Any
) -> type[Strict]:
    fields: dict[str, Any] = {
        q.name: (Annotated[kind | None, BeforeValidator(_plain)], None) for q in quantities
    }
    return create_model(name, __base__=Strict, **fields, **more)


def _optional(kind: type[Strict]) -> tuple[Any, Any]:
    """A section that may be left out, then with nothing stated in it."""
    return kind, Field(default_factory=kind)


class _UncertaintySection(Strict):
    source: str = ""
    parameters: list[str]
    covariance: list[list[float]]


_EFFECTS: Any = dict[str, dict[str, Annotated[Stated, BeforeValidator(_plain)]]]
_Sensor: Any = _section("_Sensor", SENSOR_QUANTITIES, reads=(dict[str, float], {}))
_SENSOR_TABLE: Any = dict[str, _Sensor]
_LINE_SECTION: Any = _section("_Line", LINE, layers=(Annotated[int, Field(ge=1, le=1000)], 32)) | None
_ENDS_SECTION: Any = _section("_Ends", ENDS) | None
TWIN_FILE: Any = create_model(
    "_File",
    __base__=Strict,
    schema_=(_SCHEMA, Field(alias="schema")),
    name=(str | None, None),
    description=(str, ""),
    grade=(Grade, "tactical"),
    nominal=_optional(_section("_Nominal", NOMINAL, _WithDeviation)),
    noise=_optional(_section("_Noise", NOISE, _WithFactor)),
    coil=_optional(
        _section(
            "_Coil", COIL, winding=(Winding, "quadrupole"), layers=(Annotated[int, Field(ge=3, le=1000)], 32)
        )
    ),
    receiver=_optional(_section("_Receiver", RECEIVER)),
    plant=_optional(
        _section(
            "_Plant",
            THERMAL,
            order=(Annotated[int, Field(ge=1, le=LARGEST_ORDER)], 6),
            heating=_optional(_section("_Heating", HEATING)),
            airflow=_optional(_section("_Airflow", AIRFLOW)),
            line=(_LINE_SECTION, None),
            ends=(_ENDS_SECTION, None),
        )
    ),
    sensors=_optional(_section("_Sensors", SENSOR_QUANTITIES, single=(_SENSOR_TABLE, {}))),
    surroundings=_optional(_section("_Surroundings", SURROUNDING_QUANTITIES)),
    effects=(_EFFECTS, {}),
    uncertainty=(_UncertaintySection | None, None),
    suspected=(_EFFECTS, {}),
)
"""The file as pydantic checks it; values and units are checked against their quantities afterwards."""


def message(error: ValidationError, source: str) -> str:
    """The first fault that pydantic found, in one sentence that names source and key."""
    first = first_fault(error)
    # Names of alternatives that pydantic adds to the place are no keys.
    words = [str(part) for part in first["loc"] if not str(part).startswith(("_", "function-"))]
    key = ".".join(words) or "?"
    if first["type"] == "extra_forbidden":
        known = _known_keys(words[:-1])
        return f"{source}: unknown key {quoted(key)}; {known_are(words[-1], known, 'known keys')}"
    if first["type"] == "missing":
        return f"{source}: nothing is given for '{key}'"
    reason = str(first["ctx"]["error"]) if "error" in first.get("ctx", {}) else first["msg"]
    return f"{source}: key '{key}': {reason} (found {quoted(first['input'])})"


def _known_keys(path: list[str]) -> list[str]:
    kind: Any = TWIN_FILE
    for word in path:
        fields = getattr(kind, "model_fields", {})
        if word in fields:  # else a name of the user's own: of a sensor, an effect or its shape
            kind = _model_in(fields[word].annotation)
    fields = getattr(kind, "model_fields", {})
    return [field.alias or name for name, field in fields.items()]


def _model_in(annotation: Any) -> Any:
    """The model in an annotation such as ``Model | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    found = [_model_in(part) for part in getattr(annotation, "__args__", ())]
    return next((part for part in found if part is not None), None)
