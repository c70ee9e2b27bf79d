"""Spoiled recordings of the formats that readers open: bytes, or members of a packed file, changed."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from random import Random
from typing import Any

from experiments.faults import mutate
from experiments.faults.case import Case
from fogml.readers import reader_of

FOLDER = "recorded"
NAMES = {
    "TDMS file": ("tdms", "tdms", "log.tdms"),
    "MDF4 file": ("mdf", "mdf", "log.mf4"),
    "miniSEED file": ("miniseed", "miniseed", "log.mseed"),
    "ULog file": ("ulog", "ulog", "log.ulg"),
    "DataFlash file": ("dataflash", "dataflash", "log.bin"),
    "ROS 1 bag": ("rosbag", "rosbag", "log.bag"),
    "ROS 2 bag": ("rosbag2", "rosbag", "log.db3"),
    "MCAP file": ("mcap", "mcap", "log.mcap"),
    "NumPy archive": ("npz", "npz", "log.npz"),
    "workbook": ("xlsx", "workbook", "log.xlsx"),
}
"""Kind of input to the tests' writer of it, the reader, and the file's name."""
_PACKED = (".npz", ".xlsx")
_OF_THREE_AXES = (".ulg", ".bin", ".bag", ".db3", ".mcap")
"""Of these the tests' recordings hold three gyros."""


def write_recordings(folder: Path) -> None:
    """Write a sound recording of each format whose libraries are there."""
    from tests.readers import files

    home = folder / FOLDER
    home.mkdir()
    writers: dict[str, Callable[[Path], Any]] = {"rosbag2": lambda path: files.rosbag(path, ros1=False)}
    for writer, reader, name in NAMES.values():
        if find_spec(reader_of(reader).package.partition(".")[0]) is not None:
            write = writers.get(writer) or getattr(files, writer)
            written = write(home / name)
            if writer == "rosbag2":
                # The folder's metadata stand beside it.
                written.rename(home / name)
                metadata = written.parent / "metadata.yaml"
                (home / "metadata.yaml").write_text(metadata.read_text().replace(written.name, name))
                metadata.unlink()
                written.parent.rmdir()


def recording(name: str, rng: Random, world: Mapping[str, bytes]) -> Case:
    """A command on a spoiled recording of that name."""
    content, suffix = world[f"{FOLDER}/{name}"], Path(name).suffix
    packed = suffix in _PACKED and rng.random() < 0.6
    content = _in_a_member(rng, content) if packed else mutate.data(rng, content)
    place = f"x{suffix}"
    files = {place: content}
    if suffix == ".db3":
        place, metadata = f"bag/{name}", world[f"{FOLDER}/metadata.yaml"]
        if rng.random() < 0.2:
            metadata = mutate.text(rng, metadata.decode()).encode("utf-8", errors="replace")
        files = {place: content, "bag/metadata.yaml": metadata}
    axis = ("--axis", "x") if suffix in _OF_THREE_AXES else ()
    draft = rng.random() < 0.2
    command = ("import", place, "--draft", "--quiet") if draft else ("only", "read", place, *axis)
    return Case(command, files, place)


def _in_a_member(rng: Random, content: bytes) -> bytes:
    """A sound archive of an unsound member."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as sound, zipfile.ZipFile(target, "w") as spoiled:
        chosen = rng.choice(sound.namelist())
        for member in sound.namelist():
            held = sound.read(member)
            if member == chosen:
                is_text = member.endswith((".xml", ".rels")) and rng.random() < 0.7
                held = mutate.text(rng, held.decode()).encode("utf-8", errors="replace") if is_text else (
                    mutate.data(rng, held)
                )  # fmt: skip
            spoiled.writestr(member, held, rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)))
    return target.getvalue()
