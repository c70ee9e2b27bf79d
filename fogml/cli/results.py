"""What a command does with the values that it tells: write them, print them, and say where they are."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fogml.cli.given import load
from fogml.cli.settings import Settings
from fogml.cli.terminal import Terminal
from fogml.json_files import finite_json, write_json
from fogml.outputs import whole_folder

Values = dict[str, Any]


def tell(
    command: str,
    settings: Settings,
    terminal: Terminal,
    make: Callable[[], Values],
    page: str | Callable[[Values], str],
    show: Callable[[Values, Terminal], None],
    beside: Callable[[Values, Path], None] | None = None,
) -> Values:
    """Make values, write them as file and page with the settings where a folder is named, and print them.

    Parameters
    ----------
    command
        Its last word names ``NAME.json`` and ``NAME.html``.
    settings
        Its settings, with ``out``.
    terminal
        Where to print.
    make
        Gives the values.
    page
        What draws the page of the values, or where it is, ``module:name``.
    show
        Prints the values for people.
    beside
        Writes further files of the values into the folder.
    """
    name, out = command.split()[-1], settings.out  # type: ignore[attr-defined]
    if out is None:
        values = finite_json(make())
    else:
        with whole_folder(out) as folder:
            values = finite_json(make())
            write_json(folder / f"{name}.json", values)
            with terminal.work("drawing"):
                text = (load(page) if isinstance(page, str) else page)(values)
                (folder / f"{name}.html").write_text(text, encoding="utf-8")
            if beside is not None:
                beside(values, folder)
            settings.write_into(folder, command)
    show(values, terminal)
    terminal.result(values)
    if out is not None:
        terminal.say(f"Written to {out}: open {Path(out) / f'{name}.html'}")
    return values
