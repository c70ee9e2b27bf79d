"""Parents for the tests of kills: each starts workers that write down their numbers and hang."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from fogml.fleet.manifest import Unit
from fogml.outputs import whole_file


def hang(unit: Unit, folder: Path) -> Mapping[str, Any]:
    """A fleet's job that never ends, in the midst of writing."""
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(folder / "report.json") as partial:
        partial.write_text("half")
        (folder.parent.parent / f"{os.getpid()}.worker").touch()
        time.sleep(600.0)
    return {}


def fleet(home: Path) -> None:
    """Two workers of a fleet."""
    from fogml.fleet.engines import run_tasks
    from tests.fleet.units import tasks

    run_tasks(tasks(home, 2, hang), workers=2)


def sweep(home: Path) -> None:
    """Two workers of a sweep."""
    from fogml.tuning.sweep import run_sweep
    from tests.tuning.world import plan, runs

    run_sweep(replace(plan(home), read=HangingRuns(home, os.getpid(), runs)), workers=2)


class HangingRuns:
    """Gives the runs to the parent; a worker that asks for them hangs."""

    def __init__(self, home: Path, parent: int, read: Any) -> None:
        self.home, self.parent, self.read = home, parent, read

    def __call__(self) -> Any:
        if os.getpid() != self.parent:
            (self.home / f"{os.getpid()}.worker").touch()
            time.sleep(600.0)
        return self.read()


def blind(home: Path) -> None:
    """Two sealed workers of a blind suite."""
    from fogml.blind.folders import BlindFolder
    from fogml.blind.run import RunPlan, run_cases

    plan = RunPlan(BlindFolder(home / "suite"), "hanging:hang", code=home / "code", workers=2)
    run_cases(plan)


if __name__ == "__main__":
    from fogml.processes import Terminated, end_as_interrupted

    end_as_interrupted()
    try:
        {"fleet": fleet, "sweep": sweep, "blind": blind}[sys.argv[1]](Path(sys.argv[2]))
    except Terminated as signal:
        sys.exit(signal.status)
