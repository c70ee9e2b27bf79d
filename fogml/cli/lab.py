"""``fogml lab``: procedures of a laboratory: misalignment, rate table, north seeking, acceptance."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, Field

from fogml.cli import options
from fogml.cli.settings import Settings, placed, setting
from fogml.errors import InputError

WAYS = ("plain", "drift-observing", "palindrome", "coarse-fine")
"""Ways to spend the time of a seek, by name."""


def _transients(value: Any) -> Any:
    """``["0.2,600", ...]`` as flags give them, or pairs as YAML does."""
    if not isinstance(value, list):
        return value
    pairs = [options.number_list(item, "0.2,600") if isinstance(item, str) else item for item in value]
    if any(not isinstance(pair, list | tuple) or len(pair) != 2 for pair in pairs):
        raise ValueError("a transient is an amplitude in deg/h and a time constant in s; write 0.2,600")
    return [tuple(pair) for pair in pairs]


class MisalignmentSettings(Settings):
    """Scale factor and input-axis misalignment, decoupled over four mounting states.

    In state 2 the gyro is turned clockwise in its mounting plane, seen from +z, by 180 deg, for state 3 by 90
    deg more, for state 4 by 180 deg more; other turns are stated. Turns the data contradict are an error.
    With --out, writes misalignment.json, misalignment.html and lab-misalignment.config.yaml.
    """

    job: ClassVar[str] = "fogml.cli.lab_jobs:misalignment_and_write"
    file: str | None = placed(
        None,
        "FILE",
        "Table with state, tilt [deg], rate [deg/s], output [unit], and segment or time.",
        reads=True,
        needed="no file is given; name the table of turns and rests",
        lost="no such file",
    )
    cross_tilt: bool | None = setting(
        None,
        "Fit a constant over the tilts for a fixture tilted across (where the data show one).",
        "--cross-tilt/--no-cross-tilt",
    )
    state_angles: Annotated[list[float] | None, options.numbers("0,180,270,90")] = setting(
        None,
        "Turn of the gyro in its mounting plane in states 1 to 4, clockwise as seen from +z "
        "(0,180,270,90), where FILE has no column state_angle [deg].",
        metavar="DEG,...",
        as_text=True,
    )
    out: options.FolderIfNamed = None


class RateSettings(Settings):
    """Scale factor, range, threshold, dead zone, resolution, bandwidth, slew, temperature sensitivity.

    From runs that hold any of the tests, or of a twin (--twin; synthetic). With --out, writes rate.json,
    rate.html and lab-rate.config.yaml.
    """

    job: ClassVar[str] = "fogml.cli.lab_jobs:rate_and_write"
    runs: list[str] = placed(
        [],
        "[RUN...]",
        "Runs on a rate table, with the column rate as commanded.",
        **options.RUN,
    )
    twin: str | None = setting(
        None, "Test a twin in place of recorded runs.", metavar="NAME|FILE", reads=True, known=options.TWINS
    )
    greatest: float = setting(500.0, "With --twin: greatest rate tested.", metavar="DEG/S", gt=0.0, le=1e4)
    noise: bool = setting(False, "With --twin: its noise too; else its effects alone.", "--noise/--no-noise")
    settle: float | None = setting(
        None,
        "Left out at the begin of each rate; as long as outputs show if none.",
        metavar="SECONDS",
        ge=0.0,
    )
    answers: float = setting(
        0.5, "Share of the expected output that counts.", metavar="SHARE", gt=0.0, lt=1.0
    )
    dead: float = setting(0.1, "Share of the expected change that is dead.", metavar="SHARE", gt=0.0, lt=1.0)
    range_error: float = setting(0.01, "Shortfall that ends the range.", metavar="SHARE", gt=0.0, lt=1.0)
    small: float = setting(0.02, "Of the greatest rate: rates about zero.", metavar="SHARE", gt=0.0, le=1.0)
    repair: options.Repair = False
    out: options.FolderIfNamed = None

    def check_given(self) -> None:
        """As `Settings.check_given`, and that runs or a twin are given, not both."""
        super().check_given()
        if bool(self.runs) == bool(self.twin):
            raise InputError("give recorded runs, or --twin to test a twin; one of the two")
        if self.runs:
            self.refuse_idle(
                ("greatest", "noise"), "is of the test of a twin; leave it out with recorded runs"
            )


class NorthSettings(Settings):
    """North from several positions, and what a drift does to it: the error, and where it is nothing.

    Either from a recorded run (--positions) or simulated (--azimuth and --latitude). With --out, writes
    north.json, north.html and lab-north.config.yaml.
    """

    job: ClassVar[str] = "fogml.cli.lab_jobs:north_and_write"
    positions: str | None = setting(
        None,
        "A run with a column position, 1 to 4, or the table's angle.",
        metavar="FILE",
        reads=True,
        lost="no such file",
    )
    azimuth: float | None = setting(None, "Simulate a seek at this azimuth.", metavar="DEG", ge=-1e6, le=1e6)
    latitude: float | None = setting(None, "Latitude.", metavar="DEG")
    dwell: float = setting(60.0, "In a position.", metavar="SECONDS")
    transfer: float = setting(0.0, "Time to the next position.", metavar="SECONDS")
    drift: float = setting(0.0, "Linear drift of the bias.", metavar="DEG/H/H")
    transients: Annotated[
        list[Annotated[tuple[float, float], Field(strict=False)]],
        BeforeValidator(_transients, json_schema_input_type=list[str | tuple[float, float]]),
    ] = setting([], "Exponential from power-on; may be repeated.", "--transient", metavar="DEG/H,SECONDS")
    start: float = setting(0.0, "Begin of the seek after power-on.", metavar="SECONDS")
    noise: float = setting(0.0, "Angle random walk, for se.", metavar="DEG/SQRT(H)", ge=0.0)
    sense: str = setting("cw", "Way the positions are taken.", metavar="cw|ccw", known=("cw", "ccw"))
    order: Annotated[list[float], options.numbers("0,90,180,270")] = setting(
        [0.0, 90.0, 180.0, 270.0], "Angles of the positions.", metavar="DEG,...", as_text=True
    )
    way: str = setting(
        "plain", "plain, drift-observing, palindrome, coarse-fine.", metavar="NAME", known=WAYS
    )
    method: str = setting(
        "auto",
        "With --positions: auto, plain, drift-observing, bend-observing.",
        metavar="NAME",
        known="fogml.lab.north_positions:METHODS",
    )
    settle: float = setting(0.0, "With --positions: left out at each begin.", metavar="SECONDS")
    coarse: float = setting(6.0, "Time in a coarse position.", metavar="SECONDS")
    repair: options.Repair = False
    out: options.FolderIfNamed = None

    def check_given(self) -> None:
        """As `Settings.check_given`, and that a run is given or what a simulation needs."""
        super().check_given()
        if not self.positions and (self.azimuth is None or self.latitude is None):
            raise InputError("give a run with --positions, or --azimuth and --latitude for a simulation")
        if self.positions:
            simulated = ("dwell", "transfer", "drift", "transients", "start", "noise", "way", "coarse")
            self.refuse_idle(simulated, "is of a simulation; leave it out with --positions")
        else:
            self.refuse_idle(("method", "settle"), "is of a recorded run; leave it out, or give --positions")


class AcceptanceSettings(Settings):
    """The acceptance report of one gyro: every figure that its runs tell, limits and verdict.

    From runs of one unit and axis: static, over temperature, on a rate table. Figures are before and after
    compensation where a model is named. With --out, writes acceptance.json, acceptance.html,
    acceptance.xlsx and lab-acceptance.config.yaml. Exit status 1 if limits are stated and the unit is not
    accepted.
    """

    job: ClassVar[str] = "fogml.cli.lab_jobs:acceptance_and_write"
    runs: list[str] = placed([], "RUN...", "Runs of one unit and axis.", **options.RUN)
    model: str | None = setting(
        None, "Folder of the unit's model.", metavar="DIR", reads=True, lost=options.LOST_MODEL
    )
    limits: str | None = setting(
        None, "Limits (YAML): customer, document, limits.", metavar="FILE", reads=True, lost="no such file"
    )
    noise: str | None = setting(None, "Static run for noise terms and floor.", metavar="RUN", **options.RUN)
    averaging: options.Averaging = 100.0
    turn_on_band: float | None = setting(None, "Band that tells the turn-on time.", metavar="DEG/H", gt=0.0)
    date: str | None = setting(None, "Date of issue; a line to write it on if none.")
    axis: options.Axis = None
    repair: options.Repair = False
    out: options.FolderIfNamed = None


class BatchSettings(Settings):
    """A batch of units from their acceptance reports: yield, distribution, links, who fails on what.

    With --out, writes batch.json, batch.html, batch.xlsx and lab-batch.config.yaml. Exit status 1 if a unit
    is not accepted or a folder holds no report.
    """

    job: ClassVar[str] = "fogml.cli.lab_jobs:batch_and_write"
    reports: list[str] = placed(
        [],
        "REPORT...",
        "Files acceptance.json, or the folders that hold them.",
        reads=True,
        needed="no report is given; name files acceptance.json, or the folders that hold them",
        lost="no such file; name acceptance reports (acceptance.json) or their folders",
    )
    title: str = setting("Batch", "Heading of the page.")
    out: options.FolderIfNamed = None


COMMANDS = {
    "misalignment": MisalignmentSettings,
    "rate": RateSettings,
    "north": NorthSettings,
    "acceptance": AcceptanceSettings,
    "batch": BatchSettings,
}
