"""``fogml effects``: the catalogue, or one card."""

from __future__ import annotations

from typing import Annotated, ClassVar

from fogml.cli import options
from fogml.cli.given import argument
from fogml.cli.settings import Settings


class EffectsSettings(Settings):
    """The catalogue of effects that a twin can have, or the card of one.

    A card states equation, unit, ranges, where the effect shows, what it is confused with and what
    separates the two, and draws its signature. With --out, writes ID.html, or catalogue.html with all.
    """

    job: ClassVar[str] = "fogml.cli.effects_job:show_effects"
    effect: Annotated[str | None, argument("[ID]", "An effect; all if none.", known=options.EFFECTS)] = None
    out: options.FolderIfNamed = None
