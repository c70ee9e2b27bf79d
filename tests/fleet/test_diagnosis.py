"""What a line's diagnoses tell together."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.fleet.diagnosis import line_diagnosis, unit_diagnosis
from fogml.fleet.summary import fleet_json
from fogml.report.fleet_page import fleet_page
from tests.report.diagnoses import diagnosis


def cause(
    effect: str, probability: float, size: float, share: float = 0.6, prior: float = 1.0 / 30.0
) -> dict[str, Any]:
    told = {
        "effect": effect,
        "members": [effect],
        "probability": probability,
        "prior_probability": prior,
        "share": share,
        "place": "coil",
    }
    return {**told, "amplitude": size, "se": 0.02, "unit": "deg/h", "times_usual": 1.0}


def unit(*causes: dict[str, Any], lot: str = "", hidden: tuple[str, ...] = ()) -> dict[str, Any]:
    told = {"causes": list(causes), "unknown": 0.02, "undetectable": list(hidden)}
    return {**told, "gap_square": 0.04, "floor_square": 1e-4, "covariates": {"coil_lot": lot} if lot else {}}


@pytest.fixture(scope="module")
def line() -> dict[str, Any]:
    """Forty units: hysteresis in all but one, one of them far larger; a loop gain in one lot alone."""
    rng = np.random.default_rng(0)
    units = []
    for place in range(40):
        causes = [cause("thermal_hysteresis", 0.97, 1.0 + 0.1 * rng.normal() + (3.0 if place == 5 else 0.0))]
        if place == 9:
            causes = []
        if place % 4 == 0:
            causes.append(cause("loop_gain", 0.9, 0.5 + 0.05 * rng.normal(), share=0.3))
        if place == 21:
            causes.append(cause("ageing", 0.9, 0.3, share=0.1))
        units.append(unit(*causes, lot="B" if place % 4 == 0 else "A", hidden=("radiation",)))
    return line_diagnosis([f"FOG-{place}" for place in range(40)], units)


def test_how_common_a_cause_is_follows_from_the_data_whatever_a_diagnosis_took_before_them() -> None:
    """Likelihood ratios of normal data, by Bayes with one prior or another; the share is the data's."""
    rng = np.random.default_rng(3)
    has = rng.random(60) < 0.4
    ratio = np.exp(2.0 * rng.normal(loc=2.0 * has) - 2.0)
    shares = []
    for prior in (0.02, 0.05):
        probability = prior * ratio / (prior * ratio + 1.0 - prior)
        units = [unit(cause("loop_gain", float(p), 1.0, prior=prior)) for p in probability]
        told = line_diagnosis([str(i) for i in range(60)], units)["causes"][0]
        shares.append((told["prevalence"], *told["prevalence_ci90"]))
    assert shares[0] == pytest.approx(shares[1], rel=1e-9)
    assert shares[0][1] < 0.4 < shares[0][2]


def test_what_the_line_shares_and_what_to_change_first(line: dict[str, Any]) -> None:
    first, second, *_ = line["causes"]
    assert (first["effect"], second["effect"]) == ("thermal_hysteresis", "loop_gain")
    assert first["shared"] and not second["shared"]
    assert first["units_named"] == 39 and first["prevalence_ci90"][0] > 0.8
    assert first["energy_share"] == pytest.approx(39 * 0.97 * 0.6 / 40)
    assert first["energy_share_ci90"][0] < first["energy_share"] < first["energy_share_ci90"][1]
    assert first["gap_rms_without"] == pytest.approx(0.2 * np.sqrt(1.0 - first["energy_share"]))
    assert second["between_units"] == pytest.approx(0.05, abs=0.04)
    (known,) = second["depends_on"]
    assert known["name"] == "coil_lot" and known["prevalence"]["B"] > 0.7 > 0.2 > known["prevalence"]["A"]
    assert not first["depends_on"]


def test_units_that_stand_apart(line: dict[str, Any]) -> None:
    told = {(one["unit"], one["kind"], one["effect"]) for one in line["apart"]}
    assert ("FOG-5", "size", "thermal_hysteresis") in told
    assert ("FOG-9", "without", "thermal_hysteresis") in told
    # What a quarter of the units have is not rare.
    assert {(name, effect) for name, kind, effect in told if kind == "rare"} == {("FOG-21", "ageing")}
    assert len([one for one in told if one[1] == "size"]) <= 2


def test_units_that_could_not_show_a_cause_say_nothing_of_it() -> None:
    units = [unit(cause("magnetic", 0.95, 1.0))] * 3 + [unit(hidden=("magnetic",))] * 20
    told = line_diagnosis([str(n) for n in range(23)], units)["causes"][0]
    assert told["units_told"] == 3 and told["prevalence"] > 0.7
    with pytest.raises(InputError, match="run the fleet again"):
        line_diagnosis(["FOG-1"], [{"causes": []}])


def test_it_stands_in_the_fleet_s_page_and_json(line: dict[str, Any]) -> None:
    outcomes = [
        {
            "unit": f"F{n}",
            "axis": "x",
            "job": "diagnose",
            "folder": f"F{n}",
            "status": "done",
            "found": {
                "verdict": "explained",
                "effects": ["magnetic"],
                "diagnosis": unit(cause("magnetic", 0.9, 1.0)),
            },
        }
        for n in range(6)
    ]
    values = fleet_json(outcomes, {"seed": 0})
    assert values["diagnosis"]["units"] == 6
    page = fleet_page(values)
    assert "Change first: magnetic (coil)" in page
    assert "diagnosis" not in fleet_json([{**o, "found": {}} for o in outcomes], {})
    # No cause in any: the page stands.
    none = [{**o, "found": {"diagnosis": unit()}} for o in outcomes]
    assert "Of no cause these runs show that it is shared" in fleet_page(fleet_json(none, {}))


def test_a_diagnosis_becomes_what_the_fleet_wants() -> None:
    found = diagnosis()
    told = unit_diagnosis(found, {"coil_lot": "B"})
    assert [one["effect"] for one in told["causes"]] == [one.effect for one in found.found]
    assert told["covariates"] == {"coil_lot": "B"}
    line_diagnosis(["FOG-1"], [told])


def test_a_unit_of_several_jobs_counts_once_and_by_its_model() -> None:
    """The median of seven rms of models, whatever else a manifest asks of the units."""

    def outcome(number: int, job: str, after: float) -> dict[str, Any]:
        worst = {"run": "b.csv", "averaging_s": 100.0, "before": 9.0, "after": after, "floor": 0.1}
        about = {
            "unit": f"F{number}",
            "axis": "x",
            "job": job,
            "folder": f"F{number}-{job}",
            "status": "done",
        }
        return {**about, "found": {"worst": worst}}

    rms = [0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5]
    jobs = (("train", 0.0), ("compare", 0.0625), ("diagnose", 7.0))
    outcomes = [outcome(n, job, own + more) for n, own in enumerate(rms) for job, more in jobs]
    values = fleet_json(outcomes, {})
    assert values["distribution"]["after"]["median"] == 1.2 and not values["outliers"]
    assert "21 jobs done; the median unit goes from 9.00 to 1.20 deg/h" in fleet_page(values)
    # Where a unit was only compared, or all were only diagnosed, these are their figures.
    compared = fleet_json([outcomes[1], *outcomes[3:]], {})["distribution"]["after"]
    assert compared["least"] == 0.9625 and compared["median"] == 1.2
    assert fleet_json(outcomes[2::3], {})["distribution"]["after"]["median"] == 8.2


def test_units_of_like_names_both_count() -> None:
    """``A`` with axis ``x`` and ``A x`` without one read alike: the first of them was left out."""

    def outcome(name: str, axis: str, after: float) -> dict[str, Any]:
        worst = {"run": "b.csv", "averaging_s": 100.0, "before": 9.0, "after": after, "floor": 0.1}
        about = {"unit": name, "axis": axis, "job": "train", "folder": f"{name}-{axis}", "status": "done"}
        return {**about, "found": {"worst": worst}}

    values = fleet_json([outcome("A", "x", 1.0), outcome("A x", "", 3.0)], {})
    assert values["distribution"]["after"]["median"] == 2.0
    assert "2 units done" in fleet_page(values)
