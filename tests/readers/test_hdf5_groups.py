"""HDF5 and NumPy files as people lay them out: in groups, as tables, as matrices, packed as netCDF is."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from scipy.io import savemat

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


@pytest.mark.parametrize("key", ["_FillValue", "missing_value"])
def test_values_that_netcdf_calls_missing_are_none(tmp_path, key):
    """A packed -32768 was a rate of -327.68 deg/h."""
    counts = np.arange(COUNT, dtype="i2")
    counts[7] = -32768
    with h5py.File(tmp_path / "log.nc.h5", "w") as file:
        write(file, "time", TIME, "seconds since 2026-03-11 08:00:00")
        write(file, "gyro", counts, "deg/h", scale_factor=0.01, **{key: np.int16(-32768)})
        # What the type can't hold is no value of it.
        write(file, "T", np.zeros(COUNT, "i2"), "degC", add_offset=20.0, **{key: 1e20})
    with pytest.raises(InputError, match="column 'gyro', row 8: the value is missing"):
        read_run(tmp_path / "log.nc.h5")
    run = read_run(tmp_path / "log.nc.h5", repair=True, most_dropped=0.5)
    np.testing.assert_allclose(run.gyro, np.delete(0.01 * np.arange(COUNT), 7))
    np.testing.assert_array_equal(run.columns["T"], 20.0)


def test_attributes_of_no_convention_that_may_change_numbers_are_told(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        write(file, "time", TIME, "s", scale=1.0, offset=0.0)
        write(file, "gyro", GYRO, "deg/h", scale=0.001)
        write(file, "T", WARM, "degC")
    (found,) = (f for f in read_run(tmp_path / "log.h5").findings if f.code == "unused_attributes")
    assert "scale = 0.001 of 'gyro'" in found.message
    assert found.count == 1
    (run,) = by_draft(tmp_path / "log.h5")
    assert "unused_attributes" in {f.code for f in run.findings}


def h5_of(path, rate):
    with h5py.File(path, "w") as file:
        write(file, "gyro", GYRO, "deg/h")
        file.attrs["SampleRate"] = rate


def h5_with_a_number(path, rate):
    with h5py.File(path, "w") as file:
        write(file, "gyro", GYRO, "deg/h")
        file["dt"] = 1.0 / rate


def mat_of(path, rate):
    savemat(path, {"gyro": GYRO, "Fs": rate, "units": {"gyro": "deg/h"}})


def mat_struct(path, rate):
    savemat(path, {"run": {"gyro": GYRO, "Ts": 1.0 / rate, "units": {"gyro": "deg/h"}}})


def npz_of(path, rate):
    np.savez(path, **{"gyro [deg/h]": GYRO, "sample_rate": rate})


def tdms_of(path, rate):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as file:
        group = nptdms.GroupObject("g", {"SampleRate": rate})
        file.write_segment([group, nptdms.ChannelObject("g", "gyro", GYRO, {"unit_string": "deg/h"})])


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("a.h5", h5_of),
        ("b.h5", h5_with_a_number),
        ("a.mat", mat_of),
        ("b.mat", mat_struct),
        ("a.npz", npz_of),
        ("a.tdms", tdms_of),
    ],
)
def test_a_draft_takes_the_interval_from_a_rate_beside_the_columns_as_a_guess(tmp_path, name, written):
    written(tmp_path / name, 8.0)
    assert "sample_s: 0.125    # GUESS: no clock was found; by " in draft_profile(tmp_path / name)
    (run,) = by_draft(tmp_path / name)
    np.testing.assert_allclose(run.time, 0.125 * np.arange(len(GYRO)))
    np.testing.assert_allclose(run.gyro, GYRO)
