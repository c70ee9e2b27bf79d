"""How often a diagnosis is right, as its page tells it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from experiments import gap_blind
from fogml.report import gap_page
from fogml.report.error_rates import ERROR_RATES, error_rates, error_sentences
from fogml.report.words import plural
from tests.report.diagnoses import diagnosis, every_diagnosis, hysteresis
from tests.report.pages import Page

SCORE = json.loads((Path(gap_blind.__file__).parent / "score.json").read_text(encoding="utf-8"))
RATES = json.loads(ERROR_RATES.read_text(encoding="utf-8"))
"""What the pages tell, and the score that it is of."""


def test_the_rates_told_are_those_of_the_score_that_is_kept() -> None:
    assert error_rates(SCORE) == RATES
    assert SCORE["final"], "figures to develop on are no error rates"
    rows = {row["key"]: row for row in SCORE["methods"]["diagnosis"]["rows"]}
    named = RATES["named"]
    # The bands together hold each named effect once, and the wrong ones among them are the FDR's, to
    # which a case that failed adds a false name that nobody stated a probability of.
    failed = rows["failed"]["n"] * rows["failed"]["value"]
    assert sum(band["n"] for band in named) + failed == pytest.approx(rows["false_discovery"]["n"])
    wrong = sum(band["n"] * (1.0 - band["value"]) for band in named)
    assert wrong + failed == pytest.approx(rows["false_discovery"]["n"] * rows["false_discovery"]["value"])
    for band in named:
        assert 0.5 <= band["from"] < band["to"] <= 1.0 and band["low"] <= band["value"] <= band["high"]


@pytest.mark.parametrize("verdict", ["explained", "ambiguous", "partly_explained", "unknown", "no_gap"])
def test_every_page_tells_how_often_such_findings_are_right(verdict: str) -> None:
    found = every_diagnosis()[verdict]
    text = Page(gap_page(found)).text
    sentences = error_sentences(found)
    assert all(sentence in text for sentence in sentences)
    assert "synthetic cases" in sentences[0]
    assert any(" given with " in sentence for sentence in sentences) == bool(found.named)
    assert any("nothing missing" in sentence for sentence in sentences) == (not found.named)


@pytest.mark.parametrize(
    ("probabilities", "bands"),
    [
        ((0.5,), ["50 to 60 %"]),
        ((0.8,), ["80 to 90 %"]),
        ((0.799,), ["70 to 80 %"]),
        ((1.0,), ["90 to 100 %"]),
        ((0.97, 0.91, 0.62), ["90 to 100 %", "60 to 70 %"]),
    ],
)
def test_each_name_is_told_in_its_own_band_once(probabilities: tuple[float, ...], bands: list[str]) -> None:
    named = tuple(hysteresis(probability=probability) for probability in probabilities)
    told = [s for s in error_sentences(diagnosis("explained", named)) if " given with " in s]
    assert len(told) == len(bands)
    assert all(band in sentence for band, sentence in zip(bands, told))


def test_a_band_that_no_name_fell_into_is_said_to_be_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    held = [band for band in RATES["named"] if band["from"] >= 0.9]
    monkeypatch.setattr("fogml.report.error_rates._held", lambda: {**RATES, "named": held})
    named = (hysteresis(probability=0.95), hysteresis(probability=0.65))
    told = [s for s in error_sentences(diagnosis("explained", named)) if " given with " in s]
    assert told[0].startswith(f"Of {plural(held[0]['n'], 'name')} given with 90 to 100 %")
    assert told[1:] == [
        "No name was given with 60 to 70 % there: how often such a name is right is not known."
    ]
