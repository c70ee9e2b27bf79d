"""``fogml demo``: the main job on a real recording that ships."""

from __future__ import annotations

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def demo(
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Train and judge on a real recording that ships, then say what to open.

    Trains on the up leg of a chamber cycle and judges on the last down leg, three axes. Writes
    x/, y/ and z/, each as 'train' does, and index.html.
    """
    from fogml.cli.demo_job import DemoSettings, demo_and_write

    settings = DemoSettings.gather(config, {"out": str(out) if out else None, "seed": seed})
    demo_and_write(settings, Terminal(as_json, quiet))
