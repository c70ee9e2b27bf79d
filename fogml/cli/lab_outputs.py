"""Writing what a procedure of ``fogml lab`` tells: JSON, page and settings, whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fogml.cli.settings import Settings
from fogml.cli.terminal import Terminal
from fogml.outputs import whole_folder


def tell(
    name: str,
    make: Callable[[], dict[str, Any]],
    page: Callable[[dict[str, Any]], str],
    settings: Settings,
    out: str | None,
    terminal: Terminal,
) -> dict[str, Any]:
    """Make the values and, where a folder is named, write ``name.json``, ``name.html``, ``config.yaml``."""
    if out is None:
        return make()
    with whole_folder(out) as folder:
        values = make()
        text = json.dumps(values, indent=2, allow_nan=False, ensure_ascii=False)
        (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")
        with terminal.work("drawing"):
            (folder / f"{name}.html").write_text(page(values), encoding="utf-8")
        (folder / "config.yaml").write_text(settings.yaml(f"lab {name}"), encoding="utf-8")
    return values


def say_where(name: str, out: str | None, terminal: Terminal) -> None:
    """Say which page to open, where something was written."""
    if out is not None:
        terminal.say(f"Written to {out}: open {Path(out) / f'{name}.html'}")
