"""Pages as a browser shows them: drawn in silence, nothing from outside, nothing cut or covered."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest

from fogml.numerals import number
from fogml.report import page, style
from fogml.report.certificate import certificate
from tests.report.chromium import _SCREEN, CHROMIUM, Browser, Opened
from tests.report.judgements import judgement
from tests.report.many_units import batch_biases, pages_of_many
from tests.report.pages import Page, every_page
from tests.report.procedure_pages import procedure_pages

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"no Chromium at {CHROMIUM}"),
]
NAMED_BUTTONS = {"Zoom", "Pan", "Zoom in", "Zoom out", "Reset axes", "Download plot"}
KINDS = (
    *("train", "train of five", "compare", "inspect", "noise", "gap", "what if", "index", "certificate"),
    *("acceptance", "batch", "fleet", "monitor", "monitored unit"),
    *(
        "sweep",
        "plan",
        "blind",
        "benchmark",
        "effect",
        "catalogue",
        "misalignment",
        "north",
        "north of a recording",
    ),
    *("rate", "train with navigation", "axes", "axes accepted", "units"),
    *("axes of train", "axes of inspect", "axes of compare", "manual", "experiment"),
)
LAYOUT = (Path(__file__).parent / "layout.js").read_text(encoding="utf-8")


@cache
def pages() -> dict[str, str]:
    """Every kind of page."""
    return every_page() | pages_of_many() | procedure_pages()


_FIELD = re.compile(r"[xyz]|text|customdata(\[\d\])?")


def test_what_stands_beside_a_pointer_is_of_what_plotly_knows() -> None:
    for html in pages().values():
        for figure in Page(html).figures:
            for trace in figure.get("data", ()):
                assert trace.get("name") is not None, "it would be called trace 0 beside the pointer"
                for told in re.findall(r"%\{(.*?)\}", trace.get("hovertemplate", "")):
                    assert _FIELD.fullmatch(told.partition(":")[0]), told


def test_every_template_is_among_the_pages() -> None:
    assert set(KINDS) == set(pages())
    used = {name for _, name in page._environment().cache}
    folder = Path(page.__file__).parent / "templates"
    bases = {"base.html", "figure.html", "parts.html"}
    assert used >= {file.name for file in folder.glob("*.html")} - bases


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], Opened]]:
    """Opens the HTML of a page."""
    folder = tmp_path_factory.mktemp("browser")
    one = Browser(folder / "profile")

    def open_html(html: str) -> Opened:
        page = folder / "page.html"
        page.write_text(html, encoding="utf-8")
        return one.open(page)

    yield open_html
    one.close()


TICKS = "[...document.querySelectorAll('.ytick text, .xtick text')].map(tick => tick.textContent)"


@pytest.mark.parametrize(
    ("values", "axis"),
    [
        (np.linspace(1234.5, 1234.501, 9), {}),
        (np.linspace(-1e8, 5e8, 9), {}),
        (np.linspace(0.0, 2e-8, 9), {}),
        (np.geomspace(2e-7, 3e-5, 9), style.log_axis(2e-7, 3e-5)),
        (np.geomspace(1e7, 1e9, 9), style.log_axis(1e7, 1e9)),
    ],
)
def test_ticks_tell_values_apart_in_plain_numbers(browser, values, axis) -> None:
    figure = go.Figure(style.line(values, values, None, style.BLUE, 1.0))
    figure.update_yaxes(**axis)
    drawing = page.Drawing(style.styled(figure.update_xaxes(**axis), 300), alt="")
    template = page._environment().from_string(
        '{% extends "base.html" %}{% block content %}{{ draw(drawing) }}{% endblock %}'
    )
    opened = browser(page.render(template, title="Ticks", drawing=drawing))
    told = opened.tell(TICKS)
    opened.close()
    assert len(set(told)) > 2
    assert max(map(told.count, told)) == 2, told  # once on either axis
    assert not [tick for tick in told if re.search("[<>a-zA-Zµ]", tick)], told


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_is_drawn_in_silence_and_nothing_is_cut_or_covered(browser, kind) -> None:
    opened = browser(pages()[kind])
    faults = [f"console: {line}" for line in opened.console]
    for figure in opened.tell(FIGURES):
        # plotly's own choice of buttons holds one that sends the chart away.
        if not figure["curves"] or not set(figure["buttons"]) <= NAMED_BUTTONS:
            faults.append(f"figure {figure}")
    for paper in (False, True):
        opened.on_paper(paper)
        told = opened.tell(f"({LAYOUT})({str(paper).lower()})")
        faults += [f"{'on paper' if paper else 'on screen'}: {fault}" for fault in told]
    opened.close()
    assert not faults, "\n".join(faults)


FIGURES = """Array.from(document.querySelectorAll(".plot")).map(function (plot) {
  return {
    curves: plot.querySelectorAll(".main-svg .js-line, .main-svg .point, .main-svg .trace.bars, .main-svg .points, .main-svg .hm image").length,
    buttons: Array.from(plot.querySelectorAll(".modebar-btn")).map(function (e) { return e.dataset.title; })
  };
})"""  # noqa: E501


def test_no_legend_reaches_under_the_tools(browser) -> None:
    opened = browser(pages()["noise"])
    boxes = """["legend", "modebar"].map(function (name) {
      var box = document.querySelector(".plot ." + name).getBoundingClientRect();
      return [box.left, box.right, box.top, box.bottom];
    })"""
    (_, right, top, _), (left, _, _, bottom) = opened.tell(boxes)
    opened.close()
    assert right > left, "the legend is too short to tell"
    assert top >= bottom


NARROW = """(function () {
  var faults = [];
  document.querySelectorAll(".plot:not(.plain)").forEach(function (plot) {
    var tools = plot.querySelector(".modebar").getBoundingClientRect();
    plot.querySelectorAll(".legendtext").forEach(function (text) {
      var box = text.getBoundingClientRect();
      if (tools.width && box.right > tools.left && box.top < tools.bottom) { faults.push("tools over " + text.textContent); }
    });
  });
  document.querySelectorAll(".scroll caption span").forEach(function (words) {
    var place = words.closest(".scroll");
    place.scrollLeft = 1e4;
    var box = words.getBoundingClientRect(), room = place.getBoundingClientRect();
    if (box.left < room.left - 1 || box.right > room.right + 1) { faults.push("gone: " + words.textContent); }
    place.scrollLeft = 0;
  });
  return faults;
})()"""  # noqa: E501


@pytest.mark.parametrize("kind", ["train", "gap", "index"])
def test_in_a_narrow_window_tools_cover_no_legend_and_captions_stay_in_sight(browser, kind) -> None:
    opened = browser(pages()[kind])
    opened.ask("Emulation.setDeviceMetricsOverride", **{**_SCREEN, "width": 800})
    faults: list[str] = ["not looked at"]
    until = time.monotonic() + 10.0  # figures are drawn anew one by one
    while faults and time.monotonic() < until:
        time.sleep(0.1)
        faults = opened.tell(f"({LAYOUT})(false)") + opened.tell(NARROW)
    opened.close()
    assert not faults, "\n".join(faults)


def test_a_slider_moves_what_is_replayed(browser) -> None:
    opened = browser(every_page()["what if"])
    left = 'document.getElementById("left").textContent'
    beside = 'document.getElementById(slider.id + "-told").textContent'
    move = """(function (value, size) {
      var slider = document.querySelector(".sliders input");
      slider.dataset.size = size || slider.dataset.size;
      slider.value = value;
      slider.dispatchEvent(new Event("input"));
      return %s;
    })"""
    found, off = opened.tell(left), opened.tell(f"{move % left}(0)")
    told = opened.tell(f"{move % beside}(-1, 1.5e-8)")
    opened.close()
    assert told.startswith("−1 × = −1.5 × 10⁻⁸ ")
    # The loop of 0.05 deg/h, 0.035 rms, is back in the gap; the noise of the floor is in both.
    assert re.match(r"Gap 0\.007\d* deg/h rms", found) and re.match(r"Gap 0\.03[56]\d* deg/h rms", off)


def test_what_is_cut_or_covered_would_be_noticed(browser) -> None:
    spoiled = (
        '<p style="width:60px;overflow:hidden;white-space:nowrap">a line that is far too long for it</p>'
        '<p style="margin:0">one</p><p style="margin:-20px 0 0 0">another</p>'
        '<div style="width:3000px">wide</div></main>'
    )
    opened = browser(pages()["certificate"].replace("</main>", spoiled))
    faults = " ".join(opened.tell(f"({LAYOUT})(false)"))
    assert "'a line that is far too long" in faults and "'one' and 'another'" in faults
    assert "the page is" in faults
    opened.close()


def test_headings_sort_and_names_lead_to_the_units_pages(browser) -> None:
    opened = browser(pages()["batch"])
    first = opened.tell(
        'var head = document.querySelectorAll(".sortable th [role=button]")[2]; head.click(); head.click();'
        'document.querySelector(".sortable tbody td.figure").textContent'
    )
    assert first == f"{number(max(batch_biases(), key=abs))} ✗"
    opened.close()
    opened = browser(pages()["fleet"])
    links = opened.tell(
        'document.querySelectorAll(".sortable th [role=button]")[4].click();'
        'Array.from(document.querySelectorAll(".sortable tbody tr")).slice(0, 200).map(function (row) {'
        ' var a = row.querySelector("a"); return a ? a.getAttribute("href") : ""; })'
    )
    assert (
        len([link for link in links if link.endswith(("/report.html", "/acceptance.html", "/gap.html"))])
        == 199
    )
    # The one without a figure is last.
    assert links[-1].endswith("/acceptance.html") or not links[-1]
    opened.close()


def test_a_request_to_the_outside_would_be_noticed(browser) -> None:
    lure = '<img src="https://example.org/x.png"><script src="http://example.org/x.js"></script>'
    opened = browser(pages()["certificate"].replace("</main>", lure + "</main>"))
    assert len([line for line in opened.console if "Content Security Policy" in line]) == 2
    opened.close()


def test_an_error_in_a_script_would_be_noticed(browser) -> None:
    opened = browser(pages()["certificate"].replace("</main>", "<script>nothing()</script></main>"))
    assert any("nothing is not defined" in line for line in opened.console)
    opened.close()


def of_many_features() -> str:
    """The certificate of a model of 18 features, each with a trained range of its own."""
    judged = judgement()
    names = [f"lag(T_in-T_out, {seconds} s)" for seconds in range(100, 1900, 100)]
    model = {**judged.model, "features": names, "box": dict.fromkeys(names, (-36.57, 63.51))}
    return certificate(replace(judged, model=model), "2026-03-02")


def of_many_words() -> str:
    """The certificate of a long unit's name and verdict, an index out of reach, Earth rate not known."""
    judged = judgement(2)
    runs = tuple(
        replace(run, unit="MEMS IMU of a long name/examples", run=f"thermal-cycle-{run.run}")
        for run in judged.test
    )
    notes = (
        "No model can reach the design index: " + 6 * "so says the noise, ",
        7 * "Earth rate is not known, ",
    )
    return certificate(replace(judged, test=runs, notes=notes))


@pytest.mark.parametrize("make", [lambda: pages()["certificate"], of_many_features, of_many_words])
def test_a_certificate_prints_on_one_a4_sheet(browser, make) -> None:
    opened = browser(make())
    assert "<svg" in opened.tell("document.documentElement.outerHTML")
    pdf = opened.printed()
    assert len(re.findall(rb"/Type\s*/Page[^s]", pdf)) == 1
    box = re.search(rb"/MediaBox\s*\[\s*0\s+0\s+([\d.]+)\s+([\d.]+)", pdf)
    assert box is not None
    assert [round(float(side) / 72 * 25.4) for side in box.groups()] == [210, 297]
    opened.close()


def test_figures_are_printed_as_wide_as_the_sheet(browser) -> None:
    probe = (
        "<script>addEventListener('beforeprint', function () {"
        "document.querySelectorAll('.plot').forEach(function (plot) {"
        "console.log('figure ' + plot.querySelector('.main-svg').getAttribute('width')); });"
        "});</script></body>"
    )
    html = pages()["train"].replace("</body>", probe)
    opened = browser(html)
    opened.printed()
    assert opened.console == ["figure 672"] * len(Page(html).figures)
    opened.close()


def test_the_block_for_the_firmware_file_is_printed_without_its_button(browser) -> None:
    block = '<button type="button" class="copy">Copy</button><pre>formula</pre></body>'
    opened = browser(pages()["train"].replace("</body>", block))
    opened.on_paper(True)
    button = opened.tell("document.querySelector('button.copy').getBoundingClientRect().height")
    letter = opened.tell("parseFloat(getComputedStyle(document.querySelector('pre')).fontSize)")
    opened.close()
    # 100 letters of 0.6 of its height on a sheet of 178 mm.
    assert button == 0 and 100 * 0.6 * letter < 178 / 25.4 * 96


@pytest.mark.parametrize("kind", ["fleet", "train", "gap", "index", "sweep"])
def test_no_word_of_an_axis_lies_on_another_panel_on_paper(browser, kind) -> None:
    """Beside a panel of two columns a title lay over the points of the one to its left."""
    opened = browser(pages()[kind])
    opened.on_paper(True)
    over = opened.tell(
        """Array.from(document.querySelectorAll(".plot")).flatMap(function (plot) {
          var panels = Array.from(plot.querySelectorAll(".bglayer .bg, .draglayer .nsewdrag"));
          var words = Array.from(plot.querySelectorAll(".ytick text, text[class^='y'][class$='title']"));
          return words.filter(function (text) {
            var own = text.getBoundingClientRect();
            return panels.some(function (panel) {
              var box = panel.getBoundingClientRect();
              return own.width && own.right > box.left + 1 && own.left < box.right - 1 &&
                own.bottom > box.top + 1 && own.top < box.bottom - 1;
            });
          }).map(function (text) { return text.textContent; });
        })"""
    )
    panels = opened.tell("""document.querySelectorAll(".draglayer .nsewdrag").length""")
    opened.close()
    assert panels > 1 and not over
