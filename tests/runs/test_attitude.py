"""Attitude of gyro and table against vectors that are turned by scipy's rotations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fogml.arrays import FloatArray
from fogml.runs.attitude import attitude, earth_field
from fogml.runs.facts import EARTH_RATE_DEG_H, Direction, Facts, Heading
from fogml.runs.run import Run
from fogml.runs.turning import turned_earth_rate
from fogml.twin.inputs import Inputs
from fogml.twin.registry import effect
from fogml.twin.replay import replay
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin

AXES = ("up", "down", "north", "south", "east", Heading(heading=30.0))
TABLES = ("up", "down", "east", Direction(heading=30.0, elevation=40.0))
LATITUDES = (40.0, -40.0)
TURNING = [
    {"soak at 25 degC for 3 min": ["turn at 10 deg/s for 30 s, then -400 deg/s for 30 s, from second 20"]},
    {"ramp to 35 degC at 5 degC/min": ["turn at 2 deg/s for 60 s from second 10"]},
]


def earth(latitude: float) -> FloatArray:
    phi = np.radians(latitude)
    return EARTH_RATE_DEG_H * np.array([np.cos(phi), 0.0, np.sin(phi)])


def carried(vector: FloatArray, table: FloatArray, theta_deg: FloatArray) -> FloatArray:
    """A vector on the table at each angle, shape (n, 3)."""
    return Rotation.from_rotvec(np.radians(theta_deg)[:, None] * table).apply(vector)


@pytest.mark.parametrize("axis", AXES, ids=str)
@pytest.mark.parametrize("table", TABLES, ids=str)
def test_frames_are_right_handed_and_the_field_turns_in_them(axis, table) -> None:
    for latitude in LATITUDES:
        facts = Facts(latitude=latitude, input_axis=axis, table_axis=table)
        held = attitude(facts)
        frame = np.stack([held.x, held.y, held.z])
        assert np.linalg.det(frame) == pytest.approx(1.0)
        theta = np.linspace(-200.0, 500.0, 15)
        # Earth's field points down in the north, up in the south.
        field = np.array([20.0, 0.0, -np.sign(latitude) * 40.0])
        found = earth_field(facts, held.sense * theta, 20.0, 40.0)
        for name, own in zip(("B_x", "B_y", "B_z"), frame):
            assert found[name] == pytest.approx(carried(own, held.table, theta) @ field, abs=1e-9)


@pytest.mark.parametrize("axis", AXES, ids=str)
@pytest.mark.parametrize("table", TABLES, ids=str)
@pytest.mark.parametrize("latitude", LATITUDES)
def test_a_simulated_gyro_feels_earth_and_table_as_vectors(axis, table, latitude: float) -> None:
    facts = Facts(latitude=latitude, input_axis=axis, table_axis=table)
    found = simulate(TURNING, Twin(), facts=facts).run
    held = attitude(facts)
    theta = held.sense * found.columns["angle"]
    now = carried(held.z, held.table, theta)
    turned = np.gradient(theta)
    # Away from the table's own changes of rate.
    steady = np.abs(np.gradient(turned)) < 1e-9
    wanted = now @ earth(latitude) + 3600.0 * turned * (now @ held.table)
    assert found.gyro[steady] == pytest.approx(wanted[steady], abs=1e-5)
    # Rate and angle have one sense: that of the input axis.
    assert np.all((found.rate * np.gradient(found.columns["angle"]))[steady] >= -1e-9)


@pytest.mark.parametrize("axis", ["up", "down", "north", "south"])
@pytest.mark.parametrize("latitude", LATITUDES)
@pytest.mark.parametrize("id", ["input_axis_misalignment", "table_wobble"])
def test_a_tilted_axis_feels_all_rates_across_it(axis: str, latitude: float, id: str) -> None:
    """Means over the samples by own integration over the table's angle."""
    facts = Facts(latitude=latitude, input_axis=axis)
    held, rate, delta, way = attitude(facts), 3.0, 1e-3, 35.0
    theta = rate * np.arange(200.0)
    angle = held.sense * theta
    given = Inputs(
        np.arange(200.0),
        {"T": np.full(200, 25.0)},
        np.full(200, held.along * rate),
        earth_deg_h=facts.earth_rate_deg_h or 0.0,
        facts=facts,
        drives={"angle": angle},
    )
    name = "direction" if id == "input_axis_misalignment" else "phase"
    size = 1.0 if id == "input_axis_misalignment" else np.degrees(delta) * 3600.0
    found = effect(id).signature(given, **{name: way}) * size
    z, across = held.z, held.tilted_to(way)
    assert np.dot(z, across) == pytest.approx(0.0, abs=1e-15)
    tilted = np.cos(delta) * z + np.sin(delta) * across
    fine = (theta[1:, None] - rate) + rate * (np.arange(200) + 0.5)[None, :] / 200
    now = carried(tilted - np.cos(delta) * z, held.table, fine.ravel())
    felt = now @ (earth(latitude) + 3600.0 * rate * held.table)
    assert found[1:] == pytest.approx(felt.reshape(fine.shape).mean(axis=1), rel=1e-5, abs=1e-7)


def test_five_milliradian_of_a_level_axis_feel_180_deg_h_of_a_table_at_10_deg_s() -> None:
    facts = Facts(latitude=0.0, input_axis="east")
    programme = [{"soak at 25 degC for 5 min": ["turn at 10 deg/s for 2 min from second 60"]}]
    gyros = [
        simulate(programme, twin, facts=facts).run.gyro[120]
        for twin in (Twin(), Twin().with_effect("input_axis_misalignment", 5.0, direction=0.0))
    ]
    assert gyros[1] - gyros[0] == pytest.approx(36_000.0 * np.sin(5e-3), rel=1e-3)
    for id in ("mount_tilt", "table_wobble"):
        twin = Twin().with_effect(id, 10.0, **({"direction": 0.0} if id == "mount_tilt" else {"phase": 0.0}))
        hot = [{"soak at 60 degC for 30 min": ["turn at 10 deg/s for 2 min from minute 25"]}]
        part = simulate(hot, twin, facts=facts, truth=True).truth.contributions[id]
        assert np.abs(part).max() > 1.0


def test_a_table_about_a_level_axis_turns_the_scale_factor_through() -> None:
    """Both table and input axis to the east: Earth does not turn in, and the whole rate is felt."""
    facts = Facts(latitude=50.0, input_axis="east", table_axis="east")
    twin = Twin().with_effect("source_wavelength", 10.0)
    programme = [{"soak at 45 degC for 2 h": ["turn at 20 deg/s for 60 s from minute 100"]}]
    found = simulate(programme, twin, facts=facts, truth=True)
    row = int(np.argmax(found.run.rate)) + 30
    ppm = -10.0 * (found.truth.nodes["T_electronics"][row] - 25.0)
    assert found.run.gyro[row] == pytest.approx(72_000.0 * (1.0 + 1e-6 * ppm), rel=1e-9)


@pytest.mark.parametrize("id", ["sf_asymmetry", "sf_nonlinearity"])
def test_scale_factor_follows_the_heading(id: str) -> None:
    """A level axis that the table turns from north to south: the rate about it changes sign."""
    facts = Facts(latitude=30.0, input_axis="north")
    programme = [{"soak at 25 degC for 5 min": ["turn to 180 deg at 30 deg/s at second 60"]}]
    twin = Twin().with_effect(id, 1000.0)
    part = simulate(programme, twin, facts=facts, truth=True).truth.contributions[id]
    horizontal = EARTH_RATE_DEG_H * np.cos(np.radians(30.0))
    if id == "sf_asymmetry":
        # s = k_a sign(Omega): the output gains k_a |Omega| both ways.
        assert part[[0, -1]] == pytest.approx(1e-3 * horizontal, rel=1e-6)
        given = Inputs(np.arange(2.0), {"T": np.zeros(2)}, np.zeros(2), facts=facts)
        given = replace(given, earth_deg_h=horizontal, drives={"angle": np.array([0.0, 180.0])})
        assert effect(id).signature(given) == pytest.approx([1.0, -1.0])
    else:
        assert part[0] == pytest.approx(-part[-1])


COLUMNS = {
    "all": None,
    "no field": ("T_in", "T_out", "T_case", "T_electronics", "rate", "angle", "fan"),
    "faces": ("T_in", "T_out", "rate", "angle"),
}


@pytest.mark.parametrize("axis", ["up", "down", "north", "east"])
@pytest.mark.parametrize("id", ["magnetic", "input_axis_misalignment", "table_wobble", "g_sensitivity"])
@pytest.mark.parametrize("columns", list(COLUMNS))
def test_replay_is_the_simulation_whatever_is_recorded(axis: str, id: str, columns: str) -> None:
    facts = Facts(latitude=-35.0, input_axis=axis)
    twin = Twin(surroundings=replace(Twin().surroundings, horizontal_field=26.0)).with_effect(id)
    recorded = COLUMNS[columns]
    if recorded is None:
        recorded = (*COLUMNS["no field"], "B_x", "B_y", "B_z", "power", "supply")
    run = simulate(TURNING, twin, facts=facts, columns=recorded).run
    assert replay(twin, run) == pytest.approx(run.gyro, abs=1e-7)


def test_whole_turns_of_a_fast_table_unwrap_about_a_downward_axis() -> None:
    """The slow samples of a table that turns by 400 deg in each; its angle is recorded modulo 360 deg."""
    facts = Facts(latitude=30.0, input_axis="down")
    twin = Twin().with_effect("input_axis_misalignment", 5.0, direction=20.0)
    programme = [{"soak at 25 degC for 2 h": ["turn at 40 deg/s for 60 min from minute 30"]}]
    run = simulate(programme, twin, facts=facts, sample_s=10.0).run
    wrapped = run.with_columns(angle=run.columns["angle"] % 360.0)
    moving = slice(200, 500)
    whole = replay(twin, run)[moving]
    assert replay(twin, wrapped)[moving] == pytest.approx(whole, abs=1e-9)
    assert whole == pytest.approx(run.gyro[moving], abs=1e-7)


def carried_round(facts: Facts, rate_deg_s: float = 0.0) -> Run:
    """A gyro of no error: at rest, a turn by 210 deg, at rest again."""
    time = np.arange(300.0)
    angle = np.clip(7.0 * (time - 100.0), 0.0, 210.0)
    rate = np.where((time >= 100.0) & (time < 130.0), rate_deg_s, 0.0)
    return Run.from_columns("turned", facts, time=time, gyro=0.0 * time, rate=rate, angle=angle)


@pytest.mark.parametrize(
    ("axis", "table", "sense"),
    [
        ("north", None, 1.0),
        ("east", None, 1.0),
        (Heading(heading=75.0), "up", 1.0),
        (Heading(heading=75.0), "down", -1.0),
    ],
)
def test_the_reference_holds_the_earth_as_the_table_turns_the_axis(axis, table, sense):
    """15.041 cos(lat) cos(heading), the heading less the angle of a table that turns counter-clockwise."""
    run = carried_round(Facts(latitude=40.0, input_axis=axis, table_axis=table))
    start = {"north": 0.0, "east": 90.0}.get(axis, 75.0) if isinstance(axis, str) else axis.heading
    heading = np.radians(start - sense * run.columns["angle"])
    expected = 15.041067 * np.cos(np.radians(40.0)) * np.cos(heading)
    np.testing.assert_allclose(run.reference_deg_h, expected, atol=1e-9)
    np.testing.assert_allclose(run[150:].reference_deg_h, expected[150:], atol=1e-9)
    assert "turned_earth_rate" in {finding.code for finding in turned_earth_rate(run)}


@pytest.mark.parametrize("facts", [Facts(latitude=40.0, input_axis="up"), Facts(input_axis="north"), Facts()])
def test_where_the_table_does_not_turn_it_the_earth_is_one_number(facts):
    run = carried_round(facts, 7.0)
    np.testing.assert_allclose(run.reference_deg_h - 3600.0 * run.rate, facts.earth_rate_deg_h or 0.0)
    assert not list(turned_earth_rate(run))


def test_a_part_at_rest_is_of_the_table_that_the_whole_run_tells():
    """A table that turns about the horizontal input axis leaves the Earth's part of it alone."""
    run = carried_round(Facts(latitude=40.0, input_axis="north"), 7.0)
    north = 15.041067 * np.cos(np.radians(40.0))
    np.testing.assert_allclose(run.reference_deg_h - 3600.0 * run.rate, north)
    for part in (run[200:], run[200:][10:], run[run.time > 200.0]):
        np.testing.assert_allclose(part.reference_deg_h, north)
