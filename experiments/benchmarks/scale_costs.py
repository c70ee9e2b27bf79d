"""What a Dask cluster and a PostgreSQL server cost a fleet, a sweep and the store of a monitor.

``python -m experiments.benchmarks.scale_costs DIR`` runs the same small fleet in two processes and on a Dask
cluster of two, the same sweep with its study in a journal file and in PostgreSQL, and adds runs to both kinds
of store. It writes ``scale_costs.json`` beside itself and ``scale.md`` anew. About 10 core-minutes; the
server writes without waiting for its disk.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from experiments.benchmarks.fleet_run import COMMAND, make_units
from experiments.faults.postgres import postgres
from experiments.line_diagnosis.__main__ import cluster
from fogml import __version__
from fogml.json_files import write_json
from fogml.monitor.record import NUMBERS, TEXTS, RunRecord
from fogml.monitor.store import open_store
from fogml.outputs import whole_file
from fogml.processes import of_this_package

HERE = Path(__file__).parent
FOUND = HERE / "scale_costs.json"
SWEEP = """schema: fogml.sweep/1
name: cost
runs: ["shipped:thermal-cycle-1-y", "shipped:thermal-cycle-2-y"]
test: ["shipped:thermal-cycle-3-y"]
space:
  features: ["T", "T^1..2", "T^1..3"]
  models:
    polynomial: {ridge: {low: 1.0e-8, high: 0.1, log: true}}
averaging: 10.0
workers: 2
"""


def spent(action: Callable[[], object]) -> dict[str, float]:
    """Wall time and processor time, of processes that it starts and ends too [s]."""
    wall, cpu = time.perf_counter(), _processors_s()
    action()
    return {"wall_s": time.perf_counter() - wall, "core_s": _processors_s() - cpu}


def _processors_s() -> float:
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


def fogml(folder: Path, *words: str) -> None:
    """A command of fogml, in a folder."""
    command = [sys.executable, "-m", "fogml", *words]
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL, env=of_this_package())


def fleet(home: Path, units: int) -> dict[str, Any]:
    """The same units in two processes and on a cluster, whose start and end count."""
    manifest = make_units(home, units)

    def on_cluster() -> None:
        with cluster(True) as address:
            assert address
            fogml(home, "fleet", manifest.name, *COMMAND, "--cluster", address, "-o", "dask")

    alone = spent(lambda: fogml(home, "fleet", manifest.name, *COMMAND, "-o", "alone"))
    return {"units": units, "processes": alone, "dask": spent(on_cluster)}


def sweep(home: Path, trials: int, url: str) -> dict[str, Any]:
    """The same study in a journal file and in a database."""
    (home / "sweep.yaml").write_text(SWEEP, encoding="utf-8")
    words = ("sweep", "sweep.yaml", "--trials", str(trials), "--quiet")
    journal = spent(lambda: fogml(home, *words, "-o", "journal"))
    database = spent(lambda: fogml(home, *words, "--storage", url, "-o", "database"))
    return {"trials": trials, "journal": journal, "database": database}


def records(count: int, seed: int) -> list[RunRecord]:
    """Runs as a monitor keeps them, of numbers drawn."""
    rng = np.random.default_rng(seed)
    found = []
    for number in range(count):
        texts = dict.fromkeys(TEXTS, "") | {"key": f"{seed:08d}{number:056d}", "unit": f"U{number:05d}"}
        found.append(RunRecord(**texts, **dict(zip(NUMBERS, rng.normal(size=len(NUMBERS)).tolist()))))
    return found


def store(place: str, held: int, added: int) -> dict[str, Any]:
    """Adding runs one by one to a store that holds some, and reading it whole [s]."""
    kept = open_store(place)
    try:
        kept.add(records(held, 1))
        one_by_one = []
        for record in records(added, 2):
            begun = time.perf_counter()
            kept.add([record])
            one_by_one.append(time.perf_counter() - begun)
        begun = time.perf_counter()
        assert len(kept.records()) == held + added
        return {"add_s": statistics.median(one_by_one), "read_s": time.perf_counter() - begun}
    finally:
        kept.close()


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("directory", type=Path, help="a new folder for runs and results")
    parser.add_argument("--units", type=int, default=40, help="units of the fleet (40)")
    parser.add_argument("--trials", type=int, default=60, help="trials of the sweep (60)")
    parser.add_argument("--held", type=int, default=20_000, help="runs that the store holds (20000)")
    given = parser.parse_args()
    home = given.directory.resolve()
    values: dict[str, Any] = {"schema": "fogml.scale_costs/1", "version": __version__}
    values["date"] = time.strftime("%Y-%m-%d")
    values["fleet"] = fleet(home, given.units)
    with postgres(home / "server") as url:
        values["sweep"] = sweep(home, given.trials, url)
        stores = {"folder": str(home / "store"), "database": url}
        values["store"] = {
            "held": given.held,
            **{name: store(place, given.held, 10) for name, place in stores.items()},
        }
    with whole_file(FOUND) as partial:
        write_json(partial, values, indent=1)
    from experiments.benchmarks.scale import main as write_page

    write_page()


if __name__ == "__main__":
    main()
