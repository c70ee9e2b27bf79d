"""What a judgement is said to say: right figures, the worst run, and nothing left unsaid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.numerals import against, number
from fogml.report.certificate import certificate
from fogml.report.compare_page import compare_page
from fogml.report.train_page import train_page
from fogml.report.verdict import model_card, own_noise, stated_limits, subject, verdict, worst_run
from fogml.runs.findings import Finding
from fogml.validation.advice import advice_on
from tests.report.judgements import judged_run, judgement
from tests.report.pages import Page


def test_the_lead_states_what_is_left_of_what_the_averaging_and_the_floor() -> None:
    judged = judgement()
    run = judged.test[0]
    lead = verdict(judged)[0]
    for part in (
        "On b.csv the rbf model leaves",
        f"{number(run.after.bias_stability)} deg/h of {number(run.before.bias_stability)} deg/h",
        "bias stability, 100 s averages",
        f"noise floor is {number(run.floor)} deg/h",
    ):
        assert part in lead


def test_several_test_runs_lead_with_the_worst() -> None:
    judged = judgement(5)
    worst = max(judged.test, key=lambda run: run.after.rms)
    assert worst_run(judged.test) is worst
    assert verdict(judged)[0].startswith(f"On {worst.run}, the worst of 5 test runs,")


def test_harm_is_called_harm() -> None:
    assert "does harm" in verdict(judgement(left=3.0))[0]


def test_a_bias_stability_made_worse_is_not_called_what_is_left() -> None:
    judged = judgement()
    run = judged.test[0]
    poor = replace(run, after=replace(run.after, bias_stability=2.0 * run.before.bias_stability))
    lead = verdict(replace(judged, test=(poor,)))[0]
    assert "makes the bias stability worse" in lead and "leaves" not in lead


@pytest.mark.parametrize(("beyond", "harm"), [(0.3, False), (3.0, True)])
def test_harm_is_what_the_noise_does_not_hide(beyond: float, harm: bool) -> None:
    """Drift of `beyond` floors that a model adds to what is there: the squares add up."""
    judged = judgement()
    (run,) = judged.test
    after = float(np.hypot(run.before.rms, beyond * run.floor))
    poor = replace(run, after=replace(run.before, rms=after))
    none = replace(judged, test=(replace(run, after=run.before),))
    judged = replace(judged, test=(poor,))
    assert after > run.before.rms and ("does harm" in verdict(judged)[0]) is harm
    page = Page(compare_page({"rbf": judged, "mean": none}))
    assert ("Worse than no drift model (mean): rbf." in page.text) is harm
    assert ("worse than none on b.csv" in advice_on(judged).brief) is harm


def test_one_run_made_worse_among_several_is_named() -> None:
    judged = judgement(2, left=0.2)
    poor = replace(judged.test[0], before=replace(judged.test[0].before, rms=1e-4))
    text = " ".join(verdict(replace(judged, test=(poor, judged.test[1]))))
    assert "On c.csv, the worst" in text and "It makes b.csv worse." in text


def test_a_bias_that_makes_up_most_of_the_rest_is_told() -> None:
    text = " ".join(verdict(judgement(offset=0.2)))
    assert "mean is off by 0.2" in text and "training runs' mean" in text
    assert "mean is off" not in " ".join(verdict(judgement(offset=0.0)))


def test_limits_missed_are_named_with_their_figures() -> None:
    judged = judgement(limit=1e-3)
    text = " ".join(verdict(judged))
    assert judged.design_index is not None
    assert f"design index (largest rms) {number(judged.design_index.value)}, limit 0.001 deg/h" in text
    assert "Both stated limits are met." in " ".join(verdict(judgement(limit=0.05)))


def test_a_share_outside_training_is_told() -> None:
    assert "10.0 % of b.csv" in " ".join(verdict(judgement(outside=0.1)))
    assert "Outside" not in " ".join(verdict(judgement()))


def test_a_test_run_seen_in_training_is_told() -> None:
    seen = Finding("seen_in_training", "holds the same samples as training run a.csv")
    text = " ".join(verdict(judgement(findings=(seen,))))
    assert "how well the model fits, not how well it holds" in text


@pytest.mark.parametrize(
    ("kind", "words"), [("none", "nothing is compensated"), ("mean", "mean is taken off")]
)
def test_baselines_are_not_called_models(kind: str, words: str) -> None:
    assert words in verdict(judgement(kind=kind, left=1.0))[0]


def test_subject_names_unit_axis_model_and_runs() -> None:
    assert subject(judgement(2)) == "FOG-0417, axis x: rbf on b.csv and c.csv"


def test_a_limit_missed_by_little_is_seen_to_be_missed() -> None:
    value = judgement().design_index.value
    judged = judgement(limit=value * (1.0 - 1e-6))
    for told in (
        " ".join(verdict(judged)),
        Page(train_page(judged)).text,
        Page(certificate(judged)).text,
    ):
        shown = against(value, judged.design_index.limit)
        assert float(shown) > judged.design_index.limit and shown in told
    assert f"Rms is {shown} deg/h, the limit" in " ".join(advice_on(judged).reasons)


def test_stated_limits_begin_with_the_design_index() -> None:
    assert [o.quantity for o in stated_limits(judgement())] == ["design_index", "bias_stability"]
    assert stated_limits(replace(judgement(), design_index=None, limits=())) == []


def test_the_model_card_tells_size_box_and_band() -> None:
    card = dict(model_card(judgement().model))
    assert card["parameters"] == "41" and card["weights"] == "344 bytes"
    assert "T −20.0 to 60.0 °C; dT −0.670 to 0.670 °C/min" in card["trained within"]
    assert "± 0.0163 deg/h for 100 s averages" in card["90 % band"]
    assert np.all([isinstance(value, str) for value in card.values()])


def test_a_bias_is_no_noise() -> None:
    words = "what is left is the gyro's own noise"
    assert words in own_noise(judged_run(left=0.0)).lower()
    assert "bias" not in own_noise(judged_run(left=0.0))
    biased = own_noise(judged_run(left=0.0, offset=0.05))
    assert biased.startswith("Beside a bias of 0.0498 deg/h,") and words in biased
