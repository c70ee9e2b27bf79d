"""``fogml effects``: the catalogue, or one card."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def effects(
    effect: Annotated[str | None, typer.Argument(metavar="[ID]", help="An effect; all if none.")] = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """The catalogue of effects that a twin can have, or the card of one.

    A card states equation, unit, ranges, where the effect shows, what it is confused with and what
    separates the two, and draws its signature. With --out, writes ID.html, or catalogue.html with all.
    """
    from fogml.cli.effects_job import EffectsSettings, show_effects

    settings = EffectsSettings.gather(
        config, {"effect": effect, "out": str(out) if out else None, "seed": seed}
    )
    show_effects(settings, Terminal(as_json, quiet))
