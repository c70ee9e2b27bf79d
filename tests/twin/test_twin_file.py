"""Twin files: what ships, that they come back the same, and that every fault names its key."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import asdict, fields, replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from fogml.errors import InputError
from fogml.twin.nominal import NominalConstants
from fogml.twin.plant.coil import CoilEnds, RadialLine
from fogml.twin.plant.heat import Airflow, SelfHeating
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.twin import Twin
from fogml.twin.twin_file import TWIN_FOLDER, load_twin, save_twin, twin_dict, twin_from, twin_names
from fogml.twin.uncertainty import Suspected, Uncertainty

ROOT = Path(__file__).parents[2]


def test_nominal_is_the_stated_one():
    nominal = load_twin("nominal")
    # gap.md: priors normal with mean 0; noise log-normal by a factor of 3 where no static run is given.
    assert asdict(nominal.nominal) == dict.fromkeys(("e0", "k1", "k2", "b0", "b1", "b2", "g", "m"), 0.0)
    assert asdict(nominal.nominal_sd) == {
        "e0": 500.0,
        "k1": 50.0,
        "k2": 0.5,
        "b0": 5.0,
        "b1": 0.05,
        "b2": 5e-4,
        "g": 0.5,
        "m": 2.0,
    }
    assert dict(nominal.noise_factor) == {"N": 3.0, "B": 3.0, "K": 3.0}
    assert nominal.noise.N > 0 and nominal.noise.B > 0 and nominal.noise.K > 0
    assert nominal.noise.Q == nominal.noise.R == 0.0
    assert not nominal.settings


def test_configs_show_the_files_that_ship():
    folder = ROOT / "configs" / "twin"
    assert folder.is_symlink() and not folder.readlink().is_absolute()
    assert folder.resolve() == TWIN_FOLDER.resolve()
    assert set(twin_names()) == {"navigation", "nominal", "tactical"}


@pytest.mark.parametrize("grade", ["tactical", "navigation"])
def test_grades_keep_to_their_ranges(grade):
    twin = load_twin(grade)
    assert twin.grade == grade
    for declared, setting in twin.on:
        low, high = declared.amplitude.range(grade)
        assert low <= abs(setting.amplitude) <= high, declared.id
    n_range = {"tactical": (5e-3, 0.1), "navigation": (2e-4, 3e-3)}[grade]
    assert n_range[0] <= twin.noise.N <= n_range[1]


@pytest.mark.parametrize("name", twin_names())
def test_round_trip(name, tmp_path):
    twin = load_twin(name)
    save_twin(twin, tmp_path / "again.yaml")
    again = load_twin(tmp_path / "again.yaml")
    for part in ("name", "description", "grade", "nominal", "nominal_sd", "noise", "plant", "sensors"):
        assert getattr(again, part) == getattr(twin, part), part
    assert again.surroundings == twin.surroundings
    assert dict(again.settings) == dict(twin.settings)
    assert twin_dict(again) == twin_dict(twin)


def test_everything_that_can_be_stated_comes_back(tmp_path):
    values = twin_dict(load_twin("tactical"))
    values["plant"]["line"] = {"layers": 12, "diffusivity": {"value": 1.5e-7, "unit": "m2/s"}}
    values["sensors"]["single"] = {"T3": {"lag": {"value": 0.5, "unit": "min"}, "reads": {"T_in": 1.0}}}
    twin = twin_from(values)
    assert twin.plant.line is not None and twin.plant.line.layers == 12
    third = twin.sensors.of("T3")
    assert third.lag == 30.0 and third.noise == twin.sensors.common.noise
    save_twin(twin, tmp_path / "t.yaml")
    assert twin_dict(load_twin(tmp_path / "t.yaml")) == twin_dict(twin)


def test_bare_numbers_are_in_the_documented_unit():
    twin = twin_from(
        {"schema": "fogml.twin/1", "nominal": {"b1": 0.02}, "effects": {"ageing": {"amplitude": 1}}}
    )
    assert twin.nominal.b1 == 0.02 and twin.nominal_sd.b1 == 0.05
    assert twin.settings["ageing"].amplitude == 1.0
    assert twin.settings["ageing"].shape["time_constant"] > 0


FAULTS = [
    (("nominal", "b0"), {"value": True}, "'nominal.b0.value': Input should be a valid number"),
    (("sensors", "single"), {"T_tip": {"lag": 3.0}}, "'sensors.single.T_tip' is no temperature's name"),
    (("nominl",), {}, "unknown key 'nominl'; did you mean 'nominal'"),
    (("nominal", "e9"), 1, "unknown key 'nominal.e9'"),
    (("nominal", "e0"), {"value": 1, "unit": "ppb"}, "'nominal.e0' has unit 'ppb'; ppm is needed"),
    (("nominal", "e0"), "abc", "nominal.e0"),
    (("nominal", "e0"), True, "nominal.e0"),
    (("nominal", "e0", "sdd"), 1, "unknown key 'nominal.e0.sdd'; did you mean 'sd'"),
    (("noise", "N"), -1.0, "'noise.N' is -1 deg/sqrt(h), which is not physical"),
    (("noise", "N"), {"value": float("nan")}, "noise.N"),
    (("noise", "N", "factor"), 0.5, "noise.N.factor"),
    (("plant", "case"), {"value": -1, "unit": "min"}, "'plant.case' is -1 min, which is not physical"),
    (("plant", "order"), 0, "plant.order"),
    (("plant", "ordr"), 3, "unknown key 'plant.ordr'; did you mean 'order'"),
    (("plant", "heating", "steady"), {"value": 1, "unit": "kW"}, "'plant.heating.steady' has unit 'kW'"),
    (("plant", "line"), {"layers": 0}, "plant.line.layers"),
    (("sensors", "single"), {"T_in": {"nois": 1}}, "'sensors.single.T_in.nois'; did you mean 'noise'"),
    (("sensors", "single"), {"T_in": {"lag": {"unti": "s"}}}, "single.T_in.lag.unti'; did you mean 'unit'"),
    (("effects", "ageing"), {"amplitude": {"valu": 1}}, "ageing.amplitude.valu'; did you mean 'value'"),
    (("sensors", "single"), {"T3": {"reads": {"T_in": 0.5}}}, "add to 0.5"),
    (("effects", "thermal_hysteresi"), {"amplitude": 1}, "did you mean 'thermal_hysteresis'"),
    (("effects", "ageing"), {"time_constant": 1e5}, "'amplitude' [deg/h] is missing"),
    (("effects", "ageing"), {"amplitude": 1, "time": 1}, "unknown key 'effects.ageing.time'"),
    (
        ("effects", "thermal_hysteresis", "half_width"),
        {"value": 9, "unit": "K"},
        "'effects.thermal_hysteresis.half_width' has unit 'K'; degC is needed",
    ),
    (("effects", "thermal_hysteresis", "half_width"), -9.0, "effects.thermal_hysteresis.half_width"),
    (("schema",), "fogml.twin/2", "schema"),
    (("grade",), "best", "grade"),
]


@pytest.mark.parametrize(
    ("path", "value", "message"), FAULTS, ids=[".".join(f[0]) + str(i) for i, f in enumerate(FAULTS)]
)
def test_a_fault_names_its_key(path, value, message):
    values = copy.deepcopy(twin_dict(load_twin("tactical")))
    place = values
    for key in path[:-1]:
        place = place.setdefault(key, {})
    place[path[-1]] = value
    with pytest.raises(InputError) as raised:
        twin_from(values, "unit.yaml")
    assert str(raised.value).startswith("unit.yaml: ")
    assert message in str(raised.value)


def test_other_faults(tmp_path):
    with pytest.raises(InputError, match="no such twin"):
        load_twin("nominl")
    path = tmp_path / "list.yaml"
    path.write_text(yaml.safe_dump([1, 2]))
    with pytest.raises(InputError, match=r"list\.yaml: a twin file holds"):
        load_twin(path)
    with pytest.raises(InputError, match="nothing is given for 'schema'"):
        twin_from({"name": "x"})
    with pytest.raises(InputError, match="unknown key 'effcts'; did you mean 'effects'"):
        twin_from({"effcts": {}})


def test_effects_that_exclude_each_other():
    with pytest.raises(InputError, match="can't be on at the same time"):
        Twin().with_effect("arw_physics").with_effect("angle_random_walk")


BESIDE = {
    "plant.line": RadialLine(),
    "plant.ends": CoilEnds(),
    "plant.heating": SelfHeating(5.0, 8.0),
    "plant.airflow": Airflow(0.5, 0.5),
}


SECTIONS = (
    *("nominal", "nominal_sd", "noise", "coil", "receiver", "plant", "plant.constants", "plant.heating"),
    *("plant.airflow", "plant.line", "plant.ends", "sensors.common", "surroundings"),
)


@pytest.mark.parametrize("section", SECTIONS)
def test_what_makes_a_twin_in_python_comes_back_from_its_file(section, tmp_path):
    """A value is refused where it is given, or its file reads back as the same twin."""
    twin, path = load_twin("nominal"), tmp_path / "twin.yaml"
    outer, _, inner = section.partition(".")
    whole = getattr(twin, outer)
    held = BESIDE.get(section) or (getattr(whole, inner) if inner else whole)
    refused = 0
    for entry in fields(held):
        if not isinstance(getattr(held, entry.name), int | float):
            continue
        for value in (math.nan, math.inf, -1.0, 0.0, 1e-9, 1e9, 1e300, -1e300):
            try:
                changed = replace(held, **{entry.name: value})
                made = replace(twin, **{outer: replace(whole, **{inner: changed}) if inner else changed})
            except InputError:
                refused += 1
                continue
            save_twin(made, path)
            assert twin_dict(load_twin(path)) == twin_dict(made), (entry.name, value)
    assert refused


@pytest.mark.parametrize(
    "change, message",
    [
        ({"noise_factor": {"M": 2.0}}, "noise: 'factor' of .*terms are Q, N, B, K, R"),
        ({"noise_factor": {"N": 0.5}}, "'N': 'factor' is 0.5"),
        ({"noise_factor": {"N": math.nan}}, "'N': 'factor' is nan"),
        ({"grade": "lunar"}, "grade is 'lunar'"),
        ({"nominal_sd": NominalConstants(b0=-1.0)}, "'sd' of 'b0' is -1"),
        ({"nominal": NominalConstants(g=-2e9)}, "nominal: 'g' is -2e\\+09 .*not physical"),
    ],
)
def test_what_no_file_can_hold_is_refused_in_python_too(change, message):
    with pytest.raises(InputError, match=message):
        Twin(**change)
    with pytest.raises(InputError, match="add to nan"):
        SensorErrors(reads={"T_in": math.nan})
    with pytest.raises(InputError, match="zz' is no temperature"):
        Sensors(single={"zz": SensorErrors()})
    with pytest.raises(InputError, match="a covariance of 1 rows"):
        Uncertainty(("nominal.b0",), np.array([[math.inf]]))


def test_an_effect_that_goes_takes_its_uncertainty_along(tmp_path):
    names = ("nominal.b0", "effects.sensor_lag.amplitude", "plant.case")
    covariance = np.array([[4.0, 0.1, 3.0], [0.1, 1.0, 0.2], [3.0, 0.2, 9.0]])
    twin = replace(Twin().with_effect("sensor_lag"), uncertainty=Uncertainty(names, covariance))
    save_twin(twin.without_effect("sensor_lag"), tmp_path / "twin.yaml")
    left = load_twin(tmp_path / "twin.yaml").uncertainty
    assert left.names == ("nominal.b0", "plant.case")
    np.testing.assert_array_equal(left.covariance, [[4.0, 3.0], [3.0, 9.0]])


def test_a_suspected_effect_has_its_usual_shape_unless_stated(tmp_path):
    id = "thermal_hysteresis"
    twin = replace(Twin(), suspected={id: Suspected(0.3, 0.1, {})})
    save_twin(twin, tmp_path / "twin.yaml")
    assert load_twin(tmp_path / "twin.yaml").suspected[id] == twin.suspected[id]
    assert twin.suspected[id].shape == Twin().with_effect(id).settings[id].shape


def test_a_twin_is_never_changed_in_place():
    twin = load_twin("tactical")
    changed = twin.with_effect("ageing", 0.1, time_constant=7200.0).with_nominal(b0=3.0).with_noise(N=0.5)
    assert "ageing" not in twin.settings and twin.nominal.b0 != 3.0 and twin.noise.N != 0.5
    assert changed.settings["ageing"].shape == {"time_constant": 7200.0}
    kept = changed.with_effect("ageing", 0.2)
    assert kept.settings["ageing"].shape == {"time_constant": 7200.0}
    assert "ageing" not in kept.without_effect("ageing").settings
    with pytest.raises(InputError, match="'moisture' is not on"):
        twin.without_effect("moisture")
    with pytest.raises(TypeError):
        twin.settings["ageing"] = changed.settings["ageing"]


def test_numbers_of_numpy_make_a_twin_and_its_file(tmp_path):
    """As means of recordings and loops over ranges give them."""
    twin = load_twin("nominal").with_nominal(b0=np.mean([1.0, 2.0])).with_noise(N=np.float64(0.02))
    twin = twin.with_effect("deadband", np.int64(2)).with_effect("sensor_lag", np.float32(30.0))
    save_twin(twin, tmp_path / "twin.yaml")
    back = load_twin(tmp_path / "twin.yaml")
    assert (back.nominal.b0, back.noise.N) == (1.5, 0.02)
    assert [setting.amplitude for setting in back.settings.values()] == [2.0, 30.0]


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "3", True])
def test_a_constant_is_a_finite_number(value):
    with pytest.raises(InputError, match="a number in deg/h is needed"):
        load_twin("nominal").with_nominal(b0=value)


def test_an_output_of_reversed_sign_is_a_twin_and_comes_back(tmp_path):
    path = tmp_path / "twin.yaml"
    save_twin(Twin(nominal=NominalConstants(e0=-2e6)), path)
    assert load_twin(path).nominal.e0 == -2e6


@pytest.mark.parametrize("again", [copy.deepcopy, lambda twin: pickle.loads(pickle.dumps(twin))])
def test_a_twin_is_copied_and_pickled_and_stays_read_only(again):
    twin = replace(load_twin("tactical"), suspected={"moisture": Suspected(0.3, 0.1, {})})
    held = again(twin)
    assert twin_dict(held) == twin_dict(twin)
    with pytest.raises(TypeError):
        held.settings["ageing"] = twin.suspected["moisture"]
