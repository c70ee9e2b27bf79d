"""North seeking: closed form against simulation, known answers, quiet azimuths of any set-up."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.lab.north import PALINDROME, Drift, DriftError, Scheme, drift_error, horizontal_rate
from fogml.lab.north_json import recorded_north_json
from fogml.lab.north_positions import north_from_positions
from fogml.lab.north_schemes import (
    CoarseFine,
    error_of,
    seek,
    simulated_positions,
    standard_error,
    ways_of_equal_time,
    wrapped,
)
from fogml.runs.checks import check_run
from fogml.runs.facts import Facts
from fogml.runs.run import Run

LINEAR = Drift(0.18)
START_UP = Drift(0.05, ((0.2, 600.0), (-0.1, 90.0)))


def by_hand(azimuth_deg: float, latitude_deg: float, drift: Drift, *, sense: float, dwell: float) -> float:
    """Error of theta = atan2(G4 - G2, G1 - G3), drift averaged by a fine sum, sharing no code."""
    means = []
    for j in range(4):
        fine = j * dwell + (np.arange(200_000) + 0.5) * dwell / 200_000
        d = drift.linear_deg_h_h * fine / 3600.0
        for amplitude, constant in drift.transients:
            d = d + amplitude * np.exp(-fine / constant)
        h = 15.041067 * np.cos(np.radians(latitude_deg))
        means.append(h * np.cos(np.radians(azimuth_deg + sense * 90.0 * j)) + d.mean())
    g1, g2, g3, g4 = means
    found = np.degrees(np.arctan2(sense * (g4 - g2), g1 - g3))
    return float((found - azimuth_deg + 180.0) % 360.0 - 180.0)


@pytest.mark.parametrize(("latitude", "greatest"), [(30.0, 0.01866), (40.0, 0.0211), (50.0, 0.0251)])
def test_known_greatest_errors(latitude: float, greatest: float) -> None:
    assert drift_error(Scheme(), LINEAR, latitude).greatest == pytest.approx(greatest, rel=2e-3)


def test_known_rms_transient_and_noise() -> None:
    assert drift_error(Scheme(), LINEAR, 30.0).rms == pytest.approx(0.0132, abs=5e-6)
    assert drift_error(Scheme(), Drift(0.0, ((0.2, 600.0),)), 30.0).greatest == pytest.approx(0.10, abs=3e-3)
    azimuth = np.arange(0.0, 360.0, 15.0)
    # With R = 2 H: 2 sigma^2/R^2 plain, (6 + 4 sin 2 theta) sigma^2/R^2 with the drift observed.
    np.testing.assert_allclose(Scheme().variance_factor(azimuth), 2.0 / 4.0)
    wanted = (6.0 + 4.0 * np.sin(2.0 * np.radians(azimuth))) / 4.0
    np.testing.assert_allclose(Scheme(observes_drift=True).variance_factor(azimuth), wanted)
    np.testing.assert_allclose(Scheme(PALINDROME).variance_factor(azimuth), 1.0 / 4.0)


@pytest.mark.parametrize("sense", ["cw", "ccw"])
@pytest.mark.parametrize("drift", [LINEAR, START_UP])
def test_closed_form_is_what_a_simulation_gives(sense: str, drift: Drift) -> None:
    scheme = Scheme(sense=sense)
    for azimuth in (0.0, 37.0, 135.0, 290.0):
        error = float(drift_error(scheme, drift, 30.0).at(azimuth))
        sign = 1.0 if sense == "cw" else -1.0
        assert error == pytest.approx(by_hand(azimuth, 30.0, drift, sense=sign, dwell=60.0), abs=1e-9)


def test_the_patent_s_formula_holds_with_its_quiet_azimuths_moved() -> None:
    error, azimuth = drift_error(Scheme(), LINEAR, 30.0), np.arange(0.0, 360.0, 1.0)
    delta, r = 2.0 * 0.18 / 60.0, 2.0 * horizontal_rate(30.0)
    theta = np.radians(azimuth)
    a, b = r * np.sin(theta), r * np.cos(theta)
    np.testing.assert_allclose(
        np.tan(np.radians(error.at(azimuth))),
        delta * (a + b) / (r**2 + delta * (a - b)),
        rtol=1e-9,
        atol=1e-15,
    )
    # The patent says 45 and 225 deg are least: with its positions taken clockwise they are the most.
    assert error.quiet_deg == pytest.approx((135.0, 315.0))
    assert error.worst_deg == pytest.approx((45.0, 225.0), abs=0.02)
    ccw = drift_error(Scheme(sense="ccw"), LINEAR, 30.0)
    assert ccw.quiet_deg == pytest.approx((45.0, 225.0))
    root = np.sqrt(2.0) * delta
    wanted = root * np.sin(theta - np.pi / 4) / (r - root * np.sin(theta + np.pi / 4))
    np.testing.assert_allclose(np.tan(np.radians(ccw.at(azimuth))), wanted, rtol=1e-9, atol=1e-15)
    reordered = drift_error(Scheme((0.0, 180.0, 270.0, 90.0)), LINEAR, 30.0)
    assert reordered.quiet_deg == pytest.approx((45.0, 225.0))


@pytest.mark.parametrize(("sense", "sign"), [("cw", -1.0), ("ccw", 1.0)])
def test_quiet_azimuth_of_an_exponential(sense: str, sign: float) -> None:
    scheme = Scheme(sense=sense, transfer_s=15.0)
    quiet = drift_error(scheme, Drift(0.0, ((0.3, 200.0),)), 40.0).quiet_deg
    s = np.exp(-75.0 / 200.0)
    assert np.tan(np.radians(quiet)) == pytest.approx([sign * s] * 2)


@settings(max_examples=40, deadline=None)
@given(
    order=st.permutations([0.0, 90.0, 180.0, 270.0]),
    sense=st.sampled_from(["cw", "ccw"]),
    linear=st.floats(-3.0, 3.0),
    amplitude=st.floats(-1.0, 1.0),
    constant=st.floats(20.0, 3000.0),
    latitude=st.floats(-70.0, 70.0),
)
def test_quiet_and_worst_azimuths_are_so(order, sense, linear, amplitude, constant, latitude) -> None:
    error = drift_error(
        Scheme(tuple(order), sense, 40.0, 7.0), Drift(linear, ((amplitude, constant),)), latitude
    )
    circle = np.abs(error.at(np.arange(0.0, 360.0, 0.25)))
    assert circle.max() <= error.greatest * (1 + 1e-9) + 1e-12
    assert error.greatest <= circle.max() * (1 + 1e-4) + 1e-12
    if error.size > 1e-6:
        np.testing.assert_allclose(error.at(np.array(error.quiet_deg)), 0.0, atol=1e-9)
        np.testing.assert_allclose(np.abs(error.at(np.array(error.worst_deg))), error.greatest, rtol=1e-9)


@pytest.mark.parametrize("drift", [LINEAR, START_UP])
def test_every_way_at_equal_time(drift: Drift) -> None:
    plain = Scheme(transfer_s=10.0)
    ways, left_out = ways_of_equal_time(plain)
    assert not left_out and list(ways) == ["plain", "drift-observing", "palindrome", "coarse-fine"]
    azimuth = np.arange(0.0, 360.0, 13.0)
    for way in ways.values():
        spans = (way.coarse, way.fine) if isinstance(way, CoarseFine) else (way,)
        assert spans[-1].spans_s[1][-1] == pytest.approx(plain.duration_s)
        found = seek(way, azimuth, horizontal_rate(35.0), drift.mean)
        np.testing.assert_allclose(wrapped(found - azimuth), error_of(way, azimuth, drift, 35.0), atol=1e-9)
    if drift is LINEAR:
        for name in ("drift-observing", "palindrome"):
            assert np.abs(error_of(ways[name], azimuth, drift, 35.0)).max() < 1e-12
        assert np.abs(error_of(ways["coarse-fine"], azimuth, drift, 35.0)).max() < 1e-5


def test_standard_errors_are_those_of_many_seeks() -> None:
    scheme, walk = Scheme(dwell_s=30.0), 0.002
    rng = np.random.default_rng(2)
    azimuth = np.full(4000, 60.0)
    noise = rng.normal(0.0, walk / np.sqrt(30.0 / 3600.0), (4000, 4))
    for way in (scheme, Scheme(dwell_s=30.0, observes_drift=True)):
        found = seek(way, azimuth, horizontal_rate(30.0), lambda begin, end: noise)
        wanted = float(standard_error(way, 60.0, walk, horizontal_rate(30.0)))
        assert np.std(wrapped(found - 60.0)) == pytest.approx(wanted, rel=0.04)


def test_recorded_positions() -> None:
    scheme, azimuth = Scheme(transfer_s=10.0), 77.0
    quiet = simulated_positions(scheme, azimuth, 30.0, Drift(0.6), bias_deg_h=0.4)
    fix = north_from_positions(quiet)
    assert fix.method == "averaged" and fix.azimuth_deg == pytest.approx(azimuth, abs=1e-9)
    assert fix.drift_deg_h_h == pytest.approx(0.6, abs=1e-8)
    assert fix.error.quiet_deg == pytest.approx((135.0, 315.0))
    off = wrapped(north_from_positions(quiet, method="plain").azimuth_deg - azimuth)
    assert off == pytest.approx(float(drift_error(scheme, Drift(0.6), 30.0).at(azimuth)), abs=1e-9)
    assert float(fix.error.at(azimuth)) == pytest.approx(float(off), rel=1e-6)


@pytest.mark.parametrize("order", [(0.0, 90.0, 180.0, 270.0), (0.0, 180.0, 270.0, 90.0)])
@pytest.mark.parametrize("sense", ["cw", "ccw"])
def test_recorded_in_any_order_and_sense(order: tuple[float, ...], sense: str) -> None:
    run = simulated_positions(Scheme(order, sense, 30.0, 5.0), 201.0, -45.0, Drift())
    fix = north_from_positions(run, sense=sense, order_deg=order)
    assert fix.azimuth_deg == pytest.approx(201.0, abs=1e-9) and fix.notes == ()


@pytest.mark.parametrize("drift", [0.0, 0.15])
def test_errors_of_recorded_positions_are_those_told(drift: float) -> None:
    # The drift is two of its own standard errors: five of the plain result's at this azimuth.
    scores = []
    for seed in range(60):
        run = simulated_positions(
            Scheme(dwell_s=30.0), 45.0, 30.0, Drift(drift), random_walk_deg_sqrt_h=0.0003, seed=seed
        )
        fix = north_from_positions(run)
        assert fix.se_deg is not None
        scores.append(float(wrapped(fix.azimuth_deg - 45.0)) / fix.se_deg)
    # The noise is not known to be white: what little the stays tell of slower noise is in the standard error.
    assert 0.6 < np.std(scores) < 1.2 and abs(np.mean(scores)) < 0.3


def test_too_few_samples_tell_no_noise() -> None:
    scheme = Scheme(dwell_s=30.0)
    run = simulated_positions(scheme, 45.0, 30.0, Drift(), random_walk_deg_sqrt_h=0.003, sample_s=15.0)
    fix = north_from_positions(run)
    assert fix.se_deg is None and "no standard error" in " ".join(fix.notes)


def test_an_axis_that_is_not_level_is_noted() -> None:
    run = simulated_positions(Scheme(), 10.0, 30.0, Drift())
    assert "Earth rate" in north_from_positions(run, latitude_deg=55.0).notes[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: np.where(p == 3, 0.0, p), "no samples in position 3"),
        (lambda p: np.where(p == 3, 5.0, p), "5 is no position"),
        (lambda p: p + 0.5, "is no position"),
        (lambda p: np.full(len(p), np.nan), "no samples in position 1, 2, 3, 4"),
    ],
)
def test_faulty_positions_are_named(change, message: str) -> None:
    run = simulated_positions(Scheme(dwell_s=10.0), 10.0, 30.0, Drift())
    with pytest.raises(InputError, match=message):
        north_from_positions(run.with_columns(position=change(run.columns["position"])))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Scheme(sense="up"), "sense 'up'"),
        (lambda: Scheme(dwell_s=0.0), "dwell 0 s"),
        (lambda: Scheme(dwell_s=float("nan")), "dwell nan s"),
        (lambda: Scheme(transfer_s=-1.0), "transfer -1 s"),
        (lambda: Scheme((0.0, 90.0)), "at least three different angles"),
        (lambda: Scheme((0.0, 120.0, 240.0), observes_drift=True), "linear drift"),
        (lambda: Drift(float("nan")), "finite"),
        (lambda: Drift(0.0, ((0.1, 0.0),)), "time constant"),
        (lambda: horizontal_rate(91.0), "latitude 91"),
        (lambda: horizontal_rate(90.0), "pole"),
        (lambda: horizontal_rate(float("nan")), "latitude nan"),
    ],
)
def test_bad_settings_are_refused(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def test_a_drift_without_any_earth_rate_is_worst_where_it_points() -> None:
    found = DriftError(1.0, 0.0, 0.0)
    assert found.greatest == 180.0 and found.worst_deg == (180.0, 180.0)
    assert found.worst_deg == pytest.approx(DriftError(1.0, 0.0, 1e-9).worst_deg)


def own_seek(
    seed: int, azimuth: float, latitude: float, *, walk: float, drift: Callable[[np.ndarray], np.ndarray]
) -> Run:
    """Four stays of 60 s at 10 Hz, clockwise, 10 s from one to the next, in plain NumPy."""
    time = np.arange(2700) / 10.0
    place, into = np.divmod(time, 70.0)
    rate = 15.041067 * np.cos(np.radians(latitude)) * np.cos(np.radians(azimuth + 90.0 * place))
    noise = walk * 60.0 / np.sqrt(0.1) * np.random.default_rng(seed).standard_normal(len(time))
    position = np.where(into < 60.0, place + 1.0, 0.0)
    columns = {"time": time, "gyro": rate + 0.7 + drift(time) + noise, "position": position}
    columns["angle"] = -90.0 * (place + np.clip((into - 60.0) / 10.0, 0.0, 1.0))
    return Run("own", columns, Facts(latitude=latitude))


def test_a_table_that_stands_still_is_told_by_its_own_column() -> None:
    columns = dict(own_seek(1, 12.0, 40.0, walk=0.0, drift=np.zeros_like).columns)
    del columns["position"]
    columns["angle"] = np.zeros(2700)
    with pytest.raises(InputError, match=r"'angle': no samples in position 2, 3, 4"):
        north_from_positions(Run("still", columns, Facts(latitude=40.0)))


@pytest.mark.parametrize("counts", [-1.0, 1.0], ids=["clockwise", "counter-clockwise"])
def test_an_angle_that_counts_either_way_is_told_with_the_azimuth_of_the_other(counts: float) -> None:
    """The output is the same for both: the run's own azimuth, 33 deg, is found or stands in the note."""
    columns = dict(own_seek(1, 33.0, 40.0, walk=0.0, drift=np.zeros_like).columns)
    del columns["position"]
    columns["angle"] = counts * columns["angle"]
    fix = north_from_positions(Run("angle", columns, Facts(latitude=40.0)))
    told = float(re.search(r"of one that counts clockwise the azimuth is (\S+) deg", " ".join(fix.notes))[1])
    right, mirrored = (told, fix.azimuth_deg) if counts < 0.0 else (fix.azimuth_deg, told)
    assert (right, mirrored) == pytest.approx((33.0, 327.0), abs=0.02)


def test_a_table_whose_angles_begin_elsewhere_is_told_where_they_were_looked_for() -> None:
    columns = dict(own_seek(1, 12.0, 40.0, walk=0.0, drift=np.zeros_like).columns)
    del columns["position"]
    columns["angle"] = columns["angle"] + 10.0
    run = Run("elsewhere", columns, Facts(latitude=40.0))
    with pytest.raises(InputError, match=r"within 0\.5 deg of 0, 270, 180, 90 deg: --order"):
        north_from_positions(run)
    # Angles of the table are clockwise ones of the other sign, and the azimuth that of its zero.
    fix = north_from_positions(run, order_deg=(-10.0, 80.0, 170.0, 260.0))
    assert fix.azimuth_deg == pytest.approx(22.0, abs=0.01)


@pytest.mark.parametrize("latitude", [89.6, -89.85])
def test_near_a_pole_an_azimuth_that_is_noise_says_so(latitude: float) -> None:
    azimuths, inside, told = np.linspace(0.0, 340.0, 30), 0, 0
    for seed, azimuth in enumerate(azimuths):
        fix = north_from_positions(own_seek(seed, azimuth, latitude, walk=0.01, drift=np.zeros_like))
        assert fix.se_deg is not None
        inside += abs(float(wrapped(fix.azimuth_deg - azimuth))) <= 1.645 * fix.se_deg
        told += "don't tell north" in " ".join(fix.notes)
    assert inside >= 24 and told >= 10


def test_a_bias_that_bends_is_taken_out_by_as_much_as_it_is_probable() -> None:
    def seeks(amplitude: float, method: str, count: int) -> tuple[float, list[float | None], int]:
        """Rms error in standard errors, probabilities of a bend, and how many say that it bends."""
        scores, shares, told = [], [], 0
        for seed in range(count):
            azimuth = 14.0 * seed
            run = own_seek(seed, azimuth, 40.0, walk=0.001, drift=lambda t: amplitude * np.exp(-t / 300.0))
            fix = north_from_positions(run, method=method)
            assert fix.se_deg is not None and fix.method == method.replace("auto", "averaged")
            scores.append(float(wrapped(fix.azimuth_deg - azimuth)) / fix.se_deg)
            shares.append(fix.bend_probability)
            told += "bends" in " ".join(fix.notes)
        return float(np.sqrt(np.mean(np.square(scores)))), shares, told

    off, _, told = seeks(2.0, "drift-observing", 10)
    assert off > 1.5 and told >= 8
    assert seeks(2.0, "bend-observing", 10)[0] < 1.2
    off, shares, told = seeks(2.0, "auto", 20)
    assert off < 1.2 and np.median(shares) > 0.9 and told <= 1
    # By unit information of four stays a bend that shows nothing has the odds 1 to sqrt(5).
    off, shares, told = seeks(0.0, "auto", 20)
    assert off < 1.2 and np.quantile(shares, 0.3) < 0.4 and told <= 1


def test_a_bias_that_bends_otherwise_than_a_square_of_time_is_said() -> None:
    told = 0
    for seed in range(10):
        run = own_seek(seed, 30.0 * seed, 40.0, walk=0.001, drift=lambda t: 1.5 * np.exp(-t / 60.0))
        told += "otherwise than a square" in " ".join(north_from_positions(run).notes)
    assert told >= 9


def test_a_set_up_that_the_run_contradicts_is_noted() -> None:
    run = own_seek(1, 77.0, 40.0, walk=0.001, drift=np.zeros_like)
    assert north_from_positions(run).notes == ()
    assert "the other --sense" in north_from_positions(run, sense="ccw").notes[-1]
    order = (0.0, 180.0, 90.0, 270.0)
    assert "--order" in north_from_positions(run, order_deg=order).notes[-1]
    up = Run(run.name, dict(run.columns), Facts(latitude=40.0, input_axis="up"))
    assert "points up" in " ".join(north_from_positions(up).notes)


def test_a_gyro_that_stands_still_shows_no_north_and_a_stuck_one_says_so() -> None:
    run = simulated_positions(Scheme(transfer_s=10.0), 77.0, 30.0, Drift(), bias_deg_h=0.4)
    run = run.with_facts(Facts())
    with pytest.raises(InputError, match="in every sample"):
        recorded_north_json(run.with_columns(gyro=np.full(len(run), 5.0)), order_deg=Scheme().order_deg)
    gyro = run.gyro + np.random.default_rng(0).normal(0.0, 0.05, len(run))
    sound, stuck = run.with_columns(gyro=gyro), gyro.copy()
    second = np.flatnonzero(run.columns["position"] == 2)
    stuck[second] = stuck[second[0]]
    for one, codes in ((sound, []), (run.with_columns(gyro=stuck), ["stuck_sensor"])):
        noticed = one.with_findings(check_run(one))
        told = recorded_north_json(noticed, order_deg=Scheme().order_deg)["findings"]
        assert [finding["code"] for finding in told][:1] == codes


def test_a_coarse_seek_that_takes_all_the_time_is_told_with_what_it_takes() -> None:
    """Four positions of 6 s in the 20 s of four of 5 s."""
    _, left_out = ways_of_equal_time(Scheme(dwell_s=5.0), coarse_dwell_s=6.0)
    assert "take 24 of 20 s" in left_out["coarse-fine"]


@pytest.mark.parametrize("late_s", [-6, 0, 6, 15])
def test_positions_on_another_clock_are_cut_to_what_stands(late_s: int) -> None:
    """Stays of a minute, ways of 10 s; of a steady seek nothing is left out."""
    position = np.concatenate([np.append(np.full(60, k + 1.0), np.zeros(10)) for k in range(4)])[:-10]
    angle = np.concatenate(
        [np.append(np.full(60, 90.0 * k), 90.0 * k + 9.0 * np.arange(10)) for k in range(4)]
    )[:-10]
    time, azimuth = np.arange(len(position)), 77.0
    gyro = 1.0 + 11.5 * np.cos(np.radians(azimuth + angle))
    gyro += 0.1 * np.random.default_rng(4).standard_normal(len(time))
    recorded = position[np.clip(time - late_s, 0, len(time) - 1)]
    fix = north_from_positions(Run("seek", {"time": time * 1.0, "gyro": gyro, "position": recorded}))
    assert fix.azimuth_deg == pytest.approx(azimuth, abs=0.3) and fix.se_deg < 0.3
    left_out = [note for note in fix.notes if "of a position are left out" in note]
    assert [("last" if late_s > 0 else "first") in note for note in left_out] == [True] * bool(late_s)
