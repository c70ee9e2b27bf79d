"""Small files of each format, written by the library behind its reader or, where that only reads, by hand."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

COUNT = 120
TIME = np.arange(COUNT) * 0.25
GYRO = 10.0 + np.sin(TIME)
WARM = 20.0 + TIME / 8.0
AXES = {"x": GYRO, "y": GYRO[::-1].copy(), "z": -GYRO}
START_S = 1767600000  # 2026-01-05T08:00:00Z


def npz(path: Path) -> None:
    np.savez(path, **{"time [s]": TIME, "Gyro (deg/h)": GYRO, "T_in [degC]": WARM, "note": np.array("x")})


def xlsx(path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("python_calamine")
    book = openpyxl.Workbook()
    book.active.append(["Chamber test", "FOG-0417"])
    sheet = book.create_sheet("Data")
    for row in [[], ["Station 3"], ["Time (s)", "Gyro (°/h)", "T_in (°C)"]]:
        sheet.append(row)
    for row in zip(TIME.tolist(), GYRO.tolist(), WARM.tolist(), strict=True):
        sheet.append(row)
    sheet.append(["End of test"])
    book.save(path)


def mat_struct(path: Path) -> None:
    """A MATLAB struct of any name, with its units beside."""
    savemat = pytest.importorskip("scipy.io").savemat
    units = {"t": "s", "omega": "deg/h", "temp": "°C"}
    savemat(path, {"rig": {"t": TIME, "omega": GYRO, "temp": WARM, "units": units}, "setup": {"rate": 4.0}})


def parquet(path: Path) -> None:
    """Timestamps of pandas."""
    pandas = pytest.importorskip("pandas")
    stamps = pandas.Timestamp(START_S, unit="s") + pandas.to_timedelta(TIME, unit="s")
    frame = pandas.DataFrame({"timestamp": stamps, "gyro_dph": GYRO, "temp_C": WARM})
    frame.to_parquet(path, index=False)


def hdf5(path: Path) -> None:
    """Datasets in a group of any name."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        group = file.create_group("rig/log")
        for name, unit, values in (("time", "s", TIME), ("gyro", "deg/h", GYRO), ("T", "degC", WARM)):
            group.create_dataset(name, data=values).attrs["units"] = unit


def tdms(path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    clock = {"wf_start_time": np.datetime64(START_S, "s"), "wf_start_offset": 0.0}
    gyro = {"unit_string": "deg/h", "wf_increment": 0.25, **clock}
    warm = {"unit_string": "°C", "wf_increment": 2.5, **clock}
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("Gyro", "gyro", GYRO, properties=gyro),
                nptdms.ChannelObject("Slow", "T_in", WARM[::10], properties=warm),
            ]
        )


def mdf(path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(GYRO, TIME, unit="deg/h", name="Gyro")])
        file.append([asammdf.Signal(WARM[::10], TIME[::10], unit="°C", name="T_in")])
        file.save(path)


def miniseed(path: Path, version: int = 3) -> None:
    pymseed = pytest.importorskip("pymseed")
    traces = pymseed.MS3TraceList()
    counts = np.round(1000.0 * GYRO).astype(np.int32)
    traces.add_data("FDSN:XX_STA__H_J_Z", counts, "i", 4.0, starttime_seconds=float(START_S))
    traces.to_file(str(path), format_version=version)


def _ulog_message(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content


def ulog(path: Path) -> None:
    """The ULog file format of PX4's developer guide."""
    fields = "uint64_t timestamp;float x;float y;float z;float temperature;uint8_t[2] spare;"
    parts = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0), _ulog_message("B", bytes(40))]
    parts += [_ulog_message("F", f"sensor_gyro:{fields}".encode())]
    parts += [_ulog_message("A", struct.pack("<BH", 0, 1) + b"sensor_gyro")]
    for t, x, y, z, warm in zip(TIME, *AXES.values(), WARM, strict=True):
        parts += [_ulog_message("D", struct.pack("<HQffff2B", 1, round(1e6 * t), x, y, z, warm, 0, 0))]
    path.write_bytes(b"".join(parts))


def dataflash(path: Path) -> None:
    """FMT, UNIT, FMTU and two instances of IMU, as ArduPilot's AP_Logger writes them."""
    forms = {
        128: ("FMT", "BBnNZ", "Type,Length,Name,Format,Columns", "<BB4s16s64s"),
        129: ("UNIT", "QbZ", "TimeUS,Id,Label", "<Qb64s"),
        130: ("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "<QB16s16s"),
        131: ("IMU", "QBffff", "TimeUS,I,GyrX,GyrY,GyrZ,T", "<QBffff"),
    }

    def message(kind: int, *values: object) -> bytes:
        return bytes([0xA3, 0x95, kind]) + struct.pack(forms[kind][3], *values)

    parts = []
    for kind, (name, form, columns, layout) in forms.items():
        size = 3 + struct.calcsize(layout)
        parts += [message(128, kind, size, name.encode(), form.encode(), columns.encode())]
    parts += [
        message(129, 0, ord("E"), b"rad/s"),
        message(129, 0, ord("s"), b"s"),
        message(129, 0, ord("O"), b"degC"),
    ]
    parts += [message(130, 0, 131, b"s#EEEO", b"F-0000")]
    for t, x, y, z, warm in zip(TIME, *AXES.values(), WARM, strict=True):
        parts += [message(131, round(1e6 * t), 0, x, y, z, warm), message(131, round(1e6 * t), 1, 0, 0, 0, 0)]
    path.write_bytes(b"".join(parts))


def _imu(types: dict, t: float, values: tuple[float, ...], ros1: bool) -> object:
    stamp = types["builtin_interfaces/msg/Time"](int(START_S + t), round(t % 1 * 1e9))
    more = {"seq": 0} if ros1 else {}
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="imu", **more)
    vector, turn = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    none = np.zeros(9)
    return types["sensor_msgs/msg/Imu"](
        header, turn(0.0, 0.0, 0.0, 1.0), none, vector(*values), none, vector(0.0, 0.0, 9.8), none
    )


def rosbag(path: Path, ros1: bool = True) -> Path:
    """A bag with an IMU and a slower thermometer; returns the file to read."""
    rosbags = pytest.importorskip("rosbags.rosbag1" if ros1 else "rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if ros1 else typesys.Stores.ROS2_HUMBLE)
    write = store.serialize_ros1 if ros1 else store.serialize_cdr
    folder = path if ros1 else path.with_suffix("")
    with rosbags.Writer(folder) if ros1 else rosbags.Writer(folder, version=8) as bag:
        imu = bag.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
        warm = bag.add_connection("/temp", "sensor_msgs/msg/Temperature", typestore=store)
        for i, t in enumerate(TIME):
            now = int((START_S + t) * 1e9)
            message = _imu(store.types, t, tuple(axis[i] for axis in AXES.values()), ros1)
            bag.write(imu, now, write(message, "sensor_msgs/msg/Imu"))
            if i % 10 == 0:
                kind = store.types["sensor_msgs/msg/Temperature"]
                bag.write(warm, now, write(kind(message.header, WARM[i], 0.0), "sensor_msgs/msg/Temperature"))
    return path if ros1 else next(folder.glob("*.db3"))


def mcap(path: Path) -> None:
    """Messages of ROS 2 in CDR, and a thermometer in JSON."""
    pytest.importorskip("mcap_ros2")
    from mcap_ros2.writer import Writer

    definition = """std_msgs/Header header
geometry_msgs/Vector3 angular_velocity
===
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
===
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
===
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
    with path.open("wb") as file:
        writer = Writer(file)
        schema = writer.register_msgdef("sensor_msgs/msg/Imu", definition)
        inner = writer._writer
        plain = inner.register_schema("warm", "jsonschema", b"{}")
        channel = inner.register_channel("/temp", "json", plain)
        for i, t in enumerate(TIME):
            now = int((START_S + t) * 1e9)
            stamp = {"sec": int(START_S + t), "nanosec": round(t % 1 * 1e9)}
            turning = {name: float(axis[i]) for name, axis in AXES.items()}
            message = {"header": {"stamp": stamp, "frame_id": "imu"}, "angular_velocity": turning}
            writer.write_message("/imu", schema, message, now, now)
            if i % 10 == 0:
                inner.add_message(channel, now, b'{"temperature": %.6f}' % WARM[i], now)
        writer.finish()


def mat_7_3_structs(path: Path, name: str, structs: Sequence[Mapping[str, Any]]) -> None:
    """An array of structs as MATLAB saves it in version 7.3: each field lists references to `#refs#`."""
    import h5py

    def text(group: Any, key: str, value: str) -> Any:
        made = group.create_dataset(key, data=np.array([[ord(one)] for one in value], dtype=np.uint16))
        made.attrs["MATLAB_class"] = np.bytes_("char")
        return made

    with h5py.File(path, "w", userblock_size=512) as file:
        group, held = file.create_group(name), file.create_group("#refs#")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for field in structs[0]:
            references = group.create_dataset(field, (len(structs), 1), dtype=h5py.ref_dtype)
            for place, struct in enumerate(structs):
                key, value = f"{field}{place}", struct[field]
                if isinstance(value, Mapping):
                    made = held.create_group(key)
                    for unit, told in value.items():
                        text(made, unit, told)
                elif isinstance(value, str):
                    made = text(held, key, value)
                else:
                    made = held.create_dataset(key, data=np.asarray(value)[None, :])
                references[place, 0] = made.ref
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
