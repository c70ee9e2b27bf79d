"""The standing examination: spoiled inputs, kills at random moments, hostile inputs by name.

``python -m experiments.faults fuzz --inputs 100000 --seed 1`` spoils inputs of every kind;
``python -m experiments.faults kill --each 100 --seed 1`` kills jobs;
``python -m experiments.faults hostile`` tries every hostile input that has a name.
Each writes its part of ``results.json`` beside itself, and ``results.md`` of all that is there.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from experiments.faults.page import write_part

HERE = Path(__file__).parent


def main() -> None:
    """Run one part and write it down."""
    parser = argparse.ArgumentParser(prog="python -m experiments.faults", description=__doc__)
    parts = parser.add_subparsers(dest="part", required=True)
    fuzzing = parts.add_parser("fuzz", help="spoil inputs of every kind")
    fuzzing.add_argument("--inputs", type=int, default=100_000)
    fuzzing.add_argument("--seed", type=int, default=1)
    fuzzing.add_argument("--workers", type=int, default=1)
    fuzzing.add_argument("--minutes", type=float, default=math.inf, help="no more after so long")
    fuzzing.add_argument("--only", nargs="*", default=[], metavar="KIND", help="only these kinds")
    fuzzing.add_argument("--quick", action="store_true", help="without the kinds that take long to make")
    killing = parts.add_parser("kill", help="kill jobs at random moments")
    killing.add_argument("--each", type=int, default=100, help="kills of each kind of job")
    killing.add_argument("--seed", type=int, default=1)
    killing.add_argument("--only", nargs="*", default=[], metavar="JOB", help="only these jobs")
    named = parts.add_parser("hostile", help="every hostile input that has a name")
    for part in (fuzzing, killing, named):
        part.add_argument("--kept", type=Path, default=Path("failed-inputs"), help="folder for what failed")
        part.add_argument("--out", type=Path, default=HERE, help="folder of results.json and results.md")
    asked = parser.parse_args()
    if asked.part == "fuzz":
        from experiments.faults.fuzz import fuzz

        found = fuzz(
            asked.inputs,
            asked.seed,
            workers=asked.workers,
            kept=asked.kept,
            quick=asked.quick,
            only=asked.only,
            most_s=60.0 * asked.minutes,
            progress=True,
        )
    elif asked.part == "kill":
        from experiments.faults.kills import kill_jobs

        found = kill_jobs(asked.each, asked.seed, only=asked.only, kept=asked.kept, progress=True)
    else:
        from experiments.faults.hostile import hostile

        found = hostile()
    write_part(asked.out, asked.part, found)


if __name__ == "__main__":
    main()
