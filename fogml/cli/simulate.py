"""``fogml simulate``: a synthetic run from a programme and a twin."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator

from fogml.cli import options
from fogml.cli.given import load, option
from fogml.cli.settings import Settings, absolute

PROGRAMMES = "fogml.twin.programme:programme_names"


class StorageSettings(BaseModel):
    """Where the unit is between its runs: air [degC], humidity [%], and whether it stays on."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    temperature: float = 25.0
    humidity: float = 50.0
    power: Literal["on", "off"] = "off"

    @field_validator("power", mode="before")
    @classmethod
    def _as_word(cls, value: Any) -> Any:
        return {True: "on", False: "off"}.get(value, value) if isinstance(value, bool) else value


class SimulatedRun(BaseModel):
    """One of several runs of a unit; what it does not state is the file's."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    programme: str | list[Any] | dict[str, Any]
    started: datetime
    out: str
    truth: str | None = None
    sample_s: float | None = None
    columns: list[str] | None = None
    facts: dict[str, Any] | None = None


def _usual_columns() -> list[str]:
    from fogml.twin.simulate import DEFAULT_COLUMNS

    return list(DEFAULT_COLUMNS)


class SimulateSettings(Settings):
    """A synthetic run from a programme and a twin.

    It is written block by block. The run holds what was recorded; --truth keeps every node and every
    effect's contribution apart. With --draws a fleet of plausible units: constants, effects and plant drawn
    from the twin's covariance, as a diagnosis leaves it, and what is suspected on as often as it is likely.
    Samples in which the unit is off are not recorded.
    """

    job: ClassVar[str] = "fogml.cli.simulate_job:simulate_and_write"
    config_argument: ClassVar[str] = "YAML file of schema fogml.simulate/1."
    schema_: Literal["fogml.simulate/1"] = Field("fogml.simulate/1", alias="schema")
    sample_s: Annotated[float, option("Sample interval.", "--sample", metavar="SECONDS")] = 1.0
    programme: Annotated[
        str | list[Any] | dict[str, Any] | None,
        option("Chamber and table programme.", metavar="NAME|FILE", reads=True, known=PROGRAMMES),
    ] = None
    twin: Annotated[
        str | dict[str, Any], option("The twin.", metavar="NAME|FILE", reads=True, known=options.TWINS)
    ] = "nominal"
    draws: Annotated[
        int,
        Field(ge=0),
        option(
            "Units drawn from what is not known of the twin, a run each: OUT-1, OUT-2, ...", metavar="UNITS"
        ),
    ] = 0
    columns: list[str] = Field(default_factory=_usual_columns)
    facts: dict[str, Any] | None = None
    out: Annotated[
        str | None,
        option("Run to write: .csv or .parquet.", "--out", "-o", metavar="FILE", writes=True),
    ] = None
    truth: Annotated[
        str | None,
        option("File for the truth of nodes and effects: .csv or .parquet.", metavar="FILE", writes=True),
    ] = None
    runs: list[SimulatedRun] = []
    storage: StorageSettings = StorageSettings()

    @classmethod
    def gather(cls, config: Path | None, flags: Mapping[str, Any]) -> Self:
        """As `Settings.gather`; programmes of runs are meant from where the file lies, too."""
        found = super().gather(config, flags)
        if config is None:
            return found
        runs = []
        for run in found.runs:
            near = config.parent / run.programme if isinstance(run.programme, str) else None
            runs.append(run.model_copy(update={"programme": str(near)}) if near and near.is_file() else run)
        return found.model_copy(update={"runs": runs})

    def in_full(self) -> Self:
        """The settings with every path in full."""
        full = super().in_full()
        runs = []
        for run in full.runs:
            written = {key: absolute(value) for key in ("out", "truth") if (value := getattr(run, key))}
            if isinstance(run.programme, str) and run.programme not in load(PROGRAMMES)():
                written["programme"] = absolute(run.programme)
            runs.append(run.model_copy(update=written))
        return full.model_copy(update={"runs": runs})

    def _ships(self, key: str, value: str) -> bool:
        # A programme written out as a list of sentences names no file.
        return super()._ships(key, value) or isinstance(getattr(self, key), list)

    def as_written(self) -> dict[str, Any]:
        """The values of a configuration file."""
        return self.model_dump(mode="json", by_alias=True, exclude_none=True)
