"""``fogml app``: a page on this machine, where files are dropped and every click is a command line."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from fogml.cli.given import argument, option
from fogml.cli.settings import Settings


class AppSettings(Settings):
    """A page on this machine: drop files, choose, train, judge, diagnose, export.

    Prints the page's address, with a token that opens it; nobody on another machine reaches it. Files and
    jobs lie in FOLDER. A job is a command line of fogml, shown beside the form. It goes on when page or
    server end, and the next fogml app of the folder finds it again.
    """

    job: ClassVar[str] = "fogml.cli.app_job:serve"
    folder: Annotated[str, argument("[FOLDER]", "Where files and jobs lie.", writes=True)] = "fogml-app"
    port: Annotated[int, option("Port of the address; 0 for any that is free.")] = Field(8765, ge=0, le=65535)
    jobs: Annotated[int, option("Jobs that run at a time; others wait.")] = Field(1, ge=1)
    upload_limit: Annotated[float, option("Greatest size of a file.", metavar="MB")] = Field(2000.0, gt=0.0)
    idle: Annotated[
        float | None,
        option("End once no page has asked for so long and no job runs; never if none.", metavar="SECONDS"),
    ] = Field(None, gt=0.0)
    browser: Annotated[bool, option("Open the page in the browser.", "--browser/--no-browser")] = False
