"""The catalogue's index: built-in effects, effects by hand, effects of other packages."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fogml.twin.effects
from fogml.errors import InputError
from fogml.twin import registry
from fogml.twin.effect import BiasEffect
from fogml.twin.effect_guard import unguard
from fogml.twin.effects.shupe import ShupePure
from fogml.twin.effects.unit import Ageing
from fogml.twin.inputs import Inputs
from tests.outside import in_new_process

OUTSIDE = Path(__file__).parent / "outside_package"
# The head of the catalogue: what a diagnosis offers unless told otherwise, noise terms aside.
CANDIDATES = [
    "warmup_bias",
    "shupe_pure",
    "shupe_mohr",
    "temperature_rate_product",
    "thermal_hysteresis",
    "stress_relaxation",
    "hidden_thermal_node",
    "glass_transition",
    "polarization_nonreciprocity",
    "bias_polynomial",
    "ageing",
    "chamber_pickup",
    "magnetic",
    "source_wavelength",
    "halfwave_voltage",
    "sf_nonlinearity",
    "sf_asymmetry",
    "sf_hysteresis",
    "deadband",
    "sensor_lag",
    "sensor_quantisation",
    "sensor_placement",
    "logger_skew",
    "mount_tilt",
    "earth_rate",
    "input_axis_misalignment",
    "table_rate_error",
    "moisture",
    "supply_ripple",
    "pigtail_shupe",
    "azimuthal_gradient",
    "thermal_shock",
    "electronic_crosstalk",
    "turn_on_bias",
    "vibration_rectification",
    "coil_expansion",
]


class Borrowed(ShupePure):
    id = "borrowed"
    code = "Z9"


@pytest.fixture
def borrowed() -> Iterator[type[Borrowed]]:
    registry.register(Borrowed)
    yield Borrowed
    if "borrowed" in registry.effects():
        registry.unregister("borrowed")


def test_each_module_of_the_catalogue_holds_effects() -> None:
    folder = Path(fogml.twin.effects.__path__[0])
    modules = {f"fogml.twin.effects.{path.stem}" for path in folder.glob("[a-z]*.py")}
    assert modules == {type(held).__module__ for held in registry.effects().values()} - {__name__}


def test_order_is_that_of_the_letter_codes() -> None:
    ids = list(registry.effects())
    wanted = ["shupe_pure", "shupe_mohr", "thermal_hysteresis", "thermal_shock", "bias_polynomial", "ageing"]
    assert sorted(wanted, key=ids.index) == wanted  # B1 B3 B8 B10 C1 C10


def test_bias_effects_offered_to_a_diagnosis_are_those_of_the_catalogues_head() -> None:
    bias = {id for id, held in registry.effects().items() if held.code[0] in "BC" and held.code[1:].isdigit()}
    offered = {id for id in bias if registry.effect(id).candidate}
    assert offered == bias & set(CANDIDATES)
    assert len(bias) == 28


def test_codes_name_one_effect_each() -> None:
    codes = [held.code for id, held in registry.effects().items() if held.code[0] in "BC"]
    assert len(set(codes)) == len(codes)


def test_effects_are_found_by_id() -> None:
    assert isinstance(registry.effect("ageing"), Ageing)


@pytest.mark.parametrize(
    ("asked", "named"),
    [("shupe_pur", "shupe_pure"), ("hysteresis", "thermal_hysteresis"), ("aging", "ageing")],
)
def test_an_unknown_id_names_near_ones(asked: str, named: str) -> None:
    with pytest.raises(InputError, match=f"no effect '{asked}'; did you mean .*'{named}'"):
        registry.effect(asked)


def test_an_id_like_no_other_says_where_to_look() -> None:
    with pytest.raises(InputError, match="no effect 'qqqq'; `fogml effects` lists them"):
        registry.effect("qqqq")


def test_the_returned_catalogue_is_a_copy() -> None:
    registry.effects().clear()
    assert "ageing" in registry.effects()


def test_register_and_unregister(borrowed: type[Borrowed]) -> None:
    assert isinstance(registry.effect("borrowed"), Borrowed)
    with pytest.raises(InputError, match="'borrowed' already"):
        registry.register(Borrowed())
    registry.unregister("borrowed")
    with pytest.raises(InputError, match="no effect 'borrowed'"):
        registry.unregister("borrowed")


def test_register_decorates() -> None:
    class Passing(ShupePure):
        id = "passing"

    try:
        assert registry.register(Passing) is Passing
    finally:
        registry.unregister("passing")


class Abstract(BiasEffect):
    id = "abstract"


class Incomplete(BiasEffect):
    id = "incomplete"

    def signature(self, inputs, **shape):  # type: ignore[no-untyped-def]
        return inputs.time


class Misnamed(ShupePure):
    id = "Bad-Id"


class Misplaced(ShupePure):
    id = "misplaced"
    stage = "nowhere"  # type: ignore[assignment]


class Unmeasured(ShupePure):
    id = "unmeasured"
    amplitude = 3.0  # type: ignore[assignment]


def _stating(**more: Any) -> type[ShupePure]:
    return type("Stating", (ShupePure,), {"id": "stating"} | more)


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        (Abstract, "Abstract does not define signature"),
        (Incomplete, "Incomplete does not state 'code'"),
        (Misnamed, "id 'Bad-Id' must be lower-case words"),
        (Misplaced, "in stage 'nowhere'; stages are thermal"),
        (Unmeasured, "amplitude of effect 'unmeasured' must be a Quantity"),
        (dict, "is no effect"),
        (_stating(needs="T"), "'needs' is a tuple of texts"),
        (_stating(shape=(3.0,)), "'shape' is a tuple of Quantity"),
        (_stating(told_by="supply"), "'told_by' is a tuple of groups of columns"),
        (_stating(told_by=("supply",)), "'told_by' is a tuple of groups of columns"),
        (_stating(amplitudes=(0.0,)), "'amplitudes' is a tuple of numbers other than 0"),
    ],
)
def test_what_is_no_whole_effect_is_refused(declared: type, message: str) -> None:
    before = set(registry.effects())
    with pytest.raises(InputError, match=message):
        registry.register(declared)
    assert set(registry.effects()) == before


def test_an_outside_package_adds_an_effect_that_keeps_the_contract(tmp_path: Path) -> None:
    points = tomllib.loads((OUTSIDE / "pyproject.toml").read_text())["project"]["entry-points"]
    text = "".join(
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in entries.items())
        for group, entries in points.items()
    )
    code = (
        "from fogml.testing import check_effect; from fogml.twin.registry import effect, effects\n"
        "check_effect(effect('stray_light')); print(list(effects())[-1], 'ageing' in effects())"
    )
    assert in_new_process(tmp_path, OUTSIDE, text, code) == "stray_light True"


@pytest.mark.parametrize(
    ("point", "message"),
    [
        ("stray_light = fogml_stray_light:Nothing", "'stray_light' of fogml-stray-light in group"),
        ("ageing = fogml.twin.effects.unit:Ageing", "there is an effect 'ageing' already"),
        ("floats = fogml.runs.run:FloatArray", "is no effect"),
    ],
)
def test_a_faulty_outside_effect_is_named(tmp_path: Path, point: str, message: str) -> None:
    code = (
        "from fogml.errors import InputError; from fogml.twin.registry import effects\n"
        "for attempt in range(2):\n"
        "    try: effects()\n"
        "    except InputError as error: print(error)\n"
    )
    said = in_new_process(tmp_path, OUTSIDE, f"[fogml.effects]\n{point}\n", code).splitlines()
    assert len(said) == 2 and all(message in line for line in said)


class _Foreign(BiasEffect):
    id, code, title, stage = "foreign", "X9", "Foreign", "bias"
    amplitude = ShupePure.amplitude

    def __init__(self, made: Any) -> None:
        self.made = made

    def signature(self, inputs: Any, **shape: float) -> Any:
        return self.made(inputs, **shape)


@contextmanager
def _foreign(made: Any) -> Iterator[BiasEffect]:
    registry.register(_Foreign(made))
    try:
        yield registry.effect("foreign")  # type: ignore[misc]
    finally:
        registry.unregister("foreign")


def _moves(inputs: Any) -> Any:
    warm = inputs.temperature("T")
    warm += 1.0
    return warm


@pytest.mark.parametrize(
    ("signature", "message"),
    [
        (lambda inputs: 1.0 / 0.0, r"ends in ZeroDivisionError: .*test_registry.py, line \d+"),
        (lambda inputs: inputs.drives["none"], "ends in KeyError: 'none'"),
        (lambda inputs: np.where(inputs.time > 100.0, np.nan, 1.0), "gives nan at sample 12; finite"),
        (lambda inputs: np.zeros(3), r"gives shape \(3,\); \(30,\), one number a sample"),
        (lambda inputs: np.zeros((len(inputs.time), 2)), r"gives shape \(30, 2\)"),
        (lambda inputs: None, "gives NoneType of object; real numbers"),
        (lambda inputs: 1j * inputs.time, "real numbers"),
        (_moves, "read-only"),
    ],
)
def test_what_an_effect_of_a_package_gives_amiss_is_told_by_its_name(signature: Any, message: str) -> None:
    inputs = Inputs(10.0 * np.arange(30), {"T": np.full(30, 20.0)}, np.zeros(30))
    made = _foreign(lambda inputs, **shape: signature(inputs))
    with made as foreign, pytest.raises(InputError, match=message) as told:
        foreign.response(inputs)
    assert str(told.value).startswith("effect 'foreign' (")
    assert inputs.temperature("T").flags.writeable


def test_what_an_effect_of_a_package_gives_well_is_left_as_it_is() -> None:
    inputs = Inputs(10.0 * np.arange(3), {"T": np.array([19.0, 21.0, 22.0])}, np.zeros(3))
    with _foreign(lambda inputs, **shape: 2.0 if shape else inputs.temperature("T") > 20.0) as foreign:
        assert foreign.response(inputs).tolist() == [0.0, 1.0, 1.0]
        assert foreign.response(inputs, width=1.0) == 2.0
        assert copy.deepcopy(foreign).response(inputs).tolist() == [0.0, 1.0, 1.0]
        assert unguard(copy.copy(foreign)).response(inputs).dtype == np.bool_
    assert "signature" not in vars(registry.effect("ageing"))
