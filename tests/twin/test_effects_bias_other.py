"""Bias effects that are static in temperature or driven otherwise, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import bisect

from fogml.arrays import FloatArray
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.optics import Coil
from fogml.twin.registry import effect
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin

N = 3600
TIME = np.arange(float(N))


def inputs(temperature: FloatArray | None = None, **changes: object) -> Inputs:
    held = np.full(N, 25.0) if temperature is None else temperature
    given = Inputs(time=TIME, temperatures={"T": held}, table_rate=np.zeros(N))
    return replace(given, **changes)  # type: ignore[arg-type]


def response(id: str, given: Inputs, **shape: float) -> FloatArray:
    declared = effect(id)
    return declared.response(given, **{**declared.default_shape(), **shape})


SWEEP = np.linspace(-40.0, 60.0, N)


def test_polynomial_has_the_orders_above_the_nominal() -> None:
    found = response("bias_polynomial", inputs(SWEEP), quartic_ratio=0.5, quintic_ratio=-2.0)
    fitted = np.polynomial.Polynomial.fit(SWEEP, found, 5).convert(domain=[-25.0, 75.0], window=[-1.0, 1.0])
    assert fitted.coef == pytest.approx([0.0, 0.0, 0.0, 1.0, 0.5, -2.0], abs=1e-9)


def test_polarisation_ripple_is_periodic_in_the_electronics_temperature() -> None:
    given = inputs(np.full(N, 40.0))
    given = replace(given, temperatures={**given.temperatures, "T_electronics": SWEEP})
    found = response("polarization_nonreciprocity", given, period=3.1, phase=90.0)
    assert found == pytest.approx(np.cos(2.0 * np.pi * (SWEEP - 25.0) / 3.1))
    crossings = SWEEP[1:][np.diff(np.sign(found)) != 0]
    assert np.diff(crossings) == pytest.approx(1.55, abs=0.06)


def test_recorded_field_acts_by_its_direction() -> None:
    drives = {"B_x": np.full(N, 30.0), "B_y": np.full(N, 40.0), "B_z": np.full(N, -20.0)}
    along = np.degrees(np.arctan2(40.0, 30.0))
    given = inputs(drives=drives)
    assert response("magnetic", given, phase=along, axial_ratio=0.0) == pytest.approx(0.5)  # 50 uT
    assert response("magnetic", given, phase=along + 90.0, axial_ratio=0.25) == pytest.approx(-0.05)


def test_a_turn_in_earths_field_is_one_sinusoid() -> None:
    given = inputs(table_rate=np.full(N, 1.0))  # ten turns in an hour
    found = response("magnetic", given, phase=30.0, axial_ratio=0.0)
    line = np.abs(np.fft.rfft(found)) / (N / 2)
    assert line[10] == pytest.approx(0.2, rel=1e-3)
    assert np.delete(line, 10).max() < 1e-3


def test_crosstalk_follows_electronics_and_supply() -> None:
    supply = np.where(TIME < 1000.0, 28.0, 28.5)
    given = inputs(SWEEP, drives={"supply": supply})
    found = response("electronic_crosstalk", given, supply_ratio=4.0)
    assert found == pytest.approx(SWEEP - 25.0 + np.where(TIME < 1000.0, 0.0, 2.0))
    assert response("electronic_crosstalk", inputs(SWEEP), supply_ratio=4.0) == pytest.approx(SWEEP - 25.0)


def test_intensity_modulation_in_microradian() -> None:
    flat = response("intensity_modulation", inputs(), modulation_depth=90.0)
    assert flat == pytest.approx(1.0 / 6.5554, rel=1e-4)
    hot = inputs(np.full(N, 75.0))
    found = response("intensity_modulation", hot, modulation_depth=135.0, halfwave_coefficient=1000.0)
    assert found == pytest.approx(1.0 / np.tan(np.radians(67.5 / 1.05)) / 6.5554, rel=1e-4)


@pytest.mark.parametrize("depth", [60.0, 90.0, 157.5])
def test_intensity_modulation_is_where_two_state_detection_comes_to_rest(depth: float) -> None:
    """Root of the difference of the two states' powers, found by bisection."""
    m, phi = 1e-6, np.radians(depth)

    def difference(error: float) -> float:
        plus, minus = (1.0 + m) * (1.0 + np.cos(phi + error)), (1.0 - m) * (1.0 + np.cos(phi - error))
        return float(plus - minus)

    wanted = bisect(difference, -1e-3, 1e-3, xtol=1e-18, rtol=1e-12)
    found = response("intensity_modulation", inputs(), modulation_depth=depth)[0] * 6.5554
    assert found == pytest.approx(1e6 * wanted, rel=1e-4)


def test_kerr_follows_the_power() -> None:
    found = response("kerr", inputs(np.full(N, 75.0)), power_coefficient=-0.02)
    assert found == pytest.approx(10.0**-0.1)  # 1 dB less


def test_mismatch_is_the_drift_of_the_proper_frequency() -> None:
    found = response("proper_frequency_mismatch", inputs(SWEEP))
    coil = Coil()
    for temperature, value in ((SWEEP[0], found[0]), (SWEEP[-1], found[-1])):
        u = temperature - 25.0
        warm = Coil(length=1000.0 * (1.0 + 0.55e-6 * u), index=1.4525 + 0.97e-5 * u)
        assert value == pytest.approx(coil.proper_frequency_hz / warm.proper_frequency_hz - 1.0, abs=2e-8)
    assert 1e6 * np.ptp(found) == pytest.approx(700.0, abs=30.0)


def test_supply_steps_and_ripple_line() -> None:
    supply = np.where(TIME < 1800.0, 12.0, 12.3)
    given = inputs(drives={"supply": supply})
    assert response("supply_ripple", given, ripple=0.0) == pytest.approx(supply - 12.0)
    found = response("supply_ripple", inputs(), ripple=0.2, alias_frequency=36.0 / N, phase=60.0)
    spectrum = np.fft.rfft(found) / (N / 2)
    assert np.abs(spectrum).argmax() == 36
    assert spectrum[36] == pytest.approx(0.2 * np.exp(1j * np.radians(60.0 - 90.0)))


def test_turn_on_biases_are_drawn_from_the_seed_of_a_simulation() -> None:
    """Standard normal over power cycles, others with another seed, the same with the same one."""
    many = inputs(power_ons_s=tuple(range(1, N)))
    first, again, other = (response("turn_on_bias", replace(many, seed=seed)) for seed in (1, 1, 2))
    assert np.array_equal(first, again) and abs(np.corrcoef(first, other)[0, 1]) < 0.1
    for found in (first, other):
        assert abs(found.mean()) < 4.0 / np.sqrt(N)
        assert found.std() == pytest.approx(1.0, abs=0.05)
    twin = Twin().with_effect("turn_on_bias", 0.5)
    drawn = [simulate(["hold for 20 s"], twin, seed=seed, columns=()).run.gyro[0] for seed in range(60)]
    assert np.std(drawn) == pytest.approx(0.5, rel=0.3) and len(set(drawn)) == 60


def test_a_replay_expects_nothing_of_later_power_cycles() -> None:
    found = response("turn_on_bias", inputs(powered_on_s=0.0, power_ons_s=(1000.0, 2000.0)))
    assert np.array_equal(found, (TIME < 1000.0).astype(float))


def test_slips_of_a_simulation_have_the_mean_that_a_replay_expects() -> None:
    """Compound Poisson: sums of exponential heights, in blocks as on the whole."""
    ramp = 25.0 + np.cumsum(np.where(TIME < 1200.0, 8.0, 0.0)) / 60.0
    shape = {"threshold": 4.0, "time_constant": 1e7}
    given = inputs(ramp, rate_window_s=0.0)
    expected = response("thermal_shock", given, **shape)
    drawn = np.array(
        [response("thermal_shock", replace(given.afresh(), seed=s, cache={}), **shape) for s in range(200)]
    )
    # 80 degC above the threshold: 320 slips of 1/4 degC, with a standard deviation of sqrt(2 * 80 / 4).
    assert expected[-1] == pytest.approx(80.0, rel=1e-2)
    assert drawn[:, -1].mean() == pytest.approx(expected[-1], abs=4.0 * np.sqrt(40.0 / 200))
    assert drawn[:, -1].std() == pytest.approx(np.sqrt(40.0), rel=0.2)
    assert np.all(np.diff(drawn[0]) >= -1e-4) and np.mean(np.diff(drawn[0][:1200]) > 1e-6) < 0.5
    memory, pieces = Memory(), []
    for part in (slice(0, 100), slice(100, 101), slice(101, N)):
        piece = replace(given, seed=3, memory=memory, cache={})
        piece = replace(
            piece,
            time=TIME[part],
            temperatures={k: v[part] for k, v in piece.temperatures.items()},
            table_rate=piece.table_rate[part],
        )
        pieces.append(response("thermal_shock", piece, **shape))
    assert np.concatenate(pieces) == pytest.approx(drawn[3], abs=1e-9)


def test_ageing_slows_down() -> None:
    found = response("ageing", inputs(), time_constant=3600.0)
    assert found[0] == 0.0
    assert found[-1] == pytest.approx(np.log(1.0 + 3599.0 / 3600.0))
    assert np.diff(found)[0] == pytest.approx(1.0 / 3600.0, rel=1e-3)
    year = effect("ageing").amplitude.typical() * np.log1p(365.25 * 24.0 / 100.0)
    assert 0.1 < year < 1.0


def test_radiation_grows_with_the_dose_and_anneals() -> None:
    """10 Gy in a moment, then nothing: p D stays, the rest fades with exp(-t / tau)."""
    shape = {"dose_exponent": 0.7, "permanent_share": 0.4, "annealing_time": 900.0}
    given = inputs(drives={"dose": np.where(TIME < 1.0, 0.0, 10.0)}, table_rate=np.full(N, 10.0))
    ppm = effect("radiation").signature(given, **shape)
    wanted = (10.0 * (0.4 + 0.6 * np.exp(-(TIME - 0.5) / 900.0))) ** 0.7
    assert ppm[1:] == pytest.approx(wanted[1:], rel=1e-5)
    assert ppm[0] == 0.0 and not effect("radiation").signature(inputs(), **shape).any()
    shown = response("radiation", replace(given.afresh(), cache={}), **shape)
    assert shown == pytest.approx(1e-6 * 36_000.0 * ppm)


def test_a_dose_taken_faster_leaves_more() -> None:
    shape, end = effect("radiation").default_shape(), []
    for span in (60.0, 600.0, 3000.0):
        taken = inputs(drives={"dose": np.minimum(TIME / span, 1.0)})
        end.append(effect("radiation").signature(taken, **shape)[int(span)])
    assert end[0] > end[1] > end[2]


def test_a_programme_irradiates_and_the_dose_is_recorded() -> None:
    first, second = "radiation at 6 Gy/h for 20 min from minute 10", "radiation at 30 Gy/h from minute 50"
    twin = Twin().with_effect("radiation", 100.0).with_effect("radiation_noise", 0.1, loss=1.0)
    made = simulate([{"hold for 1 h": [first, second]}], twin, columns=("dose", "rate"), truth=True)
    dose = made.run.columns["dose"]
    assert dose[[0, 600, 1200, 1800, 2999]] == pytest.approx([0.0, 0.0, 1.0, 2.0, 2.0])
    assert dose[-1] == pytest.approx(2.0 + 30.0 * 599.0 / 3600.0)
    noise = made.truth.noise
    assert not noise[:600].any() and noise[2400:3000].std() > 1.5 * noise[650:900].std()


def test_radiations_noise_is_the_shot_noise_of_the_light_that_is_left() -> None:
    shape = {"loss": 0.3, "dose_exponent": 1.0, "permanent_share": 1.0, "annealing_time": 3600.0}
    found = effect("radiation_noise").strength(inputs(drives={"dose": TIME / 360.0}), **shape)
    light = 10.0 ** (-0.1 * 0.3 * TIME / 360.0)
    assert np.sqrt(1.0 + found**2) == pytest.approx(1.0 / np.sqrt(light))
