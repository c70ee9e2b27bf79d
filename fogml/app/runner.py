"""``python -m fogml.app.runner FOLDER``: runs a job's command to its end, whatever becomes of who started it.

The process has a session of its own. ``process.json`` says that it runs and cannot be made twice, so that a
job never runs twice; ``ended.json`` says how it ended.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from fogml.json_files import write_json
from fogml.outputs import whole_file
from fogml.processes import process_start

PROCESS, ENDED, CANCELLED = "process.json", "ended.json", "cancelled"


def tell(path: Path, values: Any) -> None:
    """Write JSON that is there whole or not at all."""
    with whole_file(path) as partial:
        write_json(partial, values)


def _claim(folder: Path, process: Any) -> bool:
    """Say that a job runs; False if that was said before."""
    partial = folder / f"{PROCESS}.{os.getpid()}"
    write_json(partial, process)
    try:
        os.link(partial, folder / PROCESS)
    except FileExistsError:
        return False
    finally:
        partial.unlink()
    return True


def begin(folder: Path) -> None:
    """Begin the job of a folder in a process of its own, unless it was begun before."""
    heard, told = os.pipe()
    pid = os.fork()
    if pid:
        process = {"pid": pid, "started": process_start(pid), "child": None}
        os.write(told, b"1" if _claim(folder, process) else b"0")
        return
    os.setsid()
    if os.read(heard, 1) == b"1":
        run(folder)


def run(folder: Path) -> None:
    """Run the job of a folder, from the folder two above it, to its end."""
    words = json.loads((folder / "job.json").read_text(encoding="utf-8"))["words"]
    process = json.loads((folder / PROCESS).read_text(encoding="utf-8"))
    # Only what is told to the command ends it; with a handler rather than ignored, it hears of that itself.
    for name in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.signal(name, lambda number, frame: None)
    began = time.monotonic()
    # Without the folder on the path: what lies there is data.
    command = [sys.executable, "-P", "-m", "fogml", *words]
    with open(folder / "stdout", "wb") as out, open(folder / "stderr", "wb") as err:
        child = subprocess.Popen(
            command, cwd=folder.parents[1], stdin=subprocess.DEVNULL, stdout=out, stderr=err
        )
        tell(folder / PROCESS, {**process, "child": child.pid})
        if (folder / CANCELLED).exists():
            with contextlib.suppress(ProcessLookupError):
                child.terminate()
        status = child.wait()
    tell(folder / ENDED, {"status": status, "seconds": time.monotonic() - began})


if __name__ == "__main__":
    begin(Path(sys.argv[1]))
