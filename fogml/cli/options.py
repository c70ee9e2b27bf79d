"""Settings that several commands share, each declared once."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator

from fogml.cli.given import argument, option
from fogml.cli.settings import RUN, Settings, setting
from fogml.errors import quoted
from fogml.yaml_text import parse_yaml


def named_values(texts: list[Any]) -> dict[str, Any]:
    """``["name=value", ...]`` as flags give them, each value read as YAML reads it."""
    values = {}
    for text in texts:
        name, equals, value = str(text).partition("=")
        if not (equals and name.strip()):
            raise ValueError(f"{quoted(text)} sets nothing; write NAME=VALUE, e.g. centres=16")
        values[name.strip()] = parse_yaml(value, quoted(text))
    return values


def numbers_by_name(texts: list[Any], expected: str) -> dict[str, float]:
    """``["name=value", ...]`` as flags give them, each value a number."""
    values = {}
    for text in texts:
        name, equals, number = str(text).partition("=")
        try:
            values[name.strip()] = float(number)
        except ValueError:
            equals = ""
        if not equals:
            raise ValueError(f"{quoted(text)} is no {expected}")
    return values


def number_list(text: str, example: str) -> list[float]:
    """Numbers of a text with commas."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"{quoted(text)} is no list of numbers; write e.g. {example}") from None


def numbers(example: str) -> BeforeValidator:
    """What takes a list of numbers as one text with commas, too."""
    return BeforeValidator(
        lambda value: number_list(value, example) if isinstance(value, str) else value,
        json_schema_input_type=str | list[float],
    )


def names_list(value: object) -> object:
    """Names of a text with commas between, as flags give them; a list as it stands."""
    if isinstance(value, str):
        return [name.strip() for name in value.split(",") if name.strip()]
    return value


NAMES = BeforeValidator(names_list, json_schema_input_type=str | list[str])
"""What takes a list of names as one text with commas, too."""
_NAMED = BeforeValidator(
    lambda value: named_values(value) if isinstance(value, list) else value,
    json_schema_input_type=dict[str, Any] | list[str],
)
Repairing = bool | Literal["anyway"]
"""Whether faulty rows are repaired, and ``anyway`` if however many that drops."""
Repair = Annotated[
    Repairing,
    option(
        "Mend clocks and drop up to 2 % of faulty rows; what was done is in every result.",
        "--repair/--no-repair",
        values={"--repair-anyway": ("anyway", "Repair, however many rows that drops.")},
    ),
]
EFFECTS = "fogml.twin.registry:effects"
TWINS = "fogml.twin.twin_file:twin_names"
Runs = Annotated[
    list[str],
    argument(
        "RUN...",
        "Training runs.",
        **RUN,
        needed="no training run is given; name the training runs before --test",
    ),
]
_TESTS = option(
    "Runs to judge on; takes several, may be repeated.",
    "--test",
    metavar="RUN...",
    spread=True,
    **RUN,
)
Tests = Annotated[list[str], replace(_TESTS, needed="no test run is given; name at least one after --test")]
TestsIfAny = Annotated[list[str], _TESTS]
LOST_MODEL = "no such folder; name the one that 'fogml train' wrote the model into, e.g. DIR/model"
Model = Annotated[str, option("Name of the model.", metavar="NAME", known="fogml.models.names:model_names")]
Features = Annotated[str | None, option('Feature text, e.g. "T, dT, T*dT".', metavar="FEATURES")]
Parameters = Annotated[
    dict[str, Any],
    option("Parameter of the model; may be repeated.", "--set"),
    _NAMED,
]
Averaging = Annotated[float, Field(gt=0.0), option("Averaging time of the figures.", metavar="SECONDS")]
Strict = Annotated[
    bool,
    option(
        "Make errors of a small span of temperature, samples outside training, a test run trained on.",
        "--strict/--no-strict",
    ),
]
AnyUnit = Annotated[
    bool, option("Allow a run of another unit or axis than the model's.", "--any-unit/--same-unit")
]
Axis = Annotated[
    str | None,
    option(
        "Of files with gyro_x, gyro_y, gyro_z this one alone; all if none.",
        metavar="x|y|z",
        known=("x", "y", "z"),
    ),
]
Workers = Annotated[int, option("Processes on this machine.")]
Track = Annotated[
    str | None,
    option("Tell MLflow there of each trial or unit, too (extra mlflow).", metavar="URL|FOLDER"),
]
CostOfFalseName = Annotated[
    float,
    Field(gt=0.0),
    option("What a false name costs over a missed one: the greater, the surer a name.", metavar="RATIO"),
]
NextRun = Annotated[
    bool,
    option(
        "Look for the programme of a run that would tell more; half of the time may go into it.",
        "--next-run/--no-next-run",
    ),
]
Lab = Annotated[
    dict[str, Any],
    option(
        "Limit of the next run, as an option of 'plan': hottest=50, fastest_ramp=1; may be repeated.", "--lab"
    ),
    _NAMED,
]
Twin = Annotated[
    str,
    option("Twin file, or one that ships.", metavar="TWIN", reads=True, known=TWINS),
]
_FOLDER = option("Folder for the results.", "--out", "-o", metavar="DIR", writes=True)
Folder = Annotated[str, _FOLDER]
FolderIfNamed = Annotated[str | None, _FOLDER]
FileToWrite = Annotated[
    str | None,
    option(
        "File to write: .csv or .parquet.",
        "--out",
        "-o",
        metavar="FILE",
        writes=True,
        needed="no --out is given; name the file to write, .csv or .parquet",
    ),
]


class LimitSettings(Settings):
    """Settings of a command that judges."""

    averaging: Averaging = 100.0
    design_index: float | None = setting(None, "Greatest rms allowed after compensation.", metavar="DEG/H")
    limits: dict[str, float] = setting({}, "Limit on another figure; may be repeated.", "--limit")
    turn_on_band: float | None = setting(
        None,
        "Tell the time from power-on until the bias stays this near to its settled value.",
        metavar="DEG/H",
    )
    noise: str | None = setting(
        None,
        "Static run of the unit: its noise makes the floor.",
        metavar="RUN",
        **RUN,
    )

    @field_validator("limits", mode="before", json_schema_input_type=dict[str, float] | list[str])
    @classmethod
    def _from_flags(cls, value: Any) -> Any:
        """``["name=value", ...]`` as flags give them, or a mapping as YAML does."""
        expected = "limit; write NAME=VALUE, e.g. bias_stability=0.02"
        return numbers_by_name(value, expected) if isinstance(value, list) else value
