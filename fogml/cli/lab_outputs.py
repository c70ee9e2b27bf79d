"""Writing what a procedure of ``fogml lab`` tells: JSON, page and settings, whole or not at all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fogml.cli.settings import Settings
from fogml.cli.terminal import Terminal
from fogml.json_files import write_json
from fogml.outputs import whole_folder


def tell(
    name: str,
    make: Callable[[], dict[str, Any]],
    page: Callable[[dict[str, Any]], str],
    settings: Settings,
    out: str | None,
    terminal: Terminal,
    sheets: Callable[[dict[str, Any], Path], None] | None = None,
) -> dict[str, Any]:
    """Make the values and, where a folder is named, write ``name.json``, ``name.html`` and the settings.

    `sheets` writes ``name.xlsx`` too.
    """
    if out is None:
        return make()
    with whole_folder(out) as folder:
        values = make()
        write_json(folder / f"{name}.json", values)
        with terminal.work("drawing"):
            (folder / f"{name}.html").write_text(page(values), encoding="utf-8")
        if sheets is not None:
            sheets(values, folder / f"{name}.xlsx")
        settings.write_into(folder, f"lab {name}")
    return values


def say_where(name: str, out: str | None, terminal: Terminal) -> None:
    """Say which page to open, where something was written."""
    if out is not None:
        terminal.say(f"Written to {out}: open {Path(out) / f'{name}.html'}")
