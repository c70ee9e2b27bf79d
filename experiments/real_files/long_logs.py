"""Long logs of each format at 400 Hz: those of the tests' writers, block by block."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tests.readers import files

RATE_HZ = 400.0
BLOCK = 1_000_000
GYRO_DEG_H, SWING_DEG_H, PERIOD_S = 10.0, 1.0, 60.0


def gyro(seconds: Any) -> Any:
    """What every log's gyro reads, about its x axis where it has three."""
    return GYRO_DEG_H + SWING_DEG_H * np.sin(2.0 * np.pi * seconds / PERIOD_S)


def blocks(hours: float) -> Iterator[Any]:
    """Times of the samples [s], block by block."""
    count = int(hours * 3600.0 * RATE_HZ)
    for start in range(0, count, BLOCK):
        yield np.arange(start, min(start + BLOCK, count)) / RATE_HZ


def _of_messages(path: Path, hours: float, size: int, layout: list[Any], write: Any) -> None:
    """The head of a small log, then messages of one layout: the first is that of the small one."""
    write(path)
    content = path.read_bytes()
    behind = files.COUNT * size
    kind = np.dtype(layout)
    first = np.frombuffer(content[-behind:][: kind.itemsize], kind)
    with path.open("wb") as file:
        file.write(content[:-behind])
        for seconds in blocks(hours):
            part = np.repeat(first, len(seconds))
            part["t"] = np.round(1e6 * seconds)
            part["x"] = gyro(seconds)
            file.write(part.tobytes())


def ulog(path: Path, hours: float) -> None:
    """One message a sample."""
    layout = [("head", "V5"), ("t", "<u8"), ("x", "<f4"), ("more", "V14")]
    _of_messages(path, hours, 31, layout, files.ulog)


def dataflash(path: Path, hours: float) -> None:
    """One message a sample, of one instance."""
    layout = [("head", "V3"), ("t", "<u8"), ("I", "u1"), ("x", "<f4"), ("more", "V12")]
    _of_messages(path, hours, 2 * 28, layout, files.dataflash)


def npz(path: Path, hours: float) -> None:
    """Three arrays."""
    seconds = np.concatenate(list(blocks(hours)))
    np.savez(path, **{"time [s]": seconds, "gyro [deg/h]": gyro(seconds), "T [degC]": 20.0 + seconds / 1e4})


def mat(path: Path, hours: float) -> None:
    """Three variables of version 5."""
    from scipy.io import savemat

    seconds = np.concatenate(list(blocks(hours)))
    units = {"time": "s", "gyro": "deg/h", "T": "degC"}
    columns = {"time": seconds, "gyro": gyro(seconds), "T": 20.0 + seconds / 1e4}
    savemat(path, {**columns, "units": units}, do_compression=True)


def tdms(path: Path, hours: float) -> None:
    """A channel of gyro and one of temperature, a segment a block."""
    import nptdms

    clock = {"wf_increment": 1.0 / RATE_HZ, "wf_start_time": np.datetime64(files.START_S, "s")}
    with nptdms.TdmsWriter(str(path)) as writer:
        for seconds in blocks(hours):
            held = {"gyro": (gyro(seconds), "deg/h"), "T": (20.0 + seconds / 1e4, "degC")}
            channels = [
                nptdms.ChannelObject("Log", name, values, properties={"unit_string": unit, **clock})
                for name, (values, unit) in held.items()
            ]
            writer.write_segment(channels)


def mdf(path: Path, hours: float) -> None:
    """One channel group."""
    import asammdf

    seconds = np.concatenate(list(blocks(hours)))
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(gyro(seconds), seconds, unit="deg/h", name="gyro")])
        file.save(path, overwrite=True)


def miniseed(path: Path, hours: float) -> None:
    """Counts of a rotation seismometer, packed."""
    import pymseed

    counts = np.concatenate([np.round(1000.0 * gyro(part)).astype(np.int32) for part in blocks(hours)])
    traces = pymseed.MS3TraceList()
    traces.add_data("FDSN:XX_STA__H_J_Z", counts, "i", RATE_HZ, starttime_seconds=float(files.START_S))
    traces.to_file(str(path), format_version=3)


def workbook(path: Path, hours: float) -> None:
    """A worksheet."""
    import xlsxwriter

    with xlsxwriter.Workbook(str(path), {"constant_memory": True}) as book:
        sheet = book.add_worksheet()
        sheet.write_row(0, 0, ["time [s]", "gyro [deg/h]", "T [degC]"])
        seconds = np.concatenate(list(blocks(hours)))
        for place, (at, value) in enumerate(zip(seconds.tolist(), gyro(seconds).tolist(), strict=True), 1):
            sheet.write_row(place, 0, [at, value, 20.0 + at / 1e4])


def rosbag(path: Path, hours: float, ros1: bool = True) -> Path:
    """One topic of an IMU: a message of the library with other times and rates."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    message = files._imu(store.types, 0.0, (0.0, 0.0, 0.0), ros1)
    kind = "sensor_msgs/msg/Imu"
    first = bytes(store.serialize_ros1(message, kind) if ros1 else store.serialize_cdr(message, kind))
    begin, frame = (("V4", "V7")) if ros1 else ("V4", "V8")
    layout = np.dtype(
        [
            ("begin", begin),
            ("sec", "<u4"),
            ("nsec", "<u4"),
            ("frame", frame),
            ("turn", "V104"),
            ("x", "<f8"),
            ("more", "V184"),
        ]
    )
    folder = path if ros1 else path.with_suffix("")
    writer: Any = rosbag1.Writer(folder) if ros1 else rosbag2.Writer(folder, version=8)
    with writer as bag:
        connection = bag.add_connection("/imu", kind, typestore=store)
        for seconds in blocks(hours):
            _write(bag.write, connection, np.frombuffer(first, layout), seconds)
    return path if ros1 else next(folder.glob("*.db3"))


def rosbag2(path: Path, hours: float) -> Path:
    """As `rosbag`, of ROS 2 in its database."""
    return rosbag(path, hours, ros1=False)


def mcap(path: Path, hours: float) -> None:
    """As `rosbag`, of ROS 2."""
    files.mcap(path)
    from mcap.reader import make_reader
    from mcap.writer import Writer

    with path.open("rb") as file:
        schema, channel, message = next(iter(make_reader(file).iter_messages(topics=["/imu"])))
    layout = np.dtype(
        [("begin", "V4"), ("sec", "<u4"), ("nsec", "<u4"), ("frame", "V8"), ("x", "<f8"), ("more", "V16")]
    )
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        kind = writer.register_schema(schema.name, schema.encoding, schema.data)
        number = writer.register_channel(channel.topic, channel.message_encoding, kind)
        for seconds in blocks(hours):
            _write(
                lambda _, now, data: writer.add_message(number, now, data, now),
                None, np.frombuffer(message.data, layout), seconds,
            )  # fmt: skip
        writer.finish()


def _write(write: Any, connection: Any, first: Any, seconds: Any) -> None:
    """Messages at some times, their stamps and rates [rad/s] set."""
    part = np.repeat(first, len(seconds))
    part["sec"] = files.START_S + seconds.astype(np.int64)
    part["nsec"] = np.round(1e9 * (seconds % 1.0))
    part["x"] = gyro(seconds)
    content, size = part.tobytes(), part.dtype.itemsize
    stamps = (np.round(1e9 * seconds).astype(np.int64) + files.START_S * 10**9).tolist()
    for place, now in enumerate(stamps):
        write(connection, now, content[place * size : (place + 1) * size])
