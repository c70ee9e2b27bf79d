"""The plan's page tells the chosen programme beside those that were not chosen."""

from copy import deepcopy

from fogml.report.plan_page import plan_page
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
