"""Every option of every command as a page of the documentation, from what the commands declare."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def options_page() -> str:
    """Markdown: for each command what it does, and its arguments and options in a table."""
    from fogml.cli.main import app

    return "\n".join(part for name, command in commands_of(app, "fogml") for part in _section(name, command))


def commands_of(group: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    """Each command of a group and of the groups in it, with all its words."""
    context = _context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if hasattr(command, "list_commands"):
            yield from commands_of(command, f"{prefix} {name}")
        else:
            yield f"{prefix} {name}", command


def _context(command: Any) -> Any:
    return command.make_context("fogml", [], resilient_parsing=True)


def _section(name: str, command: Any) -> Iterator[str]:
    yield f"\n## {name}\n\n{_cell(command.help or '')}\n"
    yield "| option | what |\n|---|---|"
    context = _context(command)
    for parameter in command.get_params(context):
        names, what = parameter.get_help_record(context) or ("", "")
        if names:
            yield f"| `{_cell(names)}` | {_cell(what)} |"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
