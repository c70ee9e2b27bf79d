"""``fogml replay``: a twin's output for a run's inputs."""

from __future__ import annotations

from typing import Annotated, ClassVar

from fogml.cli import options
from fogml.cli.given import argument, option
from fogml.cli.settings import Settings


class ReplaySettings(Settings):
    """A twin's output for a run's inputs, or what one effect changes.

    The output is the one without noise. The file written holds the run's columns and 'replayed [deg/h]'.
    What another simulator gave for the run stands in the twin's place: a file with 'time' and 'gyro', such as
    Simulink's logged output, or the folder of results of gnss-ins-sim.
    """

    job: ClassVar[str] = "fogml.cli.replay_job:replay_and_write"
    twin: Annotated[
        str | None,
        argument("TWIN", "A twin file or name, or a simulator's output.", reads=True, known=options.TWINS),
    ] = None
    run: Annotated[
        str | None,
        argument("RUN", "The run whose inputs to take.", reads=True, known=options.SHIPPED_RUNS),
    ] = None
    only: Annotated[
        str | None,
        option("The difference that one effect makes.", metavar="EFFECT", known=options.EFFECTS),
    ] = None
    truth: Annotated[
        str | None,
        option("Truth of a simulated run, in place of its columns.", metavar="FILE", reads=True),
    ] = None
    gyro_axis: Annotated[
        str | None,
        option(
            "Of gnss-ins-sim's axes the gyro's; -z where it points the other way.", "--axis", metavar="x|y|z"
        ),
    ] = None
    after: Annotated[
        list[str],
        option(
            "The unit's run before, whose memory goes on; may be repeated. Each states 'started'.",
            metavar="RUN",
            reads=True,
        ),
    ] = []
    storage_temperature: Annotated[float, option("Where the unit was between runs.", metavar="DEGC")] = 25.0
    repair: options.Repair = False
    out: options.FileToWrite = None
