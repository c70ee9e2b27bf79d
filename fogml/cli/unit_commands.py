"""Settings of the commands on many units: ``fleet``, ``monitor``."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field

from fogml.cli import options
from fogml.cli.given import argument, option
from fogml.cli.settings import Settings
from fogml.fleet.form import FORM
from fogml.tracking import shown_tracker


class FleetSettings(options.LimitSettings):
    """Do the same job for every unit of a manifest, in parallel, here or on a cluster.

    The same command goes on where it was interrupted; a bad unit is reported and the rest go on.
    Writes fleet.json, fleet.html, fleet.xlsx and one folder per unit; of units with the job acceptance
    batch.json, batch.html and batch.xlsx too. Exit status 1 if a unit failed or misses a limit.
    """

    job: ClassVar[str] = "fogml.cli.fleet_job:fleet_and_write"
    manifest: Annotated[
        str | None,
        argument("MANIFEST", "CSV or YAML of units: unit, job, train, test, axis.", reads=True),
    ] = None
    model: options.Model = "auto"
    features: options.Features = None
    parameters: options.Parameters = {}
    models: list[str] = ["all"]
    form: Annotated[
        str, option("Features that the units' constants are compared in.", metavar="FEATURES")
    ] = FORM
    prior: Annotated[
        str | None,
        option("Draw constants to those of an earlier fleet.", metavar="FLEET.JSON", reads=True),
    ] = None
    acceptance_limits: Annotated[
        str | None,
        option("Limits of acceptance reports (YAML), as of 'lab acceptance'.", metavar="FILE", reads=True),
    ] = None
    twin: options.Twin = "nominal"
    next_run: options.NextRun = True
    workers: options.Workers = 1
    cluster: Annotated[str | None, option("Scheduler of a Dask cluster.", metavar="tcp://HOST:PORT")] = None
    device: Annotated[
        str | None,
        option(
            "Train the units' RBF networks there: cpu, cuda.",
            metavar="DEVICE",
            known=("cpu", "cuda"),
        ),
    ] = None
    track: options.Track = None
    repair: options.Repair = False
    strict: options.Strict = False
    any_unit: options.AnyUnit = False
    out: options.Folder = "fleet-results"

    def as_written(self) -> dict[str, Any]:
        """The values of a configuration file; a password is never written."""
        track = None if self.track is None else shown_tracker(self.track)
        return {**super().as_written(), "track": track}

    def for_units(self) -> dict[str, Any]:
        """What units' results depend on."""
        left_out = {"manifest", "prior", "workers", "cluster", "device", "track", "out"}
        values = self.model_dump(mode="json", exclude=left_out)
        if self.device is not None:
            values["parameters"] = {**self.parameters, "device": self.device}
        return values


class MonitorSettings(Settings):
    """Watch units in service: what their model leaves on each run, and since when that is another.

    Keeps a few figures of every run in a store and judges all runs of each unit in their order: repeated and
    late runs change nothing but their place. Writes monitor.json, monitor.html, a page per unit and
    monitor.config.yaml. Exit status 1 if a unit has changed.
    """

    job: ClassVar[str] = "fogml.cli.monitor_job:monitor_and_write"
    model: Annotated[
        str | None,
        argument("MODEL", "Folder of the model, or of a fleet's results with a model per unit.", reads=True),
    ] = None
    runs: Annotated[
        list[str],
        argument("[RUN...]", "Runs that are new; none for those of the store.", reads=True),
    ] = []
    store: Annotated[
        str | None,
        option(
            "Where runs are kept: a folder, or postgresql://user@host/db (DIR/store).",
            metavar="FOLDER|URL",
        ),
    ] = None
    false_alarm_every: Annotated[
        float, option("Least mean number of a unit's runs until a false alarm.", metavar="RUNS")
    ] = Field(1000.0, ge=1.0)
    wander: Annotated[
        bool,
        option(
            "Take a bias that wanders as flicker for no change; without, smaller steps are found, and "
            "wandering raises alarms.",
            "--wander/--no-wander",
        ),
    ] = True
    bias_limit: Annotated[
        float | None,
        option("Change of the bias that asks for a calibration (the model's interval).", metavar="DEG/H"),
    ] = Field(None, gt=0.0)
    patience: Annotated[
        float, option("How long to wait for a store that is away or busy.", metavar="SECONDS")
    ] = Field(60.0, ge=0.0)
    averaging: options.Averaging = Field(100.0, gt=0.0)
    any_unit: options.AnyUnit = False
    repair: options.Repair = False
    out: options.Folder = "monitor-results"
