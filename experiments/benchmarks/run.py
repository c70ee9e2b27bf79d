"""Measure accuracy, speed and memory beside what a user would pick instead.

``python -m experiments.benchmarks [--quick] [--only NAME] [--big] [--merge] [--note TEXT]`` writes
``results.json``, ``results.md``, ``results.html`` and ``scale.md`` beside this file, or into
``--out DIR``. With ``--merge`` what is measured takes its place among the results that are there.
Run it on a machine that does nothing else, or say with ``--note`` what it did. Exit 1: a limit was
not met.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments.benchmarks import harness
from experiments.benchmarks.jobs import JOBS, STUDIES
from experiments.benchmarks.machine import describe_machine
from experiments.benchmarks.merging import kept_results, merged
from experiments.benchmarks.pages import results_page
from experiments.benchmarks.scale import found_in, scale_page
from experiments.benchmarks.study import Study, carried_out
from experiments.results import html_page
from fogml.outputs import whole_file

Measurement = harness.Job | Study


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the jobs asked for; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m experiments.benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes: checks the jobs, measures nothing")
    parser.add_argument(
        "--only", action="append", metavar="NAME", help="this job or study; may be given again"
    )
    parser.add_argument("--big", action="store_true", help="with the jobs of 100 million rows")
    parser.add_argument("--repeats", type=int, default=harness.LEAST_REPEATS, help="pairs (5)")
    parser.add_argument(
        "--out",
        type=Path,
        help="folder for results.json and results.md (this one, for all jobs at full size)",
    )
    parser.add_argument(
        "--merge", action="store_true", help="put these jobs into the results that are there, keep the rest"
    )
    parser.add_argument("--note", help="what else the machine did meanwhile; stands on the page")
    parser.add_argument("--list", action="store_true", help="names and titles of the jobs and studies")
    parser.add_argument("--peak", metavar="NAME", help=argparse.SUPPRESS)
    asked = parser.parse_args(arguments)
    jobs: dict[str, Measurement] = {job.name: job for job in (*JOBS, *STUDIES)}
    unknown = [
        name for name in [*(asked.only or []), *([asked.peak] if asked.peak else [])] if name not in jobs
    ]
    if unknown:
        parser.error(f"no job {unknown[0]!r}; there are {', '.join(jobs)}")
    if asked.list:
        for job in jobs.values():
            print(f"{job.name:28} {job.title}{' (--big)' if job.big else ''}")
        return 0
    if asked.peak:
        return _peak(next(job for job in JOBS if job.name == asked.peak), asked.quick)
    if asked.repeats < harness.LEAST_REPEATS and not asked.quick:
        parser.error(f"a median of fewer than {harness.LEAST_REPEATS} says little; give --repeats 5 or more")
    chosen = [jobs[name] for name in asked.only or jobs if asked.only or asked.big or not jobs[name].big]
    # What is kept beside the code is the whole, at full size.
    out = asked.out or (None if asked.quick or (asked.only and not asked.merge) else Path(__file__).parent)
    kept = None
    if asked.merge:
        if out is None:
            parser.error("--merge with --quick needs an --out: what is kept beside the code is at full size")
        try:
            kept = kept_results(out / "results.json", quick=asked.quick)
        except ValueError as error:
            parser.error(str(error))
    results = _measure(chosen, asked)
    if kept is not None:
        results = merged(kept, results, list(jobs))
    if out:
        write(results, out)
    print(results_page(results))
    met = all(held["met"] for job in results["jobs"] for held in job["held"])
    return 0 if met else 1


def write(results: Mapping[str, Any], out: Path) -> None:
    """The results as JSON, as a table and a page to read, and what follows from them for many units."""
    page = results_page(results)
    files = {
        "results.json": json.dumps(results, indent=1, allow_nan=False, ensure_ascii=False) + "\n",
        "results.md": page,
        "results.html": html_page(page, {}),
        "scale.md": scale_page(
            results, fleet=found_in(out, "fleet_run.json"), shared=found_in(out, "scale_costs.json")
        ),
    }
    out.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        with whole_file(out / name) as partial:
            partial.write_text(text, encoding="utf-8")


def _measure(jobs: Sequence[Measurement], asked: argparse.Namespace) -> dict[str, Any]:
    measured: list[dict[str, Any]] = []
    studied: list[dict[str, Any]] = []
    skipped: list[dict[str, Any]] = []
    for job in jobs:
        reason = job.missing()
        if reason is not None:
            print(f"{job.name}: skipped, {reason}", file=sys.stderr)
            skipped.append({"name": job.name, "title": job.title, "reason": reason})
            continue
        print(f"{job.name}: {job.title}", file=sys.stderr)
        with tempfile.TemporaryDirectory(prefix="fogml-benchmark-") as folder:
            if isinstance(job, Study):
                found = carried_out(job, Path(folder), quick=asked.quick, repeats=asked.repeats)
                studied.append(found)
            else:
                found = harness.measure(job, Path(folder), quick=asked.quick, repeats=asked.repeats)
                measured.append(found)
    words = ["python -m experiments.benchmarks"]
    words += [flag for flag, given in (("--quick", asked.quick), ("--big", asked.big)) if given]
    words += [f"--only {name}" for name in asked.only or []]
    words += ["--merge"] if asked.merge else []
    return {
        "schema": "fogml.benchmarks/1",
        "command": " ".join(words),
        "machine": describe_machine(),
        "repeats": asked.repeats,
        "quick": asked.quick,
        "note": asked.note,
        "studies": studied,
        "jobs": measured,
        "skipped": skipped,
    }


def _peak(job: harness.Job, quick: bool) -> int:
    with tempfile.TemporaryDirectory(prefix="fogml-benchmark-") as folder:
        job.prepare(quick, Path(folder)).ours()
    print(json.dumps({"peak_mb": harness.high_water_mb(os.getpid())}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
