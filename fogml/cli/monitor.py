"""``fogml monitor``: units in service, run by run."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from fogml.cli import options
from fogml.cli.given import argument, option
from fogml.cli.settings import Settings


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
