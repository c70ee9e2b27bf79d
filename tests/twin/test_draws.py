"""What is not known of a twin: its file, units drawn from it, a plant fitted to recorded temperatures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from fogml.errors import InputError
from fogml.twin.draws import drawn_twin, parameter_values
from fogml.twin.plant.fit import FitSettings, _with, fit_plant
from fogml.twin.plant.heat import SelfHeating
from fogml.twin.plant.standard import ThermalConstants
from fogml.twin.set_up import Plant
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin, save_twin, twin_dict
from fogml.twin.uncertainty import Suspected, Uncertainty

NAMES = ("nominal.b0", "effects.thermal_hysteresis.half_width", "plant.case")
COVARIANCE = np.array([[0.04, 0.05, 0.0], [0.05, 0.25, -6.0], [0.0, -6.0, 900.0]])


def unsure() -> Twin:
    """A twin with a covariance over three sections and one effect that is suspected."""
    twin = load_twin("nominal").with_effect("thermal_hysteresis", 0.2, half_width=8.0)
    shape = {
        "transition_temperature": 40.0,
        **load_twin("nominal").with_effect("glass_transition").settings["glass_transition"].shape,
    }
    suspected = {"glass_transition": Suspected(0.3, 0.1, shape)}
    return replace(twin, uncertainty=Uncertainty(NAMES, COVARIANCE, "a diagnosis"), suspected=suspected)


def test_a_file_reads_back_as_the_same_twin(tmp_path):
    twin = unsure()
    save_twin(twin, tmp_path / "twin.yaml")
    back = load_twin(tmp_path / "twin.yaml")
    assert twin_dict(back) == twin_dict(twin)
    assert back.uncertainty is not None
    np.testing.assert_allclose(back.uncertainty.covariance, COVARIANCE)


def test_a_covariance_is_in_the_units_in_which_the_file_states_the_values():
    """Variances of 4 min2, 0.25 h2 and 1 ppm2/K2: deviations of 120 s, 1800 s and 1 ppm/degC."""
    values = {
        "schema": "fogml.twin/1",
        "nominal": {"k1": {"value": 3.0, "unit": "ppm/K"}},
        "plant": {"case": {"value": 15.0, "unit": "min"}, "heating": {"steady": 2.0}},
        "effects": {"ageing": {"amplitude": 0.1, "time_constant": {"value": 4.0, "unit": "h"}}},
        "uncertainty": {
            "parameters": ["plant.case", "effects.ageing.time_constant", "nominal.k1", "plant.coil"],
            "covariance": [[4.0, 0.5, 0, 0], [0.5, 0.25, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 9.0]],
        },
    }
    told = load_twin(values).uncertainty
    assert told is not None
    np.testing.assert_allclose(np.sqrt(np.diag(told.covariance)), [120.0, 1800.0, 1.0, 3.0])
    assert told.covariance[0, 1] == pytest.approx(0.5 * 60.0 * 3600.0)


def test_drawn_units_scatter_as_the_covariance_says():
    twin = unsure()
    drawn = [drawn_twin(twin, 3, number) for number in range(1, 801)]
    values = np.array([[parameter_values(one)[name] for name in NAMES] for one in drawn])
    scale = np.sqrt(np.diag(COVARIANCE))
    np.testing.assert_allclose(values.mean(axis=0), [0.0, 8.0, 900.0], atol=4.0 * scale.max() / 28.0)
    np.testing.assert_allclose(
        np.cov(values.T) / np.outer(scale, scale), COVARIANCE / np.outer(scale, scale), atol=0.15
    )
    share = np.mean(["glass_transition" in one.settings for one in drawn])
    assert abs(share - 0.3) < 4.0 * (0.21 / 800) ** 0.5
    assert drawn_twin(twin, 3, 5).settings == drawn[4].settings
    assert drawn[0].uncertainty is None and not drawn[0].suspected


def test_draws_of_units_of_all_sizes_go_together_as_the_covariance_says():
    """Of constants from 1e-7 to 1e3 in size that nearly determine each other, and one known for sure."""
    rng = np.random.default_rng(4)
    size = 10.0 ** rng.uniform(-7.0, 3.0, 12)
    parts = rng.standard_normal((12, 4)) @ rng.standard_normal((4, 12)) + 3e-3 * rng.standard_normal((12, 12))
    unit = parts @ parts.T
    unit /= np.sqrt(np.outer(np.diag(unit), np.diag(unit)))
    covariance = np.zeros((13, 13))
    covariance[:12, :12] = unit * np.outer(size, size)
    unsure = Uncertainty(tuple("abcdefghijklm"), covariance)
    drawn = np.array([list(unsure.drawn(rng).values()) for _ in range(4000)])
    assert (drawn[:, 12] == 0.0).all()
    # Each direction of the units' own, the least varied ones too.
    variances, directions = np.linalg.eigh(unit)
    found = (drawn[:, :12] / size @ directions).var(axis=0)
    assert found / variances == pytest.approx(1.0, abs=0.15)


def test_a_number_that_counts_is_drawn_as_one():
    twin = load_twin("nominal").with_effect("fringe_jump", 2.0)
    twin = replace(twin, uncertainty=Uncertainty(("effects.fringe_jump.amplitude",), np.array([[1.0]])))
    drawn = [drawn_twin(twin, 0, number).settings["fringe_jump"].amplitude for number in range(50)]
    assert all(value == round(value) for value in drawn) and np.std(drawn) > 0.5


def test_what_is_switched_on_is_suspected_no_more():
    twin = unsure().with_effect("glass_transition")
    assert not twin.suspected and "glass_transition" in twin.settings


def test_without_a_covariance_constants_come_from_their_own_deviations():
    drawn = [drawn_twin(load_twin("nominal"), 1, number).nominal for number in range(1, 301)]
    assert np.std([one.b0 for one in drawn]) == pytest.approx(5.0, rel=0.2)
    assert np.corrcoef([one.b0 for one in drawn], [one.b1 for one in drawn])[0, 1] < 0.25


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"uncertainty": {"parameters": ["nominal.b9"], "covariance": [[1.0]]}}, "no parameter 'nominal.b9'"),
        ({"uncertainty": {"parameters": ["nominal.b0"], "covariance": [[-1.0]]}}, "covariance"),
        ({"uncertainty": {"parameters": ["nominal.b0"], "covariance": [[1.0], [2.0]]}}, "rows"),
        ({"suspected": {"ageing": {"amplitude": 0.1}}}, "suspected.ageing.probability"),
        ({"suspected": {"ageing": {"amplitude": 0.1, "probability": 2.0}}}, "between 0 and 1"),
        ({"suspected": {"thermal_hysteresis": {"amplitude": 0.1, "probability": 0.2}}}, "on and suspected"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, change, told):
    path = tmp_path / "mine.yaml"
    plain = replace(unsure(), uncertainty=None, suspected={})
    path.write_text(yaml.safe_dump({**twin_dict(plain), **change}))
    with pytest.raises(InputError, match=f"mine.yaml.*{told}"):
        load_twin(path)


STEPS = ["soak at 25 degC for 30 min", "ramp to 55 degC at 1 degC/min", "soak at 55 degC for 60 min"]
COLUMNS = ["T_chamber", "T_in", "T_out", "T_electronics"]


def test_a_plant_is_fitted_to_what_was_recorded():
    heating = SelfHeating(3.0, 3.0, 900.0)
    constants = ThermalConstants(case=1300.0, case_to_coil=240.0, coil=300.0, electronics=420.0)
    true = replace(load_twin("nominal"), plant=Plant(constants, heating=heating))
    runs = [simulate(STEPS, true, sample_s=20.0, seed=s, columns=COLUMNS).run for s in (1, 2)]
    found = fit_plant(replace(true, plant=Plant(heating=heating)), runs)
    assert found is not None
    assert {"plant.case", "plant.case_to_coil", "plant.coil", "plant.electronics"} <= set(found.names)
    deviations = np.sqrt(np.diag(found.covariance))
    for name, sd in zip(found.names, deviations):
        fitted, truth = (getattr(c, name.removeprefix("plant.")) for c in (found.plant.constants, constants))
        assert abs(np.log(fitted / truth)) < 4.0 * sd < 0.6, name
    assert max(found.misfit_degc.values()) < 0.01  # the sensors' noise is 0.005


def test_a_ripple_of_the_air_is_no_slow_wave_in_a_long_run():
    """One sample in 180 s of a ripple of 181 s would be a wave of nine hours."""
    true = replace(load_twin("nominal"), plant=Plant(heating=SelfHeating(3.0, 3.0, 900.0)))
    steps = [*STEPS, "soak at 55 degC for 1600 min"]
    run = simulate(steps, true, sample_s=20.0, columns=COLUMNS).run
    ripple = 0.5 * np.sin(2.0 * np.pi * run.time / 181.0)
    found = fit_plant(true, [run.with_columns(T_chamber=run.columns["T_chamber"] + ripple)])
    assert found is not None and max(found.misfit_degc.values()) < 0.02
    for name in ("case", "coil", "electronics"):
        fitted, known = (getattr(plant.constants, name) for plant in (found.plant, true.plant))
        assert fitted == pytest.approx(known, rel=0.03), name


def test_where_the_prior_says_more_than_the_runs_they_tell_no_plant():
    twin = replace(load_twin("nominal"), plant=Plant(heating=SelfHeating(3.0, 3.0, 900.0)))
    run = simulate(STEPS, twin, sample_s=60.0, columns=COLUMNS).run
    assert fit_plant(twin, [run], FitSettings(factor=1.0001)) is None


def test_a_plant_is_fitted_through_a_power_cycle_that_leaves_no_rows():
    """What the twin's own sensors are off by is all that may be left of its true plant."""
    true = replace(load_twin("nominal"), plant=Plant(heating=SelfHeating(3.0, 3.0, 900.0)))
    steps = [*STEPS[:2], {STEPS[2]: ["power off for 20 min from minute 10"]}]
    found = fit_plant(true, [simulate(steps, true, sample_s=20.0, columns=COLUMNS).run])
    assert found is not None
    assert max(found.misfit_degc.values()) < 0.01  # 0.7 where it is taken to be on throughout


@pytest.mark.parametrize(
    ("effect", "actions"),
    [
        (None, ["fan off for 15 min"]),
        (None, ["turn at 80 deg/s for 20 min"]),
        (("airflow", 1.0), ["fan off for 15 min"]),
        (("thermal_network", 0.4), []),
    ],
)
def test_a_plant_is_fitted_beside_all_else_that_changes_it(effect, actions):
    """Constants come back as they are: what fan, table and effects do is not in them once more."""
    true = replace(load_twin("tactical"), settings={}, sensors=load_twin("nominal").sensors)
    true = true if effect is None else true.with_effect(*effect)
    steps = [STEPS[0], {STEPS[1]: actions}, STEPS[2]]
    run = simulate(steps, true, sample_s=20.0, columns=[*COLUMNS, "fan", "rate", "angle"]).run
    found = fit_plant(true, [run])
    for name in ("case", "case_to_coil", "coil", "electronics"):
        fitted, known = (getattr(plant.constants, name) for plant in (found.plant, true.plant))
        assert fitted == pytest.approx(known, rel=0.02), name
    assert max(found.misfit_degc.values()) < 0.01


def test_power_that_is_drawn_or_tried_is_one_that_a_unit_can_have():
    """Up to the most that a twin file may state, the power right after switching on too."""
    hot = replace(load_twin("nominal"), plant=Plant(heating=SelfHeating(900.0, 950.0)))
    unsure = replace(hot, uncertainty=Uncertainty(("plant.heating.steady",), np.array([[400.0**2]])))
    drawn = [drawn_twin(unsure, 0, number).plant.heating for number in range(40)]
    assert max(one.steady_w for one in drawn) == max(one.initial_w for one in drawn) == 1000.0
    assert min(one.steady_w for one in drawn) < 700.0
    tried = _with(hot, {"steady": 5000.0, "time_constant": 1e-3, "case": 1e9}).plant
    assert (tried.heating.steady_w, tried.heating.initial_w, tried.heating.time_constant_s) == (
        1000.0,
        1000.0,
        1.0,
    )
    assert tried.constants.case == 1e6


def test_without_air_or_another_node_no_plant_is_fitted():
    for columns in (["T_in", "T_out"], ["T_chamber"]):
        run = simulate(STEPS, "nominal", sample_s=60.0, columns=columns).run
        assert fit_plant(load_twin("nominal"), [run]) is None


def test_what_can_not_be_on_beside_another_is_drawn_by_neither_card():
    """`shupe_winding` says that it excludes `shupe_pure`; the other card says nothing of it."""
    suspected = {"shupe_pure": Suspected(1.0, 0.5, {})}
    twin = replace(load_twin("nominal").with_effect("shupe_winding", 1.0), suspected=suspected)
    assert set(drawn_twin(twin, 0, 1).settings) == {"shupe_winding"}


def test_a_probability_in_percent_is_not_taken_for_a_share():
    values = twin_dict(unsure())
    values["suspected"]["glass_transition"]["probability"] = {"value": 0.5, "unit": "%"}
    with pytest.raises(InputError, match=r"suspected.glass_transition.probability' has unit '%'"):
        load_twin(values)
