"""The job of ``fogml docs``."""

from __future__ import annotations

from pathlib import Path

from fogml.cli.docs import DocsSettings
from fogml.cli.options_page import options_page
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.outputs import whole_file
from fogml.report.manual import manual_folder, manual_page, page_names, page_text, title_of


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
