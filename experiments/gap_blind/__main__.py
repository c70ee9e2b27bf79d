"""The check on withheld effects in full: make the cases, answer them by every method, score.

``python -m experiments.gap_blind DIR`` writes ``score.json`` and ``score.html`` beside itself, and the
suite into DIR, which may be on another disk. An interrupted call goes on where it was. With
``--final`` it uses the seed that is kept for final figures, and records that.

On a cluster with a shared disk: once ``--stage make``, then on each of n machines
``--stage run --shard i/n``, then once ``--stage score``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import yaml

from fogml.cli.blind_job import (
    MakeSettings,
    RunSettings,
    ScoreSettings,
    make_and_tell,
    run_and_tell,
    score_and_write,
)
from fogml.cli.terminal import Terminal

HERE = Path(__file__).parent
STAGES = ("make", "run", "score")


def main() -> None:
    """All stages, or one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("directory", help="where the suite lies or is made")
    parser.add_argument("--final", action="store_true", help="the seed kept for final figures")
    parser.add_argument("--stage", choices=STAGES, help="one stage alone")
    parser.add_argument("--shard", default="1/1", help="every n-th case from the i-th on, i/n")
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    parser.add_argument("--count", type=int, help="another number of cases, to try it")
    given = parser.parse_args()
    config = yaml.safe_load((HERE / "config.yaml").read_text(encoding="utf-8"))
    suite = config["final" if given.final else "development"]
    stages = (given.stage,) if given.stage else STAGES
    terminal = Terminal()
    if "make" in stages:
        make_and_tell(
            MakeSettings(
                directory=given.directory,
                count=given.count or suite["count"],
                seed=suite["seed"],
                sample=config["sample"],
                workers=given.workers,
            ),
            terminal,
        )
    if "run" in stages:
        run_and_tell(
            RunSettings(
                directory=given.directory,
                methods=config["methods"],
                workers=given.workers,
                limit=config["limit"],
                shard=given.shard,
            ),
            terminal,
        )
    if "score" in stages:
        ledger = str(HERE / "final_uses.json")
        settings = ScoreSettings(
            directory=given.directory,
            final=given.final,
            ledger=ledger,
            workers=given.workers,
            out=str(HERE),
        )
        score_and_write(settings, terminal)


if __name__ == "__main__":
    main()
