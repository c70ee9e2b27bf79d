"""Options that several commands share, and values after ``--test``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

Config = Annotated[
    Path | None, typer.Option("--config", help="YAML file with any of these settings; flags override it.")
]
Seed = Annotated[int | None, typer.Option("--seed", help="Seed of everything random (0).")]
Json = Annotated[bool, typer.Option("--json", help="Print the result alone, as JSON.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors and what --json asks.")]
Out = Annotated[Path | None, typer.Option("--out", "-o", help="Folder for the results.")]
Repair = Annotated[
    bool | None,
    typer.Option(
        "--repair/--no-repair",
        help="Mend clocks and drop up to 2 % of faulty rows; what was done is in every result.",
    ),
]
RepairAnyway = Annotated[
    bool | None, typer.Option("--repair-anyway", help="Repair, however many rows that drops.")
]
Strict = Annotated[
    bool | None,
    typer.Option("--strict/--no-strict", help="Make warnings on the runs' temperatures and rates errors."),
]
AnyUnit = Annotated[
    bool | None,
    typer.Option("--any-unit/--same-unit", help="Allow a run of another unit or axis than the model's."),
]
Averaging = Annotated[
    float | None, typer.Option("--averaging", metavar="SECONDS", help="Averaging time of the figures (100).")
]
Noise = Annotated[
    str | None,
    typer.Option("--noise", metavar="RUN", help="Static run of the unit: its noise makes the floor."),
]
Features = Annotated[str | None, typer.Option("--features", help='Feature text, e.g. "T, dT, T*dT".')]
DesignIndex = Annotated[
    float | None,
    typer.Option("--design-index", metavar="DEG/H", help="Greatest rms allowed after compensation."),
]
Limits = Annotated[
    list[str] | None,
    typer.Option("--limit", metavar="NAME=VALUE", help="Limit on another figure; may be repeated."),
]
TurnOnBand = Annotated[
    float | None,
    typer.Option(
        "--turn-on-band",
        metavar="DEG/H",
        help="Tell the time from power-on until the bias stays this near to its settled value.",
    ),
]
Tests = Annotated[
    list[str] | None,
    typer.Option("--test", metavar="RUN...", help="Runs to judge on; takes several, may be repeated."),
]


def repairing(repair: bool | None, anyway: bool | None) -> bool | str | None:
    """The setting ``repair`` of its two flags."""
    return "anyway" if anyway else repair


APP_SETTINGS: dict[str, Any] = {
    "add_completion": False,
    "rich_markup_mode": None,
    "pretty_exceptions_enable": False,
    "context_settings": {"help_option_names": ["-h", "--help"]},
}
"""How each command's own typer application is made."""


class TestRunsCommand(TyperCommand):
    """A command whose ``--test`` takes every value up to the next option."""

    __test__ = False  # not a test case, whatever its name

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        return super().parse_args(ctx, spread_values(args, "--test"))


def spread_values(arguments: list[str], option: str) -> list[str]:
    """The arguments with ``option a b`` written as ``option a option b``.

    Values end at the next argument that begins with a dash.
    """
    spread: list[str] = []
    inside = False
    for position, argument in enumerate(arguments):
        if argument == "--":
            return [*spread, *arguments[position:]]
        if argument.startswith("-") and argument != "-":
            inside = argument == option
            if inside and not _value_follows(arguments, position):
                spread.append(option)
            elif not inside:
                spread.append(argument)
        elif inside:
            spread += [option, argument]
        else:
            spread.append(argument)
    return spread


def _value_follows(arguments: list[str], position: int) -> bool:
    following = arguments[position + 1 : position + 2]
    return bool(following) and (following[0] == "-" or not following[0].startswith("-"))
