"""Runs that are written come back as they were; files appear whole or not at all."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fogml.errors import InputError
from fogml.runs.facts import Facts, Heading, ScaleFactor
from fogml.runs.reading import read_run
from fogml.runs.run import Run
from fogml.runs.writing import BlockWriter, write_run

SUFFIXES = [".csv", ".parquet", ".h5", ".hdf5", ".mat"]
KNOWN = ["T", "T_in", "T_out", "T1", "T2", "T_chamber", "rate", "angle", "power", "heater", "B_x"]
FACTS = Facts(
    unit="0417",
    axis="z",
    latitude=-33.25,
    input_axis=Heading(heading=30.0),
    scale_factor=ScaleFactor(value=12.5, unit="count per deg/s"),
    powered_on=-120.5,
    started=datetime(2026, 3, 2, 8, 0, tzinfo=UTC),
    notes='Kältekammer 2: öffnet; "quoted", 3 µm',
)
finite = st.floats(-1e19, 1e19)


@st.composite
def runs(draw) -> Run:
    rows = draw(st.integers(2, 12))
    bounded = st.integers(-(10**12), 10**12).map(lambda tick: 1.1e-3 * tick)
    time = draw(arrays(np.float64, rows, elements=bounded, unique=True))
    names = draw(st.lists(st.sampled_from(KNOWN), unique=True, max_size=4))
    columns = {"time": np.sort(time), "gyro": draw(arrays(np.float64, rows, elements=finite))}
    for name in names:
        columns[name] = draw(arrays(np.float64, rows, elements=finite))
    if draw(st.booleans()):
        columns["flow"] = draw(arrays(np.float64, rows, elements=st.floats(allow_infinity=False)))
    unit = draw(st.sampled_from(["deg/h", "count"]))
    return Run("run", columns, draw(st.sampled_from([Facts(), FACTS])), unit)


def assert_same(read: Run, run: Run) -> None:
    assert list(read.columns) == list(run.columns)
    for name, values in run.columns.items():
        np.testing.assert_array_equal(
            read.columns[name].view(np.uint64)[~np.isnan(values)], values.view(np.uint64)[~np.isnan(values)]
        )
        np.testing.assert_array_equal(np.isnan(read.columns[name]), np.isnan(values))
    assert read.facts == run.facts
    assert read.gyro_unit == run.gyro_unit


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(run=runs())
def test_comes_back_bit_by_bit(tmp_path_factory, suffix, run):
    path = tmp_path_factory.mktemp("trip") / f"run{suffix}"
    write_run(run, path)
    assert_same(read_run(path), run)


@pytest.mark.parametrize("suffix", [".parquet", ".h5", ".mat"])
def test_facts_travel_without_the_side_file(tmp_path, suffix):
    path = tmp_path / f"run{suffix}"
    write_run(Run("run", {"time": np.arange(3.0), "gyro": np.ones(3)}, FACTS), path)
    path.with_suffix(".yaml").unlink()
    assert read_run(path).facts == FACTS


def test_a_corrected_side_file_counts(tmp_path):
    path = tmp_path / "run.parquet"
    write_run(Run("run", {"time": np.arange(3.0), "gyro": np.ones(3)}, FACTS), path)
    path.with_suffix(".yaml").write_text("axis: y\n")
    assert read_run(path).facts == Facts(axis="y")


def test_matlab_7_3_on_request(tmp_path):
    h5py = pytest.importorskip("h5py")
    run = Run("run", {"time": np.arange(50.0), "gyro": np.ones(50), "T": np.arange(50.0)}, FACTS)
    path = tmp_path / "run.mat"
    write_run(run, path, mat_version="7.3")
    head = path.read_bytes()[:128]
    assert head.startswith(b"MATLAB 7.3 MAT-file")
    assert head[124:128] == b"\x00\x02IM"
    with h5py.File(path) as file:
        # MATLAB's column vectors are rows here, as it counts dimensions from the other end.
        assert file["time"].shape == (1, 50)
        assert file["time"].attrs["MATLAB_class"] == b"double"
    assert_same(read_run(path), run)


def test_matlab_5_as_scipy_reads_it(tmp_path):
    from scipy.io import loadmat

    path = tmp_path / "run.mat"
    write_run(Run("run", {"time": np.arange(5.0), "gyro": np.ones(5)}, gyro_unit="count"), path)
    assert path.read_bytes()[:116].decode().rstrip().endswith("Created on: unknown")
    held = loadmat(path, simplify_cells=True)
    np.testing.assert_array_equal(held["time"], np.arange(5.0))
    assert held["units"] == {"time": "s", "gyro": "count"}


def test_headers_of_csv_and_parquet(tmp_path):
    run = Run("run", {"time": np.arange(2.0), "gyro": np.ones(2), "T_in": np.ones(2), "flow": np.ones(2)})
    write_run(run, tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text().splitlines()[0] == "time [s],gyro [deg/h],T_in [degC],flow"
    assert not (tmp_path / "run.yaml").exists()
    write_run(run, tmp_path / "run.parquet")
    cells = ["time [s]", "gyro [deg/h]", "T_in [degC]", "flow"]
    assert pq.read_schema(tmp_path / "run.parquet").names == cells


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_block_by_block(tmp_path, suffix):
    rng = np.random.default_rng(0)
    run = Run("run", {"time": np.arange(1000.0), "gyro": rng.normal(size=1000)}, FACTS, "count")
    path = tmp_path / f"out{suffix}"
    with BlockWriter(path, FACTS) as writer:
        for start in range(0, 1000, 300):
            writer.write(run[start : start + 300])
            assert not path.exists()
    assert_same(read_run(path), run)
    assert yaml.safe_load(path.with_suffix(".yaml").read_text())["unit"] == "0417"


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_nothing_is_left_of_a_failure(tmp_path, suffix):
    path = tmp_path / f"out{suffix}"
    path.write_text("before")
    with pytest.raises(RuntimeError), BlockWriter(path, FACTS) as writer:
        writer.write({"time [s]": [0.0], "gyro [deg/h]": [1.0]})
        raise RuntimeError
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "before"


def test_blocks_of_other_columns_are_refused(tmp_path):
    with pytest.raises(InputError, match="columns"), BlockWriter(tmp_path / "out.csv") as writer:
        writer.write({"time [s]": [0.0], "gyro [deg/h]": [1.0]})
        writer.write({"time [s]": [0.0], "T [degC]": [1.0]})
    assert list(tmp_path.iterdir()) == []


def test_nothing_to_write_is_an_error(tmp_path):
    with pytest.raises(InputError, match="nothing"), BlockWriter(tmp_path / "out.csv"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_suffix_and_a_missing_folder(tmp_path):
    run = Run("run", {"time": np.arange(2.0), "gyro": np.ones(2)})
    with pytest.raises(InputError, match=r"\.xyz.*\.csv, \.parquet"):
        write_run(run, tmp_path / "run.xyz")
    with pytest.raises(InputError, match="no such folder"):
        write_run(run, tmp_path / "none" / "run.csv")
    with pytest.raises(InputError, match=r"block by block; use one of \.csv, \.parquet"):
        BlockWriter(tmp_path / "run.h5")


def test_a_foreign_side_file_is_not_replaced(tmp_path):
    (tmp_path / "run.yaml").write_text("model: M1\n")
    run = Run("run", {"time": np.arange(2.0), "gyro": np.ones(2)}, FACTS)
    with pytest.raises(InputError, match=r"run\.yaml"):
        write_run(run, tmp_path / "run.csv")
    assert (tmp_path / "run.yaml").read_text() == "model: M1\n"
    assert not (tmp_path / "run.csv").exists()


def test_a_side_file_that_states_the_same_is_left_as_it_is(tmp_path):
    run = Run("run", {"time": np.arange(2.0), "gyro": np.ones(2)}, Facts(unit="0417"))
    (tmp_path / "run.yml").write_text("unit: 0417  # on the label\n")
    write_run(run, tmp_path / "run.csv")
    assert (tmp_path / "run.yml").read_text() == "unit: 0417  # on the label\n"
    assert not (tmp_path / "run.yaml").exists()
    assert read_run(tmp_path / "run.csv").facts == run.facts


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".h5", ".mat"])
@pytest.mark.parametrize("more", [{"latitude": 39.9}, {"notes": "again"}])
def test_a_side_file_gains_facts_with_its_run(tmp_path, suffix, more):
    columns = {"time": np.arange(2.0), "gyro": np.ones(2)}
    path = tmp_path / f"run{suffix}"
    write_run(Run("run", columns, Facts(unit="A", notes="first")), path)
    facts = Facts(**{"unit": "A", "notes": "first", **more})
    write_run(Run("run", columns, facts), path)
    assert read_run(path).facts == facts


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".h5", ".mat"])
@pytest.mark.parametrize("facts", [Facts(), Facts(unit="B", axis="x"), Facts(unit="A", latitude=39.9)])
def test_facts_are_never_lost(tmp_path, suffix, facts):
    columns = {"time": np.arange(2.0), "gyro": np.ones(2)}
    path = tmp_path / f"run{suffix}"
    write_run(Run("run", columns, Facts(unit="A", axis="x")), path)
    kept = [file.read_bytes() for file in (path, path.with_suffix(".yaml"))]
    with pytest.raises(InputError, match=r"run\.yaml, .*states (unit: A|axis: x)"):
        write_run(Run("run", columns, facts), path)
    assert [file.read_bytes() for file in (path, path.with_suffix(".yaml"))] == kept


def test_facts_of_another_file_of_the_stem_stay(tmp_path):
    columns = {"time": np.arange(2.0), "gyro": np.ones(2)}
    for suffix in (".csv", ".h5"):
        write_run(Run("run", columns, Facts(unit="A")), tmp_path / f"run{suffix}")
    with pytest.raises(InputError, match=r"holds for run\.h5 too"):
        write_run(Run("run", columns, Facts(unit="A", latitude=39.9)), tmp_path / "run.csv")


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_table_that_is_no_run_leaves_side_files_alone(tmp_path, suffix):
    (tmp_path / "run.yaml").write_text("unit: A  # by hand\n")
    for _ in range(2):
        with BlockWriter(tmp_path / f"run{suffix}") as writer:
            writer.write({"time [s]": [0.0, 1.0], "noise [deg/h]": [1.0, 2.0]})
    assert (tmp_path / "run.yaml").read_text() == "unit: A  # by hand\n"
