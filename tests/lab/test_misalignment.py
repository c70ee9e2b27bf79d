"""Scale factor and misalignment: known answers, other geometry, intervals that cover."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fogml.errors import InputError
from fogml.lab.misalignment import TableMeasurements, _slopes, decouple
from fogml.lab.misalignment_errors import cross_tilt_angle
from fogml.lab.misalignment_json import compare_methods, misalignment_json, relative_error_ppm
from fogml.lab.misalignment_segments import from_samples
from fogml.lab.misalignment_simulation import TableUnit, measurements, samples

UNIT = TableUnit(K=1.2345, delta_x_deg=5.0, delta_y_deg=3.0, fixture_error_deg=0.5)
TILTS, RATES = (0.0, 30.0, 60.0, 90.0), (-100.0, -10.0, 10.0, 100.0)


def by_the_formulas(tilts: tuple[float, ...] = TILTS, *, cross_deg: float = 0.0) -> TableMeasurements:
    """The known answer's case from the printed equations, sharing nothing with the simulation."""
    e, dx, dy = np.radians([0.5, 5.0, 3.0])
    ax, ay = np.sin(dx), np.sin(dy)
    az = np.sqrt(1.0 - ax**2 - ay**2)
    across = {1: ay, 2: -ay, 3: ax, 4: -ax}
    rows = []
    for state, component in {1: ax, 2: -ax, 3: -ay, 4: ay}.items():
        for tilt in tilts:
            t = np.radians(tilt) + e
            along = az * np.cos(t) + component * np.sin(t)
            f = np.radians(cross_deg)
            slope = 1.2345 * (along * np.cos(f) + across[state] * np.sin(f))
            rows += [(state, tilt, rate, slope * rate) for rate in RATES]
    return TableMeasurements(*np.array(rows, dtype=float).T, "V")


def test_known_answer() -> None:
    found = decouple(by_the_formulas())
    np.testing.assert_allclose(found.K, 1.2345, rtol=1e-12)
    assert found.delta_x_deg == pytest.approx(5.0, abs=1e-11)
    assert found.delta_y_deg == pytest.approx(3.0, abs=1e-11)
    assert found.fixture_error_deg == pytest.approx((0.5, 0.5), abs=1e-11)
    expected = np.degrees(np.arccos(np.sqrt(1 - np.sin(np.radians(5)) ** 2 - np.sin(np.radians(3)) ** 2)))
    assert found.delta_deg == pytest.approx(expected, abs=1e-11)
    assert not found.cross_tilt


def turned(
    angles_deg: tuple[float, ...], *, noise: float = 0.0, stated: tuple[float, ...] | None = None
) -> TableMeasurements:
    """A gyro carried by rotation matrices: clockwise on its fixture seen from +z, that tilted about y."""
    random = np.random.default_rng(3)
    axis = np.sin(np.radians([5.0, 3.0, 0.0]))
    axis[2] = np.sqrt(1.0 - axis @ axis)
    rows = []
    for state, angle in enumerate(angles_deg, start=1):
        on_fixture = Rotation.from_euler("z", -angle, degrees=True).apply(axis)
        for tilt in TILTS:
            # The fixture's x comes up by the tilt: in its coordinates the table's axis leans to x.
            in_table = Rotation.from_euler("y", -(tilt + 0.5), degrees=True).apply(on_fixture)
            for rate in RATES:
                output = 1.2345 * in_table @ [0.0, 0.0, rate] + noise * random.standard_normal()
                rows.append((state, tilt, rate, output))
    columns = np.array(rows, dtype=float).T
    return TableMeasurements(*columns, "V", "table", angles_deg if stated is None else stated)


@pytest.mark.parametrize(
    "angles",
    [
        (0.0, 180.0, 270.0, 90.0),
        (0.0, 90.0, 180.0, 270.0),
        (0.0, 178.0, 272.0, 91.0),
        (0.0, 120.0, 240.0, 60.0),
        (10.0, 190.0, 100.0, 280.0),
        (90.0, 0.0, 270.0, 180.0),
    ],
)
def test_turns_of_the_states_as_stated(angles) -> None:
    found = decouple(turned(angles))
    np.testing.assert_allclose(found.K, 1.2345, rtol=1e-10)
    assert (found.delta_x_deg, found.delta_y_deg) == pytest.approx((5.0, 3.0), abs=1e-9)
    assert found.fixture_error_deg == pytest.approx((0.5, 0.5), abs=1e-9)
    classical, single, _ = compare_methods(turned(angles))
    if angles == (90.0, 0.0, 270.0, 180.0):
        assert single.delta_x_deg is None and single.delta_y_deg == pytest.approx(2.5, abs=0.02)
        assert classical.delta_y_deg == pytest.approx(2.5, abs=0.05)


def test_without_a_word_the_turns_are_those_of_the_document() -> None:
    """Clockwise from +z by 180, 90 more, 180 more; counter-clockwise delta y has the other sign."""
    assert decouple(by_the_formulas()).delta_y_deg == pytest.approx(3.0, abs=1e-11)
    other_way = decouple(turned((0.0, 180.0, 90.0, 270.0), stated=(0.0, 180.0, 270.0, 90.0)))
    assert other_way.delta_y_deg == pytest.approx(-3.0, abs=1e-9)
    assert any("clockwise as seen from +z" in note for note in other_way.notes)


@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("stated", [(0.0, 180.0, 270.0, 90.0), (0.0, 270.0, 90.0, 180.0)])
def test_an_order_that_the_data_contradict(noise: float, stated) -> None:
    turns = turned((0.0, 90.0, 180.0, 270.0), noise=noise, stated=stated)
    with pytest.raises(InputError, match=r"contradict the order.*(0, 90, 180, 270|0, 270, 180, 90) deg"):
        decouple(turns)


def test_the_right_order_is_rarely_refused() -> None:
    """Of 300 noisy tables none is refused, and the states' disagreement is as likely as it says."""
    chances = [
        decouple(measurements(UNIT, TILTS, RATES, noise=0.02, seed=seed)).order_p for seed in range(300)
    ]
    values = np.array(chances, dtype=float)
    assert 150 - 35 <= (values < 0.5).sum() <= 150 + 35
    assert 2 <= (values < 0.05).sum() <= 30


def test_states_seated_differently_are_told_and_not_refused() -> None:
    turns = turned((0.0, 180.0, 270.0, 90.0), noise=1e-4)
    leant = (turns.state == 3) * np.sin(np.radians(turns.tilt_deg + 0.5))
    found = decouple(replace(turns, output=turns.output + 0.02 * turns.rate_deg_s * leant))
    assert any("no other order" in note for note in found.notes)


def test_turns_that_do_not_tell_both_components() -> None:
    with pytest.raises(InputError, match="does not tell both components"):
        decouple(turned((0.0, 180.0, 0.0, 180.0)))


def test_what_the_other_methods_get_wrong() -> None:
    classical, single, four = compare_methods(by_the_formulas())
    assert relative_error_ppm(classical.K, 1.2345) == pytest.approx(-4458, abs=0.5)
    assert relative_error_ppm(single.K, 1.2345) == pytest.approx(-1371, abs=0.6)
    assert relative_error_ppm(four.K, 1.2345) == pytest.approx(0.0, abs=1e-6)
    assert single.delta_y_deg is None and classical.delta_x_deg == pytest.approx(4.516, abs=1e-3)


def test_a_fixture_tilted_across_is_seen() -> None:
    turns = by_the_formulas((0.0, 20.0, 40.0, 60.0, 90.0), cross_deg=0.3)
    found = decouple(turns)
    assert found.cross_tilt and found.cross_tilt_deg == pytest.approx(0.3, abs=1e-4)
    assert (found.delta_x_deg, found.delta_y_deg) == pytest.approx((5.0, 3.0), abs=1e-10)
    assert relative_error_ppm(found.K, 1.2345) == pytest.approx(-13.7, abs=0.02)
    blind = decouple(turns, cross_tilt=False)
    assert abs(blind.delta_x_deg - 5.0) > 1e-4


@pytest.mark.parametrize(("error_deg", "told"), [(None, True), (0.9, True), (1.1, False)])
def test_a_tilt_across_is_told_beside_a_misalignment_that_is(error_deg: float | None, told: bool) -> None:
    """Constants of opposite states differ by 2 K sin(misalignment) f; five standard errors are asked."""
    K, misalignment_deg, tilt_deg = 2.0, 5.0, 0.4
    half = K * np.sin(np.radians(misalignment_deg)) * np.sin(np.radians(tilt_deg))
    fits: Any = [SimpleNamespace(coefficients=(0.0, 0.0, constant)) for constant in (half, -half, 0.1, 0.1)]
    covariance = None if error_deg is None else np.diag([0.0, 0.0, 0.0, error_deg**2])
    values = np.array([K, 0.0, misalignment_deg, misalignment_deg])
    found, notes = cross_tilt_angle(fits, values, covariance)
    assert found == (pytest.approx(tilt_deg, rel=1e-9) if told else None)
    assert len(notes) == 1


@settings(max_examples=40, deadline=None)
@given(
    K=st.floats(0.01, 100.0),
    x=st.floats(-30.0, 30.0),
    y=st.floats(-30.0, 30.0),
    e=st.floats(-5.0, 5.0),
)
def test_every_direction_comes_back(K: float, x: float, y: float, e: float) -> None:
    found = decouple(measurements(TableUnit(K, x, y, e), TILTS, RATES), cross_tilt=False)
    np.testing.assert_allclose(found.K, K, rtol=1e-9)
    assert (found.delta_x_deg, found.delta_y_deg) == pytest.approx((x, y), abs=1e-9)
    assert found.fixture_error_deg == pytest.approx((e, e), abs=1e-9)


def test_samples_with_earth_rate_drift_and_ramps() -> None:
    unit = replace(UNIT, bias=0.2, drift_per_s=1e-7)
    rows, time = samples(unit, TILTS, (36.0, 72.0), latitude_deg=40.0)
    turns = from_samples(rows, time)
    assert len(turns.output) == 4 * 4 * 4
    found = decouple(turns)
    # Whole turns leave nothing of the horizontal Earth rate, rests before and after nothing of the drift.
    np.testing.assert_allclose(found.K, 1.2345, rtol=1e-9)
    assert (found.delta_x_deg, found.delta_y_deg) == pytest.approx((5.0, 3.0), abs=1e-8)


def test_lost_rows_leave_nothing_of_the_earth_rate() -> None:
    rows, time = samples(UNIT, TILTS, (36.0, 72.0), latitude_deg=40.0)
    kept = np.random.default_rng(5).random(len(time)) > 0.2
    columns = ("state", "tilt_deg", "rate_deg_s", "output")
    found = decouple(
        from_samples(replace(rows, **{name: getattr(rows, name)[kept] for name in columns}), time[kept])
    )
    # Without noise, means over whole turns alone leave K off by 0.06 ppm.
    np.testing.assert_allclose(found.K, 1.2345, rtol=1e-9)
    assert (found.delta_x_deg, found.delta_y_deg) == pytest.approx((5.0, 3.0), abs=1e-8)


def coverage(count: int, **noise: float) -> tuple[dict[str, int], list[float]]:
    """How often intervals and region hold the truth, and the errors of x in standard errors."""
    inside = {"K": 0, "delta_x_deg": 0, "delta_y_deg": 0, "delta_deg": 0, "region": 0}
    true = {"K": 1.2345, "delta_x_deg": 5.0, "delta_y_deg": 3.0}
    true["delta_deg"] = decouple(by_the_formulas()).delta_deg
    in_errors = []
    for seed in range(count):
        found = decouple(measurements(UNIT, TILTS, RATES, seed=seed, **noise), cross_tilt=False)
        for name, value in true.items():
            low, high = found.intervals[name]
            inside[name] += low <= value <= high
        assert found.region is not None and found.se is not None
        in_errors.append((found.delta_x_deg - 5.0) / found.se["delta_x_deg"])
        long, short = found.region.half_axes_deg
        turn = np.radians(found.region.angle_deg)
        off = np.array([5.0 - found.delta_x_deg, 3.0 - found.delta_y_deg])
        along, across = off @ [np.cos(turn), np.sin(turn)], off @ [-np.sin(turn), np.cos(turn)]
        inside["region"] += bool((along / long) ** 2 + (across / short) ** 2 <= 1.0)
    return inside, in_errors


def test_intervals_cover() -> None:
    inside, in_errors = coverage(400, noise=0.02)
    # 380 of 400 at 95 %, and 3.5 standard deviations are 15; the whole angle's interval is wider.
    for name in ("K", "delta_x_deg", "delta_y_deg", "region"):
        assert 365 <= inside[name] <= 395, (name, inside[name])
    assert inside["delta_deg"] >= 380
    # Student's t with 8 degrees of freedom.
    assert np.std(in_errors) == pytest.approx(np.sqrt(8 / 6), rel=0.15)


def test_intervals_cover_where_tilt_settings_err() -> None:
    """Errors of the tilts act at high tilts only: one variance for all slopes covers under 90 %."""
    inside, _ = coverage(200, noise=1e-3, tilt_noise_deg=0.05)
    assert min(inside.values()) >= 178, inside


@pytest.mark.parametrize("size", [1e-10, 1e10])
def test_an_output_in_any_unit_has_the_same_angles(size: float) -> None:
    """As amperes of a photocurrent, or counts of a fine angle."""
    in_volts = measurements(UNIT, TILTS, RATES, noise=1e-3, seed=2)
    plain, scaled = decouple(in_volts), decouple(replace(in_volts, output=size * in_volts.output))
    assert size * plain.K == pytest.approx(scaled.K, rel=1e-9)
    assert plain.delta_x_deg == pytest.approx(scaled.delta_x_deg, rel=1e-6)
    assert plain.se is not None and scaled.se is not None
    assert plain.se["delta_deg"] == pytest.approx(scaled.se["delta_deg"], rel=1e-6)
    assert size * float(plain.se["K"]) == pytest.approx(scaled.se["K"], rel=1e-6)


def test_zero_misalignment_lies_in_the_interval() -> None:
    spans = [
        decouple(measurements(TableUnit(2.0), TILTS, RATES, noise=0.01, seed=seed), False).intervals[
            "delta_deg"
        ]
        for seed in range(40)
    ]
    assert sum(low == 0.0 < high for low, high in spans) >= 33


def test_errors_of_the_tilt_settings_are_told() -> None:
    noisy = measurements(UNIT, TILTS, (-100.0, -50.0, 50.0, 100.0), noise=1e-4, tilt_noise_deg=0.05, seed=1)
    found = decouple(noisy)
    assert any("tilt settings" in note for note in found.notes)
    assert found.se is not None and found.se["delta_x_deg"] > 5e-3


def test_two_tilts_and_no_repeats_give_no_standard_errors() -> None:
    found = decouple(measurements(UNIT, (0.0, 90.0), (50.0,)))
    assert found.se is None and found.region is None
    np.testing.assert_allclose(found.K, 1.2345)


@pytest.mark.parametrize(
    ("tilts", "states", "cross", "message"),
    [
        ((0.0,), (1, 2, 3, 4), None, "only tilt 0 deg"),
        ((0.0, 180.0), (1, 2, 3, 4), None, "at least 2 tilts"),
        ((0.0, 90.0), (1, 2, 3, 4), True, "at least 3 tilts"),
        (TILTS, (1, 3, 4), None, "no turns in state 2"),
    ],
)
def test_too_little_is_refused(tilts, states, cross, message: str) -> None:
    turns = measurements(UNIT, tilts, RATES)
    kept = np.isin(turns.state, states)
    part = TableMeasurements(
        turns.state[kept], turns.tilt_deg[kept], turns.rate_deg_s[kept], turns.output[kept], "V"
    )
    with pytest.raises(InputError, match=message):
        decouple(part, cross)


def test_what_is_even_in_the_rate_is_neither_slope_nor_left_over() -> None:
    rates = np.array([-10.0, 0.0, 10.0, -5.0, 5.0])
    measured = TableMeasurements(np.ones(5), np.zeros(5), rates, 2.0 * rates + 0.7, "deg/h")
    found = _slopes(measured, 1)
    assert found.values == pytest.approx([2.0])
    assert (found.squares, found.dof) == (pytest.approx(0.0, abs=1e-20), 3)


def drifting(seed: int, ppm: float = 0.0, cross_deg: float = 0.0, noise: float = 1e-6) -> TableMeasurements:
    """The printed equations' case, turn after turn, K growing by `ppm` over the test, ever more slowly."""
    steady = by_the_formulas(cross_deg=cross_deg)
    place = np.arange(float(len(steady.output)))
    warm = (1.0 - np.exp(-place / place[-1])) / (1.0 - np.exp(-1.0))
    grown = 1.0 + 1e-6 * ppm * (warm - warm.mean())
    random = np.random.default_rng(seed)
    output = steady.output * grown + noise * 1.2345 * 100.0 * random.standard_normal(len(place))
    return replace(steady, output=output, place=place)


def test_a_scale_factor_that_drifts_is_no_misalignment_and_no_tilt_of_the_fixture() -> None:
    """By 50 ppm over the test, as by 10 ppm/degC over 5 degC: before, intervals held no truth."""
    held, order = np.zeros(3), []
    for seed in range(60):
        found = decouple(drifting(seed, 50.0))
        assert found.scale_drift_ppm is not None
        assert not found.cross_tilt or any("drifts unevenly" in note for note in found.notes)
        assert found.scale_drift_se_ppm is not None
        order.append((found.scale_drift_ppm - 50.0) / found.scale_drift_se_ppm)
        for i, (name, true) in enumerate([("K", 1.2345), ("delta_x_deg", 5.0), ("delta_y_deg", 3.0)]):
            low, high = found.intervals[name]
            held[i] += low <= true <= high
    assert np.all(held >= 51), held  # of 60 intervals of 95 %, 51 or more hold but once in 1000
    assert np.sum(np.abs(order) < 2.57) >= 51  # Student's t with the 5 degrees of freedom that are left
    assert any("drifts by" in note and "mean over the test" in note for note in found.notes)


@pytest.mark.parametrize("cross_deg", [0.0, 0.3])
def test_no_drift_is_told_of_a_steady_scale_factor(cross_deg: float) -> None:
    found = [decouple(drifting(seed, cross_deg=cross_deg)) for seed in range(60)]
    # One in a hundred by chance.
    assert sum(one.scale_drift_ppm is not None for one in found) <= 4
    assert sum(one.cross_tilt for one in found) in (range(5) if cross_deg == 0.0 else [60])
    # Where no one says when turns were, nothing can be told.
    assert decouple(replace(drifting(0, 50.0), place=None)).scale_drift_ppm is None


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_an_output_that_does_not_follow_the_rate_has_no_scale_factor(noise: float) -> None:
    turns = by_the_formulas()
    output = noise * np.random.default_rng(5).standard_normal(len(turns.output))
    with pytest.raises(InputError, match="column 'output': it does not follow the table rate"):
        decouple(replace(turns, output=output))
    following = replace(turns, output=turns.output + 0.1 * output)
    assert pytest.approx(1.2345, rel=0.01) == decouple(following).K


def test_turns_too_short_to_settle_are_told() -> None:
    rows, time = samples(UNIT, TILTS, (36.0,), turn_s=4.0)
    with pytest.raises(InputError, match="column 'time': every turn is over before table and gyro"):
        from_samples(rows, time)


def test_rests_that_are_cut_away_whole_are_told_with_how_much_is_cut() -> None:
    """A table that takes 10 s to its rate, and rests of 4 s between; of 15 s some is left."""

    def recorded(rest_s: float) -> TableMeasurements:
        times = {"rest_s": rest_s, "turn_s": 60.0, "acceleration_deg_s2": 10.0}
        return from_samples(*samples(UNIT, TILTS, (100.0,), noise=1e-4, **times))

    with pytest.raises(
        InputError, match=r"rest of 3\.9 s, as 2\.\d+ s and more are cut before and after each"
    ):
        recorded(4.0)
    np.testing.assert_allclose(decouple(recorded(15.0)).K, UNIT.K, rtol=1e-5)


def test_an_axis_that_points_down_lies_within_its_interval() -> None:
    turns = measurements(UNIT, TILTS, RATES, noise=1e-4)
    up, down = decouple(turns), decouple(replace(turns, output=-turns.output))
    assert down.delta_deg == pytest.approx(180.0 - up.delta_deg, abs=1e-9)
    low, high = down.intervals["delta_deg"]
    assert low < down.delta_deg < high
    assert (180.0 - high, 180.0 - low) == pytest.approx(up.intervals["delta_deg"], abs=1e-9)


def test_what_is_no_scale_factor_s_is_said() -> None:
    unit = replace(UNIT, K=1.0)
    turns = replace(measurements(unit, TILTS, RATES, noise=1e-4), unit="deg/s")

    def said(**changed: Any) -> str:
        return " ".join(misalignment_json(replace(turns, **changed))["notes"])

    assert "stated wrongly" not in said() and "saturate" not in said()
    assert "K is 3600 where an output in deg/s shows about 1" in said(output=3600.0 * turns.output)
    assert "stated wrongly" not in said(output=3600.0 * turns.output, unit="deg/h")
    assert "does the output saturate" in said(output=np.clip(turns.output, -60.0, 60.0))
    output = turns.output.copy()
    output[7] *= 1.5
    assert f"at {turns.rate_deg_s[7]:g} deg/s in state {turns.state[7]:g}" in said(output=output)
