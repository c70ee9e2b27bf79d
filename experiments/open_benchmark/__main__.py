"""The shipped round of the open benchmark: made, answered by ours and by peers, scored.

``python -m experiments.open_benchmark DIR`` makes the round of seed 2026 in DIR, lets every method of
`DRIFT` and `DIAGNOSIS` answer it, and writes ``results.json``, ``results.md`` and ``results.html`` beside
itself; an interrupted call goes on where it was. What others hand in goes into ``DIR/entries`` and is scored
with them.
"""

from __future__ import annotations

import argparse
import json
import statistics
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.results import write_results
from fogml.benchmark.answers import entry_plan
from fogml.benchmark.make import make_round
from fogml.benchmark.rounds import TRACKS, TrackFolder
from fogml.benchmark.score import score_round
from fogml.blind.folders import OUTCOME, read_json
from fogml.blind.run import run_cases
from fogml.outputs import whole_file
from fogml.report.benchmark_page import benchmark_page, diagnosis_table, drift_groups, drift_table
from fogml.report.tables import Table

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
_METHODS = "experiments.open_benchmark.methods"
DRIFT: dict[str, dict[str, Any]] = {
    "auto": {"method": "auto"},
    "constant": {"method": "mean"},
    "cubic in T": {"method": "polynomial", "features": "T^1..3"},
    "Gaussian process": {"method": f"{_METHODS}:gaussian_process", "code": ROOT},
    "boosting": {"method": "sklearn.ensemble.HistGradientBoostingRegressor", "features": "T, dT"},
    "GRU": {"method": f"{_METHODS}:gru", "code": ROOT},
    "PX4's cubic": {"method": f"{_METHODS}:px4_cubic", "code": ROOT},
}
"""What each entry of the drift track is called, and how it is run."""
DIAGNOSIS = {"fogml diagnose": {"method": "diagnosis"}, "greedy BIC": {"method": "bic"}}
ENTRIES = {"drift": DRIFT, "diagnosis": DIAGNOSIS}


def seconds(home: Path) -> dict[str, dict[str, dict[str, float]]]:
    """Processor time of every entry's cases where its run tells it: in all and median [s]."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for track in TRACKS:
        folder = TrackFolder(home, track)
        found[track] = {}
        for name in folder.methods():
            paths = sorted(folder.answers(name).glob(f"*/{OUTCOME}"))
            spent = [s for path in paths if (s := read_json(path).get("seconds")) is not None]
            if spent:
                found[track][name] = {"all": sum(spent), "median": statistics.median(spent)}
    return found


def page(values: Mapping[str, Any]) -> str:
    """``results.md`` of what ``results.json`` holds."""
    tables = [drift_table(values), drift_groups(values), diagnosis_table(values)]
    parts = "\n\n".join(_markdown(table) for table in tables if table is not None)
    told = values["round"]
    spent = "; ".join(
        f"{track} track: "
        + ", ".join(
            f"{name} {one['all']:.0f} s in all, {one['median']:.1f} s a case" for name, one in own.items()
        )
        for track, own in values["seconds"].items()
    )
    rules = "\n".join(f"{place}. {rule}" for place, rule in enumerate(told["rules"], start=1))
    return f"""# The open benchmark: the shipped round

fogml {values["version"]}; `python -m experiments.open_benchmark DIR`; seed {told["seed"]}, an open round.
SHA-256 of its `round.json`, which binds every answer: `{told["handout_sha256"]}`. Synthetic units of the
realities of `fogml blind`, which share no code with the twin; legs of recordings of **MEMS** units (no
fibre-optic gyro) that ship. How to join, and what each figure means: `docs/benchmark.md`.

{parts}

{_FOUND}

Wall time within the sealed processes, on two cores that others used too: {spent}.

## Rules

{rules}
"""


_FOUND = """## What it says, and what not

- `auto` leaves least on synthetic units and over all, and is close to doing nothing where it does not help.
  On the cold start a cubic in T leaves less; its harm is more, and its intervals hold too little.
- `auto` was developed with the legs of the thermal cycle in view; no entry saw these synthetic units.
- A GRU of 404 bytes leaves half on average and does harm in 9 of 33 cases; PX4's cubic, which takes a warm-up
  only, helps on the thermal cycle alone.
- Intervals that hold are wide: several times what doing nothing leaves. Those of the cubic and of a constant
  hold 85 and 86 % of the averages.
- Greedy BIC names one true cause more than `fogml diagnose` and closes more; 11 of its 16 names are false,
  against 3 of 7, and it names something where nothing is missing. Neither tells an unknown cause as such.
- Twelve diagnoses are too few to rank by: they show what is asked for. Figures of hundreds of cases stand in
  `experiments/gap_blind/results.md`.
- Entries that give no interval tell no coverage, and those that state no bytes have none here."""


def _markdown(table: Table) -> str:
    heads = [f"{name} [{unit}]" if unit else name for name, unit, _ in table.columns]
    marks = ["---:" if kind == "figure" else "---" for _, _, kind in table.columns]
    lines = [heads, marks, *(row.cells for row in table.rows)]
    rows = "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
    return f"{table.caption}\n\n{rows}"


def main() -> None:
    """Make, answer, score and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("directory", type=Path, nargs="?", help="where the round lies or is made")
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    parser.add_argument("--only", action="append", help="answer by this entry alone; may be repeated")
    parser.add_argument("--page", action="store_true", help="the pages of results.json alone")
    given = parser.parse_args()
    if given.page:
        return write(json.loads((HERE / "results.json").read_text(encoding="utf-8")))
    if given.directory is None:
        parser.error("name the folder of the round")
    if not (given.directory / "handout").exists():
        make_round(given.directory, workers=given.workers, step=lambda words: print(words, flush=True))
    for track, entries in ENTRIES.items():
        for name, how in entries.items():
            if not given.only or name in given.only:
                plan = entry_plan(given.directory, track, name=name, workers=given.workers, **how)
                answered, failed = run_cases(plan)
                print(f"{track}, {name}: {answered} answered, {failed} failed", flush=True)
    values = score_round(given.directory, workers=given.workers)
    write(values | {"seconds": seconds(given.directory)})


def write(values: Mapping[str, Any]) -> None:
    """The results as JSON, in Markdown and as the page that the command writes."""
    write_results(HERE, values, page(values))
    with whole_file(HERE / "results.html") as partial:
        partial.write_text(benchmark_page(values), encoding="utf-8")


if __name__ == "__main__":
    main()
