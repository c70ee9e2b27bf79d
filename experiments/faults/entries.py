"""The cheap entry points alone, as a command beside the others: within the same net, without a job behind."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options

NAME = "only"
COMMAND = {NAME: ("experiments.faults.entries", "An entry point without a job.")}
app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def read(path: str, repair: Annotated[bool, typer.Option("--repair")] = False) -> None:
    """Read a run."""
    from fogml.cli.runs import open_run

    open_run(path, repair=repair)


@app.command()
def load(folder: str) -> None:
    """Load a model."""
    from fogml.models.saved import load_model

    load_model(folder)


@app.command()
def features(text: str) -> None:
    """Read a feature text."""
    from fogml.features.parse import parse_features

    parse_features(text)
