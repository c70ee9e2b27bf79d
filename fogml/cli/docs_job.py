"""The job of ``fogml docs``, and its page of every option of every command."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fogml.cli.run_commands import DocsSettings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.outputs import whole_file
from fogml.report.manual import manual_folder, manual_page, page_names, page_text, title_of


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


def show_docs(settings: DocsSettings, terminal: Terminal) -> None:
    """List the pages, print one, or write all of them as one HTML file.

    Raises
    ------
    InputError
        If there is no such page, or the file to write is named like no HTML page.
    """
    folder = manual_folder()
    if settings.out is not None and Path(settings.out).suffix not in (".html", ".htm"):
        raise InputError(f"{settings.out}: one HTML file is written; name it, e.g. fogml.html")
    pages = [
        {"page": name, "title": title_of(page_text(folder, name)), "file": str(folder / f"{name}.md")}
        for name in page_names(folder)
    ]
    if settings.page is not None:
        terminal.markdown(page_text(folder, settings.page, {"options": options_page()}))
        pages = [page for page in pages if page["page"] == settings.page]
    elif settings.out is None:
        terminal.table("", ["page", "about"], [[page["page"], page["title"]] for page in pages])
        terminal.say("`fogml docs PAGE` prints one; `fogml docs -o fogml.html` writes all as one page.")
    if settings.out is not None:
        with whole_file(settings.out) as partial:
            partial.write_text(manual_page(folder, {"options": options_page()}), encoding="utf-8")
        terminal.say(f"Open {settings.out} in a browser.")
    terminal.result({"schema": "fogml.docs/1", "pages": pages, "out": settings.out})
