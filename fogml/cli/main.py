"""The command line ``fogml``: finds the command, runs it, and turns errors into exit statuses.

Command modules load on use, so that ``fogml --help`` stays quick. Exit 0: done. 1: done, and a
stated limit was not met. 2: bad input or usage. 3: an error that nobody expected, told in a report
file. 130, 143: interrupted, terminated. 141: what read the output has ended.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import click

from fogml import __version__
from fogml.cli.given import HELP_NAMES, HelpContext, load
from fogml.errors import FogmlError, did_you_mean_of, printable
from fogml.locks import REMEDIES
from fogml.processes import end_as_interrupted, heed_interrupt, open_closed_streams, quiet_libraries

COMMANDS = {
    "demo": (
        ".run_commands:DemoSettings",
        "Train and judge on a real recording that ships, then say what to open.",
    ),
    "import": (
        ".run_commands:ImportSettings",
        "Bring a logger's file into the run format, or draft a profile for it.",
    ),
    "inspect": (
        ".run_commands:InspectSettings",
        "Say what is in a run: columns, span, gaps, soaks and ramps, faults.",
    ),
    "train": (".model_commands:TrainSettings", "Fit a drift model on some runs and judge it on others."),
    "compare": (
        ".model_commands:CompareSettings",
        "Judge every model and baseline on the same split, in one table.",
    ),
    "compensate": (
        ".model_commands:CompensateSettings",
        "Apply a model to a run of any length, in bounded memory.",
    ),
    "export": (
        ".model_commands:ExportJobSettings",
        "Write a model's compact form, once it has been compared with the model.",
    ),
    "noise": (
        ".run_commands:NoiseSettings",
        "Allan deviation and the IEEE 952 noise terms with intervals.",
    ),
    "sweep": (
        ".model_commands:SweepSettings",
        "Search features, models and sizes on held-out parts of the training runs.",
    ),
    "lab": (
        ".lab:COMMANDS",
        "Procedures of a laboratory: misalignment, rate table, north seeking, acceptance.",
    ),
    "fleet": (
        ".run_commands:FleetSettings",
        "Do the same job for every unit of a manifest, in parallel, here or on a cluster.",
    ),
    "monitor": (
        ".run_commands:MonitorSettings",
        "Watch units in service: what their model leaves on each run, and since when that is another.",
    ),
    "app": (
        ".run_commands:AppSettings",
        "A page on this machine: drop files, choose, train, judge, diagnose, export.",
    ),
    "effects": (
        ".twin_commands:EffectsSettings",
        "The catalogue of effects that a twin can have, or the card of one.",
    ),
    "simulate": (".twin_commands:SimulateSettings", "A synthetic run from a programme and a twin."),
    "replay": (
        ".twin_commands:ReplaySettings",
        "A twin's output for a run's inputs, or what one effect changes.",
    ),
    "diagnose": (
        ".twin_commands:DiagnoseSettings",
        "Where the gap between twin and recordings lies, which effect causes it, how far it closes.",
    ),
    "plan": (
        ".twin_commands:PlanSettings",
        "Programmes that make wanted parameters identifiable, with expected standard errors.",
    ),
    "blind": (".blind:COMMANDS", "The check on withheld effects: make cases, answer them, score."),
    "benchmark": (".benchmark:COMMANDS", "The open benchmark: make a round, let methods answer it, score."),
    "docs": (
        ".run_commands:DocsSettings",
        "The documentation, without a network: list, read, or write as one page.",
    ),
}
"""Name of each command: where its settings are, and its help in one line."""

DONE, LIMIT_NOT_MET, BAD_INPUT, UNEXPECTED, INTERRUPTED, UNREAD = 0, 1, 2, 3, 130, 141


class Group(click.Group):
    """A group whose commands load when they are called.

    Parameters
    ----------
    commands
        By name: where a command's settings are, or those of a group's commands, and its help in one line.
    """

    context_class = HelpContext

    def __init__(self, commands: Mapping[str, tuple[str, str]], **more: Any) -> None:
        super().__init__(**more, no_args_is_help=True, context_settings=HELP_NAMES)
        self.known = commands

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.known)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in self.known:
            return None
        from fogml.cli.command import SettingsCommand

        place, text = self.known[cmd_name]
        found = load(place)
        if not isinstance(found, dict):
            return SettingsCommand(cmd_name, found)
        module = place.partition(":")[0]
        return Group(
            {
                name: (f"{module}:{settings.__name__}", (settings.__doc__ or "").partition("\n")[0])
                for name, settings in found.items()
            },
            name=cmd_name,
            help=text,
        )

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in self.known.items()])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if args and not args[0].startswith("-") and args[0] not in self.known:
            groups = [name for name, (place, _) in self.known.items() if place.endswith(":COMMANDS")]
            within = [f"{name} {args[0]}" for name in groups if args[0] in load(self.known[name][0])]
            texts = {name: text for name, (_, text) in self.known.items()}
            near = f"did you mean '{within[0]}'?" if within else did_you_mean_of(args[0], texts).rstrip()
            hint = near or f"commands are {', '.join(self.known)}"
            fail(f"no such command '{args[0]}'; {hint}")
        return super().resolve_command(ctx, args)


class Program(Group):
    """The program: errors become one message and an exit status."""

    def main(self, args: Sequence[str] | None = None, *more: Any, **named: Any) -> Any:
        """As click's, with the last net: what nobody expected is one line, and not the status of a limit."""
        try:
            return super().main(args, *more, **named)
        except Exception as error:
            from fogml.cli.unexpected import report_unexpected

            _tell(report_unexpected(error, sys.argv[1:] if args is None else args))
            sys.exit(UNEXPECTED)

    def make_context(self, *words: Any, **more: Any) -> Any:
        """As click's, its complaints told as all others are."""
        try:
            with _read_on():
                return super().make_context(*words, **more)
        except click.UsageError as error:
            _fail_usage(error)

    def invoke(self, ctx: Any) -> Any:
        try:
            with _read_on():
                return self._invoked(ctx)
        except click.UsageError as error:
            _fail_usage(error)
        except FogmlError as error:
            fail(str(error))
        except OSError as error:
            place = f"{error.filename}: " if error.filename else ""
            remedy = REMEDIES.get(error.errno or 0)
            fail(f"{place}{error.strerror or error}{f'; {remedy}' if remedy else ''}")
        except UnicodeEncodeError as error:
            # Python takes any bytes for a name; the libraries that read and write files take text.
            name = re.search(r"\S*[\udc80-\udcff]\S*", str(error.object))
            if name is None:
                raise
            fail(
                f"{printable(name.group())}: a name that is no text in UTF-8; rename the file or folder, or "
                "set a locale of UTF-8 (LC_ALL=C.UTF-8)"
            )
        except MemoryError:
            fail("not enough memory for this; close other programs or use a shorter run")
        except KeyboardInterrupt as interrupt:
            raise click.exceptions.Exit(_interrupted(interrupt)) from None

    def _invoked(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except click.exceptions.Exit:
            raise
        except Exception:
            heed_interrupt()
            raise


@contextmanager
def _read_on() -> Iterator[None]:
    """End by a status of its own where what reads the output has ended: click's and rich's is a limit's."""
    try:
        yield
    except (BrokenPipeError, SystemExit) as end:
        if not isinstance(end, BrokenPipeError) and not isinstance(end.__context__, BrokenPipeError):
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python writes the rest at its end
        sys.exit(UNREAD)


def _tell(message: str) -> None:
    from fogml.cli.terminal import fitted

    click.echo(fitted(message, sys.stderr), err=True)


def fail(message: str) -> None:
    """Print one message on stderr and end with exit status 2."""
    _tell(f"fogml: {message}")
    raise click.exceptions.Exit(BAD_INPUT) from None


def _fail_usage(error: click.UsageError) -> None:
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        raise error
    from fogml.cli.command import usage_words

    command = error.ctx.command_path if error.ctx else "fogml"
    fail(f"{usage_words(error)} ('{command} --help' lists what there is)")


def _interrupted(interrupt: KeyboardInterrupt) -> int:
    """Say what an interrupt leaves behind; the exit status."""
    # Jobs of many units keep those that were finished, and go on from there.
    told = "what is finished is kept, nothing is half written; run the same command again"
    _tell(f"fogml: interrupted: {told}")
    return getattr(interrupt, "status", INTERRUPTED)


def _print_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted:
        click.echo(f"fogml {__version__}")
        ctx.exit()


def _print_completion(ctx: click.Context, _: click.Parameter, shell: str | None) -> None:
    if shell is not None:
        from click.shell_completion import get_completion_class

        maker = get_completion_class(shell)
        assert maker is not None
        script = maker(ctx.command, {}, "fogml", "_FOGML_COMPLETE").source()
        # In fish click cuts a list of names at its commas.
        click.echo(script.replace('string split "," ', 'string split -m 1 "," '))
        if shell == "bash":  # names such as shipped:ring-laser-x are one word
            click.echo("COMP_WORDBREAKS=${COMP_WORDBREAKS//:}")
        ctx.exit()


app = Program(
    COMMANDS,
    name="fogml",
    help="Temperature drift models for fibre-optic gyros: train on one chamber run, judge on another.",
    params=[
        click.Option(
            ["--version"],
            is_flag=True,
            is_eager=True,
            expose_value=False,
            callback=_print_version,
            help="Print the version and end.",
        ),
        click.Option(
            ["--completion"],
            type=click.Choice(["bash", "zsh", "fish"]),
            is_eager=True,
            expose_value=False,
            callback=_print_completion,
            help="Print the script that completes commands, options and names in a shell, and end.",
        ),
    ],
)


def main() -> None:
    """Entry point of the program ``fogml``."""
    open_closed_streams()
    end_as_interrupted()
    quiet_libraries()
    for stream in (sys.stdout, sys.stderr):
        # A terminal that can't show a character must not end a long job; a file's name need not be text.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    try:
        app(prog_name="fogml")
    except KeyboardInterrupt as interrupt:
        # Before the command began, or after it.
        sys.exit(_interrupted(interrupt))
