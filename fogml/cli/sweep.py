"""``fogml sweep``: search features, models and sizes on held-out parts of the training runs."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, ValidationError

from fogml.cli import options
from fogml.cli.given import option
from fogml.cli.settings import Settings
from fogml.errors import known_are, quoted
from fogml.strict import first_fault
from fogml.tracking import shown_tracker
from fogml.tuning.space import Space


def _understood(value: Any) -> Space:
    """The space; a fault names its place."""
    try:
        return value if isinstance(value, Space) else Space.model_validate(value)
    except ValidationError as error:
        first = first_fault(error)
        if first["type"] == "missing":
            raise ValueError(f"nothing is given for '{first['loc'][-1]}'") from None
        if first["type"] == "extra_forbidden" and len(first["loc"]) == 1:
            key = str(first["loc"][0])
            known = known_are(key, Space.model_fields, "known keys")
            raise ValueError(f"unknown key {quoted(key)}; {known}") from None
        place = ".".join(str(part) for part in first["loc"] if str(part) not in ("Range", "list[float]"))
        reason = str(first["ctx"]["error"]) if "error" in first.get("ctx", {}) else first["msg"]
        raise ValueError(f"{place}: {reason}" if place else reason) from None


class SweepSettings(Settings):
    """Search features, models and sizes on held-out parts of the training runs.

    The same command goes on with a study that was interrupted, and with --storage joins it from
    another machine. Writes best.yaml (a configuration of fogml train), sweep.json, sweep.html and
    sweep.config.yaml; the study itself is kept in --out unless --storage names a database.
    """

    job: ClassVar[str] = "fogml.cli.sweep_job:sweep_and_write"
    config_argument: ClassVar[str] = "YAML file of schema fogml.sweep/1."
    needed_keys: ClassVar[tuple[str, ...]] = ("runs",)
    schema_: Literal["fogml.sweep/1"] = Field("fogml.sweep/1", alias="schema")
    name: Annotated[str, option("Name of the study in its storage.", metavar="NAME")] = "sweep"
    runs: Annotated[
        list[str],
        option(
            "Training run; may be repeated.",
            "--run",
            metavar="RUN",
            reads=True,
            known=options.SHIPPED_RUNS,
        ),
    ] = []
    test: options.Tests = []
    space: Annotated[Space, BeforeValidator(_understood)]
    objectives: Annotated[list[str], BeforeValidator(options.names_list)] = ["rms"]
    folds: Literal["auto", "time", "runs"] = "auto"
    fold_count: int = 5
    trials: Annotated[int, option("Trials to finish.")] = 50
    sampler: str = "tpe"
    prune: bool = True
    workers: options.Workers = 1
    storage: Annotated[
        str | None, option("Database of the study, e.g. postgresql://user@host/db.", metavar="URL")
    ] = None
    heartbeat_s: float = 10.0
    track: options.Track = None
    averaging: options.Averaging = 100.0
    repair: options.Repair = False
    out: options.Folder = "sweep-results"

    def as_written(self) -> dict[str, Any]:
        """The values of a configuration file; a password is never written."""
        from fogml.databases import without_password

        values = self.model_dump(mode="json", by_alias=True, exclude_none=True)
        if self.track is not None:
            values["track"] = shown_tracker(self.track)
        return values if self.storage is None else {**values, "storage": without_password(self.storage)}
