"""What commands take on a long run: ``python -m experiments.real_files.long_runs [HOURS] [--limit GB]``.

Writes a synthetic run at 400 Hz (white noise, a thermal cycle) as Parquet and CSV where temporary files lie,
and prints the most resident memory and the processor time of each command in a process of its own. With a
limit all that follows the writing runs in a control group of so much memory, pages of files among it (root,
version 1): what does not fit is killed.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from experiments.real_files.long_logs import blocks
from fogml.runs.writing import BlockWriter

PROFILE = """schema: fogml.import/1
description: a long run
columns:
  time: {source: "time [s]", unit: s}
  gyro: {source: "gyro [deg/h]", unit: deg/h}
  T: {source: "T [degC]", unit: degC, missing: [-999]}
"""


def write(path: Path, hours: float) -> None:
    """Write the run in the format of a suffix."""
    rng = np.random.default_rng(1)
    with BlockWriter(path) as writer:
        for seconds in blocks(hours):
            temperature = 20.0 + 20.0 * np.sin(seconds / 20000.0) + rng.normal(0.0, 0.01, len(seconds))
            gyro = 10.0 + rng.normal(0.0, 5.0, len(seconds)) + 0.05 * temperature
            columns = {"time [s]": seconds, "gyro [deg/h]": gyro, "T [degC]": temperature}
            writer.write(columns)


def measured(*arguments: str) -> tuple[float, float]:
    """Most resident memory [GB] and processor time [s] of a command."""
    code = "import sys; from fogml.cli.main import main; sys.argv[0] = 'fogml'; main()"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", code, *arguments], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return after.ru_maxrss * 1024 / 1e9, spent


GROUP = Path("/sys/fs/cgroup/memory/fogml-long-runs")


def limit_to(memory_gb: float) -> None:
    """Put this process, and those that it starts, into a control group of so much memory."""
    GROUP.mkdir(exist_ok=True)
    (GROUP / "memory.limit_in_bytes").write_text(str(round(1e9 * memory_gb)))
    (GROUP / "cgroup.procs").write_text(str(os.getpid()))


def main() -> None:
    """Write, measure, print: memory of the commands so far, the most of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("hours", type=float, nargs="?", default=24.0, help="length of the run (24)")
    parser.add_argument("--limit", type=float, metavar="GB", help="memory that there is")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "profile.yaml").write_text(PROFILE)
        for suffix in ("csv", "parquet"):
            write(folder / f"run.{suffix}", given.hours)
        if given.limit is not None:
            limit_to(given.limit)
        run = str(folder / "run.parquet")
        profile = ("--profile", str(folder / "profile.yaml"))
        commands = {
            "inspect": ("inspect", run, "-o", str(folder / "inspect")),
            "import": ("import", str(folder / "run.csv"), *profile, "-o", str(folder / "import")),
            "noise": ("noise", run, "-o", str(folder / "noise")),
        }
        for command, arguments in commands.items():
            memory, spent = measured(*arguments)
            print(f"{command}: {memory:.2f} GB, {spent:.0f} s", flush=True)


if __name__ == "__main__":
    main()
