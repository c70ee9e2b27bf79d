"""Every page: whole, self-contained, readable without seeing, with the right figures in its text."""

from __future__ import annotations

import base64
import math
import re
from dataclasses import replace
from functools import cache

import numpy as np
import plotly.graph_objects as go
import pytest

from fogml.numerals import number
from fogml.report.compare_page import compare_page, models_table, ranked
from fogml.report.index_page import index_page
from fogml.report.inspect_page import inspect_page
from fogml.report.noise_page import headline_tiles, noise_page
from fogml.report.page import Drawing, _Drawings
from fogml.report.tables import metrics_table
from fogml.report.train_page import train_page
from fogml.runs.findings import Finding
from fogml.runs.run import Run
from fogml.signals.drawn import DRAWN_POINTS
from tests.report.judgements import judged_run, judgement, linear_judgement
from tests.report.pages import Page, every_page, noise_values, recorded_run
from tests.report.procedure_pages import benchmark

KINDS = ("train", "train of five", "compare", "inspect", "noise", "gap", "index", "certificate")
pages = cache(every_page)


@cache
def page(kind: str) -> Page:
    return Page(pages()[kind])


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_is_self_contained(kind: str) -> None:
    html, read = pages()[kind], page(kind)
    for tag, attributes in read.elements:
        for name in ("src", "srcset", "action", "poster", "data"):
            assert name not in attributes, f"<{tag} {name}=...> loads something"
        target = attributes.get("href")
        assert target is None or not re.match(r"(?i)(\w+:)?//", target)
    assert not read.of("link") and not read.of("iframe")
    style = html[html.index("<style>") : html.index("</style>")]
    assert "url(" not in style and "@import" not in style
    policy = next(m["content"] for m in read.of("meta") if m.get("http-equiv") == "Content-Security-Policy")
    assert policy is not None and "default-src 'none'" in policy and "http" not in policy


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_has_language_title_and_one_heading(kind: str) -> None:
    read = page(kind)
    assert read.of("html")[0]["lang"] == "en"
    title = pages()[kind].split("<title>")[1].split("</title>")[0]
    assert len(title) > 8
    assert len(read.of("h1")) == 1
    assert pages()[kind].lstrip().startswith("<!doctype html>")


@pytest.mark.parametrize("kind", KINDS)
def test_plotly_is_inlined_once_and_only_where_needed(kind: str) -> None:
    read = page(kind)
    bundles = [script for script in read.inline_scripts if len(script) > 1_000_000]
    assert len(bundles) == (0 if kind == "certificate" else 1)
    assert len(pages()[kind]) < (100_000 if kind == "certificate" else 2_000_000)


@pytest.mark.parametrize("kind", KINDS)
def test_every_figure_says_what_it_shows_and_names_units(kind: str) -> None:
    read = page(kind)
    plots = [a for a in read.of("div") if "plot" in (a.get("class") or "").split()]
    assert len(plots) == len(read.figures)
    for attributes in [*plots, *read.of("svg")]:
        assert attributes["role"] == "img"
        assert len(attributes["aria-label"] or "") > 40
    for figure in read.figures:
        axes = [v for k, v in figure["layout"].items() if re.fullmatch(r"[xy]axis\d*", k)]
        titles = [axis["title"]["text"] for axis in axes if axis.get("title", {}).get("text")]
        assert len(titles) >= 1
        assert all("[" in title for title in titles)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_depends_on_colour_alone(kind: str) -> None:
    # Within a panel; panels are told apart by the titles of their axes.
    for figure in page(kind).figures:
        looks: dict[tuple[str, ...], str] = {}
        for trace in figure["data"]:
            if trace["type"] != "scatter" or trace.get("showlegend") is False or trace.get("fill"):
                continue
            line, marker = trace.get("line", {}), trace.get("marker", {})
            shape = (
                trace.get("yaxis", "y"),
                trace["mode"],
                str(line.get("dash", "solid")) + str(line.get("width")),
                str(marker.get("symbol")),
            )
            name = trace["name"]
            assert looks.setdefault(shape, name) == name, f"{name} and {looks[shape]} differ by colour alone"


def test_names_from_files_cannot_become_markup() -> None:
    name = "</script><script>alert(1)</script><b>.csv"
    judged = replace(judgement(), test=(judged_run(name, notes=("<img src=x>",)),))
    html = train_page(judged)
    assert "<script>alert" not in html and "<img" not in html and "<b>" not in html
    assert name in Page(html).text


def test_names_in_figures_are_shown_letter_by_letter() -> None:
    """plotly takes marks in its texts for markup, whatever the page's own escaping."""
    bars = go.Bar(x=["<b>u</b>"], y=[1.0], name="<a href='x'>a & b</a>", hovertemplate="%{y}<extra></extra>")
    figure = go.Figure(bars, layout={"xaxis": {"title": {"text": "unit<br>[deg/h]"}}})
    (drawn,) = Page(str(_Drawings()(Drawing(figure, "bars")))).figures
    trace = drawn["data"][0]
    assert trace["x"] == ["&lt;b&gt;u&lt;/b&gt;"]
    assert trace["name"] == "&lt;a href='x'&gt;a &amp; b&lt;/a&gt;"
    assert trace["hovertemplate"] == "%{y}<extra></extra>"
    assert drawn["layout"]["xaxis"]["title"]["text"] == "unit<br>[deg/h]"


def test_the_train_page_states_the_figures_of_the_judgement() -> None:
    judged = judgement(5, left=0.1)
    text = Page(train_page(judged)).text
    for run in judged.test:
        for field in ("bias", "bias_stability", "range", "rms"):
            before, after = getattr(run.before, field), getattr(run.after, field)
            assert f"{number(before)} → {number(after)}" in text
        assert f"Test run {run.run}" in text
    assert "100 s averages" in text and "noise floor" in text
    assert text.count("Noise floor") >= 3


def test_findings_notes_and_left_out_samples_are_told() -> None:
    finding = Finding("stuck_sensor", "one value for 12 min while T_out moves", "T_in", 77, 720)
    text = Page(train_page(judgement(findings=(finding,), notes=("MEMS unit",)))).text
    assert "stuck sensor" in text and "column T_in, from row 77" in text
    assert "b.csv: MEMS unit" in text
    assert "128 samples (0.4 %) left out" in text


def test_a_note_that_holds_for_many_runs_is_told_once() -> None:
    cut = "48 rows about changes of the table's rate left out"
    runs = tuple(judged_run(f"{name}.csv", notes=(f"{name}.csv: {cut}",)) for name in "bcd")
    judged = judgement()
    model = {**judged.model, "notes": [f"b.csv: {cut}"]}
    text = Page(train_page(replace(judged, train=runs[:1], test=runs[1:], model=model))).text
    assert text.count(cut) == 1
    assert f"b.csv, c.csv and d.csv: {cut}" in text


def test_bias_stability_of_10_s_stands_once() -> None:
    run = judged_run()
    run = replace(
        run,
        before=replace(run.before, bias_stability_10s=0.2),
        after=replace(run.after, bias_stability_10s=0.1),
    )
    names = [
        [row.cells[0] for row in metrics_table(replace(run, averaging_s=s)).rows] for s in (100.0, 10.11)
    ]
    assert ["Bias stability, 10 s averages" in told for told in names] == [True, False]


def test_coefficients_and_candidates_are_shown_where_told() -> None:
    judged = linear_judgement()
    text = Page(train_page(judged)).text
    assert "0.0040000" in text and "Standard error" in text
    assert "Standard error" not in Page(train_page(judgement())).text
    weighed = [
        {"name": "T, dT", "parameters": 3, "held_out_rms": 0.02},
        {"name": "no compensation", "parameters": 1, "held_out_rms": 0.2},
    ]
    model = {**judged.model, "chosen_by": "auto", "candidates": weighed}
    text = Page(train_page(replace(judged, model=model))).text
    assert "What auto weighed" in text and text.index("T, dT 3 0.0200") < text.index("no compensation")


def test_a_model_that_tells_little_of_itself_is_shown_all_the_same() -> None:
    judged = replace(judgement(), model={"kind": "mine"}, design_index=None, limits=(), notes=())
    text = Page(train_page(judged)).text
    assert "the mine model leaves" in text and "Limits" not in text


def test_a_run_without_temperature_or_band_is_drawn() -> None:
    run = judged_run()
    nothing = np.full(len(run.series.time), np.nan)
    series = replace(run.series, temperature=nothing, rate=nothing, lower=nothing, upper=nothing)
    read = Page(train_page(replace(judgement(), test=(replace(run, series=series),))))
    assert len(read.figures) == 2
    assert "90 % band" not in [trace["name"] for trace in read.figures[0]["data"]]


def test_the_comparison_is_sorted_and_names_the_choice_and_the_harm() -> None:
    models = {n: judgement(kind=n, left=left) for n, left in (("mean", 1.0), ("M2", 2.0), ("rbf", 0.01))}
    models["auto"] = replace(models["rbf"], model={**models["rbf"].model, "kind": "rbf", "chosen_by": "auto"})
    assert ranked(models)[-2:] == ["mean", "M2"]
    read = Page(compare_page(models, {"joint": "the table did not turn"}))
    text = read.text
    rows = models_table(models, ranked(models)).rows
    assert {row.cells[0]: row.mark for row in rows} == {
        "auto": "chosen", "mean": "baseline", "M2": "", "rbf": ""
    }  # fmt: skip
    left = [trace["name"] for trace in read.figures[-1]["data"]]
    assert "mean" not in left and {"auto", "rbf", "M2"} <= set(left)
    assert "auto chose rbf (T, dT, T*dT)" in text
    # Parameters and bytes of each, in its row.
    assert text.count(" 41 344 ") == len(models)
    assert "Worse than no drift model (mean): M2." in text
    assert "joint the table did not turn" in text
    assert len(re.findall("✗ not met", text)) == 2


def test_a_model_whose_rms_is_not_a_number_comes_last() -> None:
    broken = judgement(kind="broken")
    run = broken.test[0]
    broken = replace(broken, test=(replace(run, after=replace(run.after, rms=math.nan)),))
    assert ranked({"broken": broken, "rbf": judgement()}) == ["rbf", "broken"]


def test_the_index_claims_a_loop_only_where_there_is_one() -> None:
    closed = judgement()
    run = closed.test[0]
    apart = replace(run.series, before=run.series.before + 0.4)
    open_loop = replace(closed, test=(replace(run, series=apart),))
    text = Page(index_page({"x": open_loop, "y": closed}, {"x": "x/report.html", "y": "elsewhere.html"})).text
    assert re.search(r"On axis x the two runs lie up to 0\.4\d* deg/h apart", text)
    assert "no polynomial in T closes" in text
    assert "no polynomial" not in Page(index_page({"y": closed})).text


def test_the_index_links_to_the_axes_and_shows_models_beside() -> None:
    beside = {"cubic in T": {"x": judgement(left=0.5)}}
    read = Page(index_page({"x": judgement(), "z": judgement()}, beside=beside, title="A cycle"))
    assert [a["href"] for a in read.of("a")] == ["x/report.html", "z/report.html"]
    assert "Rms, cubic in T" in read.text
    assert number(beside["cubic in T"]["x"].test[0].after.rms) in read.text


def test_the_noise_page_tells_terms_and_warnings() -> None:
    text = Page(noise_page(noise_values(moving=True))).text
    assert "0.0100 0.00980 … 0.0102 deg/√h" in text
    assert "Mind: The temperature moves by 4 degC." in text
    assert text.count("The temperature moves by 4 degC.") == 1
    assert "not read from a run with moving temperature" in text
    assert "no more than 0.500" in text
    assert "overlapping" in text


def test_a_term_that_is_not_told_from_zero_is_no_headline() -> None:
    values = noise_values()
    white = {**values["terms"]["N"], "ci": [0.0, 0.02]}
    bare = {**values, "terms": {"N": white}, "minimum": {}}
    assert "angle random walk" in [tile.name.lower() for tile in headline_tiles(values)]
    assert not [tile for tile in headline_tiles(bare) if tile.unit == "deg/√h"]
    assert "The data support no noise term." in Page(noise_page(bare)).text


def test_a_deviation_of_nothing_is_no_empty_figure() -> None:
    values = noise_values()
    still = {**values, "adev": [0.0] * len(values["adev"]), "ci": [[0.0, 0.0]] * len(values["adev"])}
    html = noise_page(still)
    assert "nothing to draw" in html and "plotly" not in html


def test_without_overlap_the_noise_page_says_so() -> None:
    text = Page(noise_page({**noise_values(), "overlapping": False})).text
    assert "not overlapping" in text and "rest on few pairs" in text


def test_the_inspect_page_tells_gaps_findings_and_columns() -> None:
    text = Page(inspect_page(recorded_run())).text
    assert "20 000 samples" in text and "Lasts 10001 9999 10.0 min" in text
    assert "outliers : 12 outliers over 8 robust sigma" in text.replace("outliers 12", "outliers : 12")
    assert "9.6481 deg/h" in text and "inner face of the fibre coil" in text


def test_a_run_without_temperature_can_be_inspected() -> None:
    run = Run.from_columns("static.csv", time=np.arange(500.0), gyro=np.sin(np.arange(500.0)))
    text = Page(inspect_page(run)).text
    assert "no temperature recorded; at rest 100 %" in text and "soak" not in text
    assert "First row after the gap" not in text


def test_long_runs_are_drawn_with_few_points() -> None:
    read = Page(inspect_page(recorded_run(1_000_000)))
    for trace in read.figures[0]["data"]:
        y = trace["y"]
        count = len(y["bdata"]) * 3 // 4 // 4 if isinstance(y, dict) else len(y)
        assert count <= DRAWN_POINTS + 10


@pytest.mark.parametrize(
    ("values", "kept"),
    [
        (np.linspace(-3.0, 5.0, 50), "f4"),
        (np.array([1.0, np.nan, np.inf, 2.0]), "f4"),
        # A clock of seconds since 1970 and an offset with a small scatter need all their digits.
        (1.7e9 + np.arange(50.0), "f8"),
        (9.6481 + 1e-6 * np.arange(50.0), "f8"),
        (np.array([0.0, 1e300]), "f8"),
        (np.full(50, np.nan), "f8"),
    ],
)
def test_samples_are_drawn_as_exactly_as_a_screen_shows(values: np.ndarray, kept: str) -> None:
    (drawn,) = Page(str(_Drawings()(Drawing(go.Figure(go.Scatter(y=values)), "samples")))).figures
    y = drawn["data"][0]["y"]
    assert y["dtype"] == kept
    told = np.frombuffer(base64.b64decode(y["bdata"]), dtype=y["dtype"])
    span = np.ptp(values[np.isfinite(values)]) if np.isfinite(values).any() else 1.0
    np.testing.assert_allclose(told, values, rtol=0.0, atol=1e-4 * span)


def test_a_benchmark_tells_the_data_that_its_round_holds() -> None:
    synthetic = benchmark("F-1", ("synthetic, first reality", "synthetic, second reality"))
    own = benchmark("F-1", ("synthetic, first reality", "oven of bench 4"))
    both = benchmark("F-1")
    assert "MEMS units" in both and "synthetic units of realities" in both
    assert "MEMS units" not in synthetic and "synthetic units of realities" in synthetic
    assert "share no code with the twin; oven of bench 4" in own
