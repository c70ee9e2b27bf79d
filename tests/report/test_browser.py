"""Pages as a browser shows them: figures drawn, silent console, no request to the outside."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from tests.report.chromium import CHROMIUM, open_page, print_page
from tests.report.pages import Page, every_page

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"no Chromium at {CHROMIUM}"),
]
KINDS = ("train", "train of five", "compare", "inspect", "noise", "gap", "index", "certificate")
NAMED_BUTTONS = {"Zoom", "Pan", "Zoom in", "Zoom out", "Reset axes", "Download plot"}
pages = cache(every_page)


def written(html: str, folder: Path) -> Path:
    page = folder / "page.html"
    page.write_text(html, encoding="utf-8")
    return page


@pytest.mark.parametrize("kind", KINDS)
def test_figures_are_drawn_in_silence(kind: str, tmp_path: Path) -> None:
    html = pages()[kind]
    opened = open_page(written(html, tmp_path), tmp_path / "profile")
    assert opened.console == []
    figures = len(Page(html).figures)
    if kind == "certificate":
        assert figures == 0 and "<svg" in opened.dom
        return
    assert f'data-drawn="{figures}"' in opened.dom
    for number in range(1, figures + 1):
        start = opened.dom.index(f'id="figure-{number}"')
        stop = opened.dom.index(f'id="figure-{number}-data"')
        drawing = opened.dom[start:stop]
        assert 'class="main-svg"' in drawing
        # plotly's own choice of buttons holds one that sends the chart away.
        assert set(re.findall(r'class="modebar-btn[^>]*data-title="([^"]+)"', drawing)) <= NAMED_BUTTONS
        assert re.search(r'class="(js-line|point|trace bars|points)', drawing), "axes without any curve"


def test_a_request_to_the_outside_would_be_noticed(tmp_path: Path) -> None:
    lure = '<img src="https://example.org/x.png"><script src="http://example.org/x.js"></script>'
    html = pages()["certificate"].replace("</main>", lure + "</main>")
    opened = open_page(written(html, tmp_path), tmp_path / "profile")
    assert len([line for line in opened.console if "Content Security Policy" in line]) == 2


def test_an_error_in_a_script_would_be_noticed(tmp_path: Path) -> None:
    html = pages()["certificate"].replace("</main>", "<script>nothing()</script></main>")
    opened = open_page(written(html, tmp_path), tmp_path / "profile")
    assert any("nothing is not defined" in line for line in opened.console)


def test_a_certificate_prints_on_one_a4_sheet(tmp_path: Path) -> None:
    pdf, _ = print_page(written(pages()["certificate"], tmp_path), tmp_path / "profile")
    assert len(re.findall(rb"/Type\s*/Page[^s]", pdf)) == 1
    box = re.search(rb"/MediaBox\s*\[\s*0\s+0\s+([\d.]+)\s+([\d.]+)", pdf)
    assert box is not None
    assert [round(float(side) / 72 * 25.4) for side in box.groups()] == [210, 297]


def test_figures_are_printed_as_wide_as_the_sheet(tmp_path: Path) -> None:
    probe = (
        "<script>addEventListener('beforeprint', function () {"
        "document.querySelectorAll('.plot').forEach(function (plot) {"
        "console.log('figure ' + plot.querySelector('.main-svg').getAttribute('width')); });"
        "});</script></body>"
    )
    html = pages()["train"].replace("</body>", probe)
    _, console = print_page(written(html, tmp_path), tmp_path / "profile")
    assert [line.split('"')[1] for line in console] == ["figure 672"] * len(Page(html).figures)
