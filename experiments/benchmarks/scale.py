"""Scale on paper: what a month of many units takes, from the measured costs.

``python -m experiments.benchmarks.scale`` writes ``scale.md`` anew from ``results.json``.
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.benchmarks.merging import machines
from fogml.outputs import whole_file

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Load:
    """What is asked: units a month, recordings of each, and how long and how fast they are sampled."""

    units: int = 10_000
    runs: int = 2
    rate_hz: float = 100.0
    hours: float = 24.0
    columns: int = 4
    diagnosed: float = 0.05
    days: float = 30.0

    @property
    def samples(self) -> float:
        """Of one recording."""
        return self.rate_hz * self.hours * 3600.0


@dataclass(frozen=True)
class Server:
    """One machine of a laboratory, for what breaks first; stated, not measured."""

    cores: int = 16
    disk_tb: float = 20.0
    network_mb_s: float = 110.0
    memory_gb: float = 64.0
    busy: float = 0.7


@dataclass(frozen=True)
class Cost:
    """A step of the work on one unit: core-seconds, and where the figure comes from."""

    name: str
    seconds: float
    source: str


def costs(results: Mapping[str, Any], load: Load) -> tuple[list[Cost], list[str]]:
    """Core-seconds of each step for one unit, and the steps whose figures are not there."""
    rate = _rates(results)
    both = load.runs * load.samples
    # Name of a step: what it is measured as, and samples of it for one unit.
    steps = {
        "reading": ("reading Parquet, 4 columns", both),
        "noise and Allan deviation": ("Allan deviation, 13 octaves", both),
        "features": ("features: T, dT, T*dT, gradient and its rate", both),
        "training, network": ("RBF training, 64 centres", load.samples),
        "training, polynomial": ("polynomial of 33 columns", load.samples),
        "judging and compensating": ("RBF evaluation, 64 centres", both),
        "writing the compensated runs": ("write-parquet-1e7-pyarrow", both),
    }
    found, missing = [], []
    for name, (measured, samples) in steps.items():
        if measured in rate:
            found.append(Cost(name, rate[measured] * samples, measured))
        else:
            missing.append(f"{name} ({measured})")
    diagnosis = _study(results, "diagnosis")
    if diagnosis and diagnosis.get("ten_hours"):
        seconds = statistics.median(diagnosis["ten_hours"]) * load.hours / 10.0 * load.diagnosed
        found.append(
            Cost("diagnosis", seconds, f"two 10 h runs at 1 Hz, for {load.diagnosed:.0%} of the units")
        )
    else:
        missing.append("diagnosis (diagnosis)")
    return found, missing


def _rates(results: Mapping[str, Any]) -> dict[str, float]:
    """Seconds a sample of what was measured, by its name."""
    limits = _study(results, "limits") or {"rows": []}
    found = {row["name"]: statistics.median(row["seconds"][-1]) / row["sizes"][-1] for row in limits["rows"]}
    for job in results["jobs"]:
        if job["name"] == "write-parquet-1e7-pyarrow":
            found[job["name"]] = job["ours_s"]["median"] / (20_000 if job["quick"] else 10_000_000)
    return found


def _study(results: Mapping[str, Any], name: str) -> Mapping[str, Any] | None:
    return next((study for study in results.get("studies", []) if study["name"] == name), None)


def bytes_per_sample(results: Mapping[str, Any]) -> dict[str, float]:
    """Of 4 columns in a file, CSV and Parquet, where they were measured."""
    limits = _study(results, "limits") or {"rows": []}
    found = {}
    for row in limits["rows"]:
        for kind in ("CSV", "Parquet"):
            if row["name"] == f"reading {kind}, 4 columns":
                # The bytes of that row are those of the file and of four columns in memory.
                found[kind] = row["bytes"] / row["sizes"][-1] - 32.0
    return found


def scale_page(
    results: Mapping[str, Any],
    load: Load | None = None,
    server: Server | None = None,
    fleet: Mapping[str, Any] | None = None,
    shared: Mapping[str, Any] | None = None,
) -> str:
    """The page, in Markdown; `fleet` and `shared` hold ``fleet_run.json`` and ``scale_costs.json``."""
    load, server = load or Load(), server or Server()
    found, missing = costs(results, load)
    machine = results["machine"]
    elsewhere = ", of other machines too," if len(machines(results)[0]) > 1 else ""
    lines = [
        "# Scale on paper",
        "",
        f"{load.units:,} units a month, {load.runs} recordings of each (one to train on, one to judge on), "
        f"{load.hours:g} h at {load.rate_hz:g} Hz, {load.columns} columns: {load.samples:,.0f} samples a "
        f"recording, "
        f"{load.units * load.runs * load.samples:.3g} a month. Worked out by `python -m "
        f"experiments.benchmarks.scale` "
        f"from the measured costs in `results.json` ({machine['processor']}, {machine['date']}, "
        f"OMP_NUM_THREADS "
        f"{machine.get('threads', 'all cores')}; what was merged later{elsewhere} is told in `results.md`), "
        "taken as core-seconds and as linear in samples; both are what `results.md` shows. Nothing here was "
        "run at this size.",
        *(() if fleet is None else _real_run(fleet, load)),
        *(() if shared is None else _shared_costs(shared, load)),
    ]
    if missing:
        lines += ["", f"Not measured, so not in the sums: {'; '.join(missing)}."]
    if not found:
        return "\n".join(lines) + "\n"
    total = sum(cost.seconds for cost in found)
    lines += [
        "",
        "## Work for one unit",
        "",
        "| step | core-seconds | share | measured as |",
        "|---|---:|---:|---|",
    ]
    for cost in sorted(found, key=lambda cost: -cost.seconds):
        lines.append(f"| {cost.name} | {cost.seconds:.3g} | {cost.seconds / total:.0%} | {cost.source} |")
    hours = load.units * total / 3600.0
    workers = hours / (load.days * 24.0 * server.busy)
    lines += [
        f"| all | {total:.3g} | | |",
        "",
        "## A month",
        "",
        f"- Worker hours: {hours:,.0f} core-hours. With workers busy {server.busy:.0%} of the month that is "
        f"{workers:.2g} cores, so {math.ceil(workers)} worker(s) of one core; a backlog of a day "
        f"({load.units / load.days:.0f} units) takes {hours / load.days:,.1f} core-hours.",
    ]
    size = bytes_per_sample(results)
    stored = {}
    for kind, each in size.items():
        stored[kind] = load.units * load.runs * load.samples * each / 1e12
        lines.append(
            f"- Storage as {kind}: {each:.3g} bytes a sample, {load.samples * each / 1e9:.2g} GB a "
            f"recording, "
            f"{stored[kind]:.3g} TB a month, {12 * stored[kind]:.3g} TB a year; on average "
            f"{stored[kind] * 1e6 / (load.days * 86400):.3g} MB/s in."
        )
    memory = 8.0 * load.samples * (load.columns + 5 + 5) / 1e9
    lines.append(
        f"- Memory: a recording is {8.0 * load.samples * load.columns / 1e9:.2g} GB in columns, about "
        f"{memory:.2g} GB "
        "with features and their copies (5 columns each); two at once for a unit. Compensation streams "
        "and stays "
        "below 1 GB whatever the length."
    )
    lines += _breaks_first(load, server, hours, stored, memory)
    lines += _drivers(found, total)
    return "\n".join(lines) + "\n"


def found_in(folder: Path, name: str) -> Mapping[str, Any] | None:
    """What a run of its own found, if it lies in a folder."""
    path = folder / name
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None


def _shared_costs(told: Mapping[str, Any], load: Load) -> list[str]:
    """What a cluster and a database add to work done in two processes and files."""
    fleet, sweep, store = told["fleet"], told["sweep"], told["store"]
    units, trials, held = fleet["units"], sweep["trials"], store["held"]
    rows = [
        ("a unit of a fleet", "two processes", fleet["processes"], "Dask, two workers", fleet["dask"], units),
        ("a trial of a sweep", "journal file", sweep["journal"], "PostgreSQL", sweep["database"], trials),
    ]
    lines = [
        "",
        "## What a cluster and a database cost",
        "",
        f"`python -m experiments.benchmarks.scale_costs DIR`, fogml {told['version']}, {told['date']}: "
        f"{units} units of two short runs each, {trials} trials, both sides in one run; starting and ending "
        "workers counts, a server on the same machine that does not wait for its disk.",
        "",
        "| work | in | core-seconds | seconds | in | core-seconds | seconds |",
        "|---|---|---:|---:|---|---:|---:|",
    ]
    for what, one, own, other, shared, count in rows:
        cells = [
            f"{name} | {spent['core_s'] / count:.2g} | {spent['wall_s'] / count:.2g}"
            for name, spent in ((one, own), (other, shared))
        ]
        lines.append(f"| {what} | {' | '.join(cells)} |")
    folder, database = store["folder"], store["database"]
    month = load.units * load.runs
    return [
        *lines,
        "",
        f"A monitor's store of {held:,} runs (a month's are {month:,}): one more run takes "
        f"{folder['add_s']:.2g} s in a folder, whose file is read and written whole, and "
        f"{database['add_s']:.2g} s in PostgreSQL; reading all takes {folder['read_s']:.2g} and "
        f"{database['read_s']:.2g} s. Runs given in one call are added at once. Added one by one, a "
        f"month's runs take "
        f"{folder['add_s'] * month / 3600.0:.2g} h in a folder of that size and "
        f"{database['add_s'] * month / 3600.0:.2g} h in PostgreSQL.",
    ]


def _real_run(fleet: Mapping[str, Any], load: Load) -> list[str]:
    """What a fleet of synthetic units did while it was killed, beside one left alone."""
    units, killed = fleet["units"], fleet["killed"]
    each = fleet["core_s"]["alone"] / units
    kills = ", ".join(f"{count} × {what}" for what, count in killed["kills"].items())
    ends = ", ".join(f"{count} × {status}" for status, count in killed["ends"].items())
    differ = fleet["differ"]
    same = (
        f"all {fleet['files']:,} files of units and fleet are the same, bit for bit (of workbooks what is in "
        "them; the name of the folder apart)"
        if not differ
        else f"**{len(differ)} of {fleet['files']:,} files differ**, the first {differ[0]}"
    )
    return [
        "",
        "## A real run with kills",
        "",
        f"{units} synthetic units of two runs each, trained, judged and reported by `fogml fleet "
        f"--workers 2` (`python -m experiments.benchmarks.fleet_run DIR`, fogml {fleet['version']}, "
        f"{fleet['date']}). While it ran: {kills} killed at random moments; the same command was given "
        f"{killed['starts']} times (exit statuses: {ends}). {fleet['done']} of {units} units done. Beside "
        f"the same fleet left alone, {same}; partial files left: {len(killed['partial'])}. Left alone it "
        f"takes {each:.2g} core-seconds a unit, of 260 rows a run: nearly all of it is the unit's report, "
        f"page and workbook, whatever the length of the runs. {load.units:,} units a month are "
        f"{each * load.units / 3600.0:.2g} core-hours of that.",
    ]


def _breaks_first(
    load: Load, server: Server, hours: float, stored: Mapping[str, float], memory: float
) -> list[str]:
    """Units a month that each resource of one server carries, least first."""
    month_s = load.days * 86400.0
    most = {
        f"{server.cores} cores": load.units * server.cores * load.days * 24 * server.busy / hours,
        f"{server.memory_gb:g} GB of memory, one unit per core": load.units
        * min(server.cores, server.memory_gb / (load.runs * memory))
        * load.days
        * 24
        * server.busy
        / hours,
    }
    if "Parquet" in stored:
        each_tb = stored["Parquet"] / load.units
        most[f"{server.disk_tb:g} TB of disk, one month kept, Parquet"] = server.disk_tb / each_tb
        most[f"{server.disk_tb:g} TB of disk, a year kept, Parquet"] = server.disk_tb / (12 * each_tb)
        most[f"network of {server.network_mb_s:g} MB/s, recordings once in and once out"] = (
            server.network_mb_s * 1e6 * month_s * server.busy / (2 * each_tb * 1e12)
        )
    if "CSV" in stored:
        most[f"{server.disk_tb:g} TB of disk, one month kept, CSV"] = server.disk_tb / (
            stored["CSV"] / load.units
        )
    lines = [
        "",
        "## What breaks first",
        "",
        f"On one server as a laboratory may have ({server.cores} cores busy {server.busy:.0%}, "
        f"{server.memory_gb:g} GB, {server.disk_tb:g} TB, {server.network_mb_s:g} MB/s; assumed):",
        "",
        "| resource | units a month that it carries | of what is asked |",
        "|---|---:|---:|",
    ]
    ranked = sorted(most.items(), key=lambda item: item[1])
    lines += [f"| {name} | {value:,.0f} | {value / load.units:.2g} × |" for name, value in ranked]
    first, carried = ranked[0]
    verdict = (
        "breaks before the load asked"
        if carried < load.units
        else "carries the load asked, and is the first to break"
    )
    return [*lines, "", f"**{first}** {verdict}."]


def _drivers(found: list[Cost], total: float) -> list[str]:
    largest = max(found, key=lambda cost: cost.seconds)
    return [
        "",
        "## Cost drivers, and what to do",
        "",
        f"- Time: {largest.name}, {largest.seconds / total:.0%} of a unit's core-seconds.",
        "- Storage outgrows computing: the drift of a coil changes over minutes. Averaged to 1 Hz after "
        "the noise "
        "has been worked out, a recording takes a hundredth of the disk and of every step but the first "
        "reading.",
        "- Units are independent, so `fogml fleet` spreads them over workers (`--cluster`) without talk "
        "between "
        "them; what is shared is the disk that they read from.",
        "- CSV costs several times the disk and the reading time of Parquet: convert once, at the "
        "logger's end.",
    ]


def main() -> None:
    """Write the page anew."""
    results = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
    with whole_file(HERE / "scale.md") as partial:
        own, shared = (found_in(HERE, name) for name in ("fleet_run.json", "scale_costs.json"))
        partial.write_text(scale_page(results, fleet=own, shared=shared), encoding="utf-8")


if __name__ == "__main__":
    main()
