"""The job of ``fogml effects``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fogml.cli.terminal import Terminal
from fogml.cli.twin_commands import EffectsSettings
from fogml.numerals import number, short
from fogml.outputs import whole_folder
from fogml.twin.effect import Effect
from fogml.twin.registry import effect, effects

_TERMINAL_PROGRAMMES = ("multi-point-cycle", "joint-staircase", "separating")


def show_effects(settings: EffectsSettings, terminal: Terminal) -> None:
    """Print the catalogue or a card, and write its page where a folder is named."""
    if settings.effect is None:
        _catalogue(settings.out, terminal)
    else:
        _card(settings.effect, settings.out, terminal)


def _catalogue(out: str | None, terminal: Terminal) -> None:
    found = effects()
    if out is not None:
        from fogml.report.effect_card import catalogue_page
        from fogml.twin.pictures import allan_curve, card_values, pictures, rate_curves

        cards = []
        with whole_folder(out, shared=True) as folder:
            with terminal.work("drawing", total=len(found)) as work:
                for declared in found.values():
                    work.doing(declared.id)
                    (picture,) = pictures(declared)
                    drawn = picture, rate_curves(declared), allan_curve(declared)
                    cards.append((card_values(declared), *drawn))
                    work.advance()
            (folder / "catalogue.html").write_text(catalogue_page(cards), encoding="utf-8")
    rows = [[each.code, each.id, each.stage.replace("_", " "), each.title] for each in found.values()]
    terminal.table(f"{len(found)} effects", ["code", "id", "stage", "title"], rows)
    terminal.result(
        {
            "schema": "fogml.effects/1",
            "effects": [
                {
                    "id": declared.id,
                    "code": declared.code,
                    "stage": declared.stage,
                    "unit": declared.amplitude.unit,
                    "title": declared.title,
                    "candidate": declared.candidate,
                }
                for declared in found.values()
            ],
        }
    )
    if out is not None:
        terminal.say(f"Written to {out}: open {Path(out) / 'catalogue.html'}")
    else:
        terminal.say("`fogml effects ID` prints the card of one.")


def _card(id: str, out: str | None, terminal: Terminal) -> None:
    from fogml.twin.pictures import STANDARD_PROGRAMMES, allan_curve, card_values, pictures, rate_curves

    declared = effect(id)
    values = card_values(declared)
    if out is not None:
        with whole_folder(out, shared=True) as folder, terminal.work("drawing"):
            from fogml.report.effect_card import effect_page

            drawn = pictures(declared, _best_first(declared, STANDARD_PROGRAMMES))
            page = effect_page(values, drawn, rate_curves(declared), allan_curve(declared))
            (folder / f"{id}.html").write_text(page, encoding="utf-8")
    if not (terminal.quiet or terminal.as_json):
        _print_card(values, terminal)
        _print_pictures(id, terminal)
    terminal.result(values)
    if out is not None:
        terminal.say(f"Written to {out}: open {Path(out) / f'{id}.html'}")


def _print_card(card: Mapping[str, Any], terminal: Terminal) -> None:
    terminal.say(f"{card['code']}  {card['id']}: {card['title']}  ({card['stage'].replace('_', ' ')})")
    # Formulas that stand beside each other go below each other: two are often wider than a terminal.
    formulas = re.sub(r",\s{3,}", ",\n", card["equation"]).splitlines()
    for paragraph in (
        [card["summary"]],
        [f"    {line}" for line in formulas],
        *([r] for r in card["remarks"]),
    ):
        terminal.say("")
        for line in paragraph:
            terminal.say(line)
    rows = [
        [
            quantity["name"],
            quantity["unit"],
            *(" to ".join(map(short, quantity[grade])) for grade in ("tactical", "navigation")),
            quantity["meaning"],
        ]
        for quantity in (card["amplitude"], *card["shape"])
    ]
    terminal.table("", ["parameter", "unit", "tactical", "navigation", "meaning"], rows)
    terminal.say(f"Shows: {card['shows']}.")
    if card["confused_with"]:
        terminal.say("Confused with, and told apart by")
    for other, what in card["confused_with"].items():
        terminal.say(f"  {other}: {what}")
    terminal.say(f"Source: {card['source']}")


def _print_pictures(id: str, terminal: Terminal) -> None:
    from fogml.twin.pictures import pictures

    declared = effect(id)
    for picture in pictures(declared, _best_first(declared, _TERMINAL_PROGRAMMES)):
        low, high = float(picture.values.min()), float(picture.values.max())
        what = f" in {next(iter(picture.places))}" if picture.places else ""
        span = f"{number(low)} to {number(high)} {picture.unit}{what}, {short(picture.hours[-1])} h"
        terminal.say("")
        terminal.say(f"{picture.programme}: {span}")
        if low != high:
            terminal.curve(picture.values)


def _best_first(declared: Effect, names: Sequence[str]) -> list[str]:
    """Names of scenes, first that which shows the effect best."""
    return [declared.shown_on, *(name for name in names if name != declared.shown_on)]
