"""``fogml docs``: the documentation, without a network."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def docs(
    page: Annotated[str | None, typer.Argument(metavar="[PAGE]", help="A page to print here.")] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write: .html.")] = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """The documentation, without a network: what pages there are, one of them, or all as one HTML file.

    Without PAGE lists the pages; with PAGE prints it; with --out writes every page into one HTML file that
    loads nothing from elsewhere.
    """
    from fogml.cli.docs_job import DocsSettings, show_docs

    settings = DocsSettings.gather(config, {"page": page, "out": str(out) if out else None, "seed": seed})
    show_docs(settings, Terminal(as_json, quiet))
