"""Where an experiment puts what it found: ``results.json`` and ``results.md`` beside itself.

With figures it also writes each as SVG and ``results.html``, the same page complete in itself.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup

from fogml.outputs import whole_file


def write_results(folder: Path, rows: Any, page: str, figures: Mapping[str, str] | None = None) -> None:
    """Write figures as JSON and the page made of them as Markdown, with drawings as HTML too.

    Parameters
    ----------
    folder
        Where the files go.
    rows
        JSON-ready figures.
    page
        Markdown; ``![...](NAME.svg)`` shows a drawing.
    figures
        Name to SVG of each drawing.
    """
    files = {"results.json": json.dumps(rows, indent=1) + "\n", "results.md": page}
    if figures:
        files |= {f"{name}.svg": drawing + "\n" for name, drawing in figures.items()}
        files["results.html"] = html_page(page, figures)
    for name, text in files.items():
        with whole_file(folder / name) as partial:
            partial.write_text(text, encoding="utf-8")


def html_page(page: str, figures: Mapping[str, str]) -> str:
    """The Markdown page as one HTML file, its drawings within it."""
    from markdown_it import MarkdownIt

    from fogml.report.page import render

    body = MarkdownIt("commonmark").enable("table").render(page)

    def drawing(match: re.Match[str]) -> str:
        return f'<figure class="small">{figures[match[1]]}</figure>'

    body = re.sub(r'<p><img src="(\w+)\.svg"[^>]*></p>', drawing, body)
    title = page.splitlines()[0].lstrip("# ")
    return render("experiment.html", title=title, body=Markup(body))
