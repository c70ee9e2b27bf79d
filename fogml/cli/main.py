"""The command line ``fogml``: finds the command, runs it, and turns errors into exit statuses.

Command modules load on use, so that ``fogml --help`` stays quick. Exit 0: done. 1: done, and a
stated limit was not met. 2: bad input or usage. 3: an error that nobody expected, told in a report
file. 130, 143: interrupted, terminated.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from fogml import __version__
from fogml.errors import FogmlError, printable
from fogml.escaping import terminal_text
from fogml.outputs import NO_ROOM
from fogml.processes import end_as_interrupted, quiet_libraries

COMMANDS = {
    "demo": ("fogml.cli.demo", "Train and judge on a real recording that ships, then say what to open."),
    "import": ("fogml.cli.import_", "Bring a logger's file into the run format."),
    "inspect": ("fogml.cli.inspect", "Say what is in a run: columns, span, gaps, soaks and ramps, faults."),
    "train": ("fogml.cli.train", "Fit a drift model on some runs and judge it on others."),
    "compare": ("fogml.cli.compare", "Judge every model and baseline on the same split, in one table."),
    "compensate": ("fogml.cli.compensate", "Apply a model to a run of any length, in bounded memory."),
    "export": ("fogml.cli.export", "Write a model's compact form, once it has been compared with the model."),
    "noise": ("fogml.cli.noise", "Allan deviation and the IEEE 952 noise terms with intervals."),
    "sweep": ("fogml.cli.sweep", "Search features, models and sizes on held-out parts of the training runs."),
    "lab": (
        "fogml.cli.lab",
        "Procedures of a laboratory: misalignment, tests on a rate table, north seeking.",
    ),
    "fleet": (
        "fogml.cli.fleet",
        "Do the same job for every unit of a manifest, in parallel, here or on a cluster.",
    ),
    "effects": ("fogml.cli.effects", "The catalogue of effects that a twin can have, or the card of one."),
    "simulate": ("fogml.cli.simulate", "A synthetic run from a programme and a twin."),
    "replay": ("fogml.cli.replay", "A twin's output for a run's inputs, or what one effect changes."),
    "diagnose": (
        "fogml.cli.diagnose",
        "Where the gap between twin and recordings lies, which effect causes it, how far it closes.",
    ),
    "plan": (
        "fogml.cli.plan",
        "Programmes that make wanted parameters identifiable, with expected standard errors.",
    ),
    "blind": ("fogml.cli.blind", "The check on withheld effects: make cases, answer them, score."),
    "docs": ("fogml.cli.docs", "The documentation, without a network: list, read, or write as one page."),
}
"""Name of each command: its module, and its help in one line."""

DONE, LIMIT_NOT_MET, BAD_INPUT, UNEXPECTED, INTERRUPTED = 0, 1, 2, 3, 130


class LazyGroup(TyperGroup):
    """A group whose commands load when they are called."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in COMMANDS:
            return None
        module = import_module(COMMANDS[cmd_name][0])
        command = typer.main.get_command(module.app)
        command.name = cmd_name
        return command

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if args and not args[0].startswith("-") and args[0] not in COMMANDS:
            from difflib import get_close_matches

            near = get_close_matches(args[0], COMMANDS, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else f" Commands are {', '.join(COMMANDS)}."
            fail(f"no such command '{args[0]}'.{hint}")
        return super().resolve_command(ctx, args)

    def main(self, args: Sequence[str] | None = None, *more: Any, **named: Any) -> Any:
        """As click's, with the last net: what nobody expected is one line, and not the status of a limit."""
        try:
            return super().main(args, *more, **named)
        except Exception as error:
            from fogml.cli.unexpected import report_unexpected

            typer.echo(report_unexpected(error, sys.argv[1:] if args is None else args), err=True)
            sys.exit(UNEXPECTED)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except FogmlError as error:
            fail(str(error))
        except BrokenPipeError:
            raise
        except OSError as error:
            fail(_system_message(error))
        except UnicodeEncodeError as error:
            # Python takes any bytes for a name; the libraries that read and write files take text.
            name = str(error.object)
            if not any("\udc80" <= letter <= "\udcff" for letter in name):
                raise
            fail(
                f"{printable(name)}: a name that is no text in UTF-8; rename the file or folder, or set a "
                "locale of UTF-8 (LC_ALL=C.UTF-8)"
            )
        except MemoryError:
            fail("not enough memory for this; close other programs or use a shorter run")
        except KeyboardInterrupt as interrupt:
            raise typer.Exit(_interrupted(interrupt)) from None


def fail(message: str) -> None:
    """Print one message on stderr and end with exit status 2."""
    typer.echo(f"fogml: {terminal_text(message)}", err=True)
    raise typer.Exit(BAD_INPUT) from None


def _interrupted(interrupt: KeyboardInterrupt) -> int:
    """Say what an interrupt leaves behind; the exit status."""
    # Jobs of many units keep those that were finished, and go on from there.
    told = "what is finished is kept, nothing is half written; run the same command again"
    typer.echo(f"fogml: interrupted: {told}", err=True)
    return getattr(interrupt, "status", INTERRUPTED)


def _system_message(error: OSError) -> str:
    place = f"{error.filename}: " if error.filename else ""
    remedy = "; make room and run the command again" if error.errno in NO_ROOM else ""
    return f"{place}{error.strerror or error}{remedy}"


app = typer.Typer(
    cls=LazyGroup,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"fogml {__version__}")
        raise typer.Exit()


@app.callback()
def fogml(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end."),
    ] = False,
) -> None:
    """Temperature drift models for fibre-optic gyros: train on one chamber run, judge on another."""


def main() -> None:
    """Entry point of the program ``fogml``."""
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
