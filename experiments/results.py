"""Where an experiment puts what it found: ``results.json`` and ``results.md`` beside itself."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fogml.outputs import whole_file


def write_results(folder: Path, rows: Any, page: str) -> None:
    """Write figures as JSON and the page made of them as Markdown."""
    with whole_file(folder / "results.json") as partial:
        partial.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    with whole_file(folder / "results.md") as partial:
        partial.write_text(page, encoding="utf-8")
