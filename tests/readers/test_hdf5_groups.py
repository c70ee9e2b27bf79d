"""HDF5 and NumPy files as people lay them out: in groups, as tables, as matrices, packed as netCDF is."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording
from fogml.runs.reading import read_blocks, read_run
from tests.readers.files import COUNT, GYRO, TIME, WARM


def by_draft(path):
    (path.parent / "profile.yaml").write_text(draft_profile(path))
    return import_recording(path, path.parent / "profile.yaml")


def write(group, name, values, unit, key="units", **more):
    group[name] = values
    group[name].attrs.update({key: unit, **more})


def test_the_group_with_a_time_and_a_gyro_is_read(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        write(file, "bench/calibration", WARM, "degC")
        write(file, "bench/units/fog/time", TIME, "s", "Units")
        write(file, "bench/units/fog/gyro", GYRO, "deg/h", "Unit")
        write(file, "bench/units/fog/T", WARM, "degC")
        file["bench/units/fog/again"] = file["bench"]
    run = read_run(tmp_path / "log.h5")
    np.testing.assert_array_equal(run.gyro, GYRO)
    np.testing.assert_array_equal(run.columns["T"], WARM)
    blocks = list(read_blocks(tmp_path / "log.h5", block_rows=50))
    np.testing.assert_array_equal(np.concatenate([block.gyro for block in blocks]), GYRO)


def test_two_groups_with_a_time_and_a_gyro_are_told(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name in ("a", "b"):
            write(file, f"{name}/time", TIME, "s")
            write(file, f"{name}/gyro", GYRO, "deg/h")
    with pytest.raises(InputError, match=r"log\.h5: a, b each hold a time and a gyro; save"):
        read_run(tmp_path / "log.h5")


def test_the_fields_of_a_table_are_columns(tmp_path):
    table = np.zeros(COUNT, [("time_s", "f8"), ("gyro_dph", "f4"), ("T_degC", "i2"), ("state", "S4")])
    table["time_s"], table["gyro_dph"], table["T_degC"] = TIME, GYRO, np.round(WARM)
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["log"] = table
    run = read_run(tmp_path / "log.h5")
    np.testing.assert_array_equal(run.time, TIME)
    np.testing.assert_array_equal(run.gyro, GYRO.astype("f4"))
    np.testing.assert_array_equal(run.columns["T"], np.round(WARM))


def test_numbers_that_are_packed_as_netcdf_packs_them(tmp_path):
    counts = np.round((WARM - 20.0) / 0.01).astype("i2")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        write(file, "time", TIME, "s")
        write(file, "gyro", np.arange(COUNT, dtype="f4"), "deg/h", scale_factor=0.5)
        write(file, "T", counts, "degC", scale_factor=0.01, add_offset=20.0)
    run = read_run(tmp_path / "log.h5")
    np.testing.assert_array_equal(run.gyro, 0.5 * np.arange(COUNT))
    np.testing.assert_allclose(run.columns["T"], WARM, atol=0.005 + 1e-9)


def test_images_beside_a_run_are_left_out_and_told(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        write(file, "time", TIME, "s")
        write(file, "gyro", GYRO, "deg/h")
        file["spectra"] = np.zeros((COUNT, 100))
        file["square"] = np.eye(3)
    run = read_run(tmp_path / "log.h5")
    assert set(run.columns) == {"time", "gyro"}
    assert {f.column for f in run.findings if f.code == "left_out"} == {"spectra", "square"}


@pytest.mark.parametrize("turned", [False, True])
def test_a_matrix_of_three_gyros_is_drafted_as_axes(tmp_path, turned):
    matrix = np.c_[GYRO, GYRO + 1.0, GYRO + 2.0]
    with h5py.File(tmp_path / "log.h5", "w") as file:
        write(file, "time", TIME, "s")
        write(file, "gyro", matrix.T if turned else matrix, "deg/h")
    runs = by_draft(tmp_path / "log.h5")
    assert "# GUESS: in this order?" in (tmp_path / "profile.yaml").read_text()
    assert [run.facts.axis for run in runs] == ["x", "y", "z"]
    for run, values in zip(runs, matrix.T, strict=True):
        np.testing.assert_allclose(run.gyro, values, rtol=1e-14)


def test_what_has_no_clock_goes_with_the_one_clock_that_is_as_long(tmp_path):
    """An array of its own, as of Simulink's structures with time, beside a clock of another group."""
    times = np.datetime64("2026-03-13T08:00") + np.round(1e6 * TIME).astype("timedelta64[us]")
    np.savez(tmp_path / "log.npz", timestamp=times, gyro_dph=np.c_[GYRO, GYRO + 1.0, GYRO + 2.0], temp=WARM)
    runs = by_draft(tmp_path / "log.npz")
    for run, more in zip(runs, (0.0, 1.0, 2.0), strict=True):
        np.testing.assert_allclose(run.time, TIME, atol=1e-6)
        np.testing.assert_allclose(run.gyro, GYRO + more, rtol=1e-14)
        np.testing.assert_array_equal(run.columns["T"], WARM)


def test_vectors_of_two_dimensions_in_numpy_archives(tmp_path):
    rows = {
        "time [s]": TIME[:, None],
        "gyro [deg/h]": GYRO[None, :],
        "T [degC]": np.asfortranarray(WARM[:, None]),
    }
    np.savez(tmp_path / "log.npz", **rows, rate=2.0)
    run = read_run(tmp_path / "log.npz")
    np.testing.assert_array_equal(run.gyro, GYRO)
    np.testing.assert_array_equal(run.columns["T"], WARM)


@pytest.mark.parametrize(
    ("kind", "what"), [(object, "objects, which may run what they hold"), (str, "texts")]
)
def test_objects_and_texts_of_numpy_archives_are_named(tmp_path, kind, what):
    np.savez(tmp_path / "log.npz", **{"time": TIME.astype(kind), "gyro [deg/h]": GYRO})
    with pytest.raises(InputError, match=f"column 'time': holds {what}; save it as float64 or datetime64"):
        read_run(tmp_path / "log.npz")
