"""fogml's own models and floors again in the studies of accuracy, after a change of theirs.

``python -m experiments.benchmarks.ours_again`` fits them to the same runs and writes the results beside
this file; the peers' errors stay: they don't hang on the machine's speed, so that rows of two days may stand
side by side.
"""

from __future__ import annotations

import argparse
import datetime
from pathlib import Path

from experiments.benchmarks.accuracy import AGAIN, CASES, FULL, models, rows_of, with_ours_again
from experiments.benchmarks.merging import kept_results
from experiments.benchmarks.run import write


def main() -> None:
    """Fit, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder of the results")
    parser.add_argument(
        "--only", action="append", choices=tuple(CASES), help="this study; may be given again"
    )
    asked = parser.parse_args()
    out, chosen = asked.out, asked.only or tuple(CASES)
    results = kept_results(out / "results.json", quick=False)
    made = {label: make for label, make in models(FULL).items() if label in AGAIN}
    today = datetime.date.today().isoformat()
    studies = []
    for study in results["studies"]:
        if study["name"] in chosen:
            study = with_ours_again(study, rows_of(CASES[study["name"]](False), made), today)
        studies.append(study)
    write({**results, "studies": studies}, out)


if __name__ == "__main__":
    main()
