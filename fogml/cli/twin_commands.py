"""Settings of the commands on twins: ``effects``, ``simulate``, ``replay``, ``diagnose``, ``plan``."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints, field_validator

from fogml.cli import options
from fogml.cli.given import load, option
from fogml.cli.lab_settings import LabSettings
from fogml.cli.settings import Settings, absolute, placed, setting


class EffectsSettings(Settings):
    """The catalogue of effects that a twin can have, or the card of one.

    A card states equation, unit, ranges, where the effect shows, what it is confused with and what
    separates the two, and draws its signature. With --out, writes ID.html, or catalogue.html with all.
    """

    job: ClassVar[str] = "fogml.cli.effects_job:show_effects"
    effect: str | None = placed(None, "[ID]", "An effect; all if none.", known=options.EFFECTS)
    out: options.FolderIfNamed = None


class ReplaySettings(Settings):
    """A twin's output for a run's inputs, or what one effect changes.

    The output is the one without noise. The file written holds the run's columns and 'replayed [deg/h]'.
    What another simulator gave for the run stands in the twin's place: a file with 'time' and 'gyro', such as
    Simulink's logged output, or the folder of results of gnss-ins-sim.
    """

    job: ClassVar[str] = "fogml.cli.twin_jobs:replay_and_write"
    twin: str | None = placed(
        None,
        "TWIN",
        "A twin file or name, or a simulator's output.",
        reads=True,
        known=options.TWINS,
        needed="no twin is given; name a file, or one that ships, e.g. tactical",
    )
    run: str | None = placed(
        None,
        "RUN",
        "The run whose inputs to take.",
        **options.RUN,
        needed="no run is given; name the run to replay",
    )
    only: str | None = setting(
        None, "The difference that one effect makes.", metavar="EFFECT", known=options.EFFECTS
    )
    truth: str | None = setting(
        None, "Truth of a simulated run, in place of its columns.", metavar="FILE", reads=True
    )
    gyro_axis: str | None = setting(
        None,
        "Of gnss-ins-sim's axes the gyro's; -z where it points the other way.",
        "--axis",
        metavar="x|y|z",
    )
    after: list[str] = setting(
        [],
        "The unit's run before, whose memory goes on; may be repeated. Each states 'started'.",
        metavar="RUN",
        reads=True,
    )
    storage_temperature: float = setting(25.0, "Where the unit was between runs.", metavar="DEGC")
    repair: options.Repair = False
    out: options.FileToWrite = None

    def check_given(self) -> None:
        """As `Settings.check_given`, and that what is said of storage is of runs before."""
        super().check_given()
        if not self.after:
            self.refuse_idle(
                ("storage_temperature",), "is of the time since another run; name it with --after"
            )


class DiagnoseSettings(Settings):
    """Where the gap between twin and recordings lies, which effect causes it, how far it closes.

    Writes gap.json, gap.html, what-if.html (sizes of effects on sliders), twin.yaml (the twin with the effect
    added), diagnose.config.yaml and, where a further run would tell more, next-run.yaml (its programme, for
    fogml simulate). Runs with a column 'replayed [deg/h]' are held against that in place of the twin. Runs
    that state different units are diagnosed together: causes are shared, sizes are each unit's own, in a
    folder for each.
    """

    job: ClassVar[str] = "fogml.cli.diagnose_job:diagnose_and_write"
    runs: list[str] = placed(
        [],
        "RUN...",
        "Runs to fit on.",
        **options.RUN,
        needed="no run is given; name the runs to diagnose before --held-out",
    )
    held_out: list[str] = setting(
        [],
        "Runs for the final figure; takes several, may be repeated.",
        metavar="RUN...",
        spread=True,
        **options.RUN,
    )
    noise: str | None = setting(None, "Static run of the unit, for its noise.", metavar="RUN", **options.RUN)
    twin: options.Twin = "nominal"
    without: list[str] = setting(
        [], "Effect that is no candidate; may be repeated.", metavar="EFFECT", known=options.EFFECTS
    )
    cost_of_false_name: options.CostOfFalseName = 1.0
    next_run: options.NextRun = True
    lab: options.Lab = {}
    rehearse: bool = setting(False, "Tell what these runs would name of each candidate.", "--rehearse")
    repair: options.Repair = False
    out: options.Folder = "diagnosis"


def _groups(value: Any) -> Any:
    """``["a,b", ...]`` as flags give them, or lists as YAML does."""
    return [options.names_list(group) for group in value] if isinstance(value, list) else value


def _each(value: Any) -> Any:
    """Names, of which some may come as one text with commas between."""
    if isinstance(value, list) and all(isinstance(one, str) for one in value):
        return [name.strip() for one in value for name in one.split(",")]
    return options.names_list(value)


_Names = Annotated[list[str], BeforeValidator(_each, json_schema_input_type=str | list[str])]


def _usual_latitude() -> float:
    from fogml.twin.simulate import DEFAULT_FACTS

    return DEFAULT_FACTS.latitude or 0.0


class PlanSettings(LabSettings, Settings):
    """Programmes that make wanted parameters identifiable, with expected standard errors.

    Searches rates, limits, soaks, a minor loop, table rates, power steps, fan and yaw. Writes
    programme.yaml, simulation.yaml (it with the mounting planned, for fogml simulate), plan.json, plan.html
    and plan.config.yaml.
    """

    job: ClassVar[str] = "fogml.cli.plan_job:plan_and_write"
    want: _Names = setting(
        [],
        "Effect, nominal constant (k1), or EFFECT.PARAMETER to be known; may be repeated.",
        metavar="EFFECT|CONSTANT",
        known=options.EFFECTS,
    )
    separate: Annotated[
        list[list[str]], BeforeValidator(_groups, json_schema_input_type=list[str | list[str]])
    ] = setting(
        [],
        "Effects to be told apart; one alone is to be shown; repeatable.",
        metavar="A,B",
        known=options.EFFECTS,
    )
    criterion: Annotated[str, StringConstraints(to_upper=True)] = setting(
        "D",
        "D: volume of the confidence ellipsoid; A: mean square of the standard errors.",
        metavar="D|A",
        known=("D", "A"),
    )
    runs: int = setting(1, "How many runs, planned in turn.")
    twin: options.Twin = "nominal"
    input_axis: str | None = setting(
        None, "up, down, north ...: the mounting; up or north is tried else.", metavar="WAY"
    )
    latitude: Annotated[float, option("Of the lab (39.9).", metavar="DEG")] = Field(
        default_factory=_usual_latitude
    )
    columns: _Names = setting(
        [], "What is recorded beside time and gyro; as 'simulate' does if none.", metavar="A,B"
    )
    out: options.Folder = "plan"


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

    job: ClassVar[str] = "fogml.cli.twin_jobs:simulate_and_write"
    config_argument: ClassVar[str] = "YAML file of schema fogml.simulate/1."
    schema_: Literal["fogml.simulate/1"] = Field("fogml.simulate/1", alias="schema")
    sample_s: float = setting(1.0, "Sample interval.", "--sample", metavar="SECONDS")
    programme: str | list[Any] | dict[str, Any] | None = setting(
        None, "Chamber and table programme.", metavar="NAME|FILE", reads=True, known=PROGRAMMES
    )
    twin: str | dict[str, Any] = setting(
        "nominal", "The twin.", metavar="NAME|FILE", reads=True, known=options.TWINS
    )
    draws: int = setting(
        0,
        "Units drawn from what is not known of the twin, a run each, in OUT-1, OUT-2 and so on.",
        metavar="UNITS",
        ge=0,
    )
    columns: list[str] = Field(default_factory=_usual_columns)
    facts: dict[str, Any] | None = None
    out: str | None = setting(
        None, "Run to write: .csv or .parquet.", "--out", "-o", metavar="FILE", writes=True
    )
    truth: str | None = setting(
        None, "File for the truth of nodes and effects: .csv or .parquet.", metavar="FILE", writes=True
    )
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

    def check_given(self) -> None:
        """As `Settings.check_given`, and that what is said of storage is of several runs."""
        super().check_given()
        if not self.runs:
            self.refuse_idle(("storage",), "is of the time between runs; state 'runs'")

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
