"""How a setting is given on a command line, said once beside type and default; help with whole names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import click

HELP_NAMES = {"help_option_names": ["-h", "--help"]}
"""Settings of every command's and group's context."""


@dataclass(frozen=True)
class Given:
    """Words and ways of a setting, to stand beside its default (`setting`, `placed`) or in its annotation.

    Attributes
    ----------
    help
        What it is, in one sentence.
    metavar
        What is shown in place of its value; of its type by default.
    names
        Options; ``--`` and the setting's name by default. A switch names both ways, ``--on/--off``.
    values
        Further options, each of which stands for a value: that value and its help, by option.
    argument
        Given by its place rather than by an option.
    spread
        The option takes every value up to the next option.
    as_text
        A list is given as one text with commas, which the settings take apart.
    reads, writes
        It names a file or folder that is read, or written.
    known
        Names of what ships or is built in, or ``module:names``, listed or given by a function; such a name
        is no file.
    needed
        What is said where the job can't do without it and nothing is given.
    lost
        What is said of a path that is not there, before anything loads; none for one that the job looks for.
    """

    help: str
    metavar: str | None = None
    names: tuple[str, ...] = ()
    values: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    argument: bool = False
    spread: bool = False
    as_text: bool = False
    reads: bool = False
    writes: bool = False
    known: str | tuple[str, ...] = ()
    needed: str = ""
    lost: str = ""

    def known_names(self) -> Sequence[str]:
        """Names of what ships or is built in."""
        names = load(self.known) if isinstance(self.known, str) else self.known
        return names() if callable(names) else names

    def __get_pydantic_json_schema__(self, core_schema: Any, handler: Any) -> dict[str, Any]:
        """The setting's JSON schema, with its help."""
        return {**handler(core_schema), "description": self.help}

    def __call__(self, schema: dict[str, Any]) -> None:
        """Put the help into a schema, as pydantic asks of a field's own."""
        schema["description"] = self.help


def load(place: str) -> Any:
    """The object that ``module:name`` names; a module that begins with a dot is of the command line's."""
    module, _, name = place.partition(":")
    return getattr(import_module(module, __package__), name)


def option(help: str, *names: str, **more: Any) -> Given:
    """A setting given by an option; `more` as of `Given`."""
    return Given(help, names=names, **more)


def argument(metavar: str, help: str, **more: Any) -> Given:
    """A setting given by its place; `more` as of `Given`."""
    return Given(help, metavar, argument=True, **more)


_HYPHEN = "\ue000"
"""Stands for a hyphen while lines are broken; click breaks at every real one."""


class _Formatter(click.HelpFormatter):
    def write_text(self, text: str) -> None:
        super().write_text(text.replace("-", _HYPHEN))

    def write_dl(self, rows: Iterable[tuple[str, str]], *args: int, **more: int) -> None:
        super().write_dl([(name, text.replace("-", _HYPHEN)) for name, text in rows], *args, **more)

    def getvalue(self) -> str:
        return super().getvalue().replace(_HYPHEN, "-")


class HelpContext(click.Context):
    """The context of a command or group."""

    formatter_class = _Formatter
