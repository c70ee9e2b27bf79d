"""``fogml compensate``: apply a model to a run of any length."""

from __future__ import annotations

from typing import Annotated, ClassVar

from fogml.cli import options
from fogml.cli.given import argument, option
from fogml.cli.settings import Settings


class CompensateSettings(Settings):
    """Apply a model to a run of any length, in bounded memory.

    The file written holds the run's columns and 'drift [deg/h]', 'gyro_compensated [deg/h]' and
    'flag': 0 good, 1 outside what the model was trained on, 2 a window not full (there the static part) or a
    memory not settled (there what the run tells of it).
    """

    job: ClassVar[str] = "fogml.cli.compensate_job:compensate_and_write"
    run: Annotated[
        str | None,
        argument("RUN", "The run to compensate.", reads=True, known=options.SHIPPED_RUNS),
    ] = None
    model: Annotated[
        str | None, option("Folder of the model, or of the results that hold it.", metavar="DIR", reads=True)
    ] = None
    any_unit: options.AnyUnit = False
    axis: options.Axis = None
    repair: options.Repair = False
    out: options.FileToWrite = None
