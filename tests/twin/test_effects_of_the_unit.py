"""What follows from a unit's own coil, receiver and light, against plain integration and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.twin.effect import NoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.noise import NoiseConstants
from fogml.twin.optics import Coil, Light, Receiver
from fogml.twin.plant.coil import CoilEnds, with_ends
from fogml.twin.plant.network import ThermalNetwork
from fogml.twin.plant.standard import standard_network
from fogml.twin.registry import effect
from fogml.twin.replay import replay
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin, save_twin, twin_from

TIME = np.arange(0.0, 1500.0, 1.0)
ON = ["soak at 25 degC for 5 min", "ramp to 45 degC at 2 degC/min", "soak at 45 degC for 20 min"]


def behind(lag_s: float) -> FloatArray:
    """A face that is `lag_s` behind a ramp of 1 degC/min."""
    return 25.0 + (TIME - lag_s * -np.expm1(-TIME / lag_s)) / 60.0


@lru_cache(maxsize=1)
def layer_rates(count: int, per_s: float) -> FloatArray:
    """Rates of layers between the faces [degC/s], by plain steps of time; shape (n, count)."""
    inner, outer, now = behind(240.0), behind(120.0), np.full(count, 25.0)
    layers, steps = np.full((len(TIME), count), 25.0), 20
    dt = (TIME[1] - TIME[0]) / steps
    for row in range(1, len(TIME)):
        for part in range(steps):
            share = (part + 0.5) / steps
            now[0] = inner[row - 1] + share * (inner[row] - inner[row - 1])
            now[-1] = outer[row - 1] + share * (outer[row] - outer[row - 1])
            now[1:-1] += dt * per_s * (now[2:] - 2.0 * now[1:-1] + now[:-2])
        now[0], now[-1] = inner[row], outer[row]
        layers[row] = now
    return np.diff(layers, axis=0, prepend=layers[:1]) / (TIME[1] - TIME[0])


def plain_winding(halves: str, coil: Coil) -> FloatArray:
    """Shupe's integral by hand, the fibre of each layer in 20 pieces [deg/h], shape (n,)."""
    count = len(halves)
    rates = layer_rates(count, coil.diffusivity / coil.pitch**2)
    # The fibre's middle lies inside; each half winds its own layers, one after the other, outwards.
    piece, total = coil.length / count, np.zeros(len(TIME))
    wound = {"A": 0, "B": 0}
    for layer, half in enumerate(halves):
        from_middle = wound[half] * piece + (np.arange(20) + 0.5) * piece / 20.0
        wound[half] += 1
        z = 0.5 * coil.length + (from_middle if half == "B" else -from_middle)
        total += np.sum(2.0 * z - coil.length) * piece / 20.0 * rates[:, layer]
    c_t = coil.index_slope + coil.index * coil.expansion
    return np.degrees(coil.index * c_t / (coil.length * coil.diameter) * total) * 3600.0


@pytest.mark.parametrize(
    ("winding", "halves"), [("dipole", "AB" * 4), ("quadrupole", "ABBA" * 2), ("octupole", "ABBABAAB")]
)
def test_winding_is_shupes_integral_over_its_layers(winding: str, halves: str) -> None:
    coil = Coil(700.0, 0.07, winding=winding, layers=8, diffusivity=2e-8)  # type: ignore[arg-type]
    inner, outer = behind(240.0), behind(120.0)
    given = Inputs(TIME, {"T_in": inner, "T_out": outer}, np.zeros(len(TIME)), coil=coil, rate_window_s=0.0)
    found = effect("shupe_winding").signature(given)
    wanted = plain_winding(halves, coil)
    assert np.abs(wanted).max() > 1e-3
    assert found == pytest.approx(wanted, abs=0.01 * np.abs(wanted).max())
    # Nothing of it at the end of a long ramp.
    assert abs(found[-1]) < 0.02 * np.abs(found).max()


@pytest.mark.parametrize(("lead_1", "lead_2"), [(0.5, 0.3), (0.5, 0.0), (0.0, 0.3)])
def test_leads_of_the_coil_are_shupes_integral_over_all_of_the_fibre(lead_1: float, lead_2: float) -> None:
    """Coil and leads each at a rate of its own: the fibre in pieces of 1 mm, lead 2 first and lead 1 last."""
    first, second, common = 1.0 / 60.0, 0.4 / 60.0, 0.7 / 60.0
    coil, length = Coil(lead_1=lead_1, lead_2=lead_2), 1000.0 + lead_1 + lead_2
    z = np.linspace(0.0, length, round(1e3 * length) + 1)
    rate = np.where(z < lead_2, second, np.where(z > length - lead_1, first, common))
    c_t = coil.index_slope + coil.index * coil.expansion
    total = np.sum((2.0 * z - length) * rate) * (z[1] - z[0])
    wanted = np.degrees(coil.index * c_t / (length * 0.1) * total) * 3600.0
    time = np.arange(600.0)
    nodes = dict.fromkeys(("T", "T_in", "T_out"), 25.0 + common * time)
    nodes |= {"T_electronics": 25.0 + first * time, "T_case": 25.0 + second * time}
    given = Inputs(time, nodes, np.zeros(600), coil=coil, rate_window_s=0.0)
    found = effect("shupe_winding").signature(given.afresh())
    assert found[-1] == pytest.approx(wanted, rel=5e-3)
    if lead_1:
        pigtail = effect("pigtail_shupe").signature(given, length_ratio=lead_2 / lead_1)
        assert found[-1] == pytest.approx(lead_1 * pigtail[-1])
    # A rate common to all of it gives nothing.
    alike = replace(given.afresh(), temperatures=dict.fromkeys(nodes, 25.0 + first * time), cache={})
    assert abs(effect("shupe_winding").signature(alike)[-1]) < 1e-6


def test_winding_is_a_fact_of_the_twin_and_replays(tmp_path) -> None:
    bare = replace(load_twin("tactical"), settings={}, sensors=Twin().sensors, noise=NoiseConstants())
    peaks = {}
    for winding in ("dipole", "quadrupole"):
        twin = replace(bare, coil=Coil(winding=winding)).with_effect("shupe_winding", 1.0)  # type: ignore[arg-type]
        save_twin(twin, tmp_path / "twin.yaml")
        again = load_twin(tmp_path / "twin.yaml")
        assert again.coil == twin.coil and again.receiver == twin.receiver
        made = simulate(ON, twin, sample_s=2.0, truth=True)
        assert replay(again, made.run) == pytest.approx(made.run.gyro, abs=1e-9)
        peaks[winding] = np.abs(made.truth.contributions["shupe_winding"]).max()
    assert 4.0 < peaks["dipole"] / peaks["quadrupole"] < 12.0


def test_winding_and_layers_have_to_fit() -> None:
    stated = {"schema": "fogml.twin/1", "coil": {"winding": "quadrupole", "layers": 30}}
    with pytest.raises(InputError, match="multiple of 4 layers, not 30"):
        twin_from(stated)
    with pytest.raises(InputError, match=r"coil\.winding.*'cylinder'"):
        twin_from({"schema": "fogml.twin/1", "coil": {"winding": "bifilar"}})
    with pytest.raises(InputError, match=r"receiver\.resistance' is 0 ohm"):
        twin_from({"schema": "fogml.twin/1", "receiver": {"resistance": 0.0}})


def at(electronics: float, light: Light | None = None, **changes: object) -> Inputs:
    count = 50
    given = Inputs(
        0.1 * np.arange(count),
        {"T_electronics": np.full(count, electronics)},
        np.zeros(count),
        light=light or Light(),
        drives={"supply": np.full(count, 28.0)},
    )
    return replace(given, **changes)  # type: ignore[arg-type]


def test_light_feeds_noise_gain_and_crosstalk_at_the_same_temperature() -> None:
    """2 dB per 100 degC and 0.03 dB/degC make 2.5 dB at 75 degC, and 0.5 dB at -25 degC."""
    course = {"power_loss": 0.03, "power_slope": -2.0}
    twin = Twin().with_effect("light_power", 0.4, **course)
    for electronics, lost_db in ((75.0, 2.5), (-25.0, 0.5), (25.0, 0.0)):
        more = 10.0 ** (0.1 * lost_db)
        dim, full = at(electronics, twin.light), at(electronics)
        found = effect("light_power").signature(dim, **course)
        assert found == pytest.approx(more - 1.0)
        noise = effect("arw_physics")
        assert isinstance(noise, NoiseEffect)
        shape = {"power": 20.0, "modulation_depth": 0.5 * math.pi, "power_loss": 0.04}
        # By hand: shot, thermal and excess noise of what is left of 20 uW.
        current = 0.5 * 0.9 * 20e-6 / more
        rin = 2.0 * math.sqrt(2.0 * math.log(2.0) / math.pi) * 1550e-9**2 / (299_792_458.0 * 10e-9)
        density = 2.0 * 1.602176634e-19 * current + 4.0 * 1.380649e-23 * 300.0 / 1e5 + current**2 * rin
        sagnac = 2.0 * math.pi * 1000.0 * 0.1 / (1550e-9 * 299_792_458.0)
        walk = math.sqrt(0.5 * density) / current / sagnac * math.degrees(1.0) * 60.0
        assert noise.strength(dim, **shape) == pytest.approx(walk, rel=1e-9)
        leak = {"supply_ratio": 0.0}
        crosstalk = effect("electronic_crosstalk")
        assert crosstalk.signature(dim, **leak) == pytest.approx(more * crosstalk.signature(full, **leak))
        assert effect("kerr").signature(dim, power_coefficient=-0.05) == pytest.approx(1.0 / more)
        loop, ramp = effect("loop_gain"), 5.0 * at(electronics).time
        slow = loop.signature(dim.with_output(ramp), power_slope=-0.5, leak_time=1e12)
        assert slow[1:] == pytest.approx(-5.0 * more)


def test_each_states_its_own_light_where_the_unit_does_not() -> None:
    assert Twin().light.power_loss is None
    noise, shape = effect("arw_physics"), {"power": 20.0, "modulation_depth": 1.57}
    assert isinstance(noise, NoiseEffect)
    lossy = noise.strength(at(75.0), power_loss=0.04, **shape)
    assert np.all(lossy > noise.strength(at(75.0), power_loss=0.0, **shape))


def test_receiver_is_a_fact_of_the_twin() -> None:
    """Under much light excess noise leads: 1 / sqrt(line width); a larger resistor has less thermal noise."""
    noise = effect("arw_physics")
    assert isinstance(noise, NoiseEffect)
    shape = {"power": 1e6, "modulation_depth": 1.57, "power_loss": 0.0}
    narrow, wide = (at(25.0, Light(Receiver(line_width=width))) for width in (10e-9, 40e-9))
    assert noise.strength(narrow, **shape) == pytest.approx(2.0 * noise.strength(wide, **shape), rel=1e-5)
    twin = twin_from({"schema": "fogml.twin/1", "receiver": {"line_width": {"value": 40, "unit": "nm"}}})
    assert twin.light.receiver.line_width == pytest.approx(40e-9)


def test_light_replays() -> None:
    twin = replace(load_twin("tactical"), settings={}, sensors=Twin().sensors, noise=NoiseConstants())
    twin = twin.with_effect("light_power").with_effect("electronic_crosstalk").with_effect("loop_gain")
    made = simulate(ON, twin, sample_s=2.0)
    assert replay(twin, made.run) == pytest.approx(made.run.gyro, abs=1e-8)
    # What it makes of the others is part of the difference that it makes.
    alone = replay(twin.without_effect("electronic_crosstalk"), made.run, only="light_power")
    assert np.abs(replay(twin, made.run, only="light_power") - alone).max() > 1e-3


def test_two_periods_beat_as_product_of_sum_and_difference() -> None:
    u = np.linspace(-50.0, 50.0, 1001)
    given = Inputs(np.arange(1001.0), {"T_electronics": 25.0 + u}, np.zeros(1001))
    shape = {"period": 10.0, "second_period": 4.0, "second_share": 0.5, "phase": 0.0, "second_phase": 0.0}
    found = effect("polarization_two_periods").signature(given, **shape)
    mean, half = 0.5 * (0.1 + 0.25), 0.5 * (0.25 - 0.1)
    assert found == pytest.approx(np.sin(2.0 * np.pi * mean * u) * np.cos(2.0 * np.pi * half * u), abs=1e-9)
    alone = {key: shape[key] for key in ("period", "phase")}
    for share, one in ((0.0, {}), (1.0, {"period": 4.0})):
        wanted = effect("polarization_nonreciprocity").signature(given, **(alone | one))
        found = effect("polarization_two_periods").signature(given, **(shape | {"second_share": share}))
        assert found == pytest.approx(wanted, abs=1e-12)


def test_ends_of_the_coil_follow_their_equations() -> None:
    """Case, two faces, plate and both ends, in plain steps of time."""
    plain = ThermalNetwork(
        {"T_case": 400.0, "T_out": 60.0, "T_in": 60.0, "T_plate": 3000.0},
        {
            ("T_chamber", "T_case"): 0.5,
            ("T_chamber", "T_plate"): 1.2,
            ("T_case", "T_out"): 0.3,
            ("T_out", "T_in"): 0.4,
        },
    )
    ends = CoilEnds(share=0.1, across=250.0, top=800.0, bottom=200.0)
    network = with_ends(plain, ends)
    assert sum(network.capacities.values()) == pytest.approx(sum(plain.capacities.values()))
    time = np.arange(0.0, 3000.0, 5.0)
    air = 25.0 + np.minimum(time, 1200.0) / 60.0
    found = network.temperatures(time, air)
    case = face_out = face_in = plate = top = bottom = 25.0
    dt, tops, bottoms = 0.5, [25.0], [25.0]
    for row in range(1, len(time)):
        for part in range(10):
            chamber = air[row - 1] + (part + 0.5) / 10.0 * (air[row] - air[row - 1])
            up, down = 12.0 * (case - top) / 800.0, 12.0 * (plate - bottom) / 200.0
            to_top_out, to_top_in = 6.0 * (face_out - top) / 250.0, 6.0 * (face_in - top) / 250.0
            to_bottom_out, to_bottom_in = (6.0 * (face - bottom) / 250.0 for face in (face_out, face_in))
            across, inward = 0.3 * (case - face_out), 0.4 * (face_out - face_in)
            case += dt * (0.5 * (chamber - case) - across - up) / 400.0
            plate += dt * (1.2 * (chamber - plate) - down) / 3000.0
            face_out += dt * (across - inward - to_top_out - to_bottom_out) / 48.0
            face_in += dt * (inward - to_top_in - to_bottom_in) / 48.0
            top += dt * (up + to_top_out + to_top_in) / 12.0
            bottom += dt * (down + to_bottom_out + to_bottom_in) / 12.0
        tops.append(top)
        bottoms.append(bottom)
    assert found["T_top"] == pytest.approx(np.array(tops), abs=0.01)
    assert found["T_bottom"] == pytest.approx(np.array(bottoms), abs=0.01)


def test_ends_alike_have_no_gradient_and_a_long_ramp_shows_none() -> None:
    alike = with_ends(standard_network(order=5), CoilEnds(top=400.0, bottom=400.0))
    time = np.arange(0.0, 40_000.0, 20.0)
    nodes = alike.temperatures(time, 25.0 + time / 600.0)
    assert nodes["T_top"] == pytest.approx(nodes["T_bottom"], abs=1e-10)
    apart = with_ends(standard_network(order=6), CoilEnds())
    nodes = apart.temperatures(time, 25.0 + time / 600.0)
    given = Inputs(time, nodes, np.zeros(len(time)), rate_window_s=0.0)
    found = effect("axial_gradient").signature(given)
    assert np.abs(found).max() > 0.01 and abs(found[-1]) < 1e-4 * np.abs(found).max()
    with pytest.raises(InputError, match="order 3 or more"):
        with_ends(standard_network(order=2), CoilEnds())


def test_axial_gradient_brings_its_nodes_and_replays() -> None:
    twin = replace(load_twin("tactical"), settings={}, sensors=Twin().sensors, noise=NoiseConstants())
    assert "T_top" not in twin.network.names
    twin = twin.with_effect("axial_gradient", 0.5)
    made = simulate(ON, twin, sample_s=2.0, truth=True)
    assert {"T_top", "T_bottom"} <= set(made.truth.nodes)
    assert np.abs(made.truth.contributions["axial_gradient"]).max() > 0.05
    assert replay(twin, made.run) == pytest.approx(made.run.gyro, abs=1e-5)
    stated = replace(twin, plant=replace(twin.plant, ends=CoilEnds(top=300.0, bottom=299.0)))
    assert np.abs(replay(stated, made.run, only="axial_gradient")).max() != pytest.approx(
        np.abs(replay(twin, made.run, only="axial_gradient")).max(), rel=0.1
    )


def test_a_noise_stated_as_a_number_is_said_not_to_follow_the_light() -> None:
    twin = Twin(noise=NoiseConstants(N=0.01))
    assert twin.notes == ()
    (dimmed,), (doubled,) = twin.with_effect("light_power").notes, twin.with_effect("arw_physics").notes
    assert "N = 0.01 deg/sqrt(h) stays as it is" in dimmed and "'arw_physics' in its place" in dimmed
    assert "comes on top of the photon noise" in doubled
    assert Twin().with_effect("light_power").with_effect("arw_physics").notes == ()
