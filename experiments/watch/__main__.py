"""Measure the watched figures and record them for this release: ``python -m experiments.watch``.

Writes ``results.json``, a row for each release, and ``results.md``. ``--show`` measures and writes nothing.
``tests/experiments/test_watch.py`` fails where a figure is 1.5 times that of the newest row.
"""

from __future__ import annotations

import argparse
import json
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.results import write_results
from experiments.watch.figures import WATCHED, measured
from fogml import __version__

HERE = Path(__file__).parent
WORSE = 1.5
"""From how many times a recorded figure on one counts as worse."""


def recorded() -> list[dict[str, Any]]:
    """The rows that there are, the first release first."""
    path = HERE / "results.json"
    return list(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else []


def worse(now: Mapping[str, float | None], before: Mapping[str, float | None]) -> list[str]:
    """Figures that are worse by `WORSE` than before, in words; those that were not measured are left out."""
    found = []
    for key, value in now.items():
        held = before.get(key)
        if value is not None and held is not None and value > WORSE * held:
            found.append(f"{WATCHED[key].words}: {value:.4g}, was {held:.4g}")
    return found


def with_release(
    rows: Sequence[Mapping[str, Any]], release: str, figures: Mapping[str, float | None]
) -> list[dict[str, Any]]:
    """The rows with that of a release in its place, or at the end."""
    made = {
        "release": release,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "figures": dict(figures),
    }
    return [*(dict(row) for row in rows if row["release"] != release), made]


def page(rows: Sequence[Mapping[str, Any]]) -> str:
    """``results.md``: a column for each release."""
    heads = " | ".join(f"{row['release']} (Python {row['python']}, numpy {row['numpy']})" for row in rows)
    lines = [f"| figure | {heads} |", f"|---|{'---:|' * len(rows)}"]
    for key, watched in WATCHED.items():
        values = (row["figures"].get(key) for row in rows)
        cells = ("–" if value is None else f"{value:.4g} {watched.unit}".strip() for value in values)
        lines.append(f"| {watched.words} | {' | '.join(cells)} |")
    table = "\n".join(lines)
    return f"""# Watched figures, release by release

Counts of work and ratios within one run, none of them by the clock; more is worse. Recorded by `python -m
experiments.watch`; `tests/experiments/test_watch.py` fails where the code in force has {WORSE:g} times a
figure of the newest column. Calls are those of fogml's own functions and of compiled code from within them;
memory is what Python's allocators and numpy hold at the peak; instructions are counted in an emulator. Data:
one synthetic unit through a chamber cycle.

{table}

They do not tell how long compiled code runs within a call; `experiments/benchmarks` does, by the clock.
"""


def main() -> None:
    """Measure, and record unless only shown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--show", action="store_true", help="measure and print alone")
    given = parser.parse_args()
    figures = measured()
    for key, value in figures.items():
        print(f"{key:20} {value if value is None else f'{value:.6g}'} {WATCHED[key].unit}")
    before = recorded()
    for line in worse(figures, before[-1]["figures"]) if before else ():
        print(f"worse: {line}")
    if not given.show:
        rows = with_release(before, __version__, figures)
        write_results(HERE, rows, page(rows))


if __name__ == "__main__":
    main()
