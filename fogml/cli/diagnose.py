"""``fogml diagnose``: where the gap lies, which effect causes it, how far it closes."""

from __future__ import annotations

from typing import Annotated, ClassVar

from fogml.cli import options
from fogml.cli.given import argument, option
from fogml.cli.settings import Settings


class DiagnoseSettings(Settings):
    """Where the gap between twin and recordings lies, which effect causes it, how far it closes.

    Writes gap.json, gap.html, what-if.html (sizes of effects on sliders), twin.yaml (the twin with the effect
    added), diagnose.config.yaml and, where a further run would tell more, next-run.yaml (its programme, for
    fogml simulate). Runs with a column 'replayed [deg/h]' are held against that in place of the twin. Runs
    that state different units are diagnosed together: causes are shared, sizes are each unit's own, in a
    folder for each.
    """

    job: ClassVar[str] = "fogml.cli.diagnose_job:diagnose_and_write"
    runs: Annotated[
        list[str], argument("RUN...", "Runs to fit on.", reads=True, known=options.SHIPPED_RUNS)
    ] = []
    held_out: Annotated[
        list[str],
        option("Run for the final figure; may be repeated.", metavar="RUN", reads=True),
    ] = []
    noise: Annotated[
        str | None, option("Static run of the unit, for its noise.", metavar="RUN", reads=True)
    ] = None
    twin: options.Twin = "nominal"
    without: Annotated[
        list[str],
        option("Effect that is no candidate; may be repeated.", metavar="EFFECT", known=options.EFFECTS),
    ] = []
    cost_of_false_name: options.CostOfFalseName = 1.0
    next_run: options.NextRun = True
    rehearse: Annotated[bool, option("Tell what these runs would name of each candidate.", "--rehearse")] = (
        False
    )
    repair: options.Repair = False
    out: options.Folder = "diagnosis"
