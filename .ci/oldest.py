"""The floors of pyproject.toml as constraints: ``python .ci/oldest.py > oldest.txt``."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# Libraries alone: with which version of its tools a test runs tells nothing of the library.
READERS = ("hdf5", "xlsx", "tdms", "mdf", "ulog", "dataflash", "ros", "mcap", "miniseed")
extras = (project["optional-dependencies"][name] for name in (*READERS, "export", "sweep", "cluster"))
for requirement in sorted({*project["dependencies"], *(each for extra in extras for each in extra)}):
    name, floor = re.fullmatch(r"([\w-]+)(?:\[\w+\])?>=([\d.]+)", requirement).groups()
    print(f"{name}=={floor}")
