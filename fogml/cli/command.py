"""Commands made of their settings: arguments, options, help, completion and JSON schema."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

import click
from click.shell_completion import CompletionItem
from pydantic.fields import FieldInfo

from fogml.cli.each_axis import do_job
from fogml.cli.given import HELP_NAMES, Given, HelpContext
from fogml.cli.settings import Settings, given_settings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError, did_you_mean_of, printable, quoted
from fogml.json_files import json_text


class _Number(click.ParamType):
    """A number, or a whole one; errors say so rather than name a type of Python."""

    def __init__(self, kind: type, name: str) -> None:
        self.kind = kind
        self.name = name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            return self.kind(value)
        except ValueError:
            self.fail(f"{quoted(value)} is no {self.name}", param, ctx)


_KINDS: tuple[tuple[type, click.ParamType, str], ...] = (
    (int, _Number(int, "whole number"), "N"),
    (float, _Number(float, "number"), "NUMBER"),
    (str, click.STRING, "TEXT"),
    (dict, click.STRING, "NAME=VALUE"),
    (list, click.STRING, "TEXT"),
)
_OWN = "__"
"""In a parameter's name, between a setting and the value that one of its options stands for."""
_CONFIG = "YAML file with any of these settings; flags override it."


class SettingsCommand(click.Command):
    """A command that takes its settings from flags and a file, and does their job.

    The docstring of their class is its help.
    """

    context_class = HelpContext

    def __init__(self, name: str, settings: type[Settings]) -> None:
        self.settings = settings
        self.given = given_settings(settings)
        words = [param for key, given in self.given.items() for param in _params(settings, key, given)]
        if settings.config_argument:
            place = click.Argument(
                ["config" + _OWN],
                type=Place(None),
                metavar="CONFIG" if _needs_file(settings) else "[CONFIG]",
                help=settings.config_argument,
                required=False,
            )
            words.insert(0, place)
        super().__init__(
            name,
            context_settings=HELP_NAMES,
            callback=self._do,
            params=[*words, *_common(settings)],
            help=inspect.getdoc(settings),
        )

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As click's, once an option that takes several values stands before each of them."""
        for key, given in self.given.items():
            if given.spread:
                args = spread_values(args, *_names(key, given))
        return super().parse_args(ctx, args)

    def check_words(self, words: list[str]) -> None:
        """Hold that a job can begin with what a command line gives.

        Raises
        ------
        InputError
            With what is missing or wrong, as the command says it before its job begins.
        """
        try:
            told = dict(self.make_context(self.name, list(words)).params)
        except click.UsageError as error:
            raise InputError(usage_words(error)) from None
        del told["as_json"], told["quiet"]
        self._gathered(**told).check_given()

    def _gathered(self, /, config: str | None, **values: Any) -> Settings:
        named = values.pop("config" + _OWN, None)
        if named is not None and config is not None:
            raise InputError("CONFIG and --config are the same file; give one of them")
        stated = named if config is None else config
        return self.settings.gather(None if stated is None else Path(stated), _flags(values))

    def _do(self, /, as_json: bool, quiet: bool, **values: Any) -> None:
        settings = self._gathered(**values)
        # Without the program's own name: "train", "lab acceptance".
        command = click.get_current_context().command_path.partition(" ")[2]
        if not do_job(settings, command, Terminal(as_json, quiet)):
            raise click.exceptions.Exit(1)


def usage_words(error: click.UsageError) -> str:
    """What click complains of, as fogml tells it."""
    text = error.format_message().rstrip(".")
    if isinstance(error, click.NoSuchOption):
        told = {
            name.removeprefix("--"): getattr(option, "help", None) or ""
            for option in (error.ctx.command.params if error.ctx else ())
            for name in (*option.opts, *option.secondary_opts)
            if name.startswith("--")
        }
        near = re.sub(r"'([\w-]+)'", r"'--\1'", did_you_mean_of(error.option_name.lstrip("-"), told))
        text = f"no such option '{error.option_name}'; {near}".rstrip("; ")
    return f"{text[:1].lower()}{text[1:]}"


class Place(click.Path):
    """A file or folder, or a name that stands for what ships."""

    def __init__(self, given: Given | None) -> None:
        super().__init__(readable=False)  # what reads it says what is wrong
        self.given = given

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> Any:
        names = () if self.given is None else self.given.known_names()
        # In bash the offer of files takes back what was offered before it.
        return [*super().shell_complete(ctx, param, incomplete), *_beginning(names, incomplete)]


def spread_values(arguments: list[str], *options: str) -> list[str]:
    """The arguments with ``option a b`` written as ``option a option b``.

    Values end at the next argument that begins with a dash.

    Raises
    ------
    InputError
        If a value follows ``option=a``: it may be meant as the option's, too, or as an argument.
    """
    spread: list[str] = []
    inside = ""
    for position, argument in enumerate(arguments):
        if argument == "--":
            return [*spread, *arguments[position:]]
        if argument.startswith("-") and argument != "-":
            option, joined, value = argument.partition("=")
            if joined and option in options and _value_follows(arguments, position):
                first, second = printable(value), printable(arguments[position + 1])
                raise InputError(
                    f"{option}={first} {second}: whether {second} belongs to {option} is not clear; write "
                    f"'{option} {first} {second}' if it does, else name it before {option}"
                )
            inside = argument if argument in options else ""
            if not inside or not _value_follows(arguments, position):
                spread.append(argument)
        elif inside:
            spread += [inside, argument]
        else:
            spread.append(argument)
    return spread


def _value_follows(arguments: list[str], position: int) -> bool:
    following = arguments[position + 1 : position + 2]
    return bool(following) and (following[0] == "-" or not following[0].startswith("-"))


def _flags(values: Mapping[str, Any]) -> dict[str, Any]:
    """What was given, by setting; an option that stands for a value comes last."""
    flags = {key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}
    for key in [key for key in flags if _OWN in key]:
        setting, _, own = key.partition(_OWN)
        if flags.pop(key):
            flags[setting] = own
    return flags


def _params(settings: type[Settings], key: str, given: Given) -> list[click.Parameter]:
    field = settings.model_fields[key]
    types = _types(field.annotation)
    if bool in types:
        names = _names(key, given)
        text = _told(given.help, field, names[0])
        switch = click.Option([key, *names], is_flag=True, default=None, help=text)
        others = given.values.items()
        return [switch, *(click.Option([key + _OWN + v, o], is_flag=True, help=h) for o, (v, h) in others)]
    choices = get_args(field.annotation) if Literal in types else ()
    kind, metavar = next(
        ((kind, metavar) for type_, kind, metavar in _KINDS if type_ in types),
        (click.Choice(choices), "|".join(choices)),
    )
    several = not given.as_text and (dict in types or list in types) and (given.argument or str not in types)
    if given.reads or given.writes:
        kind = Place(given)
    more: dict[str, Any] = {"type": kind, "metavar": given.metavar or metavar, "default": None}
    if given.known and not isinstance(kind, Place):
        more["shell_complete"] = lambda ctx, param, begun: _beginning(given.known_names(), begun)
    text = _told(given.help, field)
    if given.argument:
        return [click.Argument([key], help=text, required=False, nargs=-1 if several else 1, **more)]
    return [click.Option([key, *_names(key, given)], help=text, multiple=several, **more)]


def _types(annotation: Any) -> tuple[Any, ...]:
    """The plain types of an annotation: of a union its members', of ``list[str]`` list."""
    origin = get_origin(annotation)
    if origin in (Union, UnionType):
        return tuple(plain for member in get_args(annotation) for plain in _types(member))
    return (origin or annotation,)


def _names(key: str, given: Given) -> tuple[str, ...]:
    return given.names or ("--" + key.replace("_", "-"),)


def _told(text: str, field: FieldInfo, switch: str = "") -> str:
    """The help, with the default where one is stated; of a switch with two ways, the one that holds."""
    value = field.default
    if isinstance(value, bool):
        on, _, off = switch.partition("/")
        shown = (on if value else off).lstrip("-")
    elif not isinstance(value, (str, int, float, list)):
        shown = ""
    else:
        shown = ",".join(map(_short, value if isinstance(value, list) else [value]))
    return f"{text.removesuffix('.')} ({shown})." if shown else text


def _needs_file(settings: type[Settings]) -> bool:
    """Whether a setting that no option gives has to be stated."""
    given = given_settings(settings)
    return any(field.is_required() and key not in given for key, field in settings.model_fields.items())


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _beginning(names: Any, begun: str) -> list[CompletionItem]:
    # Of a list with commas the last name is the one that is being typed.
    first = begun[: begun.rfind(",") + 1]
    return [CompletionItem(first + name) for name in names if name.startswith(begun[len(first) :])]


def _common(settings: type[Settings]) -> list[click.Parameter]:
    def show(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
        if wanted:
            click.echo(json_text(settings.model_json_schema(), "schema"))
            ctx.exit()

    flag: dict[str, Any] = {"is_flag": True, "default": False}
    return [
        click.Option(["--config"], type=Place(None), metavar="FILE", help=_CONFIG),
        click.Option(["as_json", "--json"], help="Print the result alone, as JSON.", **flag),
        click.Option(["-q", "--quiet"], help="Print nothing but errors and what --json asks.", **flag),
        click.Option(
            ["--schema"],
            help="Print the JSON schema of a configuration file, and end.",
            is_eager=True,
            expose_value=False,
            callback=show,
            **flag,
        ),
    ]
