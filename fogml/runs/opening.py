"""Which format a file has, and where it is read: text within another file is unpacked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fogml.errors import InputError
from fogml.folders import with_slashes
from fogml.readers import READERS, reader_of, reader_of_content
from fogml.runs.held_texts import HOLDING, HeldText
from fogml.runs.raw_table import RawTable, empty_file
from fogml.runs.reading_limits import DEFAULT_LIMITS, ReadingLimits

_HEAD_BYTES = 1024
_CSV_SUFFIXES = (".csv", ".tsv")
_FOREIGN = {
    b"7z\xbc\xaf": "a 7-Zip archive; unpack it first",
    b"%PDF": "a PDF; export the table as CSV",
    b"ARROW1": "a Feather (Arrow) file; write it as Parquet",
    b"\x93NUMPY": "one NumPy array, whose columns have no names; write it with names, as numpy.savez does",
}


@dataclass(frozen=True)
class Opened:
    """A file as it is read: its format and its place, of text within another file where it lies unpacked."""

    kind: str
    path: Path
    within: HeldText | None = None

    @property
    def size_mb(self) -> float:
        """What it holds, unpacked where it tells [MB]."""
        size = float(self.path.stat().st_size)
        if self.kind == "parquet":
            from fogml.runs.parquet_files import parquet_values

            size = max(size, 8.0 * parquet_values(self.path))
        return size / 1e6

    def keeping(self, table: RawTable) -> RawTable:
        """A table of the file, which is kept as long as the table."""
        return self.within.keeping(table) if self.within else table


def opened(path: Path, limits: ReadingLimits = DEFAULT_LIMITS) -> Opened:
    """A file of any format; text within another file is unpacked, and is CSV then."""
    kind = file_format(path)
    if kind not in HOLDING:
        return Opened(kind, path)
    text = HeldText(path, kind, limits)
    return Opened("csv", text.path, text)


def file_format(path: Path) -> str:
    """Which of the formats a file has, told by its first bytes: ``csv`` or the name of a reader.

    Raises
    ------
    InputError
        If it is missing, no file, not readable, empty, of a known format that holds no run, or
        of another format than its suffix says.
    """
    kind = _format_of_content(path)
    suffix = path.suffix.lower()
    stated = [reader for reader in READERS if suffix in reader.suffixes]
    # Programs that load pages leave a packed file under the name that its text has.
    is_text = kind in ("csv", "packed") and (suffix in _CSV_SUFFIXES or not stated)
    if is_text or kind in [r.name for r in stated]:
        return kind
    if kind == "csv":
        label = stated[0].label
        raise InputError(f"{path.name}: damaged or no {label} file (its first bytes are not {label}'s)")
    reader = reader_of(kind)
    if not stated and suffix not in _CSV_SUFFIXES:
        return kind
    label = stated[0].label if stated else "CSV"
    do = "unpack it first" if kind == "packed" else f"rename it to '{path.stem}{reader.suffixes[0]}'"
    raise InputError(
        f"{path.name}: its content is of the format {reader.label}, and it is named as {label}; {do}"
    )


def _of_shipped(path: Path) -> str:
    name = str(path).removeprefix("shipped:")
    return "" if name == str(path) else f"; in Python a recording that ships is fogml.shipped_run('{name}')"


def _format_of_content(path: Path) -> str:
    try:
        if not path.exists():
            raise InputError(f"{path}: no such file{with_slashes(path)}{_of_shipped(path)}")
        if path.is_dir() and (path / "metadata.yaml").is_file():
            raise InputError(f"{path}: is the folder of a ROS 2 bag; name its .db3 or .mcap file")
        if path.is_dir():
            raise InputError(f"{path}: is a folder; name a file")
        if not path.is_file():
            raise InputError(f"{path}: is no ordinary file; save the recording to one first")
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    if not head:
        raise empty_file(path.name)
    if (reader := reader_of_content(head, path.suffix)) is not None:
        return reader.name
    for magic, what in _FOREIGN.items():
        if head.startswith(magic):
            raise InputError(f"{path.name}: is {what}")
    return "csv"
