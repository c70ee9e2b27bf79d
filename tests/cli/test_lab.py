"""``fogml lab``: what its commands print and write, what is run again, and what they refuse."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from fogml.errors import InputError
from fogml.lab.misalignment_simulation import TableUnit, measurements
from fogml.lab.north import Drift, Scheme
from fogml.lab.north_positions import north_from_positions
from fogml.lab.north_schemes import simulated_positions
from fogml.runs.run import Run

MISALIGNMENT_KEYS = ("K", "delta_x_deg", "delta_y_deg", "delta_deg", "fixture_error_deg", "se")
NORTH_KEYS = (
    "azimuth_deg",
    "drift_deg_h_per_h",
    "quiet_azimuth_deg",
    "worst_azimuth_deg",
    "error_deg",
    "se",
)


@pytest.fixture
def turns(tmp_path: Path) -> Path:
    """The documented file: one row per average, four states, four tilts."""
    made = measurements(TableUnit(1.2345, 5.0, 3.0, 0.5), (0.0, 30.0, 60.0, 90.0), (10.0, -10.0), noise=1e-5)
    rows = ["state,tilt [deg],rate [deg/s],segment,output [V]"]
    for state, tilt, rate, value in np.column_stack(
        [made.state, made.tilt_deg, made.rate_deg_s, made.output]
    ).tolist():
        rows += [
            f"{state:g},{tilt:g},{rate:g},{mark},{level!r}"
            for mark, level in (("before", 0.2), ("turn", 0.2 + value), ("after", 0.2))
        ]
    path = tmp_path / "turns.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.fixture
def positions(tmp_path: Path) -> Path:
    """A recorded seek at 77 deg with a drift."""
    run = simulated_positions(Scheme(dwell_s=30.0, transfer_s=10.0), 77.0, 30.0, Drift(2.0), bias_deg_h=0.4)
    columns = np.column_stack([run.columns[name] for name in ("time", "gyro", "position")])
    path = tmp_path / "positions.csv"
    header = "time [s],gyro [deg/h],position"
    np.savetxt(path, columns, delimiter=",", header=header, comments="", fmt="%.12g")
    path.with_suffix(".yaml").write_text("latitude: 30.0\n")
    return path


def test_a_noise_run_of_several_legs_is_refused_and_named(run_files, tmp_path: Path, invoke) -> None:
    legs = tmp_path / "legs.csv"
    first, second = (path.read_text().splitlines() for path in run_files)
    legs.write_text("\n".join([*first, *second[1:]]))
    told = invoke("lab", "acceptance", run_files[0], "--noise", legs, "--repair", status=2).stderr
    assert "legs.csv" in told and "one run is needed here" in told


def test_of_a_static_run_nothing_is_said_of_drift_models(tmp_path: Path, invoke) -> None:
    still = tmp_path / "still.csv"
    gyro = np.random.default_rng(1).normal(5.0, 0.1, 1000)
    rows = [f"{i},{value:.6f},25.0" for i, value in enumerate(gyro)]
    still.write_text("\n".join(["time [s],gyro [deg/h],T [degC]", *rows]))
    assert "drift model" not in invoke("lab", "acceptance", still).stderr


def test_misalignment(turns: Path, tmp_path: Path, invoke, invoke_json) -> None:
    told = invoke_json("lab", "misalignment", turns)
    assert told["schema"] == "fogml.misalignment/1" and set(MISALIGNMENT_KEYS) <= set(told)
    assert told["K"] == pytest.approx(1.2345, rel=1e-5) and told["unit"] == "V per deg/s"
    assert told["fixture_error_deg"] == pytest.approx([0.5, 0.5], abs=1e-3)
    assert 0.0 < told["se"]["delta_x_deg"] < 1e-3
    out = tmp_path / "out"
    printed = invoke("lab", "misalignment", turns, "--out", out).stdout
    assert "four states" in printed and "misalignment.html" in printed
    files = ["lab-misalignment.config.yaml", "misalignment.html", "misalignment.json"]
    assert sorted(p.name for p in out.iterdir()) == files
    assert json.loads((out / "misalignment.json").read_text()) == told
    assert invoke_json("lab", "misalignment", "--config", out / "lab-misalignment.config.yaml") == told


def test_misalignment_without_constant(turns: Path, invoke_json) -> None:
    assert invoke_json("lab", "misalignment", turns, "--cross-tilt")["cross_tilt"] is True
    assert invoke_json("lab", "misalignment", turns, "--no-cross-tilt")["cross_tilt"] is False


def test_misalignment_without_the_upright_tilt(turns: Path, invoke) -> None:
    """The classical test needs tilt 0; without it the four states still tell, and have a dash beside them."""
    lines = turns.read_text().splitlines()
    turns.write_text("\n".join(line for line in lines if line.split(",")[1] != "0") + "\n")
    printed = invoke("lab", "misalignment", turns).stdout
    assert "classical" in printed and "1.2345" in printed and "-0.0" not in printed


def test_north_of_a_recording(positions: Path, tmp_path: Path, invoke, invoke_json) -> None:
    told = invoke_json("lab", "north", "--positions", positions)
    assert told["schema"] == "fogml.north/1" and set(NORTH_KEYS) <= set(told)
    assert told["azimuth_deg"] == pytest.approx(77.0, abs=1e-6)
    assert told["drift_deg_h_per_h"] == pytest.approx(2.0, abs=1e-5)
    assert told["quiet_azimuth_deg"] == pytest.approx([135.0, 315.0])
    out = tmp_path / "north"
    assert "azimuth is 77.0" in invoke("lab", "north", "--positions", positions, "-o", out).stdout
    assert sorted(p.name for p in out.iterdir()) == ["lab-north.config.yaml", "north.html", "north.json"]


@pytest.mark.parametrize(("sense", "turn"), [("cw", -1.0), ("ccw", 1.0)])
def test_positions_follow_from_the_table_angle(sense: str, turn: float) -> None:
    """As recorded, clockwise negative; a sample beside a turn is on the way."""
    run = simulated_positions(Scheme(sense=sense, dwell_s=30.0, transfer_s=10.0), 77.0, 30.0, Drift(2.0))
    position = run.columns["position"]
    held = np.maximum.accumulate(np.where(position > 0.0, np.arange(len(position)), 0))
    angle = turn * 90.0 * (position[held] - 1.0) + np.where(position > 0.0, 0.0, 45.0)
    angles = Run("turned", {"time": run.time, "gyro": run.columns["gyro"], "angle": angle + 360.0}, run.facts)
    found = north_from_positions(angles, sense=sense)
    assert found.azimuth_deg == pytest.approx(north_from_positions(run, sense=sense).azimuth_deg, abs=0.05)
    assert found.azimuth_deg == pytest.approx(77.0, abs=0.05)
    with pytest.raises(InputError, match="column 'angle"):
        north_from_positions(Run("neither", {"time": run.time, "gyro": run.columns["gyro"]}, run.facts))


def test_a_simulated_seek_is_read_as_it_was_written(tmp_path: Path, invoke, invoke_json) -> None:
    out = tmp_path / "seek.csv"
    invoke("simulate", "--programme", "four-positions", "--twin", "tactical", "-o", out)
    assert yaml.safe_load(out.with_suffix(".yaml").read_text())["input_axis"] == "north"
    told = invoke_json("lab", "north", "--positions", out)
    off = (told["azimuth_deg"] + 180.0) % 360.0 - 180.0
    assert 0.0 < told["se"] < 2.0 and abs(off) < 4.0 * told["se"]


def test_north_simulated(tmp_path: Path, invoke, invoke_json) -> None:
    asked = ("--azimuth", 45, "--latitude", 30, "--dwell", 60, "--transfer", 0, "--drift", 0.18)
    told = invoke_json("lab", "north", *asked)
    assert set(NORTH_KEYS) <= set(told)
    assert told["error_deg"] == pytest.approx(0.01866, abs=5e-6)
    assert told["error_deg"] == pytest.approx(told["simulated_error_deg"], abs=1e-9)
    assert told["greatest_error_deg"] == pytest.approx(0.01866, abs=5e-6)
    assert told["drift_deg_h_per_h"] == pytest.approx(0.18)
    assert told["quiet_azimuth_deg"] == pytest.approx([135.0, 315.0])
    ccw = invoke_json("lab", "north", *asked, "--sense", "ccw")
    assert ccw["quiet_azimuth_deg"] == pytest.approx([45.0, 225.0]) and abs(ccw["error_deg"]) < 1e-9
    order = invoke_json("lab", "north", *asked, "--order", "0,180,270,90")
    assert order["quiet_azimuth_deg"] == pytest.approx([45.0, 225.0])
    out = tmp_path / "north"
    more = ("--transient", "0.2,600", "--transient", "0.1,120", "--noise", 0.002, "--way", "coarse-fine")
    first = invoke_json("lab", "north", *asked, *more, "-o", out)
    assert first["se"] > 0.0 and first["way"] == "coarse-fine"
    config = out / "lab-north.config.yaml"
    assert yaml.safe_load(config.read_text())["transients"] == [[0.2, 600.0], [0.1, 120.0]]
    assert invoke_json("lab", "north", "--config", config) == first


def test_rate_of_a_twin_and_of_its_recorded_test(tmp_path: Path, invoke, invoke_json) -> None:
    twin = tmp_path / "unit.yaml"
    twin.write_text("schema: fogml.twin/1\neffects: {deadband: {amplitude: 0.3}}\n")
    out = tmp_path / "rate"
    assert "threshold" in invoke("lab", "rate", "--twin", twin, "-o", out).stdout
    assert sorted(p.name for p in out.iterdir()) == ["lab-rate.config.yaml", "rate.html", "rate.json"]
    told = json.loads((out / "rate.json").read_text())
    assert told["schema"] == "fogml.rate/1" and told["kind"] == "simulated"
    assert told["threshold"] == {"above_deg_h": pytest.approx(0.2), "below_deg_h": pytest.approx(0.5)}
    turn = (
        "turn at 10 deg/s for 60 s, then -10 deg/s for 60 s, then 20 deg/s for 60 s, then -20 deg/s for 60 s"
    )
    config = {"schema": "fogml.simulate/1", "programme": [{"hold for 6 min": [f"{turn}, from minute 1"]}]}
    config |= {"twin": "nominal", "out": str(tmp_path / "run.csv")}
    (tmp_path / "simulate.yaml").write_text(yaml.safe_dump(config))
    invoke("simulate", tmp_path / "simulate.yaml")
    told = invoke_json("lab", "rate", tmp_path / "run.csv")
    assert told["scale_factor"]["scale_factor"] == pytest.approx(1.0, abs=1e-6)
    assert told["bandwidth"] is None and told["unit"] is None


def test_three_positions_tell_no_drift_and_say_so(invoke_json) -> None:
    told = invoke_json("lab", "north", "--azimuth", 10, "--latitude", 30, "--order", "0,120,240")
    assert told["drift_deg_h_per_h"] is None
    assert any("drift-observing is left out" in note for note in told["notes"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("misalignment",), "no file is given"),
        (("misalignment", "nowhere.csv"), "no such file"),
        (("rate",), "give recorded runs, or --twin"),
        (("rate", "--twin", "nowhere.yaml"), "no such twin"),
        (("rate", "--twin", "nominal", "--greatest", -5), "'greatest'"),
        (("rate", "--twin", "nominal", "shipped:thermal-cycle-1-x"), "one of the two"),
        (("north",), "--positions, or --azimuth and --latitude"),
        (("north", "--azimuth", 10), "--azimuth and --latitude"),
        (("north", "--azimuth", 10, "--latitude", 95), "latitude 95"),
        (("north", "--azimuth", 10, "--latitude", "nan"), "'latitude': Input should be a finite number"),
        (("north", "--azimuth", "nan", "--latitude", 10), "'azimuth': Input should be a finite number"),
        (("north", "--azimuth", 10, "--latitude", 10, "--sense", "left"), "sense 'left'"),
        (("north", "--azimuth", 10, "--latitude", 10, "--order", "0,x"), "no list of numbers"),
        (("north", "--azimuth", 10, "--latitude", 10, "--order", "0,90"), "three different angles"),
        (("north", "--azimuth", 10, "--latitude", 10, "--transient", "0.2"), "write 0.2,600"),
        (("north", "--azimuth", 10, "--latitude", 10, "--dwell", -1), "dwell -1"),
        (("north", "--azimuth", 10, "--latitude", 10, "--way", "fast"), "way 'fast'"),
        (("north", "--azimuth", 10, "--latitude", 10, "--noise", -1), "'noise': Input should be greater"),
        (("north", "--positions", ".", "--azimuth", 1), "give one of them"),
        (("north", "--positions", ".", "--drift", 0.2), "--drift is of a simulation"),
        (("north", "--positions", ".", "--transient", "0.2,60"), "--transient is of a simulation"),
        (("north", "--positions", ".", "--way", "fast"), "--way is of a simulation"),
        (("north", "--azimuth", 10, "--latitude", 10, "--settle", 5), "--settle is of a recorded run"),
        (("north", "--azimuth", 10, "--latitude", 10, "--method", "plain"), "or give --positions"),
        (("rate", "shipped:thermal-cycle-1-x", "--noise"), "--noise is of the test of a twin"),
        (("rate", "shipped:thermal-cycle-1-x", "--greatest", 20), "--greatest is of the test of a twin"),
    ],
)
def test_bad_usage_is_one_message(invoke, tmp_path: Path, monkeypatch, arguments, message: str) -> None:
    monkeypatch.chdir(tmp_path)
    result = invoke("lab", *arguments, "--out", "out", status=2)
    assert message in result.stderr and result.stderr.count("fogml: ") == 1
    assert result.stdout == "" and not list(tmp_path.iterdir())


def test_faulty_files_write_nothing(turns: Path, positions: Path, tmp_path: Path, invoke) -> None:
    out = tmp_path / "out"
    text = turns.read_text()
    upright = [row for row in text.splitlines() if row.startswith("state") or row[1:4] == ",0,"]
    for change, message in (
        (text.replace("\n4,", "\n3,"), "no turns in state 4"),
        ("\n".join(upright) + "\n", "only tilt 0 deg"),
        (text.replace("state,", "x,", 1), "no column 'state'"),
        (text.replace("0.2\n", "nan\n", 1), "missing or not finite"),
    ):
        turns.write_text(change)
        assert message in invoke("lab", "misalignment", turns, "-o", out, status=2).stderr
    text = positions.read_text()
    positions.write_text("\n".join(row for row in text.splitlines() if not row.endswith(",2")) + "\n")
    assert "position 2" in invoke("lab", "north", "--positions", positions, "-o", out, status=2).stderr
    assert not out.exists()


def test_train_shows_the_cost_in_navigation(run_files, tmp_path: Path, invoke, invoke_json) -> None:
    out = tmp_path / "out"
    asked = ("train", run_files[0], "--test", run_files[1], "--model", "polynomial", "--features", "T, dT")
    told = invoke_json(*asked, "-o", out, "--navigation", 39.9)
    assert told["navigation"]["latitude_deg"] == 39.9
    costs = told["navigation"]["test"][0]
    assert costs["run"] == "b.csv" and len(costs["constant"]["after"]["north"]["position_km"]) == 6
    assert costs["constant"]["after"]["drift_deg_h"] == pytest.approx(told["test"][0]["after"]["rms"])
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "What the drift costs in navigation" in page
    assert "navigation" in json.loads((out / "report.json").read_text())
    message = invoke(*asked, "-o", tmp_path / "other", "--navigation", 90, status=2).stderr
    assert "latitude 90" in message and not (tmp_path / "other").exists()


def test_what_rounding_leaves_is_no_error_and_the_terminal_shows_the_page(tmp_path: Path, invoke) -> None:
    asked = ("--azimuth", 77, "--latitude", 40, "--transfer", 10, "--drift", 0.18, "--noise", 0.01)
    told = invoke("lab", "north", *asked, "-o", tmp_path / "out").stdout
    ways = json.loads((tmp_path / "out" / "north.json").read_text())["ways"]
    assert ways["palindrome"]["greatest_error_deg"] == ways["drift-observing"]["error_deg"] == 0.0
    assert ways["plain"]["error_deg"] > 1e-3 and "e-1" not in told
    assert "under 10⁻⁹ deg" in (tmp_path / "out" / "north.html").read_text()
    for way in ways.values():
        assert f"{way['rms_se']:.3g}" in told
