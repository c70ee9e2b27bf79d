"""The result pages of the joint, multi-point and temperature-product methods: known answers, quick modes."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

import experiments.joint_scale_bias.__main__ as joint
import experiments.multipoint_model.__main__ as multipoint
import experiments.rbf_product.__main__ as product
from experiments.rbf_product.world import programme, signal_to_noise
from experiments.results import html_page, write_results


@pytest.fixture(scope="module")
def joint_values():
    return joint.results(joint.settings_of(quick=True))


@pytest.fixture(scope="module")
def multipoint_values():
    return multipoint.results(multipoint.settings_of(quick=True))


@pytest.fixture(scope="module")
def product_values():
    return product.results(product.settings_of(quick=True))


def test_known_answers_of_the_columns(joint_values):
    known = joint_values["known"]
    assert 2.0 < known["six columns, as printed"]["largest_residual"] < 11.0
    bare = known["six columns, Earth rate in y"]
    assert 0.12 < bare["largest_residual"] < 0.74 and bare["scale_factor_ppm"] < 1.0
    sound = known["intercept and Earth rate in y"]
    assert sound["largest_residual"] < 0.02 and sound["scale_factor_ppm"] < 1.0
    # Earth rate at 30 deg, taken for bias.
    assert known["intercept, no Earth rate in y"]["largest_residual"] == pytest.approx(7.52, abs=0.01)


def test_known_correlations_of_the_rate(joint_values):
    quality = joint_values["rate_quality"]
    assert quality["noise"]["6"] == pytest.approx(0.89, abs=0.01)
    assert quality["noise"]["0"] == pytest.approx(0.22, abs=0.01)
    assert quality["no noise"]["0"] == pytest.approx(0.46, abs=0.01)


def test_joint_and_two_steps_are_alike_and_one_way_turns_are_not(joint_values):
    ways = {name: told["second staircase"] for name, told in joint_values["compared"]["ways"].items()}
    both, steps = ways["intercept and Earth rate in y"], ways["two steps, one run"]
    assert steps["rms"] == pytest.approx(both["rms"], rel=0.1)
    assert steps["scale_factor_ppm"] == pytest.approx(both["scale_factor_ppm"], abs=2.0)
    assert ways["two steps, one run, turns one way"]["scale_factor_ppm"] > both["scale_factor_ppm"] + 15.0
    hours = joint_values["compared"]["hours"]
    assert hours["intercept and Earth rate in y"] == pytest.approx(9.9, abs=0.1)
    assert hours["two steps, two runs"] == pytest.approx(2 * hours["two steps, one run"])
    turns = joint_values["sensitivity"]["turning_soaks"]
    assert turns["2"]["scale_factor_ppm"] > 100.0 > 3.0 > turns["12"]["scale_factor_ppm"]


def test_knee_in_sample_and_loss_at_another_rate(multipoint_values):
    forms = multipoint_values["forms"]

    def left(form, run, key="std_10s"):
        return forms[form]["runs"][run][key]

    one, two, four = (f"{n} point{'s' if n > 1 else ''} 5/3" for n in (1, 2, 4))
    assert left(two, "in sample") < 0.55 * left(one, "in sample")
    assert left(four, "in sample") > 0.9 * left(two, "in sample")
    assert left(four, "2 degC/min") > 3.0 * left("4 points 2/1", "2 degC/min")
    assert forms[four]["coefficients"] == 33 and forms["4 points 2/1"]["coefficients"] == 13
    assert left("T in pieces", "in sample") > 2.0 * left("M2", "in sample")
    for told in forms.values():
        for run in told["runs"].values():
            assert run["std_10s"] > 0.95 * run["floor_10s"] and run["own_error"] < run["std_10s"]


def test_folds_choose_what_holds_elsewhere(multipoint_values):
    chosen = multipoint_values["choice"]["chosen"]
    folds = max(chosen["one run, parts of it left out: least error"]["std"].values())
    paper = max(chosen["least error in sample, as the paper scores"]["std"].values())
    best = max(chosen["best on the test runs themselves (not a choice)"]["std"].values())
    assert best <= folds < 0.5 * paper


def test_start_up_needs_a_start_up_in_training(multipoint_values):
    told = multipoint_values["start_up"]["heat alone"]
    before = told["none"][""]["10 degC"]
    form = {source: std["10 degC"] for source, std in told["4 points 2/1"].items()}
    assert form["both"] < 0.5 * before < before < form["the thermal cycle"]


def test_product_helps_what_is_linear_in_the_rate(product_values):
    sizes = product_values["sizes"]
    without, with_term = (sizes["polynomial"]["0.01"][term]["10"]["own"] for term in ("False", "True"))
    assert with_term < 0.3 * without
    without, with_term = (
        sizes["RBF, patent's form"]["0.01"][term]["10"]["own"] for term in ("False", "True")
    )
    assert with_term == pytest.approx(without, rel=0.3)
    # A term that the truth lacks costs little.
    without, with_term = (sizes["polynomial"]["0.0"][term]["10"]["own"] for term in ("False", "True"))
    assert with_term < 1.2 * without


def test_first_differences_drown_the_product(product_values):
    told = product_values["directions"]
    steps, windows = (
        told[f"RBF, patent's form|{rate}|both"]["True"]["10 both"]["rms"]
        for rate in ("first difference", "64 s windows")
    )
    assert windows < 0.6 * steps
    moved = product_values["mean_removed"]
    assert moved["rms"] > 0.015 > 0.012 > moved["stability"]


def test_known_signal_to_noise():
    assert signal_to_noise(0.01, 0.005) == pytest.approx(0.34, abs=0.01)
    assert signal_to_noise(0.0625, 0.02) == pytest.approx(0.07, abs=0.01)
    assert programme(10, "down")["start_temperature"] == "40 degC"


@pytest.mark.parametrize(
    ("experiment", "values"),
    [(joint, "joint_values"), (multipoint, "multipoint_values"), (product, "product_values")],
    ids=["joint", "multipoint", "product"],
)
def test_pages_say_what_they_must(experiment, values, request, tmp_path):
    values = request.getfixturevalue(values)
    text = experiment.page(values, experiment.settings_of(quick=True))
    drawings = experiment.drawings(values)
    assert "**synthetic**" in text and "**Verdict" in text and "floor" in text
    assert "nan" not in text.replace("nano", "")
    write_results(tmp_path, values, text, drawings)
    html = (tmp_path / "results.html").read_text(encoding="utf-8")
    assert html.count("<svg") == len(drawings) == text.count(".svg)")
    assert "<img" not in html and "http-equiv" in html
    assert html == html_page(text, drawings)
    for name in drawings:
        assert (tmp_path / f"{name}.svg").read_text(encoding="utf-8").startswith("<svg")


def test_committed_pages_are_of_the_committed_figures():
    import json

    for experiment in (joint, multipoint, product):
        values = json.loads((experiment.HERE / "results.json").read_text(encoding="utf-8"))
        text = experiment.page(values, experiment.settings_of(quick=False))
        assert (experiment.HERE / "results.md").read_text(encoding="utf-8") == text
