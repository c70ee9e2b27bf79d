"""The job of ``fogml docs``: the pages as one without a network, and one of every option of every command."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Iterator, Mapping
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path
from typing import Any

from markupsafe import Markup

import fogml
from fogml.cli.run_commands import DocsSettings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError, known_are
from fogml.escaping import markup
from fogml.outputs import whole_file

_MEDIA = {".svg": "image/svg+xml", ".png": "image/png"}
_FIRST = "index.md"
"""The page that lists the others, in its fences of ``{toctree}``."""


def manual_folder() -> Path:
    """Where the pages lie: in the checkout, or where the distribution was installed to.

    Raises
    ------
    InputError
        If they are in neither.
    """
    checkout = Path(fogml.__file__).parents[1]
    if (checkout / "docs" / _FIRST).is_file() and (checkout / "pyproject.toml").is_file():
        return checkout / "docs"
    try:
        installed = [Path(str(f.locate())) for f in files("fogml-lab") or [] if f.name == _FIRST]
    except PackageNotFoundError:
        installed = []
    for path in installed:
        if path.is_file():
            return path.resolve().parent
    raise InputError(
        "the pages of the documentation are not beside this installation; they are the folder docs of the "
        "source, and what `pip install .` there brings along"
    )


def page_names(folder: Path | None = None) -> list[str]:
    """Stems of a folder's pages (of `manual_folder` if None), in the order of the list on the first."""
    text = ((folder or manual_folder()) / _FIRST).read_text(encoding="utf-8")
    fences = re.findall(r"^```\{toctree\}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)
    lines = [line.strip() for fence in fences for line in fence.splitlines()]
    return [Path(_FIRST).stem, *(line for line in lines if line and not line.startswith(":"))]


def _page_text(folder: Path, name: str, made: Mapping[str, str] | None = None) -> str:
    """A page's Markdown, as any reader of CommonMark shows it, with what is made for its end, by stem."""
    names = page_names(folder)
    if name not in names:
        raise InputError(f"no page '{name}'; {known_are(name, names, 'pages')}")
    written = (folder / f"{name}.md").read_text(encoding="utf-8")
    plain = re.sub(r"^```\{[a-z-]+\}.*?^```\n", "", written, flags=re.MULTILINE | re.DOTALL)
    # Comments mark the tables that experiments write.
    plain = re.sub(r"^<!--.*?-->\n", "", plain, flags=re.MULTILINE | re.DOTALL)
    return plain + (made or {}).get(name, "")


def title_of(text: str) -> str:
    """The first heading of a page."""
    return next((line.lstrip("# ") for line in text.splitlines() if line.startswith("# ")), "")


def mathml(formula: str) -> str:
    """A formula in LaTeX as a ``math`` element, which browsers draw without a script."""
    from docutils.utils.math.latex2mathml import tex2mathml

    return str(tex2mathml(formula.strip(), as_block=True))


def manual_page(folder: Path, made: Mapping[str, str] | None = None) -> str:
    """All pages as one HTML page, formulas and pictures within it; the first lists the others."""
    from fogml.report.page import render

    names = page_names(folder)
    texts = {name: _page_text(folder, name, made) for name in names}
    sections = [(name, Markup(_html(text, name, names, folder))) for name, text in texts.items()]
    return render("manual.html", title=f"fogml {fogml.__version__}: the manual", sections=sections)


def _html(text: str, name: str, names: Iterable[str], folder: Path) -> str:
    from markdown_it import MarkdownIt

    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(text)
    for place, token in enumerate(tokens):
        if token.type == "heading_open":
            token.attrSet("id", _anchor(name, tokens[place + 1].content))
        if token.type == "fence" and token.info.strip() == "math":
            token.type, token.content = "html_block", mathml(token.content)
        for child in token.children or []:
            if child.type == "link_open":
                child.attrSet("href", _address(str(child.attrGet("href")), name, set(names)))
            if child.type == "image":
                path = folder / str(child.attrGet("src"))
                content: Any = base64.b64encode(path.read_bytes()).decode("ascii")
                child.attrSet("src", f"data:{_MEDIA[path.suffix]};base64,{markup(content)}")
    return reader.renderer.render(tokens, reader.options, {})


def _anchor(name: str, heading: str = "") -> str:
    """Identifier of a heading of a page; of the page itself where none is given."""
    slug = re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-")
    return f"{name}--{slug}" if slug else name


def _address(address: str, name: str, names: set[str]) -> str:
    """A link between pages as one within the page; others stay as they are."""
    page, _, heading = address.partition("#")
    stem = page.removesuffix(".md") or name
    if (page and not page.endswith(".md")) or stem not in names:
        return address
    return f"#{_anchor(stem, heading)}"


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
        {"page": name, "title": title_of(_page_text(folder, name)), "file": str(folder / f"{name}.md")}
        for name in page_names(folder)
    ]
    if settings.page is not None:
        terminal.markdown(_page_text(folder, settings.page, {"options": options_page()}))
        pages = [page for page in pages if page["page"] == settings.page]
    elif settings.out is None:
        terminal.table("", ["page", "about"], [[page["page"], page["title"]] for page in pages])
        terminal.say("`fogml docs PAGE` prints one; `fogml docs -o fogml.html` writes all as one page.")
    if settings.out is not None:
        with whole_file(settings.out) as partial:
            partial.write_text(manual_page(folder, {"options": options_page()}), encoding="utf-8")
        terminal.say(f"Open {settings.out} in a browser.")
    terminal.result({"schema": "fogml.docs/1", "pages": pages, "out": settings.out})
