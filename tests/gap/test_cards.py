"""Amplitude, direction and shape of an effect as its card states them, against those that made the data."""

from dataclasses import replace

import numpy as np
import pytest

from fogml.gap.cards import card_of
from fogml.gap.inference import foreseen
from fogml.gap.model import TwinModel
from fogml.gap.settings import STANDARD
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.twin_file import load_twin
from tests.play_operator import play


@pytest.fixture(scope="module")
def field():
    """Ten hours of a cycle, the table turned once an hour by a quarter, fields and duties recorded."""
    time = 20.0 * np.arange(1800)
    hours = time / 3600.0
    temperature = 25.0 + 30.0 * np.sin(2.0 * np.pi * hours / 5.0)
    angle = 90.0 * np.floor(hours)
    turn = np.radians(angle)
    columns = {
        "T_in": temperature,
        "T_out": temperature + 0.5 * np.cos(2.0 * np.pi * hours / 5.0) + 0.3 * np.sin(3.0 * hours),
        "rate": np.gradient(angle, time) * (np.abs(np.gradient(angle, time)) > 0.0),
        "angle": angle,
        "B_x": 20.0 * np.cos(turn),
        "B_y": -20.0 * np.sin(turn),
        "B_z": -40.0 + 5.0 * np.sin(hours),
        "supply": 12.0 + 0.05 * np.sin(2.0 * hours),
    }
    run = Run.from_columns("a", time=time, gyro=np.zeros(len(time)), **columns)
    return foreseen(TwinModel(load_twin("nominal")), [run], NoiseModel(0.005, 0.0, 0.0), STANDARD).field


MADE = (
    ("magnetic", -0.4, {"phase": 309.0, "axial_ratio": 0.4}),
    ("magnetic", 0.4, {"phase": 20.0, "axial_ratio": 0.15}),
    ("azimuthal_gradient", 3.0, {"phase": 130.0}),
    ("polarization_nonreciprocity", 0.4, {"period": 15.0, "phase": 77.0}),
    ("supply_ripple", 3.0, {"ripple": 0.3, "phase": 200.0}),
    ("chamber_pickup", 0.4, {"phase": 100.0}),
    ("chamber_pickup", 0.5, {"phase": 100.0, "period": 95.0}),
    ("hidden_thermal_node", 0.05, {"time_constant": 2326.0}),
    ("thermal_hysteresis", 0.1, {"half_width": 17.1}),
    ("glass_transition", 0.5, {"transition_temperature": 33.7, "width": 3.3, "static_ratio": 0.12}),
)


@pytest.mark.parametrize(("id", "amplitude", "stated"), MADE, ids=[f"{m[0]}{m[1]:+g}" for m in MADE])
def test_sizes_directions_and_shapes_are_those_that_made_the_data(field, id, amplitude, stated):
    """Between the nodes of a grid, too; (A, phi) and (-A, phi + 180 deg) are one."""
    declared = field.setting.scene.candidates[id]
    shape = declared.default_shape("tactical") | stated
    made = field.made(declared, amplitude, shape)
    inside = dict.fromkeys(stated, 0)
    for seed in range(4):
        noise = np.random.default_rng(seed).standard_normal(len(made))
        # A family tells the period that stands out, where there is one: the card is looked for about it.
        lines = {"period": stated["period"]} if "period" in stated else {}
        card = card_of(id, field, replace(field.base, data=made + noise), lines)
        size = card.value.amplitude
        assert abs(abs(size) - abs(amplitude)) < 4.0 * card.amplitude_se
        assert card.amplitude_se < 0.3 * abs(amplitude)
        for name, value in stated.items():
            off = card.value.shape[name] - value
            if name == "phase":
                turned = 180.0 if size * amplitude < 0.0 else 0.0
                off = (off + turned + 180.0) % 360.0 - 180.0
            assert abs(off) < 4.0 * card.shape_se[name]
            inside[name] += abs(off) < 1.645 * card.shape_se[name]
    assert min(inside.values()) >= 2, "of four 90 % intervals fewer hold by chance but once in 270"


def test_a_direction_that_does_not_matter_leaves_a_size_alone():
    """A chamber's pick-up follows the duties of its machines where they are recorded: no period, no phase."""
    time = 10.0 * np.arange(2000)
    heater = (np.sin(2.0 * np.pi * time / 700.0) > 0.4).astype(float)
    temperature = 25.0 + 20.0 * np.sin(2.0 * np.pi * time / time[-1])
    columns = {
        "T_in": temperature,
        "T_out": temperature,
        "heater": heater,
        "compressor": 0.3 * (1.0 - heater),
    }
    run = Run.from_columns("a", time=time, gyro=np.zeros(len(time)), **columns)
    field = foreseen(TwinModel(load_twin("nominal")), [run], NoiseModel(0.005, 0.0, 0.0), STANDARD).field
    declared = field.setting.scene.candidates["chamber_pickup"]
    made = field.made(declared, 0.3, declared.default_shape("tactical"))
    card = card_of("chamber_pickup", field, replace(field.base, data=made), {})
    assert card.value.amplitude == pytest.approx(0.3, rel=1e-3)
    alone = field.base.length(made) ** -1.0
    assert card.amplitude_se == pytest.approx(0.3 * np.hypot(alone, STANDARD.form_error), rel=0.02)


@pytest.mark.parametrize("common", [0.0, 4.0])
def test_turn_on_bias_is_the_deviation_of_constants_whatever_is_common_to_them(common):
    time, sizes = 60.0 * np.arange(400), common + np.array([0.1, -0.2, 0.4, 0.05])
    runs = [
        Run.from_columns(f"r{i}", time=time, gyro=np.zeros(400), T=25.0 + 30.0 * np.sin(time / 3000.0 + i))
        for i in range(len(sizes))
    ]
    held = foreseen(TwinModel(load_twin("nominal")), runs, NoiseModel(0.002, 0.0, 0.0), STANDARD).field
    gaps = [np.full(len(r), size) for r, size in zip(held.setting.scene.fit, sizes)]
    beside = replace(held.base, data=held.whitening.stacked(gaps))
    card = card_of("turn_on_bias", held, beside, {})
    assert card.value.amplitude == pytest.approx(sizes.std(ddof=1), rel=1e-3)
    # Of so few the deviation is known by the chi distribution.
    assert card.amplitude_se == pytest.approx(sizes.std(ddof=1) / np.sqrt(2.0 * 3.0), rel=0.01)


def test_a_shape_is_as_unsure_as_the_place_that_it_is_of():
    """Which face drives a weak hysteresis these runs can't say; its width is another by each."""
    time = 60.0 * np.arange(900)
    outer = 20.0 + 35.0 * np.sin(2.0 * np.pi * time / 16000.0) + 8.0 * np.sin(2.0 * np.pi * time / 43000.0)
    inner = np.interp(time - 700.0, time, outer)
    run = Run.from_columns("a", time=time, gyro=np.zeros(len(time)), T_in=inner, T_out=outer)
    noise = NoiseModel(0.02, 0.0, 0.0)
    field = foreseen(TwinModel(load_twin("nominal")), [run], noise, STANDARD).field
    rows = field.setting.scene.runs[0]
    off = []
    for seed in range(8):
        for share in (0.0, 0.5, 1.0):
            course = np.interp(rows.time_s, time, (1.0 - share) * inner + share * outer)
            made = 0.006 * (play(course, 9.0) - course)
            data = field.whitening.stacked([made])
            data = data + np.random.default_rng(seed).standard_normal(len(data))
            card = card_of("thermal_hysteresis", field, replace(field.base, data=data), {})
            off.append((card.value.shape["half_width"] - 9.0) / card.shape_se["half_width"])
    assert np.mean(np.abs(off) < 1.645) >= 0.8
