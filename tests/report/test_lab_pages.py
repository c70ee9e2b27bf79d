"""Pages of the lab's procedures: self-contained, with their figures in words and units on every axis."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from fogml.json_files import finite_json
from fogml.lab.misalignment_json import misalignment_json
from fogml.lab.misalignment_simulation import TableUnit, measurements
from fogml.lab.navigation import navigation_costs
from fogml.lab.north import DEFAULT_ORDER, Drift, Scheme
from fogml.lab.north_json import recorded_north_json, simulated_north_json
from fogml.lab.north_schemes import simulated_positions
from fogml.report.misalignment_page import misalignment_page, region_figure, slopes_over_tilts
from fogml.report.north_page import north_page
from fogml.report.train_page import train_page
from tests.report.judgements import judgement
from tests.report.pages import Page

UNIT = TableUnit(1.2345, 5.0, 3.0, 0.5)


TILTS = (0.0, 30.0, 60.0, 90.0)


def misalignment_values(tilts: tuple[float, ...] = TILTS, rates=(-10.0, 10.0)) -> dict[str, Any]:
    return finite_json(misalignment_json(measurements(UNIT, tilts, rates, noise=1e-4)))


def misalignment(tilts: tuple[float, ...] = TILTS, rates=(-10.0, 10.0)) -> str:
    return misalignment_page(misalignment_values(tilts, rates))


def recorded() -> str:
    run = simulated_positions(Scheme(dwell_s=20.0), 70.0, 30.0, Drift(3.0), random_walk_deg_sqrt_h=1e-4)
    return north_page(finite_json(recorded_north_json(run, order_deg=DEFAULT_ORDER)))


def simulated() -> str:
    drift = Drift(0.18, ((0.2, 600.0),))
    values = simulated_north_json(Scheme(transfer_s=10.0), 45.0, 30.0, drift, random_walk_deg_sqrt_h=0.002)
    return north_page(finite_json(values))


def rates(source: str = "T") -> str:
    from fogml.lab.rate_json import rate_json
    from fogml.lab.rate_programmes import rate_runs
    from fogml.report.rate_page import rate_page
    from fogml.twin.twin import Twin

    twin = Twin().with_effect("loop_gain", 1e-3)
    values = rate_json(
        rate_runs(twin, frequencies_hz=np.array([10.0, 100.0, 300.0])), source=source, twin=twin
    )
    return rate_page(finite_json(values))


def trained() -> str:
    judged = judgement()
    return train_page(judged, finite_json(navigation_costs(judged, 39.9)))


@pytest.mark.parametrize("make", [misalignment, recorded, simulated, trained], ids=lambda make: make.__name__)
def test_a_page_is_whole(make) -> None:
    html = make()
    read = Page(html)
    assert len(read.of("h1")) == 1 and not read.of("link")
    for _, attributes in read.elements:
        assert "src" not in attributes
    plots = [a for a in read.of("div") if "plot" in (a.get("class") or "").split()]
    assert plots and len(plots) == len(read.figures)
    assert all(a["role"] == "img" and len(a["aria-label"] or "") > 40 for a in plots)
    for figure in read.figures:
        axes = [v for k, v in figure["layout"].items() if re.fullmatch(r"[xy]axis\d*", k)]
        titles = [axis["title"]["text"] for axis in axes if axis.get("title", {}).get("text")]
        assert titles and all("[" in title for title in titles)


def test_page_of_a_rate_table_has_its_figures_and_the_units_facts() -> None:
    read = Page(html := rates())
    figures = [a for a in read.of("svg") if a.get("role") == "img"]
    assert len(figures) == 4 and all(len(a["aria-label"] or "") > 20 for a in figures)
    assert (
        '<p class="verdict"><strong>The scale factor is ' in html and "ppm/°C" in html and "degC2" not in html
    )
    assert "gain 0.707" in html and "Sagnac constant" in html and "synthetic" in html
    assert not read.of("link") and len(read.of("h1")) == 1


def test_figures_in_the_text() -> None:
    text = misalignment()
    assert re.search(r"−44\d\d ppm", text) and "5.83" in text
    text = simulated()
    assert "135.0, 315.0" in text and "synthetic" in text
    assert "is taken out" in recorded()
    assert "What the drift costs in navigation" in trained()


def test_without_standard_errors_the_page_says_so() -> None:
    assert "No confidence region" in misalignment((0.0, 90.0), (50.0,))


def test_the_region_of_both_components_lies_within_its_frame() -> None:
    values = misalignment_values()
    figure = region_figure(values).figure
    outline = np.asarray(values["region"]["outline_deg"])
    for axis, (low, high) in enumerate((figure.layout.xaxis.range, figure.layout.yaxis.range)):
        free = 0.05 * np.ptp(outline[:, axis])
        assert low < outline[:, axis].min() - free and high > outline[:, axis].max() + free


def test_train_page_without_navigation_has_no_such_part() -> None:
    assert "costs in navigation" not in train_page(judgement())


def test_slopes_stand_above_what_their_fit_leaves_over_the_same_tilts() -> None:
    values = misalignment_values()
    figure = slopes_over_tilts(values).figure
    assert figure.layout.xaxis.matches == "x2"
    marks = [trace for trace in figure.data if trace.mode == "markers"]
    assert {trace.yaxis for trace in marks} == {"y", "y2"}
    for state in values["states"]:
        slopes = next(trace for trace in marks if trace.name == f"state {state['state']}")
        assert (slopes.yaxis, list(slopes.y)) == ("y", state["slopes"])
