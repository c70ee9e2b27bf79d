"""``fogml inspect``: what is in a run."""

from __future__ import annotations

from typing import Annotated, ClassVar

from fogml.cli import options
from fogml.cli.given import argument
from fogml.cli.settings import Settings


class InspectSettings(Settings):
    """Say what is in a run: columns, span, gaps, soaks and ramps, faults.

    With --out, writes inspect.json, inspect.html and inspect.config.yaml.
    """

    job: ClassVar[str] = "fogml.cli.inspect_job:inspect_and_write"
    runs: Annotated[
        list[str], argument("RUN...", "Runs to look into.", reads=True, known=options.SHIPPED_RUNS)
    ] = []
    axis: options.Axis = None
    repair: options.Repair = False
    strict: options.Strict = False
    out: options.FolderIfNamed = None
