"""Logs as people's loggers write them, and procedures on ordinary units: what comes out, and what is right.

Run ``python -m experiments.real_files [PART ...] [--quick]``. Each part that runs writes ``parts/PART.json``;
``results.md`` and ``results.json`` are put together from all parts that are there.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

from experiments.real_files.section import Section
from experiments.results import write_results
from fogml import __version__
from fogml.outputs import whole_file

HERE = Path(__file__).parent
PARTS = {
    "formats": "every format, and headers as laboratories write them",
    "first_page": "from an own file to a judged page",
    "memory": "what reading long logs takes",
    "clocks": "clocks, dropouts and what the numbers give away",
    "noise": "noise terms of filtered and polled gyros",
    "standard_errors": "standard errors of coefficients",
    "floors": "one floor for one run",
    "sweeps": "sweeps' winners against the default",
    "fleet": "the fleet's test of agreement",
    "recordings": "what moved on the shipped recordings",
}
"""Module with ``section(quick: bool) -> Section`` to what it is about, in the page's order."""


def run_part(name: str, quick: bool, **limits: Any) -> Section:
    """Compute one part; limits are what its ``section`` takes beside."""
    found: Section = import_module(f"experiments.real_files.{name}").section(quick, **limits)
    return found


def keep(name: str, part: Section) -> None:
    """Write one part's JSON."""
    folder = HERE / "parts"
    folder.mkdir(exist_ok=True)
    with whole_file(folder / f"{name}.json") as draft:
        draft.write_text(json.dumps(asdict(part), indent=1) + "\n", encoding="utf-8")


def assemble() -> None:
    """Put the page together from the parts that are there."""
    files = {name: HERE / "parts" / f"{name}.json" for name in PARTS}
    found = {name: json.loads(file.read_text("utf-8")) for name, file in files.items() if file.exists()}
    head = (
        "# Real files and ordinary units: no wrong figure in silence\n\n"
        f"Data: **synthetic** unless a line names a recording. fogml {__version__}; "
        "`python -m experiments.real_files [PART ...]`, parts: "
        + "; ".join(f"`{name}` ({about})" for name, about in PARTS.items())
        + ".\n"
    )
    page = "\n".join([head, *(part["markdown"].rstrip() + "\n" for part in found.values())])
    write_results(HERE, {name: part["data"] for name, part in found.items()}, page)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the parts asked for, all by default, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m experiments.real_files", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--quick", action="store_true", help="few cases, to see that it runs; writes nothing")
    parser.add_argument("--hours", type=float, default=math.inf, help="of memory: no longer logs [h]")
    parser.add_argument("--formats", nargs="+", default=[], help="of memory: only these formats")
    options = parser.parse_args(arguments)
    if unknown := sorted(set(options.parts) - set(PARTS)):
        parser.error(f"no part '{unknown[0]}'; there are {', '.join(PARTS)}")
    for name in options.parts or PARTS:
        limits = {"most_hours": options.hours, "formats": options.formats} if name == "memory" else {}
        part = run_part(name, options.quick, **limits)
        if options.quick:
            print(part.markdown)
        else:
            keep(name, part)
            assemble()


if __name__ == "__main__":
    main()
