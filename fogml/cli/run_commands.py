"""Settings of ``demo``, ``import``, ``inspect``, ``noise``, ``app``, ``docs``, ``fleet`` and ``monitor``."""

from __future__ import annotations

import shlex
from typing import Any, ClassVar

from fogml.cli import options
from fogml.cli.settings import Settings, given_settings, placed, setting
from fogml.errors import InputError
from fogml.fleet import FORM
from fogml.tracking import shown_tracker


class DemoSettings(Settings):
    """Train and judge on a real recording that ships, then say what to open.

    Trains on the up leg of a chamber cycle and judges on the last down leg, three axes. Writes
    x/, y/ and z/, each as 'train' does, and index.html.
    """

    job: ClassVar[str] = "fogml.cli.demo_job:demo_and_write"
    out: options.Folder = "demo-results"


class ImportSettings(Settings):
    """Bring a logger's file into the run format, or draft a profile for it.

    Writes one run for each leg and axis, STEM[-LEG][-AXIS].csv, with its side file; with --repair one for
    each restart of the clock. With --draft, --out names the profile to write.
    """

    job: ClassVar[str] = "fogml.cli.run_jobs:import_and_write"
    file: str | None = placed(
        None,
        "FILE",
        "The logger's file.",
        reads=True,
        needed="no file is given; name the logger's file",
        lost="no such file",
    )
    profile: str | None = setting(
        None,
        "Name of a profile that ships, or a YAML file.",
        metavar="NAME|FILE",
        reads=True,
        known="fogml.runs.profile_schema:profile_names",
    )
    axis: str | None = setting(None, "One axis of the profile; all if none.", metavar="AXIS")
    draft: bool = setting(
        False,
        "Write a profile with guesses into the file that --out names, or print it; show the first rows "
        "as it reads them.",
    )
    repair: options.Repair = False
    out: options.FolderIfNamed = None

    def check_given(self) -> None:
        """As `Settings.check_given`, and what an import needs and a draft does not."""
        super().check_given()
        if self.draft:
            self.refuse_idle(("profile", "axis"), "is of an import; leave it out with --draft")
            return
        if not self.profile:
            draft = shlex.join(["fogml", "import", str(self.file), "--draft", "-o", "profile.yaml"])
            ships = ", ".join(given_settings(type(self))["profile"].known_names())
            raise InputError(
                f"no --profile is given; those that ship are {ships}, and '{draft}' writes a first one"
            )
        if not self.out:
            raise InputError("no --out is given; name the folder for the runs")


class InspectSettings(Settings):
    """Say what is in a run: columns, span, gaps, soaks and ramps, faults.

    With --out, writes inspect.json, inspect.html and inspect.config.yaml.
    """

    job: ClassVar[str] = "fogml.cli.run_jobs:inspect_and_write"
    runs: list[str] = placed(
        [],
        "RUN...",
        "Runs to look into.",
        **options.RUN,
        needed="no run is given; name at least one",
    )
    axis: options.Axis = None
    repair: options.Repair = False
    strict: options.Strict = False
    out: options.FolderIfNamed = None


class NoiseSettings(Settings):
    """Allan deviation and the IEEE 952 noise terms with intervals.

    With --out, writes noise.json, noise.html and noise.config.yaml; with --to the terms for another program
    too: noise.kalibr.yaml, noise_gyroparams.m (MATLAB), or noise.kalman.json (discrete-time Q).
    """

    job: ClassVar[str] = "fogml.cli.run_jobs:noise_and_write"
    run: str | list[str] | None = placed(
        None,
        "RUN...",
        "A run, best at constant temperature; several share their terms.",
        **options.RUN,
        needed="no run is given; name one",
    )
    overlapping: bool = setting(True, "Kind of estimator.", "--overlapping/--not-overlapping")
    to: str | None = setting(
        None,
        "Write the terms for another program.",
        metavar="kalibr|matlab|kalman",
        known="fogml.export.noise_parameters:TARGETS",
    )
    axis: options.Axis = None
    repair: options.Repair = False
    out: options.FolderIfNamed = None


class AppSettings(Settings):
    """A page on this machine: drop files, choose, train, judge, diagnose, export.

    Prints the page's address, with a token that opens it; nobody on another machine reaches it. Files and
    jobs lie in FOLDER. A job is a command line of fogml, shown beside the form. It goes on when page or
    server end, and the next fogml app of the folder finds it again.
    """

    job: ClassVar[str] = "fogml.cli.app_job:serve"
    folder: str = placed("fogml-app", "[FOLDER]", "Where files and jobs lie.", writes=True)
    port: int = setting(8765, "Port of the address; 0 for any that is free.", ge=0, le=65535)
    jobs: int = setting(1, "Jobs that run at a time; others wait.", ge=1)
    upload_limit: float = setting(2000.0, "Greatest size of a file.", metavar="MB", gt=0.0)
    idle: float | None = setting(
        None,
        "End once no page has asked for so long and no job runs; never if none.",
        metavar="SECONDS",
        gt=0.0,
    )
    browser: bool = setting(False, "Open the page in the browser.", "--browser/--no-browser")


class DocsSettings(Settings):
    """The documentation, without a network: list, read, or write as one page.

    Without PAGE lists the pages; with PAGE prints it; with --out writes every page into one HTML file that
    loads nothing from elsewhere.
    """

    job: ClassVar[str] = "fogml.cli.docs_job:show_docs"
    page: str | None = placed(None, "[PAGE]", "A page to print here.", known="fogml.cli.docs_job:page_names")
    out: str | None = setting(None, "File to write: .html.", "--out", "-o", metavar="FILE", writes=True)


class FleetSettings(options.LimitSettings):
    """Do the same job for every unit of a manifest, in parallel, here or on a cluster.

    The same command goes on where it was interrupted; a bad unit is reported and the rest go on.
    Writes fleet.json, fleet.html, fleet.xlsx and one folder per unit; of units with the job acceptance
    batch.json, batch.html and batch.xlsx too. Exit status 1 if a unit failed or misses a limit.
    """

    job: ClassVar[str] = "fogml.cli.fleet_job:fleet_and_write"
    manifest: str | None = placed(
        None,
        "MANIFEST",
        "CSV or YAML of units: unit, job, train, test, axis.",
        reads=True,
        needed="no manifest is given; name a CSV or YAML file of units",
        lost="no such file; a manifest was expected, CSV or YAML",
    )
    model: options.Model = "auto"
    features: options.Features = None
    parameters: options.Parameters = {}
    models: list[str] = ["all"]
    form: str = setting(FORM, "Features that the units' constants are compared in.", metavar="FEATURES")
    prior: str | None = setting(
        None,
        "Draw constants to those of an earlier fleet.",
        metavar="FLEET.JSON",
        reads=True,
        lost="no such file; a fleet.json was expected",
    )
    acceptance_limits: str | None = setting(
        None,
        "Limits of acceptance reports (YAML), as of 'lab acceptance'.",
        metavar="FILE",
        reads=True,
        lost="no such file",
    )
    twin: options.Twin = "nominal"
    next_run: options.NextRun = True
    workers: options.Workers = 1
    cluster: str | None = setting(None, "Scheduler of a Dask cluster.", metavar="tcp://HOST:PORT")
    device: str | None = setting(
        None, "Train the units' RBF networks there: cpu, cuda.", metavar="DEVICE", known=("cpu", "cuda")
    )
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
    monitor.config.yaml. A run that can't be used is told and holds up no other. Exit status 1 if a unit has
    changed or a run can't be used.
    """

    job: ClassVar[str] = "fogml.cli.monitor_job:monitor_and_write"
    model: str | None = placed(
        None,
        "MODEL",
        "Folder of the model, or of a fleet's results with a model per unit.",
        reads=True,
        needed="no model is given; name its folder, or that of a fleet's results",
        lost=options.LOST_MODEL,
    )
    runs: list[str] = placed([], "[RUN...]", "Runs that are new; none for those of the store.", reads=True)
    store: str | None = setting(
        None, "Where runs are kept: a folder, or postgresql://user@host/db (DIR/store).", metavar="FOLDER|URL"
    )
    false_alarm_every: float = setting(
        1000.0, "Least mean number of a unit's runs until a false alarm.", metavar="RUNS", ge=1.0
    )
    wander: bool = setting(
        True,
        "Take a bias that wanders as flicker for no change; without, smaller steps are found, and "
        "wandering raises alarms.",
        "--wander/--no-wander",
    )
    bias_limit: float | None = setting(
        None,
        "Change of the bias that asks for a calibration (the model's interval).",
        metavar="DEG/H",
        gt=0.0,
    )
    patience: float = setting(
        60.0, "How long to wait for a store that is away or busy.", metavar="SECONDS", ge=0.0
    )
    averaging: options.Averaging = 100.0
    any_unit: options.AnyUnit = False
    repair: options.Repair = False
    out: options.Folder = "monitor-results"
