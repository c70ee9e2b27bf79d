"""The plan's page tells the chosen programme beside those that were not chosen."""

from copy import deepcopy

import pytest

from fogml.report.plan_page import errors_drawing, plan_page
from tests.report.procedure_pages import written

OTHER = "another course"


def test_runners_up_stand_beside_the_chosen_programme():
    values = deepcopy(written("plan"))
    run = values["runs"][0]
    told = {key: run[key] for key in ("summary", "hours", "wanted", "separations")}
    run["alternatives"] = [told | {"summary": OTHER, "hours": 7.25}]
    page = plan_page(values)
    assert OTHER in page and "7.25" in page and "runners-up" in page
    run["alternatives"] = []
    assert "runners-up" not in plan_page(values)


def test_a_constant_is_told_in_words():
    values = deepcopy(written("plan"))
    values["wanted"][0] |= {"name": "k1", "unit": "ppm/degC"}
    assert "k1: scale factor, by T" in plan_page(values)


def test_errors_are_drawn_as_shares_of_what_was_known_or_is_usual():
    one = {"name": "b0", "se": 0.02, "prior_se": 5.0, "usual": 3.0}
    other = {"name": "thermal_hysteresis", "se": 0.01, "prior_se": None, "usual": -0.04}
    drawing = errors_drawing({"wanted": [one, other]})
    assert drawing is not None
    assert list(drawing.figure.data[0].x) == pytest.approx([0.004, 0.25])
    assert errors_drawing({"wanted": []}) is None
