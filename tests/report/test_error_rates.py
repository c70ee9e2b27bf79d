"""How often a diagnosis is right, as its page tells it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from experiments import gap_blind
from fogml.numerals import percent, plural
from fogml.report.gap_page import gap_page
from fogml.report.gap_tiles import ERROR_RATES, error_rates, error_sentences
from tests.report.diagnoses import every_diagnosis
from tests.report.pages import Page

HELD = json.loads((Path(gap_blind.__file__).parent / "results.json").read_text(encoding="utf-8"))
RATES = json.loads(ERROR_RATES.read_text(encoding="utf-8"))
"""What the pages tell, and the table that it is of."""


def test_the_rates_told_are_those_of_the_table_that_is_kept() -> None:
    rows = HELD["by_reality"]["all"]
    assert HELD["final"]
    cases = {name: count for name, count in HELD["cases"].items() if name in HELD["by_reality"]}
    assert error_rates(rows, cases, [HELD["seed"]], final=True) == RATES
    assert set(RATES["cases"]) == set(HELD["by_reality"]) - {"all"}
    for share in RATES["figures"].values():
        assert 0.0 <= share["low"] <= share["value"] <= share["high"] <= 1.0 and share["n"] > 0


@pytest.mark.parametrize("verdict", ["explained", "ambiguous", "partly_explained", "unknown", "no_gap"])
def test_every_page_tells_how_often_such_findings_are_right(verdict: str) -> None:
    found = every_diagnosis()[verdict]
    text = Page(gap_page(found)).text
    sentences = error_sentences(found)
    assert all(sentence in text for sentence in sentences)
    assert "synthetic cases" in sentences[0] and "development" not in sentences[0]
    false = RATES["figures"]["false_names"]
    told = f"Of the causes named there, {percent(false['value'])} of {plural(false['n'], 'name')}"
    assert any(sentence.startswith(told) for sentence in sentences) == bool(found.named)
    assert any("nothing missing" in sentence for sentence in sentences) == (not found.named)


def test_rates_of_cases_that_were_developed_on_are_told_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fogml.report.gap_tiles._held", lambda: {**RATES, "final": False})
    (first, *_) = error_sentences(every_diagnosis()["explained"])
    assert "development cases" in first and "worked on with these in view" in first
