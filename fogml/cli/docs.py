"""``fogml docs``: the documentation, without a network."""

from __future__ import annotations

from typing import Annotated, ClassVar

from fogml.cli.given import argument, option
from fogml.cli.settings import Settings


class DocsSettings(Settings):
    """The documentation, without a network: list, read, or write as one page.

    Without PAGE lists the pages; with PAGE prints it; with --out writes every page into one HTML file that
    loads nothing from elsewhere.
    """

    job: ClassVar[str] = "fogml.cli.docs_job:show_docs"
    page: Annotated[
        str | None, argument("[PAGE]", "A page to print here.", known="fogml.report.manual:page_names")
    ] = None
    out: Annotated[
        str | None, option("File to write: .html.", "--out", "-o", metavar="FILE", writes=True)
    ] = None
