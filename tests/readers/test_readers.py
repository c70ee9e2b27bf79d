"""Files of each format, written by the library behind its reader, give what was written."""

from __future__ import annotations

import contextlib
import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from fogml.errors import InputError
from fogml.readers import READERS, reader_of
from fogml.runs import raw_table, reader_process
from fogml.runs.opening import file_format
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording
from fogml.runs.reading import read_blocks, read_run, read_table
from fogml.runs.reading_limits import DEFAULT_LIMITS
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from tests.readers import files
from tests.readers.files import AXES, COUNT, GYRO, TIME, WARM

STARTED = datetime.fromtimestamp(files.START_S, UTC)
ZIP = b"PK\x03\x04" + bytes(26)
HEADS = {"workbook": ZIP + b"[Content_Types].xml", "npz": ZIP + b"a.npy"}
SLOW = np.interp(TIME, TIME[::10], WARM[::10])


@pytest.mark.parametrize(
    ("kind", "name", "warm"),
    [
        ("npz", "log.npz", WARM),
        ("workbook", "log.xlsx", WARM),
        ("tdms", "log.tdms", SLOW),
        ("mdf", "log.mf4", SLOW),
    ],
)
def test_one_gyro(tmp_path, kind, name, warm):
    path = tmp_path / name
    {"workbook": files.xlsx}.get(kind, getattr(files, kind, None))(path)
    assert file_format(path) == kind
    run = read_run(path)
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_allclose(run.gyro, GYRO, rtol=1e-15)  # openpyxl writes 16 digits
    np.testing.assert_allclose(run.columns["T_in"], warm, atol=1e-9)
    if kind == "tdms":
        assert run.facts.started == STARTED
    blocks = list(read_blocks(path, block_rows=50, columns=["T_in"]))
    assert [len(block) for block in blocks] == [50, 50, 20]
    np.testing.assert_allclose(np.concatenate([b.columns["T_in"] for b in blocks]), warm, atol=1e-9)


@pytest.mark.parametrize("version", [2, 3])
def test_a_rotation_seismometer(tmp_path, version):
    path = tmp_path / "log.mseed"
    files.miniseed(path, version)
    run = read_run(path)
    assert run.gyro_unit == "count" and run.facts.started == STARTED
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_array_equal(run.gyro, np.round(1000.0 * GYRO))


def bag2(path: Path) -> Path:
    return files.rosbag(path, ros1=False)


@pytest.mark.parametrize(
    ("write", "name", "warm"),
    [
        (files.ulog, "log.ulg", WARM),
        (files.dataflash, "log.bin", WARM),
        (files.rosbag, "log.bag", SLOW),
        (bag2, "log.db3", SLOW),
        (files.mcap, "log.mcap", SLOW),
    ],
)
def test_three_gyros(tmp_path, write, name, warm):
    pytest.importorskip({"log.ulg": "pyulog", "log.bin": "pymavlink"}.get(name, "numpy"))
    path = tmp_path / name
    table = read_table(write(path) or path)
    assert len(table) == COUNT
    held = {cell.partition(" ")[0]: (cell, values) for cell, values in table.columns.items()}
    scale = 1e-6 if "[us]" in held["time"][0] else 1.0
    np.testing.assert_allclose(held["time"][1] * scale, TIME, atol=1e-6)
    for axis, values in AXES.items():
        cell, found = held[f"gyro_{axis}"]
        assert cell == f"gyro_{axis} [rad/s]"
        np.testing.assert_allclose(found, values, rtol=1e-6)
    assert held["T"][0] == "T [degC]"
    np.testing.assert_allclose(held["T"][1], warm, rtol=1e-6)


def test_a_second_instance_is_named(tmp_path):
    pytest.importorskip("pymavlink")
    path = tmp_path / "log.bin"
    files.dataflash(path)
    (finding,) = (f for f in read_table(path).findings if f.code == "other_gyros")
    assert "IMU.1" in finding.message


def test_fields_that_nobody_can_know_are_listed_with_the_way_on(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, data=np.c_[TIME, GYRO, WARM], volts=GYRO)
    with pytest.raises(
        InputError, match=r"log\.npz: a NumPy file.*data column 1.*volts.*import log\.npz --draft"
    ):
        read_run(path)


@pytest.mark.parametrize(
    "reader", [r for r in READERS if r.extra not in (None, "hdf5")], ids=lambda reader: reader.name
)
def test_a_missing_package_is_named_with_its_extra(tmp_path, monkeypatch, reader):
    path = tmp_path / f"log{reader.suffixes[0]}"
    if reader.name == "hdf5":
        pytest.skip("said where the file is opened, test_hdf5_without_h5py")
    path.write_bytes(HEADS.get(reader.name, b"".join(reader.magic[:1])) + bytes(50))
    monkeypatch.setattr(reader_process.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=rf"its format is {reader.label}.*pip install .\.\[{reader.extra}\]"):
        read_run(path)


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_a_damaged_file_is_named(tmp_path, reader):
    pytest.importorskip(reader.package.partition(".")[0])
    path = tmp_path / f"log{reader.suffixes[0]}"
    path.write_bytes(
        HEADS.get(reader.name, b"".join(reader.magic[:1])) + np.random.default_rng(0).bytes(3000)
    )
    with pytest.raises(InputError, match=r"log\.\w+: "):
        read_run(path)


def test_objects_in_a_numpy_archive_are_never_unpickled(tmp_path):
    class Bomb:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "ran",))

    path = tmp_path / "log.npz"
    np.savez(path, gyro=np.array([Bomb()], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match=r"log\.npz"):
        read_run(path)
    assert not (tmp_path / "ran").exists()


def test_wide_messages_are_cut_aloud_and_read_by_name(tmp_path):
    writer = pytest.importorskip("mcap.writer")
    path, profile = tmp_path / "log.mcap", tmp_path / "log.yaml"
    with path.open("wb") as file:
        book = writer.Writer(file)
        book.start()
        channel = book.register_channel("/imu", "json", book.register_schema("Imu", "jsonschema", b"{}"))
        for i, t in enumerate(TIME):
            cells = [{"a": float(GYRO[i]), "b": k} for k in range(16)]
            whole, part = divmod(t, 1)
            stamp = {"sec": files.START_S + int(whole), "nsec": round(part * 1e9)}
            angular = {"x": 0.5 * i, "y": 0.0, "z": 0.0}
            message = {"timestamp": stamp, "angular_velocity": angular, "c": [cells, cells, cells, cells]}
            late_ns = int((files.START_S + t + 0.01 * (i % 3)) * 1e9)
            book.add_message(channel, late_ns, json.dumps(message).encode(), late_ns)
        book.finish()
    # A profile of the log's own name states no facts of it.
    profile.write_text(
        "schema: fogml.import/1\ndescription: the last cell\ncolumns:\n"
        "  time: {source: /imu/time, unit: s}\n  gyro: {source: /imu/c.3.15.a, unit: deg/h}\n"
    )
    run = read_run(path, axis="x")
    # The messages' own times, not those of recording.
    np.testing.assert_allclose(run.time - run.time[0], TIME, atol=1e-6)
    np.testing.assert_allclose(run.gyro, np.degrees(0.5 * np.arange(COUNT)) * 3600.0)
    (told,) = (f.message for f in run.findings if f.code == "fields_left_out")
    assert (
        "'/imu' holds 132 numbers a message, of which the first 100" in told and "source: /imu/NAME" in told
    )
    (last,) = import_recording(path, profile)
    np.testing.assert_allclose(last.gyro, GYRO)


def test_of_several_structs_of_a_matlab_file_it_is_said_what_is_not_read(tmp_path):
    own = {"time": files.TIME, "gyro": files.GYRO, "units": {"time": "s", "gyro": "deg/h"}}
    oven = {"time": files.TIME[::10], "T": files.WARM[::10], "units": {"time": "s", "T": "degC"}}
    savemat(tmp_path / "log.mat", {"log": {"imu": own, "oven": oven}})
    (told,) = (f for f in read_run(tmp_path / "log.mat").findings if f.code == "other_columns")
    assert "'log.oven/T'" in told.message
    # An array of structs is each of them by its place.
    runs = np.zeros((1, 2), dtype=[(name, object) for name in own])
    runs[0, :] = [tuple(own.values())] * 2
    savemat(tmp_path / "log.mat", {"runs": runs})
    with pytest.raises(InputError, match=r"runs\(1\), runs\(2\) each hold a time and a gyro; save the one"):
        read_run(tmp_path / "log.mat")
    (tmp_path / "p.yaml").write_text(draft_profile(tmp_path / "log.mat"))
    (run,) = import_recording(tmp_path / "log.mat", tmp_path / "p.yaml")
    np.testing.assert_array_equal(run.gyro, files.GYRO)


def test_an_array_of_structs_of_matlab_7_3_is_read_as_that_of_version_5(tmp_path):
    pytest.importorskip("h5py")
    path, units = tmp_path / "log.mat", {"time": "s", "gyro": "deg/h", "T_in": "degC"}
    own = {"time": TIME, "gyro": GYRO, "T_in": WARM, "units": units, "note": "bench 4"}
    files.mat_7_3_structs(path, "runs", [own])
    run = read_run(path)
    np.testing.assert_array_equal(run.gyro, GYRO)
    np.testing.assert_array_equal(run.columns["T_in"], WARM)
    files.mat_7_3_structs(path, "runs", [own, {**own, "gyro": -GYRO}])
    with pytest.raises(InputError, match=r"runs\(1\), runs\(2\) each hold a time and a gyro; save the one"):
        read_run(path)
    (tmp_path / "p.yaml").write_text(draft_profile(path))
    (run,) = import_recording(path, tmp_path / "p.yaml")
    # The thermometer of the other struct is another run's.
    np.testing.assert_array_equal(run.gyro, GYRO)
    assert list(run.columns) == ["time", "gyro", "T_in"]


def test_structs_of_matlab_7_3_that_hold_each_other_are_refused(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.mat"
    files.mat_7_3_structs(path, "runs", [{"a": {"b": "x"}}] * 50)
    with h5py.File(path, "r+") as file:
        file["runs/a"][:] = np.full((50, 1), file["runs"].ref, dtype=h5py.ref_dtype)
    with pytest.raises(InputError, match="more than 10000 names"):
        read_run(path)


def test_the_struct_of_a_matlab_file_and_the_group_of_an_hdf5_file(tmp_path):
    inner = {"time_s": TIME, "gyro_dph": GYRO, "note": "bench 4", "deeper": {"T_in_C": WARM}}
    savemat(tmp_path / "log.mat", {"setup": {"rate": 4.0}, "log": inner})
    np.testing.assert_array_equal(read_run(tmp_path / "log.mat").gyro, GYRO)
    files.mat_struct(tmp_path / "deep.mat")
    np.testing.assert_array_equal(read_run(tmp_path / "deep.mat").gyro, GYRO)
    savemat(tmp_path / "two.mat", {"a": inner, "b": inner})
    with pytest.raises(InputError, match=r"'?a'?, '?b'? each hold a time and a gyro; save"):
        read_run(tmp_path / "two.mat")
    savemat(tmp_path / "none.mat", {"a": {"x": TIME}, "b": {"y": GYRO}})
    with pytest.raises(InputError, match=r"it holds .*a/x.*b/y.*import none\.mat --draft"):
        read_run(tmp_path / "none.mat")
    files.hdf5(tmp_path / "log.h5")
    np.testing.assert_array_equal(read_run(tmp_path / "log.h5").gyro, GYRO)


def test_readers_have_names_of_their_own():
    assert len({reader.name for reader in READERS}) == len(READERS)
    assert all(reader_of(reader.name) is reader for reader in READERS)


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_durations_and_times_of_day_in_parquet(tmp_path, unit):
    import pyarrow as pa
    from pyarrow import parquet

    steps = np.arange(COUNT) * {"s": 1, "ms": 250, "us": 250_000, "ns": 250_000_000}[unit]
    seconds = steps * {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[unit]
    of_day = pa.time32(unit) if unit in ("s", "ms") else pa.time64(unit)
    for kind in (pa.duration(unit), of_day):
        whole = pa.array(steps, pa.int32() if kind == of_day and unit in ("s", "ms") else pa.int64())
        table = pa.table({"time": whole.cast(kind), "gyro [deg/h]": GYRO, "T [degC]": WARM})
        parquet.write_table(table, tmp_path / "log.parquet")
        run = read_run(tmp_path / "log.parquet")
        np.testing.assert_allclose(run.time, seconds, atol=1e-9)
        np.testing.assert_array_equal(run.gyro, GYRO)


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_timestamps_of_pandas_in_parquet(tmp_path, zone):
    import pandas as pd

    begin = pd.Timestamp(files.START_S, unit="s", tz="UTC").tz_convert(zone)
    index = begin + pd.to_timedelta(TIME, unit="s")
    frame = pd.DataFrame({"Gyro (dph)": GYRO, "Temperature [°C]": WARM}, index=index)
    frame.to_parquet(tmp_path / "log.parquet")
    run = read_run(tmp_path / "log.parquet")
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_array_equal(run.gyro, GYRO)
    np.testing.assert_array_equal(run.columns["T"], WARM)
    assert run.facts.started == STARTED
    blocks = list(read_blocks(tmp_path / "log.parquet", block_rows=50))
    np.testing.assert_allclose(np.concatenate([block.time for block in blocks]), TIME, atol=1e-9)


def test_stamps_of_numpy_count_from_the_first(tmp_path):
    stamps = np.datetime64(1000 * files.START_S, "ms") + np.round(1000.0 * TIME).astype("timedelta64[ms]")
    np.savez(tmp_path / "log.npz", time=stamps, **{"gyro [deg/h]": GYRO, "T [degC]": WARM})
    run = read_run(tmp_path / "log.npz")
    np.testing.assert_allclose(run.time, TIME, atol=1e-3)
    assert run.facts.started == STARTED


def test_a_struct_of_matlab(tmp_path):
    from scipy.io import savemat

    held = {"Time": TIME, "gyro": GYRO, "T_in": WARM, "units": {"Time": "s", "gyro": "dph", "T_in": "°C"}}
    savemat(tmp_path / "log.mat", {"log": held, "bench": "4"})
    run = read_run(tmp_path / "log.mat")
    np.testing.assert_array_equal(run.gyro, GYRO)
    np.testing.assert_array_equal(run.columns["T_in"], WARM)


def test_mdf_is_read_in_parts_however_large_and_invalid_samples_are_none(tmp_path, monkeypatch):
    asammdf = pytest.importorskip("asammdf")
    from asammdf.blocks import mdf_v4

    from fogml.readers.tables import Mdf

    path = tmp_path / "log.mf4"
    invalid = np.arange(COUNT) % 7 == 3
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(GYRO, TIME, name="gyro", invalidation_bits=invalid)])
        file.save(path)
    # The library takes every file for a large one.
    monkeypatch.setattr(mdf_v4, "validate_blocks", lambda *told: True)
    monkeypatch.setattr(mdf_v4, "get_channel_raw_bytes_complete", None)
    with contextlib.closing(Mdf(str(path), [])) as held:
        found = held.arrays[[told["name"] for told in held.described].index("gyro")]
        np.testing.assert_array_equal(found[20:50,], np.where(invalid, np.nan, GYRO)[20:50])


def test_messages_of_mcap_come_in_the_order_of_their_times(tmp_path):
    """As the library's own reader orders them, in chunks that overlap."""
    pytest.importorskip("mcap")
    from mcap.reader import make_reader
    from mcap.writer import Writer

    from fogml.readers import messages

    rng, path = np.random.default_rng(3), tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=300)
        writer.start()
        channels = [writer.register_channel(f"/{name}", "json", 0) for name in "abc"]
        for i in range(400):
            now = int(100 * i + rng.integers(0, 3000)) // 50
            writer.add_message(channels[rng.integers(3)], now, b"%d" % i, now)
        writer.finish()
    with path.open("rb") as file:
        reader = make_reader(file)
        right = [(m.log_time, m.channel_id, m.data) for _, _, m in reader.iter_messages(topics=["/a", "/c"])]
        chunks = reader.get_summary().chunk_indexes
        assert len(chunks) > 20 and len(right) > 200
        found = list(messages.messages(file, chunks, (channels[0], channels[2])))
    assert [time for time, *_ in found] == [time for time, *_ in right]
    assert sorted(found) == sorted(right)


def test_a_block_of_many_columns_has_fewer_rows(tmp_path, monkeypatch):
    monkeypatch.setattr(raw_table, "BLOCK_VALUES", 4 * 25)
    path = tmp_path / "log.npz"
    np.savez(path, **{"time [s]": TIME, "gyro [deg/h]": GYRO, "T [degC]": WARM, "more": GYRO})
    assert [len(block) for block in read_blocks(path, block_rows=30)] == [25, 25, 25, 25, 20]
    assert [len(block) for block in read_blocks(path, block_rows=30, columns=["T"])] == [30] * 4


def test_a_long_variable_of_matlab_is_put_away(tmp_path, monkeypatch):
    from fogml.readers import matlab

    monkeypatch.setattr(matlab, "_LONG_BYTES", 100)
    for layout in (np.ascontiguousarray, np.asfortranarray):
        matrix = layout(np.c_[TIME, GYRO])
        (tmp_path / "log.mat").unlink(missing_ok=True)
        savemat(tmp_path / "log.mat", {"log": {"time_s": TIME, "both": matrix}, "gyro_dph": GYRO, "n": "x"})
        held = matlab.Mat.loaded(str(tmp_path / "log.mat"))
        assert isinstance(held["log"]["both"], matlab.PutAway) and held["n"] == "x"
        np.testing.assert_array_equal(held["log"]["both"][10:20, 1], GYRO[10:20])
        np.testing.assert_array_equal(held["gyro_dph"][:], GYRO)


def test_repair_refuses_what_is_too_long_to_be_held(tmp_path):
    files.npz(tmp_path / "log.npz")
    limits = replace(DEFAULT_LIMITS, repair_mb=0.001)
    with pytest.raises(
        InputError, match=r"log\.npz: 0 MB, and --repair holds a file in memory, up to 0 MB; cut"
    ):
        read_run(tmp_path / "log.npz", repair=True, limits=limits)


def test_units_stated_as_the_message_says_are_read(tmp_path):
    held = {"t": TIME, "omega": GYRO, "Tin": WARM}
    savemat(tmp_path / "log.mat", held)
    with pytest.raises(InputError, match="save a struct 'units' with a field of the variable's name"):
        read_run(tmp_path / "log.mat")
    savemat(tmp_path / "log.mat", {**held, "units": {"t": "s", "omega": "deg/h", "Tin": "degC"}})
    np.testing.assert_array_equal(read_run(tmp_path / "log.mat").gyro, GYRO)
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name, values in (("time", TIME), ("gyro", GYRO)):
            file[name] = values
    with pytest.raises(InputError, match="give the dataset an attribute 'unit' that holds 'deg/h'"):
        read_run(tmp_path / "log.h5")
    with h5py.File(tmp_path / "log.h5", "a") as file:
        file["time"].attrs["unit"], file["gyro"].attrs["unit"] = "s", "deg/h"
    np.testing.assert_array_equal(read_run(tmp_path / "log.h5").gyro, GYRO)


def test_stamps_of_several_groups_count_from_one_moment(tmp_path):
    """A thermometer's log in TDMS that began 5 s before the gyro's; temperatures are those of the moment."""
    nptdms = pytest.importorskip("nptdms")
    begin = np.datetime64(files.START_S, "s")
    gyro_s, warm_s = 5.0 + TIME, np.arange(0.0, 40.0, 2.0)

    def stamps(seconds):
        return begin + (1000 * seconds).astype("timedelta64[ms]")

    channels = {"g": {"time": stamps(gyro_s), "gyro [deg/h]": GYRO}}
    channels["t"] = {"time": stamps(warm_s), "T [degC]": 20.0 + warm_s / 8.0}
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
        for group, columns in channels.items():
            writer.write_segment([nptdms.ChannelObject(group, *column) for column in columns.items()])
    run = read_run(tmp_path / "log.tdms")
    np.testing.assert_allclose(run.columns["T"], 20.0 + gyro_s / 8.0, atol=1e-6)
    assert run.facts.started == STARTED
    np.testing.assert_allclose(run.time, gyro_s, atol=1e-6)


def test_waveforms_of_two_rates_in_one_group_of_tdms(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    told = {"gyro": (GYRO, 0.25, "deg/h"), "T_in": (WARM[::10], 2.5, "°C"), "supply": (WARM, 0.25, "V")}
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
        properties = {
            name: {"wf_increment": step, "unit_string": unit} for name, (_, step, unit) in told.items()
        }
        writer.write_segment([nptdms.ChannelObject("g", n, told[n][0], properties[n]) for n in told])
    run = read_run(tmp_path / "log.tdms")
    np.testing.assert_allclose(run.columns["T_in"], SLOW, atol=1e-9)
    np.testing.assert_array_equal(run.columns["supply"], WARM)


def test_clocks_of_two_groups_may_be_in_two_units(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    warm_s = np.arange(0.0, 40.0, 2.0)
    groups = {"g": {"time [ms]": 1000.0 * TIME, "gyro [deg/h]": GYRO}}
    groups["rack"] = {"time [s]": warm_s, "T [degC]": 20.0 + warm_s / 8.0}
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
        for group, columns in groups.items():
            writer.write_segment([nptdms.ChannelObject(group, *column) for column in columns.items()])
    run = read_run(tmp_path / "log.tdms")
    np.testing.assert_allclose(run.time, TIME)
    np.testing.assert_allclose(run.columns["T"], 20.0 + TIME / 8.0)


def test_a_column_that_two_groups_hold_is_of_the_first_and_the_other_is_told(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    groups = {"g": {"gyro [deg/h]": GYRO}, "inner": {"T [degC]": WARM}, "rack": {"T [degC]": WARM + 30.0}}
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
        for group, columns in groups.items():
            columns = {"time [s]": TIME, **columns}
            writer.write_segment([nptdms.ChannelObject(group, *column) for column in columns.items()])
    run = read_run(tmp_path / "log.tdms")
    np.testing.assert_array_equal(run.columns["T"], WARM)
    (told,) = [finding.message for finding in run.findings if finding.code == "other_columns"]
    assert told == "'T' of 'inner' is read; an import profile reads that of 'rack'"


def test_a_switch_of_another_rate_keeps_its_value_until_the_next(tmp_path):
    """As in a table whose column is empty in most rows; by a profile, too."""
    nptdms = pytest.importorskip("nptdms")
    path, profile = tmp_path / "log.tdms", tmp_path / "own.yaml"
    switched_s, states = np.arange(0.0, 30.0, 4.0), np.arange(8.0) % 2
    groups = {"g": {"time [s]": TIME, "gyro [deg/h]": GYRO}}
    groups["rack"] = {"time [s]": switched_s, "heater [0/1]": states}
    with nptdms.TdmsWriter(str(path)) as writer:
        for group, columns in groups.items():
            writer.write_segment([nptdms.ChannelObject(group, *column) for column in columns.items()])
    profile.write_text(
        "schema: fogml.import/1\ndescription: bench\ncolumns:\n  time: {source: 'g/time [s]', unit: s}\n"
        "  gyro: {source: 'gyro [deg/h]', unit: deg/h}\n  heater: {source: 'heater [0/1]', unit: 0/1}\n"
    )
    for run in (read_run(path), *read_blocks(path, block_rows=1000), *import_recording(path, profile)):
        np.testing.assert_array_equal(run.columns["heater"], TIME // 4.0 % 2)


def test_messages_of_a_seismometers_logger_beside_its_samples(tmp_path):
    """State of health stands in channels of text whose rate is 0."""
    pymseed = pytest.importorskip("pymseed")
    path = tmp_path / "log.mseed"
    files.miniseed(path)
    record = pymseed.MS3Record()
    record.sourceid, record.samprate, record.reclen = "FDSN:XX_STA__L_O_G", 0.0, 512
    record.formatversion, record.encoding = 3, pymseed.DataEncoding.TEXT
    record.set_starttime_str("2026-01-01T00:00:00Z")
    with record.with_datasamples(b"clock locked", "t"):
        path.write_bytes(path.read_bytes() + b"".join(bytes(part) for part in record.generate()))
    run = read_run(path)
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    assert run.facts.started == STARTED


def test_a_recording_in_parquet_began_when_its_clock_did(tmp_path):
    pandas = pytest.importorskip("pandas")
    path = tmp_path / "run.parquet"
    files.parquet(path)
    frame = pandas.read_parquet(path)
    frame.insert(0, "exported", pandas.Timestamp("2026-06-30T12:00:00"))
    frame.to_parquet(path, index=False)
    assert read_run(path).facts.started == STARTED


def test_a_dataset_without_a_value_is_left_out_and_a_column_without_one_named(tmp_path):
    """A null dataspace, of which the library gives no shape."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file["time [s]"], file["gyro [deg/h]"], file["empty"] = TIME, GYRO, h5py.Empty("f8")
    run = read_run(path)
    assert "'empty' is left out: it holds nothing" in [f.message for f in run.findings]
    with h5py.File(path, "a") as file:
        del file["gyro [deg"]
        file["gyro [deg/h]"] = h5py.Empty("f8")
    with pytest.raises(InputError, match=r"run\.h5, column 'gyro': holds nothing; one number per sample"):
        read_run(path)
    path = tmp_path / "run.mat"
    write_run(Run.from_columns(time=TIME, gyro=GYRO), path, mat_version="7.3")
    with h5py.File(path, "a") as file:
        for name, kind in (("note", "char"), ("empty", "double")):
            file[name] = h5py.Empty("u2" if kind == "char" else "f8")
            file[name].attrs["MATLAB_class"] = np.bytes_(kind)
    np.testing.assert_array_equal(read_run(path).gyro, GYRO)


def test_the_reader_of_the_recipe_gives_its_columns(tmp_path):
    text = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    code = text.partition("## Add a reader")[2].partition("```python\n")[2].partition("```")[0]
    held: dict[str, Any] = {}
    exec(code, held)
    rows = [f"{t!r}|{g!r}" for t, g in zip(TIME.tolist(), GYRO.tolist(), strict=True)]
    (tmp_path / "log.bars").write_text("\n".join(["BARS 1", "time:s gyro:deg/h", *rows]))
    found = held["Bars"](str(tmp_path / "log.bars"), [])
    assert [(one["name"], one["unit"]) for one in found.told["arrays"]] == [("time", "s"), ("gyro", "deg/h")]
    np.testing.assert_array_equal(found.arrays, [TIME, GYRO])
