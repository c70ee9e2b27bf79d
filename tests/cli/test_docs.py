"""``fogml docs``: the pages, without a network."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from fogml.cli import docs_job as manual
from fogml.errors import InputError


class Page(HTMLParser):
    """Identifiers, addresses and elements of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.elements: list[str] = []
        self.sources: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.elements.append(tag)
        self.ids += [given["id"] or ""] if "id" in given else []
        self.links += [given["href"] or ""] if tag == "a" else []
        self.sources += [given["src"] or ""] if "src" in given else []


def test_lists_the_pages(invoke, invoke_json) -> None:
    told = invoke_json("docs")
    assert told["schema"] == "fogml.docs/1"
    assert [page["page"] for page in told["pages"]][:3] == ["index", "install", "first-model"]
    assert all(page["title"] and Path(page["file"]).is_file() for page in told["pages"])
    assert "first-model" in invoke("docs").stdout


def test_prints_a_page(invoke) -> None:
    told = invoke("docs", "figures").stdout
    assert "bias stability" in told and "toctree" not in told


def test_a_page_that_is_not_there_is_told_with_its_nearest(invoke) -> None:
    assert "did you mean 'firmware'?" in invoke("docs", "firmwar", status=2).stderr


def test_a_folder_is_no_page(invoke, tmp_path: Path) -> None:
    assert "name it, e.g. fogml.html" in invoke("docs", "-o", tmp_path / "site", status=2).stderr
    assert not list(tmp_path.iterdir())


def test_writes_one_page_that_is_complete_in_itself(invoke, tmp_path: Path) -> None:
    out = tmp_path / "fogml.html"
    assert f"Open {out}" in invoke("docs", "-o", out).stdout
    text = out.read_text(encoding="utf-8")
    page = Page()
    page.feed(text)
    within = [link[1:] for link in page.links if link.startswith("#")]
    assert len(within) > 60 and set(within) <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    assert page.sources and all(source.startswith("data:image/") for source in page.sources)
    assert page.elements.count("math") > 20 and "```" not in text and "&lt;!--" not in text
    assert "script" not in page.elements and "link" not in page.elements
    assert not [link for link in page.links if not link.startswith(("#", "https://"))]


def test_without_pages_says_where_they_are(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(manual.fogml, "__file__", str(tmp_path / "fogml" / "__init__.py"))
    monkeypatch.setattr(manual, "files", lambda name: None)
    with pytest.raises(InputError, match="pip install"):
        manual.manual_folder()


def test_installed_pages_are_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Installed:
        name = "index.md"

        def locate(self) -> Path:
            return tmp_path / "share" / self.name

    (tmp_path / "share").mkdir()
    (tmp_path / "share" / "index.md").write_text("# Pages\n")
    monkeypatch.setattr(manual.fogml, "__file__", str(tmp_path / "fogml" / "__init__.py"))
    monkeypatch.setattr(manual, "files", lambda name: [Installed()])
    assert manual.manual_folder() == (tmp_path / "share").resolve()


def test_every_option_stands_on_its_page(invoke) -> None:
    from fogml.cli.docs_job import options_page

    text = options_page()
    sections = dict(re.findall(r"^## (fogml [^\n]+)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL))
    assert {"fogml train", "fogml lab north", "fogml blind make", "fogml docs"} <= set(sections)
    shown = set(re.findall(r"(--[a-z-]+)", invoke("train", "--help").stdout))
    assert shown - {"--help"} <= set(re.findall(r"(--[a-z-]+)", sections["fogml train"]))
    for section in sections.values():
        assert {
            line.replace("\\|", "").count("|") for line in section.splitlines() if line.startswith("|")
        } == {3}


def test_the_json_names_what_was_written(invoke_json, tmp_path: Path) -> None:
    told = invoke_json("docs", "-o", tmp_path / "all.html")
    assert told["out"] == str(tmp_path / "all.html") and json.dumps(told)
