"""Readers of binary files, one declaration each: suffixes, first bytes, package, extra, class.

A reader runs in a process of its own with limits (`fogml.runs.reader_child`), as the libraries behind it are
written for sound files. It gives named arrays in groups (a worksheet, a message type, a channel group), with
units where the format has them; `fogml.runs` makes a run of them, or says which fields there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fogml.errors import install_words

__all__ = ["READERS", "Reader", "plain_path", "reader_of", "reader_of_content"]


@dataclass(frozen=True)
class Reader:
    """One format.

    Attributes
    ----------
    name, label
        What the format is called in the code, and in messages.
    suffixes
        Of file names; the first is the usual one.
    magic
        What a file begins with, any of these.
    place
        ``module:Class`` of its reader; the class takes a path and the names of wanted attributes, and has
        `arrays`, `told` and `close` as `fogml.readers.stored` says.
    package
        Module that it needs, loaded before memory is limited.
    extra
        Extra of the distribution that installs the package; None where fogml needs it anyway.
    cpu_s_per_mb
        Time that reading may take [s] for each megabyte, where that is more than of a fast format.
    memory_per_byte
        Memory that reading may take for each byte, likewise.
    """

    name: str
    label: str
    suffixes: tuple[str, ...]
    magic: tuple[bytes, ...]
    place: str
    package: str
    extra: str | None = None
    cpu_s_per_mb: float = 0.0
    memory_per_byte: float = 0.0


_TABLES = "fogml.readers.tables"
_VEHICLES, _MESSAGES = "fogml.readers.vehicles", "fogml.readers.messages"
READERS = (
    Reader("parquet", "Parquet", (".parquet", ".pq"), (b"PAR1",), "fogml.readers.parquet:Parquet",
           "pyarrow.parquet"),
    Reader("hdf5", "HDF5", (".h5", ".hdf5"), (b"\x89HDF\r\n\x1a\n",), "fogml.readers.stored:Hdf5", "h5py",
           "hdf5"),
    Reader("mat", "MATLAB", (".mat",), (b"MATLAB",), "fogml.readers.matlab:Mat", "scipy.io"),
    Reader("npz", "NumPy", (".npz",), (), f"{_TABLES}:Npz", "numpy"),
    Reader("workbook", "Excel or OpenDocument", (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"),
           (b"\xd0\xcf\x11\xe0",), "fogml.readers.workbooks:Workbook", "python_calamine", "xlsx", 2.0, 400.0),
    Reader("packed", "gzip, bzip2, xz, zstd or zip", (".gz", ".bz2", ".xz", ".zst", ".zip"),
           (b"\x1f\x8b", b"BZh", b"\xfd7zXZ", b"\x28\xb5\x2f\xfd"), "fogml.readers.packed:Packed", "numpy",
           cpu_s_per_mb=1.0),
    Reader("tdms", "TDMS", (".tdms",), (b"TDSm",), f"{_TABLES}:Tdms", "nptdms", "tdms"),
    Reader("mdf", "MDF4", (".mf4", ".mdf"), (b"MDF     ", b"UnFinMF "), f"{_TABLES}:Mdf", "asammdf", "mdf",
           1.0),
    Reader("miniseed", "miniSEED", (".mseed", ".miniseed", ".ms"), (b"MS\x03",),
           f"{_VEHICLES}:MiniSeed", "pymseed", "miniseed"),
    Reader("ulog", "ULog", (".ulg", ".ulog"), (b"ULog\x01\x12\x35",), f"{_VEHICLES}:ULog", "pyulog", "ulog",
           2.0),
    Reader("dataflash", "DataFlash", (".bin",), (b"\xa3\x95\x80\x80",), f"{_VEHICLES}:DataFlash",
           "pymavlink.DFReader", "dataflash", 3.0),
    Reader("rosbag", "ROS bag", (".bag", ".db3"), (b"#ROSBAG V2.0", b"SQLite format 3\0"),
           f"{_MESSAGES}:RosBag", "rosbags.highlevel", "ros", 5.0),
    Reader("mcap", "MCAP", (".mcap",), (b"\x89MCAP0\r\n",), f"{_MESSAGES}:Mcap", "mcap.reader", "mcap",
           5.0),
)  # fmt: skip
"""Every format, in the order in which first bytes are compared."""
_BY_NAME = {reader.name: reader for reader in READERS}


def reader_of(name: str) -> Reader:
    """The reader of a format by its name."""
    return _BY_NAME[name]


def reader_of_content(head: bytes, suffix: str) -> Reader | None:
    """The reader of a file by its first 64 bytes; by its suffix where several formats begin alike."""
    suffix = suffix.lower()
    named = [reader for reader in READERS if suffix in reader.suffixes]
    if head.startswith(b"PK\x03\x04"):
        inside = head[30:60]
        if inside.startswith((b"[Content_Types]", b"mimetype", b"xl/", b"_rels/", b"docProps/")):
            return _BY_NAME["workbook"]
        return _BY_NAME["npz"] if b".npy" in head[30:1024] else next(iter(named), _BY_NAME["packed"])
    if head.startswith(_BY_NAME["hdf5"].magic) and suffix == ".mat":
        return _BY_NAME["mat"]
    if head.startswith(b"SQLite") and suffix not in _BY_NAME["rosbag"].suffixes:
        return None  # another database
    # Version 2 of miniSEED begins with a number of six digits, a quality and a blank.
    if len(head) > 20 and head[:6].isdigit() and head[6:7] in b"DRQM" and head[7:8] in b" \0":
        return _BY_NAME["miniseed"]
    return next((reader for reader in READERS if reader.magic and head.startswith(reader.magic)), None)


def plain_path(path: Path) -> Path:
    """A file's path without the suffix of what packed it: ``log.csv`` of ``log.csv.gz``."""
    is_packed = path.suffix.lower() in _BY_NAME["packed"].suffixes and Path(path.stem).suffix
    return path.with_suffix("") if is_packed else path


def extra_hint(reader: Reader, path: Path) -> str:
    """What to say of a file whose reader's package is missing."""
    package = reader.package.partition(".")[0]
    return (
        f"{path.name}: its format is {reader.label}; reading it needs the package {package}: "
        + install_words(reader.extra or "readers")
    )
