"""Run files of all formats as other programs write them, read to the last digit."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import h5py
import numpy as np
import pyarrow as arrow
import pyarrow.parquet as parquet
import pytest
from hypothesis import HealthCheck, given, settings
from scipy.io import savemat

from fogml.errors import InputError
from fogml.runs.columns import KNOWN
from fogml.runs.reading import read_blocks, read_run
from tests.runs.files import SUFFIXES, same, samples, tables, write_table

slow = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.parametrize("suffix", SUFFIXES)
@slow
@given(columns=tables())
def test_any_numbers_come_back_to_the_last_digit(tmp_path, suffix, columns):
    path = write_table(tmp_path / f"run{suffix}", columns)
    assert same(read_run(path), columns)


UNITS = [
    ("time [ms]", 1500.0, "time", 1.5),
    ("time [us]", 2.5e6, "time", 2.5),
    ("time [ns]", 2.5e9, "time", 2.5),
    ("time [min]", 2.5, "time", 150.0),
    ("time [h]", 2.5, "time", 9000.0),
    ("time [sec]", 2.5, "time", 2.5),
    ("time [d]", 0.5, "time", 43_200.0),
    ("gyro [deg/s]", 0.01, "gyro", 36.0),
    ("gyro [°/h]", 0.5, "gyro", 0.5),
    ("gyro [°/s]", 0.5, "gyro", 1800.0),
    ("gyro [rad/s]", 1e-6, "gyro", 1e-6 * 3600 * 180 / np.pi),
    ("replayed [deg/s]", 0.01, "replayed", 36.0),
    ("replayed [rad/s]", 1e-6, "replayed", 1e-6 * 3600 * 180 / np.pi),
    ("T [K]", 300.0, "T", 26.85),
    ("T [°C]", 26.85, "T", 26.85),
    ("T_in [K]", 273.15, "T_in", 0.0),
    ("T_out [K]", 0.0, "T_out", -273.15),
    ("T7 [K]", 300.0, "T7", 26.85),
    ("T_chamber [K]", 300.0, "T_chamber", 26.85),
    ("T_case [C]", 1.0, "T_case", 1.0),
    ("T_electronics [K]", 300.0, "T_electronics", 26.85),
    ("rate [deg/h]", 3600.0, "rate", 1.0),
    ("rate [rad/s]", 1.0, "rate", 180 / np.pi),
    ("rate [deg/s]", 10.0, "rate", 10.0),
    ("angle [rad]", np.pi, "angle", 180.0),
    ("angle [deg]", 90.0, "angle", 90.0),
    ("power [W]", 2.0, "power", 2.0),
    ("supply [V]", 5.0, "supply", 5.0),
    ("humidity [%]", 40.0, "humidity", 40.0),
    ("vibration [g]", 0.1, "vibration", 0.1),
    ("compressor [%]", 50.0, "compressor", 0.5),
    ("heater [0/1]", 1.0, "heater", 1.0),
    ("heater [1]", 0.85, "heater", 0.85),
    ("fan [%]", 100.0, "fan", 1.0),
    ("dose [krad]", 2.0, "dose", 20.0),
    ("B_x [G]", 0.5, "B_x", 50.0),
    ("B_y [uT]", 50.0, "B_y", 50.0),
    ("B_z [µT]", 50.0, "B_z", 50.0),
]


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("cell, value, name, internal", UNITS)
def test_units_are_brought_to_the_internal_ones(tmp_path, suffix, cell, value, name, internal):
    columns = {"time [s]": np.arange(3.0), "gyro [deg/h]": np.arange(3.0)}
    columns = {other: values for other, values in columns.items() if not other.startswith(f"{name} ")}
    columns[cell] = np.array([0.0, value / 2, value]) if name == "time" else np.full(3, value)
    run = read_run(write_table(tmp_path / f"run{suffix}", columns))
    assert run.columns[name][-1] == pytest.approx(internal, rel=1e-15, abs=1e-13)


def test_every_unit_of_the_run_format_is_tested():
    tested = {(name, cell.split("[")[1][:-1]) for cell, _, name, _ in UNITS}
    aliases = {"°/h": "deg/h", "°C": "degC", "C": "degC", "µT": "uT", "sec": "s"}
    tested |= {(name, aliases.get(unit, unit)) for name, unit in tested}
    conversions = {(spec.name, unit) for spec in KNOWN.values() for unit in spec.units if unit != "count"}
    trivial = {(name, unit) for name, unit in conversions if unit == KNOWN[name].internal}
    assert conversions - trivial - tested <= {
        ("compressor", "%"), ("heater", "%"), ("compressor", "0/1"), ("fan", "0/1"), ("B_y", "G"),
        ("B_z", "G"), ("T_case", "K"), ("T_top", "K"), ("T_bottom", "K"),
    }  # fmt: skip


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_counts_stay_counts_and_become_a_rate_by_the_scale_factor(tmp_path, suffix):
    columns = {"time [s]": np.arange(3.0), "gyro [count]": np.array([7200.0, 3600.0, 0.0])}
    path = write_table(tmp_path / f"run{suffix}", columns)
    with pytest.raises(InputError, match=r"run\..*scale_factor"):
        _ = read_run(path).gyro_deg_h
    path.with_suffix(".yaml").write_text('scale_factor: {value: 3600.0, unit: "count per deg/s"}\n')
    run = read_run(path)
    assert run.gyro_unit == "count"
    assert run.gyro.tolist() == [7200.0, 3600.0, 0.0]
    assert run.gyro_deg_h.tolist() == [7200.0, 3600.0, 0.0]


@pytest.mark.parametrize(
    "kind", [np.float32, np.int64, np.int16, np.uint8, np.bool_], ids=lambda kind: kind.__name__
)
@pytest.mark.parametrize("suffix", [".parquet", ".h5", ".mat"])
def test_numbers_of_any_kind(tmp_path, suffix, kind):
    heater = np.array([0, 1, 1]).astype(kind)
    columns = {"time [s]": np.arange(3.0), "gyro [deg/h]": np.arange(3.0), "heater [0/1]": heater}
    run = read_run(write_table(tmp_path / f"run{suffix}", columns))
    assert run.columns["heater"].tolist() == [0.0, 1.0, 1.0]


def test_nanoseconds_since_1970_in_parquet(tmp_path):
    time = 1_772_438_400_000_000_001 + 10_000_000 * np.arange(5)
    path = write_table(tmp_path / "run.parquet", {"time [ns]": time, "gyro [deg/h]": np.zeros(5)})
    assert np.diff(read_run(path).time) == pytest.approx(0.01, abs=1e-6)


def test_hdf5_in_a_group_with_rows_or_columns(tmp_path):
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group["time [s]"] = np.arange(5.0)[:, None]
        group["gyro [deg/h]"] = np.arange(5.0)[None, :]
        group["comment"] = "free text"
        group["calibration"] = np.zeros((3, 3))
    run = read_run(path)
    assert run.gyro.tolist() == [0, 1, 2, 3, 4]
    assert {finding.column for finding in run.findings if finding.code == "left_out"} == {
        "comment",
        "calibration",
    }
    blocks = list(read_blocks(path, block_rows=2))
    assert np.concatenate([block.gyro for block in blocks]).tolist() == run.gyro.tolist()


def test_mat_with_the_rest_of_a_workspace(tmp_path):
    path = tmp_path / "run.mat"
    run_struct = {
        "time": np.arange(4.0),
        "gyro": np.ones((1, 4)),
        "T": np.ones((4, 1)),
        "fs": 100.0,
        "matrix": np.eye(3),
        "comment": "text",
        "units": {"time": "s", "gyro": "deg/h", "T": "K"},
        "facts": json.dumps({"unit": "FOG-0417", "latitude": 39.9}),
    }
    savemat(path, {"run": run_struct})
    run = read_run(path)
    assert run.temperature().tolist() == [-272.15] * 4
    assert run.facts.unit == "FOG-0417"
    assert {finding.column for finding in run.findings if finding.code == "left_out"} == {
        "fs",
        *(f"matrix column {i}" for i in (1, 2, 3)),
        "comment",
    }


class TestFacts:
    @pytest.fixture
    def path(self, tmp_path) -> Path:
        return write_table(tmp_path / "run.csv", samples())

    def test_all_of_them(self, path):
        path.with_suffix(".yaml").write_text(
            "unit: 0417\naxis: x\nlatitude: 39.9\ninput_axis: {heading: 30.0}\n"
            'scale_factor: {value: 2.0, unit: "count per deg/h"}\npowered_on: -60\n'
            "started: 2026-03-02T08:00:00Z\nnotes: free text\n"
        )
        facts = read_run(path).facts
        # YAML takes 0417 for an octal number; a serial number is a name.
        assert facts.unit == "0417"
        assert facts.axis == "x"
        assert facts.input_axis.heading == 30.0
        assert facts.scale_factor.count_per_deg_h == 2.0
        assert facts.powered_on == -60.0
        assert facts.started == datetime(2026, 3, 2, 8, tzinfo=UTC)

    @pytest.mark.parametrize("name", ["0x1F", "12:30", "2026-03-02", "1_000", "yes", "1e3", "007"])
    def test_a_serial_number_is_kept_letter_by_letter(self, path, name):
        path.with_suffix(".yml").write_text(f"unit: {name}\n")
        assert read_run(path).facts.unit == name

    def test_an_empty_side_file(self, path):
        path.with_suffix(".yaml").write_text("# nothing known yet\n")
        assert read_run(path).facts.as_dict() == {}

    def test_a_side_file_comes_before_what_the_file_states(self, tmp_path):
        path = tmp_path / "run.parquet"
        table = arrow.table(samples())
        metadata = {"fogml.facts": json.dumps({"unit": "inside", "axis": "x"})}
        parquet.write_table(table.replace_schema_metadata(metadata), path)
        assert read_run(path).facts.unit == "inside"
        path.with_suffix(".yaml").write_text("unit: beside\n")
        assert read_run(path).facts.as_dict() == {"unit": "beside"}

    @pytest.mark.parametrize(
        "text, told",
        [
            ("latitud: 39.9", "latitud.*known keys.*latitude"),
            ("latitude: north", "latitude.*number"),
            ("latitude: 91", "latitude.*90"),
            ("latitude: .nan", "latitude"),
            ("input_axis: sideways", "input_axis.*'up'.*heading"),
            ("input_axis: {heading: .inf}", "input_axis"),
            ("scale_factor: 3", "scale_factor.*value: 1.0"),
            ("scale_factor: {value: 0}", "scale_factor.*0"),
            ("compensated: yes", "yes.*compensated: true"),
            ('scale_factor: {value: 1, unit: "V"}', "count per deg/h"),
            ("started: 2026-13-45", "started.*ISO 8601"),
            ("started: 20260302", "started.*20260302.*2026-03-02T08"),
            ("powered_on: yes", "powered_on.*number.*'yes'"),
            ("powered_on: true", "powered_on.*number.*True"),
            ("powered_on: 1:30", "powered_on.*number.*'1:30'"),
            ("latitude: 030", "latitude.*'030' begins with a zero"),
            ("latitude: '39.9'", "latitude.*number.*'39.9'"),
            ("scale_factor: {value: true}", "scale_factor.*True"),
            ("started: soon", "started.*2026-03-02"),
            ("powered_on: .inf", "powered_on"),
            ("- a\n- b", "key: value"),
            ("unit: [", "line 1.*YAML|YAML"),
            ("unit: a\naxis: x\nunit: b", "line 3.*'unit'.*twice"),
            ("[" * 5000, "more than 32 levels|maximum nesting depth"),
            ("1: 2", "'1'"),
        ],
    )
    def test_faults_name_file_and_key(self, path, text, told):
        path.with_suffix(".yaml").write_text(text)
        for read in (read_run, lambda path: next(read_blocks(path))):
            with pytest.raises(InputError, match=rf"(?s)run\.yaml.*({told})"):
                read(path)

    def test_a_side_file_that_is_no_text(self, path):
        path.with_suffix(".yaml").write_bytes(bytes(range(256)))
        with pytest.raises(InputError, match=r"run\.yaml, line 2: is no UTF-8"):
            read_run(path)
