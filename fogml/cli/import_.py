"""``fogml import``: a logger's file into the run format."""

from __future__ import annotations

from typing import Annotated, ClassVar

from fogml.cli import options
from fogml.cli.given import argument, option
from fogml.cli.settings import Settings


class ImportSettings(Settings):
    """Bring a logger's file into the run format, or draft a profile for it.

    Writes one run for each leg and axis, STEM[-LEG][-AXIS].csv, with its side file; with --repair one for
    each restart of the clock. With --draft, --out names the profile to write.
    """

    job: ClassVar[str] = "fogml.cli.import_job:import_and_write"
    file: Annotated[str | None, argument("FILE", "The logger's file.", reads=True)] = None
    profile: Annotated[
        str | None,
        option(
            "Name of a profile that ships, or a YAML file.",
            metavar="NAME|FILE",
            reads=True,
            known="fogml.runs.profile_schema:profile_names",
        ),
    ] = None
    axis: Annotated[str | None, option("One axis of the profile; all if none.", metavar="AXIS")] = None
    draft: Annotated[
        bool,
        option(
            "Write a profile with guesses into the file that --out names, or print it; show the first rows "
            "as it reads them."
        ),
    ] = False
    repair: options.Repair = False
    out: options.FolderIfNamed = None
