"""A judgement and a diagnosis shown in a notebook: the figures of their pages, and pictures."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest

from tests.report.diagnoses import diagnosis
from tests.report.judgements import judgement


def shown(html: str) -> tuple[str, int]:
    page = ElementTree.fromstring(html.replace("<br>", "<br/>"))
    return "".join(page.itertext()), len(page.findall(".//{http://www.w3.org/2000/svg}svg"))


def test_a_judgement_shows_before_and_after_of_each_test_run() -> None:
    judged = judgement(3)
    text, pictures = shown(judged._repr_html_())
    assert pictures == 3
    for one in judged.test:
        assert f"{one.run}: rms {one.before.rms:.3g} → {one.after.rms:.3g} deg/h" in text
    figure = judged.plot()
    assert [trace.name for trace in figure.data] == ["before", "after"] * 3
    held = np.asarray(figure.data[1].y, dtype=float)
    assert np.nanmax(held) == pytest.approx(np.nanmax(judged.test[0].series.after))


def test_of_many_runs_a_notebook_shows_some_and_the_figure_all() -> None:
    judged = judgement(4)
    many = replace(judged, test=judged.test * 2)
    text, pictures = shown(many._repr_html_())
    assert pictures == 6 and "2 more; plot() draws all." in text
    assert len(many.plot().data) == 16


def test_a_diagnosis_shows_what_it_says_and_the_gap_of_each_run() -> None:
    found = diagnosis()
    text, pictures = shown(found._repr_html_())
    assert (found.headline or (found.verdict,))[0] in text
    assert pictures == min(len(found.series), 6)
    assert {trace.name for trace in found.plot().data} == {"gap, recalibrated", "with what was found"}


def test_in_a_list_too_they_are_short() -> None:
    assert len(repr([judgement(1), diagnosis()])) < 1000
    assert repr(judgement(1)).startswith("<Judgement: ") and repr(diagnosis()).startswith("<Diagnosis: ")
