"""Packages of other makers, as an installer would put them on a path."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def in_new_process(folder: Path, package: Path, entry_points: str, code: str) -> str:
    """What a program says where a package is installed in a folder, with these entry points."""
    name = next((package / "src").glob("fogml_*")).stem
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name.replace('_', '-')}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(entry_points)
    search = os.pathsep.join([str(folder), str(package / "src"), *filter(None, sys.path)])
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": search}
    )
    assert answer.returncode == 0, answer.stderr
    return answer.stdout.strip()
